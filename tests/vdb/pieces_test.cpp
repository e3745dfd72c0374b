#include "pavel/vdb/pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace pavel {
namespace {

/// The voxels of blocks.
std::set<Coord> voxelsOf(const std::vector<MaskedBlock>& blocks) {
    std::set<Coord> voxels;
    for (const MaskedBlock& block : blocks)
        for (int v = 0; v < 512; ++v)
            if (testMask(block.mask, v)) voxels.insert(block.origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)));
    return voxels;
}

/// All that are joined by faces to one of them; takes them out.
std::set<Coord> takePiece(std::set<Coord>& rest) {
    std::vector<Coord> open{*rest.begin()};
    rest.erase(rest.begin());
    std::set<Coord> piece;
    while (!open.empty()) {
        const Coord at = open.back();
        open.pop_back();
        piece.insert(at);
        for (int side = 0; side < 6; ++side) {
            Coord next = at;
            next[side / 2] += side % 2 ? 1 : -1;
            if (rest.erase(next)) open.push_back(next);
        }
    }
    return piece;
}

TEST(Pieces, StraysAreAllButTheLargestPiece) {
    std::mt19937 random(7);
    for (const double share : {0.25, 0.3, 0.35, 0.6}) {
        std::vector<MaskedBlock> blocks;
        forEachBlock(CoordBBox(Coord(-16), Coord(15)), [&](const Coord& origin) {
            MaskedBlock block{origin, {}};
            if (origin == Coord(0))
                block.mask.fill(0xff);
            else
                for (uint8_t& row : block.mask)
                    for (int z = 0; z < 8; ++z)
                        row = uint8_t(row | (std::uniform_real_distribution<>(0, 1)(random) < share) << z);
            blocks.push_back(block);
        });
        std::set<Coord> rest = voxelsOf(blocks), strays = rest;
        std::set<Coord> largest;
        while (!rest.empty()) {
            std::set<Coord> piece = takePiece(rest);
            if (piece.size() > largest.size()) largest.swap(piece);
        }
        for (const Coord& c : largest) strays.erase(c);
        EXPECT_GT(strays.size(), 0u);
        EXPECT_EQ(voxelsOf(straysOf(blocks)), strays) << "share " << share;
    }
}

TEST(Pieces, OfOnePieceNothingIsStray) {
    MaskedBlock block{Coord(8, 0, -8), {}};
    block.mask.fill(0x18);
    EXPECT_TRUE(straysOf({block}).empty());
    EXPECT_TRUE(straysOf({}).empty());
}

}  // namespace
}  // namespace pavel
