#include "pavel/core/shapes.h"

#include "pavel/core/error.h"
#include "pavel/core/footprint.h"
#include "pavel/core/mesh_check.h"
#include "support/meshes.h"

namespace pavel {
namespace {

class EveryShape : public testing::TestWithParam<std::string> {};

TEST_P(EveryShape, IsAClosedOutwardSolid) {
    const MeshFacts f = meshFacts(makeShape(GetParam()));
    EXPECT_TRUE(f.fit());
    EXPECT_EQ(f.degenerateTriangles, 0u);
    EXPECT_EQ(f.unusedVertices, 0u);
    EXPECT_EQ(f.doubledVertices, 0u);
}

std::vector<std::string> shapeNames() {
    std::vector<std::string> names;
    for (const ShapeInfo& s : builtinShapes()) names.push_back(s.name);
    return names;
}
INSTANTIATE_TEST_SUITE_P(Builtin, EveryShape, testing::ValuesIn(shapeNames()), [](const auto& i) { return i.param; });

// Closed forms, or values by voxel integration of the same formulas (within 1 %).
struct ElementFacts {
    const char* name;
    double footprint, height, volume;
};
class ElementShape : public testing::TestWithParam<ElementFacts> {};

TEST_P(ElementShape, HasItsFootprintAndVolume) {
    const auto [name, footprint, height, volume] = GetParam();
    const TriangleMesh m = makeShape(name);
    EXPECT_NEAR(footprintArea(m) / footprint, 1, 0.01);
    EXPECT_NEAR(meshVolume(m) / volume, 1, 0.01);
    EXPECT_NEAR(meshBounds(m).max[2] / height, 1, 0.03);
}
INSTANTIATE_TEST_SUITE_P(Table, ElementShape,
                         testing::Values(ElementFacts{"pearl", 50.265, 7.2, 268.08},
                                         ElementFacts{"disc", 50.265, 2.4, 106}, ElementFacts{"petal", 53.3, 3.0, 59.6},
                                         ElementFacts{"leaf", 73.5, 2.3, 70.9}, ElementFacts{"scale", 68.5, 3.45, 80.6},
                                         ElementFacts{"bean", 31.416, 4, 83.78}, ElementFacts{"rice", 17.4, 2.2, 28.1},
                                         ElementFacts{"torus", 48.38, 2.2, 83.6},
                                         ElementFacts{"rose_petal", 123, 2.65, 112},
                                         ElementFacts{"pebble", 70.8, 5.2, 249}),
                         [](const auto& i) { return std::string(i.param.name); });

struct BaseFacts {
    const char* name;
    double area, volume, outer;
};
class VesselShape : public testing::TestWithParam<BaseFacts> {};

TEST_P(VesselShape, HasItsAreasAndVolume) {
    const auto [name, area, volume, outer] = GetParam();
    const TriangleMesh m = makeShape(name);
    EXPECT_NEAR(meshArea(m) / area, 1, 2e-3);
    EXPECT_NEAR(meshVolume(m) / volume, 1, 2e-3);
    EXPECT_NEAR(meshArea(groupSubmesh(m, "outer")) / outer, 1, 2e-3);
}
INSTANTIATE_TEST_SUITE_P(Table, VesselShape,
                         testing::Values(BaseFacts{"vase", 112030, 227930, 55672},
                                         BaseFacts{"bottle", 83358, 150510, 40576},
                                         BaseFacts{"glass", 41499, 54185, 19295}, BaseFacts{"tile", 22481, 79297, 9216},
                                         BaseFacts{"sphere", 20106, 268083, 20106}),
                         [](const auto& i) { return std::string(i.param.name); });

TEST(Shapes, HeightScalesAVessel) {
    EXPECT_NEAR(
        meshVolume(makeShape("vase", {{"height", 90}, {"wall", 2}, {"floor", 3}})) * 8 / meshVolume(makeShape("vase")),
        1, 1e-6);
}

TEST(Shapes, BadNamesAndValuesAreErrors) {
    EXPECT_THROW(makeShape("vaze"), InputError);
    EXPECT_THROW(makeShape("pearl", {{"radios", 1}}), InputError);
    EXPECT_THROW(makeShape("pearl", {{"radius", -1}}), InputError);
    EXPECT_THROW(makeShape("pearl", {{"radius", std::nan("")}}), InputError);
    EXPECT_THROW(makeShape("glass", {{"wall", 50}}), InputError);
    EXPECT_EQ(didYouMean("petel", {"pearl", "petal"}), " (did you mean \"petal\"?)");
    EXPECT_EQ(didYouMean("zzzzzz", {"pearl", "petal"}), "");
}

}  // namespace
}  // namespace pavel
