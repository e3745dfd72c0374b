#include "pavel/vdb/pieces.h"

#include <algorithm>
#include <unordered_map>

#include "pavel/core/union_find.h"

namespace pavel {
namespace {

struct Run {
    uint8_t row, mask;
};

}  // namespace

BlockMask negativeMask(const float* values) {
    BlockMask m;
    for (int row = 0; row < 64; ++row) {
        unsigned bits = 0;
        for (int z = 0; z < 8; ++z) bits |= unsigned(values[row * 8 + z] < 0) << z;
        m[size_t(row)] = uint8_t(bits);
    }
    return m;
}

std::vector<MaskedBlock> straysOf(const std::vector<MaskedBlock>& blocks) {
    std::vector<Run> runs;
    std::vector<std::array<int, 65>> rowStart;  // of each block, runs before a row
    std::unordered_map<Coord, int, CoordHash> numbers;
    rowStart.resize(blocks.size());
    for (size_t b = 0; b < blocks.size(); ++b) {
        numbers[blocks[b].origin] = int(b);
        for (int row = 0; row < 64; ++row) {
            rowStart[b][size_t(row)] = int(runs.size());
            for (unsigned rest = blocks[b].mask[size_t(row)]; rest;) {
                const unsigned low = rest & (~rest + 1), run = rest & ~(rest + low);  // lowest run of ones
                runs.push_back({uint8_t(row), uint8_t(run)});
                rest &= ~run;
            }
        }
        rowStart[b][64] = int(runs.size());
    }
    UnionFind sets(runs.size());
    const auto joinRows = [&](size_t a, int rowA, size_t b, int rowB) {
        for (int i = rowStart[a][size_t(rowA)]; i < rowStart[a][size_t(rowA) + 1]; ++i)
            for (int j = rowStart[b][size_t(rowB)]; j < rowStart[b][size_t(rowB) + 1]; ++j)
                if (runs[size_t(i)].mask & runs[size_t(j)].mask) sets.join(i, j);
    };
    const auto numberAt = [&](const Coord& origin) {
        const auto found = numbers.find(origin);
        return found == numbers.end() ? -1 : found->second;
    };
    for (size_t b = 0; b < blocks.size(); ++b) {
        for (int row = 0; row < 64; ++row) {
            if (row & 7) joinRows(b, row, b, row - 1);
            if (row >= 8) joinRows(b, row, b, row - 8);
        }
        const Coord& o = blocks[b].origin;
        if (const int n = numberAt(o.offsetBy(8, 0, 0)); n >= 0)
            for (int row = 0; row < 8; ++row) joinRows(b, 56 + row, size_t(n), row);
        if (const int n = numberAt(o.offsetBy(0, 8, 0)); n >= 0)
            for (int row = 0; row < 64; row += 8) joinRows(b, row + 7, size_t(n), row);
        if (const int n = numberAt(o.offsetBy(0, 0, 8)); n >= 0)
            for (int row = 0; row < 64; ++row)
                if ((blocks[b].mask[size_t(row)] & 0x80) && (blocks[size_t(n)].mask[size_t(row)] & 1))
                    sets.join(rowStart[b][size_t(row) + 1] - 1, rowStart[size_t(n)][size_t(row)]);
    }
    std::vector<uint64_t> size(runs.size(), 0);
    for (size_t i = 0; i < runs.size(); ++i)
        size[size_t(sets.find(int(i)))] += uint64_t(__builtin_popcount(runs[i].mask));
    const int largest = runs.empty() ? -1 : int(std::max_element(size.begin(), size.end()) - size.begin());
    std::vector<MaskedBlock> strays;
    for (size_t b = 0; b < blocks.size(); ++b) {
        MaskedBlock m{blocks[b].origin, {}};
        bool any = false;
        for (int i = rowStart[b][0]; i < rowStart[b][64]; ++i) {
            if (sets.find(i) == largest) continue;
            m.mask[runs[size_t(i)].row] |= runs[size_t(i)].mask;
            any = true;
        }
        if (any) strays.push_back(m);
    }
    return strays;
}

}  // namespace pavel
