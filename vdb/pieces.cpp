#include "pavel/vdb/pieces.h"

#include <algorithm>
#include <cstring>

#include "pavel/core/union_find.h"
#include "pavel/vdb/block_numbers.h"

namespace pavel {
namespace {

/// Voxels of a block as slabs: x by word, bit y * 8 + z, as BlockMask lies in memory.
using Slabs = std::array<uint64_t, 8>;

constexpr uint64_t kFirstZ = 0x0101010101010101, kLastZ = kFirstZ << 7;

Slabs slabsOf(const BlockMask& mask) {
    Slabs s;
    std::memcpy(s.data(), mask.data(), sizeof s);
    return s;
}

/// What of a slab can be reached from some of its voxels within it.
uint64_t filledSlab(uint64_t from, uint64_t within) {
    for (uint64_t before = 0; from != before;) {
        before = from;
        from |= (from << 8 | from >> 8 | (from << 1 & ~kFirstZ) | (from >> 1 & ~kLastZ)) & within;
    }
    return from;
}

/// Takes one connected piece out of a block that is not empty.
Slabs takePiece(Slabs& rest) {
    Slabs piece{};
    size_t first = 0;
    while (!rest[first]) ++first;
    piece[first] = rest[first] & (~rest[first] + 1);
    for (bool grows = true; grows;) {
        grows = false;
        const auto fill = [&](size_t x) {
            const uint64_t from = piece[x] | (((x > 0 ? piece[x - 1] : 0) | (x < 7 ? piece[x + 1] : 0)) & rest[x]);
            const uint64_t filled = filledSlab(from, rest[x]);
            grows |= filled != piece[x];
            piece[x] = filled;
        };
        for (size_t x = 0; x < 8; ++x) fill(x);
        for (size_t x = 8; x-- > 0;) fill(x);
    }
    for (size_t x = 0; x < 8; ++x) rest[x] &= ~piece[x];
    return piece;
}

/// Do two pieces touch, the second in the next block along an axis?
bool touch(const Slabs& a, const Slabs& b, int axis) {
    if (axis == 0) return a[7] & b[0];
    uint64_t both = 0;
    for (size_t x = 0; x < 8; ++x) both |= axis == 1 ? a[x] >> 56 & b[x] : a[x] >> 7 & b[x] & kFirstZ;
    return both;
}

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

PAVEL_WIDE bool nearMask(const float* values, float limit, BlockMask& mask) {
    unsigned any = 0;
    for (int row = 0; row < 64; ++row) {
        unsigned bits = 0;
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) bits |= unsigned(std::abs(values[row * 8 + z]) < limit) << z;
        mask[size_t(row)] = uint8_t(bits);
        any |= bits;
    }
    return any != 0;
}

WorkLeaf::NodeMaskType nodeMask(const BlockMask& m) {
    const Slabs slabs = slabsOf(m);
    WorkLeaf::NodeMaskType mask;
    for (openvdb::Index x = 0; x < 8; ++x) mask.getWord<uint64_t>(x) = slabs[x];
    return mask;
}

BlockMask blockMask(const WorkLeaf::NodeMaskType& m) {
    Slabs slabs;
    for (openvdb::Index x = 0; x < 8; ++x) slabs[x] = m.getWord<uint64_t>(x);
    BlockMask mask;
    std::memcpy(mask.data(), slabs.data(), sizeof slabs);
    return mask;
}

std::vector<MaskedBlock> straysOf(const std::vector<MaskedBlock>& blocks) {
    std::vector<Slabs> pieces;
    std::vector<int> start;  // of each block's pieces
    CoordBBox box;
    for (const MaskedBlock& block : blocks) box.expand(block.origin);
    BlockNumbers numbers(box);
    for (size_t b = 0; b < blocks.size(); ++b) {
        numbers.set(blocks[b].origin, int(b));
        start.push_back(int(pieces.size()));
        Slabs rest = slabsOf(blocks[b].mask);
        while (std::any_of(rest.begin(), rest.end(), [](uint64_t slab) { return slab != 0; }))
            pieces.push_back(takePiece(rest));
    }
    start.push_back(int(pieces.size()));
    UnionFind sets(pieces.size());
    for (size_t b = 0; b < blocks.size(); ++b)
        for (int axis = 0; axis < 3; ++axis) {
            Coord next = blocks[b].origin;
            next[axis] += 8;
            const int n = numbers.at(next);
            if (n < 0) continue;
            for (int i = start[b]; i < start[b + 1]; ++i)
                for (int j = start[size_t(n)]; j < start[size_t(n) + 1]; ++j)
                    if (touch(pieces[size_t(i)], pieces[size_t(j)], axis)) sets.join(i, j);
        }
    std::vector<uint64_t> size(pieces.size(), 0);
    for (size_t i = 0; i < pieces.size(); ++i)
        for (const uint64_t slab : pieces[i]) size[size_t(sets.find(int(i)))] += uint64_t(__builtin_popcountll(slab));
    const int largest = pieces.empty() ? -1 : int(std::max_element(size.begin(), size.end()) - size.begin());
    std::vector<MaskedBlock> strays;
    for (size_t b = 0; b < blocks.size(); ++b)
        for (int i = start[b]; i < start[b + 1]; ++i) {
            if (sets.find(i) == largest) continue;
            if (strays.empty() || strays.back().origin != blocks[b].origin) strays.push_back({blocks[b].origin, {}});
            Slabs all = slabsOf(strays.back().mask);
            for (size_t x = 0; x < 8; ++x) all[x] |= pieces[size_t(i)][x];
            std::memcpy(strays.back().mask.data(), all.data(), sizeof all);
        }
    return strays;
}

}  // namespace pavel
