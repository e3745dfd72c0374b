#pragma once
// What a long run shares with its caller: progress, cancellation, warnings, timing of stages.
#include <atomic>
#include <functional>
#include <string>
#include <vector>

namespace pavel {

struct StageTime {
    std::string name;
    double seconds = 0, cpuSeconds = 0;
};

class RunContext {
  public:
    /// Called with the stage's name and its progress in [0, 1]; calls come from one thread at a time.
    std::function<void(const std::string& stage, double done)> onProgress;
    /// Set from any thread or a signal handler; the run then throws Interrupted soon.
    std::atomic<bool> cancelled{false};

    void progress(const std::string& stage, double done) const;
    /// Throws Interrupted when cancelled.
    void check() const;
    void warn(const std::string& text) { warnings.push_back(text); }

    std::vector<std::string> warnings;
    std::vector<StageTime> stages;
};

/// Adds the wall and CPU time of its scope to the context's stage of that name.
class StageTimer {
  public:
    StageTimer(RunContext& context, std::string name);
    ~StageTimer();
    StageTimer(const StageTimer&) = delete;
    StageTimer& operator=(const StageTimer&) = delete;

  private:
    RunContext& context_;
    std::string name_;
    double wall_, cpu_;
};

/// Largest resident size of this process so far, in bytes.
size_t peakResidentBytes();
/// Gives memory that was freed back to the system: glibc keeps it for the thread that asked for it, and the next
/// stage's threads would not get it. For the ends of stages; milliseconds.
void returnFreedMemory();
const char* version();

}  // namespace pavel
