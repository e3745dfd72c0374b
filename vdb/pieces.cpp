#include "pavel/vdb/pieces.h"

#include <algorithm>

#include "pavel/core/union_find.h"
#include "pavel/vdb/block_numbers.h"

namespace pavel {
namespace {

struct Run {
    uint8_t row, mask;
};

}  // namespace

PAVEL_WIDE BlockMask negativeMask(const float* values) {
    BlockMask m;
    for (int row = 0; row < 64; ++row) {
        unsigned bits = 0;
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) bits |= unsigned(values[row * 8 + z] < 0) << z;
        m[size_t(row)] = uint8_t(bits);
    }
    return m;
}

std::vector<MaskedBlock> straysOf(const std::vector<MaskedBlock>& blocks) {
    /// A block's runs of voxels: those before each row, or, in a full block, one that stands for all.
    struct Runs {
        std::array<int, 65> start;
        bool full;
        int begin(int row) const { return full ? start[0] : start[size_t(row)]; }
        int end(int row) const { return full ? start[0] + 1 : start[size_t(row) + 1]; }
    };
    BlockMask all;
    all.fill(0xff);
    std::vector<Run> runs;
    std::vector<Runs> runsOf(blocks.size());
    CoordBBox box;
    for (const MaskedBlock& block : blocks) box.expand(block.origin);
    BlockNumbers numbers(box);
    for (size_t b = 0; b < blocks.size(); ++b) {
        numbers.set(blocks[b].origin, int(b));
        runsOf[b].full = blocks[b].mask == all;
        runsOf[b].start[0] = int(runs.size());
        if (runsOf[b].full) {
            runs.push_back({0, 0xff});
            continue;
        }
        for (int row = 0; row < 64; ++row) {
            runsOf[b].start[size_t(row)] = int(runs.size());
            for (unsigned rest = blocks[b].mask[size_t(row)]; rest;) {
                const unsigned low = rest & (~rest + 1), run = rest & ~(rest + low);  // lowest run of ones
                runs.push_back({uint8_t(row), uint8_t(run)});
                rest &= ~run;
            }
        }
        runsOf[b].start[64] = int(runs.size());
    }
    UnionFind sets(runs.size());
    const auto joinRows = [&](size_t a, int rowA, size_t b, int rowB) {
        for (int i = runsOf[a].begin(rowA); i < runsOf[a].end(rowA); ++i)
            for (int j = runsOf[b].begin(rowB); j < runsOf[b].end(rowB); ++j)
                if (runs[size_t(i)].mask & runs[size_t(j)].mask) sets.join(i, j);
    };
    for (size_t b = 0; b < blocks.size(); ++b) {
        for (int row = 0; row < 64 && !runsOf[b].full; ++row) {
            if (row & 7) joinRows(b, row, b, row - 1);
            if (row >= 8) joinRows(b, row, b, row - 8);
        }
        const Coord& o = blocks[b].origin;
        const auto joinBlock = [&](int n, const auto& join) {
            if (n < 0) return;
            if (runsOf[b].full && runsOf[size_t(n)].full)
                sets.join(runsOf[b].start[0], runsOf[size_t(n)].start[0]);
            else
                join(size_t(n));
        };
        joinBlock(numbers.at(o.offsetBy(8, 0, 0)), [&](size_t n) {
            for (int row = 0; row < 8; ++row) joinRows(b, 56 + row, n, row);
        });
        joinBlock(numbers.at(o.offsetBy(0, 8, 0)), [&](size_t n) {
            for (int row = 0; row < 64; row += 8) joinRows(b, row + 7, n, row);
        });
        joinBlock(numbers.at(o.offsetBy(0, 0, 8)), [&](size_t n) {
            for (int row = 0; row < 64; ++row)
                if ((blocks[b].mask[size_t(row)] & 0x80) && (blocks[n].mask[size_t(row)] & 1))
                    sets.join(runsOf[b].end(row) - 1, runsOf[n].begin(row));
        });
    }
    const auto eachRun = [&](const auto& f) {
        for (size_t b = 0; b < blocks.size(); ++b)
            for (int i = runsOf[b].start[0], end = runsOf[b].end(63); i < end; ++i) f(b, i);
    };
    std::vector<uint64_t> size(runs.size(), 0);
    eachRun([&](size_t b, int i) {
        size[size_t(sets.find(i))] += runsOf[b].full ? 512 : uint64_t(__builtin_popcount(runs[size_t(i)].mask));
    });
    const int largest = runs.empty() ? -1 : int(std::max_element(size.begin(), size.end()) - size.begin());
    std::vector<MaskedBlock> strays;
    eachRun([&](size_t b, int i) {
        if (sets.find(i) == largest) return;
        if (strays.empty() || strays.back().origin != blocks[b].origin) strays.push_back({blocks[b].origin, {}});
        BlockMask& mask = strays.back().mask;
        if (runsOf[b].full)
            mask = all;
        else
            mask[runs[size_t(i)].row] |= runs[size_t(i)].mask;
    });
    return strays;
}

}  // namespace pavel
