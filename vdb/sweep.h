#pragma once
// Going over a scene from one side to the other, so that only what lies around is asked for at a time.
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <mutex>
#include <vector>

#include "pavel/core/run_context.h"
#include "pavel/vdb/element.h"

namespace pavel {

/// Elements in the order in which a plane sweeps over them along the longest side of their box.
std::vector<int> sweepOrder(const std::vector<WorkElement>& elements);

/// Runs f(element) in an order that is kept whatever the number of threads: who is free takes the next.
template <class F>
void inOrder(const std::vector<int>& order, const RunContext& context, const char* stage, double from, double to, F f) {
    std::atomic<size_t> next{0};
    std::mutex reporting;
    tbb::parallel_for(0, tbb::this_task_arena::max_concurrency(), [&](int) {
        for (size_t k = next++; k < order.size(); k = next++) {
            f(order[k]);
            if (k % 16 != 0) continue;
            const std::lock_guard<std::mutex> lock(reporting);
            context.progress(stage, from + (to - from) * double(k) / double(order.size()));
        }
    });
    context.progress(stage, to);
}

}  // namespace pavel
