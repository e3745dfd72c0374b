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

/// Made and dropped one by one as the archive asks for them: none is taken for another, whatever the way of reading.
TEST(VdbFile, HoldsEveryElement) {
    const test::TemporaryFolder folder;
    VdbOptions options;
    options.digest = std::string(32, '0');
    Packing p = ball(0.5);
    const std::vector<double> radii{5, 9, 0, 7};  // the third was swallowed
    for (const double radius : radii) {
        p.elements.emplace_back().finalVolume = radius;
        WorkTree::Ptr tree;
        if (radius > 0) {
            tree = std::make_shared<WorkTree>(kResultBand);
            const auto whole = narrowBand(test::sphere(radius), 1, kResultBand)->treePtr();
            for (auto leaf = whole->cbeginLeaf(); leaf; ++leaf) tree->addLeaf(new WorkLeaf(*leaf));
        }
        p.grids->elements.push_back(tree ? CompactLevelSet(*tree) : CompactLevelSet());
    }
    EXPECT_TRUE(writeElementsVdb(folder / "e.vdb", p, {"a", "b", "c", "d"}, options).empty());
    for (const bool delayed : {false, true}) {
        openvdb::io::File file(folder / "e.vdb");
        file.open(delayed);
        const auto grids = file.getGrids();
        ASSERT_EQ(grids->size(), 3u);
        for (const auto& g : *grids) {
            const int id = g->metaValue<int>("id");
            const double radius = radii[size_t(id) - 1];
            EXPECT_EQ(g->getName(), "element_0000" + std::to_string(id));
            EXPECT_EQ(g->metaValue<std::string>("kind"), std::string(1, char('a' + id - 1)));
            EXPECT_EQ(g->metaValue<double>("volume"), radius);
            EXPECT_EQ(g->metaValue<openvdb::Int64>("file_voxel_count"), int64_t(g->activeVoxelCount()));
            const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(g);
            ASSERT_TRUE(grid);
            EXPECT_EQ(grid->activeVoxelCount(), p.grids->elements[size_t(id) - 1].activeVoxels());
            EXPECT_NEAR(grid->tree().getValue(Coord(int(radius), 0, 0)), 0, 0.5 * 0.05);
            EXPECT_LT(grid->tree().getValue(Coord(0, 0, 0)), 0);
        }
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
