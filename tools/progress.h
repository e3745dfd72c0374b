#pragma once
#include "pavel/tools/commands.h"

namespace pavel {

/// A context that shows progress on stderr (a bar with stage, per cent and time left on a terminal, plain lines
/// elsewhere), or as JSON lines on stdout, and stops on Ctrl-C. One per process.
class CommandContext : public RunContext {
  public:
    explicit CommandContext(const CommonOptions& options);
    ~CommandContext();
    CommandContext(const CommandContext&) = delete;
    CommandContext& operator=(const CommandContext&) = delete;
    /// Ends the bar's line.
    void finish();
    /// The warnings, on stderr.
    void printWarnings() const;

  private:
    void show(const std::string& stage, double done);
    const CommonOptions& options_;
    bool terminal_;
    std::string stage_;
    double start_ = 0, lastShown_ = -1;
};

}  // namespace pavel
