#include "pavel/tools/progress.h"

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace pavel {
namespace {

std::atomic<bool>* interruptFlag = nullptr;

void onSignal(int) {
    if (interruptFlag) interruptFlag->store(true);
}

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Share of a whole run that is over when a stage begins, and its own share: for the time left.
std::pair<double, double> stageShare(const std::string& stage) {
    static const std::pair<const char*, double> shares[] = {{"seeding", 0.08}, {"voxelize", 0.15}, {"overlap", 0.07},
                                                            {"growth", 0.5},   {"extract", 0.05},  {"remesh", 0.05},
                                                            {"write", 0.1}};
    double before = 0;
    for (const auto& [name, share] : shares) {
        if (stage == name) return {before, share};
        before += share;
    }
    return {0, 1};
}

}  // namespace

CommandContext::CommandContext(const CommonOptions& options) : options_(options), terminal_(isatty(2)), start_(now()) {
    interruptFlag = &cancelled;
    std::signal(SIGINT, onSignal);
    std::signal(SIGTERM, onSignal);
    onProgress = [this](const std::string& stage, double done) { show(stage, done); };
}

CommandContext::~CommandContext() {
    finish();
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
    interruptFlag = nullptr;
}

void CommandContext::finish() {
    if (terminal_ && !options_.quiet && !options_.json && !stage_.empty()) std::fprintf(stderr, "\r%70s\r", "");
    stage_.clear();
}

void CommandContext::printWarnings() const {
    for (const std::string& w : warnings) std::fprintf(stderr, "warning: %s\n", w.c_str());
}

void CommandContext::show(const std::string& stage, double done) {
    const double t = now();
    const bool newStage = stage != stage_;
    if (options_.json) {
        if (!newStage && t - lastShown_ < 0.5) return;
        std::printf("%s\n", nlohmann::ordered_json{{"stage", stage}, {"done", done}}.dump().c_str());
        std::fflush(stdout);
    } else if (!options_.quiet) {
        if (terminal_) {
            if (!newStage && t - lastShown_ < 0.1) return;
            const auto [before, share] = stageShare(stage);
            const double all = before + share * done;
            char left[32] = "";
            if (all > 0.03) std::snprintf(left, sizeof left, ", about %.0f s left", (t - start_) * (1 - all) / all);
            char bar[21];
            for (int i = 0; i < 20; ++i) bar[i] = i < 20 * all ? '#' : '.';
            bar[20] = 0;
            std::fprintf(stderr, "\r[%s] %3.0f %%  %-9s %3.0f %%%-22s", bar, 100 * all, stage.c_str(), 100 * done,
                         left);
            std::fflush(stderr);
        } else if (newStage) {
            std::fprintf(stderr, "%6.1f s  %s\n", t - start_, stage.c_str());
        }
    }
    stage_ = stage;
    lastShown_ = t;
}

}  // namespace pavel
