#include "pavel/vdb/creases.h"

#include <gtest/gtest.h>

#include <functional>

#include "pavel/vdb/fuse.h"
#include "support/elements.h"

namespace pavel {
namespace {

using Distance = std::function<double(const Vec3&)>;

CompactLevelSet levelSet(const CoordBBox& box, const Distance& distance) {
    BlockLevelSet set(box, kResultBand);
    BlockLevelSet::Blocks blocks;
    forEachBlock(box, [&](const Coord& origin) {
        float values[512];
        BlockMask near;
        for (int v = 0; v < 512; ++v)
            values[v] = float(std::clamp(distance(centreOf(origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)))),
                                         -double(kResultBand), double(kResultBand)));
        if (nearMask(values, kResultBand, near))
            blocks.add(origin, values, near);
        else if (values[0] < 0)
            set.fill(origin);
    });
    set.add(std::move(blocks));
    return set.compact();
}

/// To a box.
Distance boxed(const Vec3& lo, const Vec3& hi) {
    return [=](const Vec3& p) {
        double outside2 = 0, inside = -1e9;
        for (int k = 0; k < 3; ++k) {
            const double off = std::max(lo[k] - p[k], p[k] - hi[k]);
            outside2 += off > 0 ? off * off : 0;
            inside = std::max(inside, off);
        }
        return outside2 > 0 ? std::sqrt(outside2) : inside;
    };
}

TEST(Creases, FlushSeamsStayFlat) {
    const CoordBBox box(Coord(-32, -32, -32), Coord(31, 31, 31));
    for (const double shift : {0.0, 0.3, 0.5}) {
        // A contact face to a tenth of a voxel, oblique to nothing: the hardest case for a fillet.
        const CompactLevelSet left = levelSet(box, boxed({-20, -20, -20}, {shift, 20, 10 + shift})),
                              right = levelSet(box, boxed({shift + 0.1, -20, -20}, {20, 20, 10 + shift}));
        const openvdb::FloatTree::Ptr all = unionOf({&left, &right}, true);
        for (int y = -12; y <= 12; ++y) {
            for (double x = -4; x <= 4; x += 0.25) {
                // Where the surface is, along z.

                double a = 8, b = 13;
                for (int step = 0; step < 30; ++step) {
                    const double z = (a + b) / 2;
                    (sampleAt(*all, Vec3(x, y + 0.3, z)) < 0 ? a : b) = z;
                }
                EXPECT_NEAR(a, 10 + shift, 0.15) << x << " " << y;
            }
            for (int z = -10; z <= 6; ++z) EXPECT_LT(all->getValue(Coord(0, y, z)), -0.8) << "the face between them";
        }
    }
}

TEST(Creases, GroovesGetAFilletAVoxelDeep) {
    constexpr double r = 20, half = 15;  // meets at 97 degrees
    const CoordBBox box(Coord(-48, -32, -32), Coord(47, 31, 31));
    const auto ball = [&](double x) {
        return [=](const Vec3& p) { return std::max(length(p - Vec3(x, 0, 0)) - r, x < 0 ? p[0] : -p[0]); };
    };
    const CompactLevelSet left = levelSet(box, ball(-half)), right = levelSet(box, ball(half));
    const openvdb::FloatTree::Ptr all = unionOf({&left, &right}, true), plain = unionOf({&left, &right}, false);
    const double rim = std::sqrt(r * r - half * half);
    for (double t = 0; t < 6.2; t += 0.1) {
        const Vec3 radial(0, std::cos(t), std::sin(t));
        EXPECT_NEAR(sampleAt(*plain, rim * radial), 0, 0.3);
        EXPECT_NEAR(sampleAt(*all, rim * radial), -1, 0.3) << t;
        EXPECT_NEAR(sampleAt(*all, Vec3(half, 0, 0) + r * radial), 0, 0.02) << "away from it";
    }
}

}  // namespace
}  // namespace pavel
