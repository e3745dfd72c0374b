#include "pavel/io/scene_json.h"

#include "pavel/io/seed_files.h"

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "support/meshes.h"

namespace pavel {
namespace {

const char* const kScene = R"({
  // a comment
  "units": "mm", "voxel_size": 0.25, "seed": 7,
  "base": { "shape": "sphere", "radius": 40 },
  "elements": [ { "name": "petal", "shape": "petal", "length": 9, "width": 6, "height": 3, "weight": 2, "color": "#d98c8c", "stiffness": 1,
                  "sink": 0.1, "material": { "a": 0.1, "b": 0.3 } },
                { "shape": "pearl" } ],
  "seeding": { "method": "cvt", "coverage": 1.4, "iterations": 50, "offset": 0, "region": "all" },
  "orientation": { "rotation": "fixed", "angle": 10, "jitter": 5 }, "assignment": "random", "variation": { "size": 0.1 },
  "refine": { "iterations": 0 }, "material": { "a": 0.1, "b": 0.3, "contact": "center", "gap": 0, "base_loss": "recover" },
  "output": { "vdb": true, "fog": false, "half": false, "elements": "separate", "mesh": ["glb", "ply"], "with_base": true, "preview": true }
})";

Scene parse(const std::string& text, const std::vector<std::string>& overrides = {}) {
    return parseScene(text, "scene.json", ".", overrides);
}

std::string errorOf(const std::string& text, const std::vector<std::string>& overrides = {}) {
    try {
        parse(text, overrides);
    } catch (const InputError& e) {
        return e.what();
    }
    return "";
}

TEST(SceneJson, ReadsEveryKey) {
    const Scene s = parse(kScene);
    EXPECT_EQ(*s.voxelSize, 0.25);
    EXPECT_EQ(s.seed, 7u);
    EXPECT_EQ(s.base.parameters.at("radius"), 40);
    ASSERT_EQ(s.elements.size(), 2u);
    EXPECT_EQ(s.elements[0].parameters.at("height"), 3);
    EXPECT_EQ(s.elements[0].weight, 2);
    EXPECT_EQ(s.elements[1].name, "pearl");
    EXPECT_EQ(*s.seedings[0].coverage, 1.4);
    EXPECT_EQ(s.orientation.rotation, "fixed");
    EXPECT_EQ(s.sizeVariation, 0.1);
    EXPECT_TRUE(s.output.separate);
    EXPECT_EQ(s.output.mesh.size(), 2u);
}

TEST(SceneJson, WritesWhatItReads) {
    const std::string once = sceneJson(parse(kScene), ".");
    EXPECT_EQ(sceneJson(parse(once), "."), once);
    EXPECT_EQ(sceneDigest(parse(once)), sceneDigest(parse(kScene)));
    EXPECT_NE(sceneDigest(parse(kScene, {"seed=8"})), sceneDigest(parse(kScene)));
    EXPECT_EQ(sceneDigest(parse(kScene)).size(), 32u);
}

TEST(SceneJson, MeshPathsFollowTheFolder) {
    const Scene s = parseScene(
        R"({"voxel_size":1,"base":{"mesh":"in/b.obj"},"elements":[{"shape":"pearl"}],"seeding":{"count":3}})", "x",
        "/a/scenes");
    EXPECT_NE(sceneJson(s, "/a/out").find("\"../scenes/in/b.obj\""), std::string::npos);
}

TEST(SceneJson, OverridesWin) {
    const Scene s = parse(kScene, {"seeding.coverage=1.6", "elements.1.radius=3", "voxel_size=null", "resolution=50",
                                   "output.mesh=[\"stl\"]"});
    EXPECT_EQ(*s.seedings[0].coverage, 1.6);
    EXPECT_EQ(s.elements[1].parameters.at("radius"), 3);
    EXPECT_FALSE(s.voxelSize);
    EXPECT_EQ(*s.resolution, 50);
    EXPECT_EQ(s.output.mesh, std::vector<std::string>{"stl"});
    EXPECT_EQ(parse(kScene, {"material.a=.05"}).material.a, 0.05);
}

