#include "pavel/io/vdb_file.h"

#include <filesystem>

#include "pavel/vdb/packed_grids.h"
#include "pavel/vdb/voxelize.h"
#include "support/meshes.h"

namespace pavel {
namespace {

/// A ball as surface and base of a packing, in voxels of the size.
Packing ball(double voxelSize) {
    openvdb::initialize();
    Packing p;
    p.voxelSize = voxelSize;
    p.grids = std::make_shared<PackedGrids>();
    p.grids->surface = narrowBand(test::sphere(9), 1, kResultBand)->treePtr();
    p.grids->base = narrowBand(test::sphere(9), 1, kResultBand)->treePtr();
    return p;
}

/// Rounding of voxel size and background must not make OpenVDB's own checks doubt the half width.
TEST(VdbFile, IsCleanAtAnyVoxelSize) {
    const test::TemporaryFolder folder;
    VdbOptions options;
    options.fog = true;
    options.digest = std::string(32, '0');
    for (int i = 1; i <= 40; ++i) {
        const double h = 0.0137 * i * i / 7;
        Packing p = ball(h);
        const auto faults = writeDecorationVdb(folder / "d.vdb", p, options);
        EXPECT_FALSE(p.grids->surface);  // not held twice
        EXPECT_TRUE(faults.empty()) << h << ": " << faults[0];
    }
    for (const VdbGridInfo& g : vdbInfo(folder / "d.vdb"))
        if (g.name != "density") {
            EXPECT_EQ(g.gridClass, "level set");
        }
}

TEST(VdbFile, FaultsAreNamed) {
    const test::TemporaryFolder folder;
    VdbOptions options;
    options.digest = std::string(32, '0');
    Packing p = ball(1);
    p.grids->surface->setValueOn(Coord(9, 0, 0), std::numeric_limits<float>::quiet_NaN());
    const auto faults = writeDecorationVdb(folder / "d.vdb", p, options);
    ASSERT_FALSE(faults.empty());
    EXPECT_NE(faults[0].find("\"surface\""), std::string::npos);
}

}  // namespace
}  // namespace pavel
