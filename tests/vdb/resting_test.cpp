// What rests while others march or are solved.
#include <gtest/gtest.h>

#include <mutex>
#include <random>
#include <set>

#include "pavel/vdb/grow.h"
#include "pavel/vdb/redistance.h"
#include "pavel/vdb/region_builder.h"
#include "pavel/vdb/resting_cells.h"
#include "support/elements.h"

namespace pavel {
namespace {

TEST(RestingCells, KeepWhatWasTouched) {
    constexpr float kFarthest = 60;
    std::mt19937 random(5);
    std::deque<GrowthBlock> blocks(3);
    const VoxelMask body;
    std::vector<std::unique_ptr<GrowthCell>> cells;
    const float distances[] = {0, 0.01f, 0.3f, 2, 17.5f, 59.9f, 80};
    for (int b = 0; b < 3; ++b) {
        blocks[size_t(b)].number = b, blocks[size_t(b)].body = &body;
        for (int c = b; c < 8; c += 3) {
            GrowthCell& cell = *cells.emplace_back(new GrowthCell);
            blocks[size_t(b)].cells[c] = &cell;
            for (int i = 0; i < GrowthCell::kCount; ++i) {
                const bool touched = random() % 3 == 0;
                cell.time[i] = touched ? 0.1f * float(random() % 100) : GrowthBlock::kNever;
                cell.contact[i] = touched ? distances[random() % 7] : -1;
                cell.state[i] = uint8_t(touched ? unsigned(kReal) + random() % 3 : unsigned(kFar));
            }
        }
    }
    RestingCells rest(blocks, kFarthest);
    for (int b = 0; b < 3; ++b)
        for (int c = 0; c < 8; ++c) {
            const GrowthCell* cell = blocks[size_t(b)].cells[c];
            ASSERT_EQ(rest.cells(b) >> c & 1, cell != nullptr);
            if (!cell) continue;
            GrowthCell read;
            rest.read(b, c, read);
            for (int i = 0; i < GrowthCell::kCount; ++i) {
                ASSERT_EQ(read.time[i], cell->time[i]);
                ASSERT_EQ(read.state[i], cell->state[i]);
                const float distance = std::min(cell->contact[i], kFarthest);
                ASSERT_NEAR(read.contact[i], distance, std::sqrt(std::max(distance, 0.f) * kFarthest) / 60000 + 1e-7);
            }
        }
    EXPECT_EQ(rest.cells(3), 0u);
    // A state that is changed, and marks that are not told as states.
    const auto count = [&](VoxelState state) {
        int n = 0;
        rest.forEach(state, [&](int, int, float, uint8_t&) { ++n; });
        return n;
    };
    const int reals = count(kReal), deep = count(kDeepGhost);
    int block = -1, voxel = -1;
    rest.forEach(kReal, [&](int b, int v, float time, uint8_t& state) {
        EXPECT_EQ(time, blocks[size_t(b)].time(v));
        state |= RestingCells::kHeld;
        block = b, voxel = v;
    });
    ASSERT_GT(reals, 50);
    EXPECT_EQ(count(kReal), reals);
    rest.setState(block, voxel, kDeepGhost);
    EXPECT_EQ(count(kReal), reals - 1);
    EXPECT_EQ(count(kDeepGhost), deep + 1);
    GrowthCell read;
    rest.read(block, cellOf(voxel), read);
    EXPECT_EQ(read.state[inCell(voxel)], kDeepGhost);
}

/// A row of spheres that overlap.
struct Row {
    std::vector<WorkElement> elements;
    std::unique_ptr<Growth> growth;
    std::vector<double> targets;
    explicit Row(int count) {
        std::vector<Vec3> places;
        for (int i = 0; i < count; ++i) places.emplace_back(15.2 * i, 0.3 * (i % 3), 0.1);
        elements = test::elementsAt(test::sphere(9, {0, 0, 0}, 64), places);
        test::resolve(elements);
        growth = std::make_unique<Growth>(elements, nullptr, std::vector<Material>{{0.1, 0.3}});
        growth->march(RunContext());
        for (const WorkElement& e : elements) targets.push_back(e.targetVolume);
    }
};

TEST(LastCalls, ComeWhenNobodyAsksAnyMore) {
    constexpr int kCount = 9;
    Row row(kCount);
    std::mutex mutex;
    std::set<int> solved, done;
    std::vector<double> volumes(kCount);
    const auto use = [&](int i, Region& region, double later) {
        volumes[size_t(i)] = RegionMeasure(region)(later).volume;
        const std::lock_guard<std::mutex> lock(mutex);
        solved.insert(i);
    };
    const auto drop = [&](int i) {
        {
            const std::lock_guard<std::mutex> lock(mutex);
            for (int k = std::max(i - 2, 0); k <= std::min(i + 2, kCount - 1); ++k)
                EXPECT_TRUE(solved.count(k)) << k << " asks for " << i;
            EXPECT_TRUE(done.insert(i).second) << i;
        }
        row.growth->drop(i);
        row.elements[size_t(i)].placed = {}, row.elements[size_t(i)].body = {};
    };
    row.growth->solveStopTimes(row.targets, 2, 1e-4, RunContext(), use, drop);  // nothing moves by 2 voxels
    EXPECT_EQ(done.size(), size_t(kCount));
    // The same volumes as of those that nobody dropped.
    Row other(kCount);
    other.growth->solveStopTimes(other.targets, 2, 1e-4, RunContext(), [&](int i, Region& region, double later) {
        EXPECT_EQ(RegionMeasure(region)(later).volume, volumes[size_t(i)]) << i;
    });
    for (int i = 0; i < kCount; ++i) EXPECT_NEAR(volumes[size_t(i)] / row.targets[size_t(i)], 1, 5e-3);
}

TEST(LastCalls, DoNotComeForThoseThatMoved) {
    Row row(5);
    std::set<int> done;
    std::mutex mutex;
    // Two of them are to have more than they have lost: they move on.
    row.targets[0] *= 1.04;
    row.growth->solveStopTimes(row.targets, 0.05, 1e-4, RunContext(), {}, [&](int i) {
        const std::lock_guard<std::mutex> lock(mutex);
        done.insert(i);
    });
    for (const int near : {0, 1, 2}) EXPECT_FALSE(done.count(near)) << near;
}

TEST(LastCalls, KeepWhomMovesMayReach) {
    constexpr int kCount = 16;
    Row row(kCount);
    row.targets[0] *= 1.05;  // moves on, and its neighbours after it, for several rounds
    std::mutex mutex;
    std::set<int> done;
    std::vector<double> volumes(kCount, -1);
    std::vector<int> times(kCount, 0);
    const auto use = [&](int i, Region& region, double later) {
        volumes[size_t(i)] = RegionMeasure(region)(later).volume;
        const std::lock_guard<std::mutex> lock(mutex);
        EXPECT_FALSE(done.count(i)) << i << " is asked for again";
        ++times[size_t(i)];
    };
    row.growth->solveStopTimes(row.targets, 0.03, 1e-4, RunContext(), use, [&](int i) {
        row.growth->drop(i);
        row.elements[size_t(i)].placed = {}, row.elements[size_t(i)].body = {};
        const std::lock_guard<std::mutex> lock(mutex);
        done.insert(i);
    });
    EXPECT_TRUE(done.count(kCount - 1));
    EXPECT_GT(times[1], 1);
    for (int i = 0; i < kCount; ++i) EXPECT_NEAR(volumes[size_t(i)] / row.targets[size_t(i)], 1, 5e-3) << i;
}

TEST(Front, GoesOnFromItsRestAmongTheClaimsOfOthers) {
    // The first one moves on by a voxel or so while the shared clock is away; faces stay where both arrive.
    Row row(3);
    row.targets[0] *= 1.05, row.targets[1] *= 1.05;
    row.growth->solveStopTimes(row.targets, 0.02, 1e-4, RunContext());
    row.growth->catchUp();
    const RegionBuilder builder(row.elements, nullptr, row.growth->fronts());
    std::vector<WorkTree::Ptr> packed;
    for (int i = 0; i < 3; ++i) {
        const Region region = builder.build(i);
        EXPECT_NEAR(RegionMeasure(region)(0).volume / row.targets[size_t(i)], 1, 5e-3) << i;
        packed.push_back(redistanced(region).compact().tree());
    }
    const WorkReader a(*packed[0]), b(*packed[1]);
    double gap = 0;
    int count = 0;
    for (auto it = packed[0]->cbeginValueOn(); it; ++it) {
        const float other = b.getValue(it.getCoord());
        EXPECT_GT(std::max(*it, other), -0.1f);
        if (*it < -0.5f || *it > 0.5f || std::abs(other) > 0.5f) continue;
        gap += std::abs(*it + other), ++count;
    }
    ASSERT_GT(count, 50);
    EXPECT_LT(gap / count, 0.2);
}

}  // namespace
}  // namespace pavel