TEST(SceneJson, ErrorsNameTheKeyAndTheMend) {
    const auto says = [](const std::string& text, const std::vector<std::string>& set, const std::string& part) {
        const std::string e = errorOf(text, set);
        EXPECT_NE(e.find(part), std::string::npos) << e;
        EXPECT_NE(e.find("scene.json"), std::string::npos) << e;
    };
    says("{\n \"units\": mm }", {}, "line 2");
    says("[]", {}, "must be an object");
    says(kScene, {"seeding.coverrage=1"}, "did you mean \"coverage\"");
    says(kScene, {"seeding.count=5"}, "coverage or count, not both");
    says(kScene, {"voxel_size=-1"}, "voxel_size must be above 0");
    says(kScene, {"voxel_size=\"big\""}, "must be a number");
    says(kScene, {"resolution=30"}, "not both");
    says(kScene, {"material.b=0.05", "elements.0.material.b=0.05"}, "0 < a < b");
    says(kScene, {"elements.0.shape=petl"}, "did you mean \"petal\"");
    says(kScene, {"elements.0.length=-3"}, "must be above 0");
    says(kScene, {"elements.0.color=red"}, "#rrggbb");
    says(kScene, {"base.shape=pearl"}, "no built-in base");
    says(kScene, {"units=furlong"}, "units");
    says(kScene, {"seeding.count=-5"}, "whole number");
    says(kScene, {"material.gap=-1"}, "at least 0");
    says(kScene, {"seeding=[]"}, "list is empty");
    says(kScene, {"seeding.region={\"height\":[3,1]}"}, "lower first");
    says(kScene, {"seeding.region={\"sphere\":{\"radius\":0}}"}, "radius above 0");
    says(kScene, {"seeding.elements=[\"petl\"]"}, "did you mean");
    says(kScene, {"seeding.offset=-1"}, "at least 0");
    says(kScene, {"material.contact=edge"}, "depth");
    says(kScene, {"output.mesh=[\"fbx\"]"}, "unknown");
    says(kScene, {"elements.1.name=petal"}, "is taken");
}

TEST(SceneJson, OutputAndShellAreCheckedByName) {
    const std::pair<const char*, const char*> wrong[] = {{"output.mesh=[\"dae\"]", "output.mesh"},
                                                         {"output.remesh={\"vertices\":0}", "output.remesh.vertices"},
                                                         {"output.remesh={\"vertices\":-5}", "output.remesh.vertices"},
                                                         {"output.adaptivity=2", "output.adaptivity"},
                                                         {"shell.parts=\"some\"", "shell.parts"},
                                                         {"shell.parts=0", "shell.parts"},
                                                         {"shell.bed=[100,0,100]", "shell.bed"},
                                                         {"shell.clearance=-1", "shell.clearance"},
                                                         {"shell.min_thickness=-1", "shell.min_thickness"}};
    for (const auto& [set, key] : wrong) {
        const std::string e = errorOf(kScene, {set});
        EXPECT_NE(e.find(key), std::string::npos) << set << ": " << e;
    }
}

TEST(SceneJson, ShellRoundTrip) {
    for (const char* parts : {"\"planes\"", "7", "{\"groups\":true}"}) {
        const Scene s = parse(kScene, {std::string("shell.parts=") + parts, "shell.bed=[90,80,70]",
                                       "shell.lay_flat=true", "output.remesh.vertices=500"});
        const Scene back = parse(sceneJson(s, "."));
        EXPECT_EQ(back.shell.split, s.shell.split);
        EXPECT_EQ(back.shell.parts, s.shell.parts);
        EXPECT_EQ(back.shell.bed, Vec3(90, 80, 70));
        EXPECT_TRUE(back.shell.layFlat);
        EXPECT_EQ(back.output.remeshVertices, size_t(500));
    }
}

TEST(SeedsJson, RoundTrip) {
    SeedSet set;
    set.method = "cvt";
    set.decoratedArea = 100;
    set.coverage = 1.3;
    Seed s;
    s.id = 1;
    s.position = Vec3(1.25, -2, 3.0 / 7);
    s.normal = normalized(Vec3(1, 2, 3));
    s.tangent = anyPerpendicular(s.normal);
    s.rotation = 12.5;
    s.scale = 1.05;
    set.seeds = {s};
    ElementKind kind;
    kind.name = "pearl";
    const test::TemporaryFolder folder;
    writeText(folder / "seeds.json", seedsJson(set, {kind}, "mm"));
    const auto back = readSeeds(folder / "seeds.json", "mm");
    ASSERT_EQ(back.size(), 1u);
    for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(back[0].position[k], s.position[k]);
        EXPECT_EQ((*back[0].tangent)[k], s.tangent[k]);
    }
    EXPECT_EQ(back[0].rotation, 12.5);
    EXPECT_EQ(back[0].element, "pearl");
    EXPECT_NEAR(readSeeds(folder / "seeds.json", "cm")[0].position[0], 0.125, 1e-12);
    writeSeedsPly(folder / "seeds.ply", set);
    const auto ply = readSeedsPly(folder / "seeds.ply", {"pearl"});
    ASSERT_EQ(ply.size(), 1u);
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(ply[0].position[k], s.position[k], 1e-6);
        EXPECT_NEAR((*ply[0].normal)[k], s.normal[k], 1e-6);
        EXPECT_NEAR((*ply[0].tangent)[k], s.tangent[k], 1e-6);
    }
    EXPECT_EQ(ply[0].rotation, 12.5);
    EXPECT_NEAR(ply[0].scale, 1.05, 1e-6);
    EXPECT_EQ(ply[0].element, "pearl");
    EXPECT_THROW(readSeedsPly(folder / "seeds.ply", {}), InputError);
}

}  // namespace
}  // namespace pavel
