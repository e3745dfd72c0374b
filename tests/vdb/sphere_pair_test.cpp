#include <cmath>

#include "pavel/core/error.h"
#include "pavel/vdb/extract.h"
#include "pavel/vdb/packed_grids.h"
#include "support/elements.h"

namespace pavel {
namespace {

/// Two spheres that overlap, far from the base.
struct Pair {
    static constexpr double kRadius = 5, kHalf = 3.4;  // of the way between the centres, along x
    const double rim = std::sqrt(kRadius * kRadius - kHalf * kHalf);
    std::vector<ElementKind> kinds;
    std::vector<PlacedElement> placed;

    Pair() : kinds(1), placed(2) {
        kinds[0].mesh = test::sphere(kRadius, {0, 0, 0}, 128);
        for (int i : {0, 1})
            placed[size_t(i)].id = i + 1, placed[size_t(i)].worldFromElement.origin[0] = i ? kHalf : -kHalf;
    }
    Packing packed(PackOptions options, bool fused = false) const {
        options.surface = fused;
        RunContext context;
        return pack(test::sphere(3, {0, 0, -20}, 16), kinds, placed, options, context);
    }
};

TEST(SpherePair, NothingMovesBeyondTheReachOfTheGrowth) {
    const Pair pair;
    PackOptions options;
    options.voxelSize = 0.07;  // 12 voxels to the fastest growth: fronts, which have far to go, march on every other
    options.a = 0.05;
    options.b = 0.15;
    const Packing p = pair.packed(options);
    const double coarse = 2 * options.voxelSize, reach = options.b * meshBounds(pair.kinds[0].mesh).diagonal();
    double crest = 0, warts = 0;
    for (const Vec3& q : extractElement(p, 1).points) {
        const double out = length(q - pair.placed[0].worldFromElement.origin) - Pair::kRadius;
        const double fromRim = std::hypot(q[0], std::hypot(q[1], q[2]) - pair.rim);
        double& most = fromRim > reach + coarse ? warts : crest;
        most = std::max(most, out);
    }
    EXPECT_GT(crest, 0.5);
    EXPECT_LT(warts, 0.1 * options.voxelSize);
}

/// A shape of revolution about the x axis: the most by which its radius (voxels) is off the mean of those two degrees
/// before and after, in a plane.
template <class Reader>
double unevenness(const Reader& reader, double x) {
    std::vector<double> radii;
    for (int degree = 0; degree < 360; ++degree) {
        const Vec3 out(0, std::cos(degreesToRadians(degree)), std::sin(degreesToRadians(degree)));
        double lo = 25, hi = 60;
        while (hi - lo > 1e-3) {
            const double mid = 0.5 * (lo + hi);
            (sampleAt(reader, Vec3(x, 0, 0) + mid * out) < 0 ? lo : hi) = mid;
        }
        radii.push_back(lo);
    }
    double most = 0;
    for (size_t i = 0; i < 360; ++i)
        most = std::max(most, std::abs(radii[i] - 0.5 * (radii[(i + 358) % 360] + radii[(i + 2) % 360])));
    return most;
}

TEST(SpherePair, SeamsAreSmoothAlongTheRim) {
    const Pair pair;
    PackOptions options;
    options.voxelSize = 0.11;  // fronts march on every seventh voxel
    options.a = 0.2;
    options.b = 0.6;
    const Packing p = pair.packed(options, true);
    const WorkTree::Ptr tree = p.grids->elements[0].tree();
    for (const double x : {-3.0, -5.0, -8.0, -12.0}) EXPECT_LT(unevenness(WorkReader(*tree), x), 0.07) << x;
    for (const double x : {-3.0, -1.0, 0.0, 1.0, 3.0})
        EXPECT_LT(unevenness(BaseReader(*p.grids->surface), x), 0.16) << x;
}

TEST(SpherePair, GroovesStayOpenOnMuchCoarserGrids) {
    // Two spheres whose fronts turn by less than the wedge between them: a groove is left down to the rim.
    const Pair pair;
    PackOptions options;
    options.voxelSize = 0.08;  // 125 voxels across, rise 21.6: fronts march on a grid five times coarser
    const Packing p = pair.packed(options);
    const std::vector<WorkTree::Ptr> trees = treesOf(p.grids->elements);
    int torn = 0, columns = 0, highest = -1000;
    for (int degrees = 0; degrees < 360; degrees += 3)
        for (int x = -12; x <= 12; ++x) {
            const double angle = degreesToRadians(degrees);
            bool in = true;
            int last = 0, flips = 0;
            for (int r = int(0.8 * pair.rim / options.voxelSize); r < 75; ++r) {
                const Coord c(x, int(std::lround(r * std::cos(angle))), int(std::lround(r * std::sin(angle))));
                const bool now = trees[0]->getValue(c) < 0.5 || trees[1]->getValue(c) < 0.5;  // no gap to speak of
                if (now) last = r;
                flips += now != in;
                in = now;
            }
            torn += flips > 1;
            ++columns;
            if (std::abs(x) <= 2) highest = std::max(highest, last);
        }
    EXPECT_LT(torn, columns / 100);  // out through one surface: neither tongues nor holes
    EXPECT_LT(highest, pair.rim / options.voxelSize + 8);
}

TEST(SpherePair, SeamsOfTheFusedMeshAreFinerThanItsTriangles) {
    const Pair pair;
    PackOptions options;
    options.voxelSize = 0.1;
    Packing p = pair.packed(options, true);
    const LabelledMesh fused = extractFused(p, false);
    dropElements(p);
    EXPECT_THROW(extractFused(p, false), RunError);  // nobody could tell any more
    std::vector<const SeamVertex*> at(fused.mesh.points.size());
    for (const SeamVertex& s : fused.seams) at[size_t(s.vertex)] = &s;
    int atSeam = 0;
    for (size_t v = 0; v < at.size(); ++v) {
        // The contact face is the plane x = 0: both are equally far from it.
        const double x = fused.mesh.points[v][0] / options.voxelSize;
        if (std::abs(x) < 1.5) {
            ASSERT_NE(at[v], nullptr) << x;
        }
        if (!at[v]) continue;
        if (std::abs(x) > 0.1) {
            EXPECT_EQ(at[v]->id, x < 0 ? 1 : 2) << x;
        }
        if (std::abs(x) > 0.1 && at[v]->share > 0) {
            EXPECT_EQ(at[v]->other, x < 0 ? 2 : 1) << x;
        }
        if (std::abs(x) < 0.1) {
            EXPECT_GT(at[v]->share, 0.3) << x;
        }
        if (std::abs(x) > 2.5) {
            EXPECT_EQ(at[v]->share, 0) << x;
        }
        EXPECT_LE(at[v]->share, 0.5);
        atSeam += at[v]->share > 0.05;
    }
    EXPECT_GT(atSeam, 2 * kPi * pair.rim / options.voxelSize / 2);  // along all of the rim
}

}  // namespace
}  // namespace pavel
