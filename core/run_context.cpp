#include "pavel/core/run_context.h"

#include <sys/resource.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <chrono>
#include <ctime>

#include "pavel/core/error.h"

namespace pavel {
namespace {

double wallNow() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpuNow() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

}  // namespace

void RunContext::progress(const std::string& stage, double done) const {
    check();
    if (onProgress) onProgress(stage, done);
}

void RunContext::check() const {
    if (cancelled.load(std::memory_order_relaxed)) throw Interrupted();
}

StageTimer::StageTimer(RunContext& context, std::string name)
    : context_(context), name_(std::move(name)), wall_(wallNow()), cpu_(cpuNow()) {
    context_.progress(name_, 0);
}

StageTimer::~StageTimer() {
    const double wall = wallNow() - wall_, cpu = cpuNow() - cpu_;
    for (StageTime& s : context_.stages) {
        if (s.name == name_) {
            s.seconds += wall;
            s.cpuSeconds += cpu;
            return;
        }
    }
    context_.stages.push_back({name_, wall, cpu});
}

size_t peakResidentBytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return size_t(usage.ru_maxrss) * 1024;
}

void returnFreedMemory() {
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

const char* version() {
    return PAVEL_VERSION;
}

}  // namespace pavel
