// Proof by other programs: what Pavel writes is read, sliced and found whole. Each test skips where its program is
// missing.
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pavel/core/mesh_check.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_read.h"
#include "support/meshes.h"
#include "support/process.h"

namespace pavel {
namespace {

namespace fs = std::filesystem;

bool has(const std::string& program) {
    return test::runCommand("command -v " + program).status == 0;
}

/// The number that follows a word.
double numberAfter(const std::string& text, const std::string& word) {
    const size_t at = text.find(word);
    return at == std::string::npos ? -1 : std::atof(text.c_str() + text.find_first_of("0123456789", at + word.size()));
}

const char* const kScene = R"({ "voxel_size": 0.6, "base": { "shape": "sphere", "radius": 20 },
  "elements": [ { "shape": "pearl", "radius": 7 } ], "seeding": { "count": 40, "iterations": 20 },
  "output": { "mesh": ["glb", "obj", "stl", "3mf"], "elements": "merged", "preview": false },
  "shell": { "clearance": 0.3, "min_thickness": 1.2, "bed": [60, 60, 60] } })";

/// A scene that is decorated and taken apart once.
const test::TemporaryFolder& results() {
    static const test::TemporaryFolder folder;
    static const bool made = [&] {
        writeText(folder / "scene.json", kScene);
        for (const char* verb : {"decorate", "shell"}) {
            const test::Outcome o = test::runCommand(std::string(PAVEL_PROGRAM) + " " + verb + " " +
                                                     (folder / "scene.json") + " -o " + (folder / verb) + " --quiet");
            EXPECT_EQ(o.status, 0) << o.text;
        }
        return true;
    }();
    EXPECT_TRUE(made);
    return folder;
}

std::vector<std::string> parts() {
    std::vector<std::string> files;
    for (int i = 1; i < 100; ++i) {
        char name[32];
        std::snprintf(name, sizeof name, "shell/part_%02d.stl", i);
        if (!fs::exists(results() / name)) break;
        files.push_back(results() / name);
    }
    return files;
}

TEST(Others, ShellLeavesClosedPartsAndNoOtherStl) {
    const auto files = parts();
    ASSERT_GE(files.size(), 2u);
    size_t stl = 0;
    for (const auto& e : fs::directory_iterator(results() / "shell")) stl += e.path().extension() == ".stl";
    EXPECT_EQ(stl, files.size());
    EXPECT_TRUE(fs::exists(results() / "shell/assembly.png"));
    std::ifstream file(results() / "shell/shell.json");
    const nlohmann::json report = nlohmann::json::parse(file);
    ASSERT_EQ(report["parts"].size(), files.size());
    size_t elements = 0;
    for (size_t i = 0; i < files.size(); ++i) {
        TriangleMesh mesh = readMesh(files[i]);
        makeSolid(mesh, files[i]);
        const MeshFacts facts = meshFacts(mesh);
        EXPECT_TRUE(facts.fit());
        EXPECT_EQ(facts.components, 1u);
        EXPECT_NEAR(facts.volume, double(report["parts"][i]["volume"]), 1e-4 * facts.volume);
        EXPECT_LE(facts.bounds.longestSide(), 60);
        elements += report["parts"][i]["elements"].size();
    }
    EXPECT_EQ(elements, 40u);
}

TEST(Others, AdmeshFindsNoDefect) {
    if (!has("admesh")) GTEST_SKIP() << "admesh is not installed";
    std::vector<std::string> files = parts();
    files.push_back(results() / "decorate/decoration.stl");
    for (const std::string& f : files) {
        const test::Outcome o = test::runCommand("admesh " + f);
        EXPECT_EQ(o.status, 0);
        EXPECT_EQ(numberAfter(o.text, "Total disconnected facets"), 0) << o.text;
        for (const char* defect : {"Degenerate facets", "Edges fixed", "Facets removed", "Facets added",
                                   "Facets reversed", "Backwards edges", "Normals fixed"})
            EXPECT_EQ(numberAfter(o.text, defect), 0) << f << ": " << defect;
    }
}

TEST(Others, PrusaSlicerSlicesEveryPartWithoutRepair) {
    if (!has("prusa-slicer")) GTEST_SKIP() << "prusa-slicer is not installed";
    for (const std::string& f : parts()) {
        const test::Outcome info = test::runCommand("prusa-slicer --info " + f);
        EXPECT_NE(info.text.find("manifold = yes"), std::string::npos) << info.text;
        EXPECT_EQ(info.text.find("repaired"), std::string::npos) << info.text;
        const std::string gcode = f + ".gcode";
        const test::Outcome o =
            test::runCommand("prusa-slicer --export-gcode --center 100,100 --output " + gcode + " " + f);
        EXPECT_EQ(o.status, 0) << o.text;
        EXPECT_GT(fs::exists(gcode) ? fs::file_size(gcode) : 0, 10000u);
        fs::remove(gcode);
    }
}

TEST(Others, BlenderImportsMeshesAndVolume) {
    if (!has("blender")) GTEST_SKIP() << "blender is not installed";
    const std::string at = results() / "decorate/decoration";
    writeText(results() / "check.py", R"(
import bpy, json, sys, numpy
numpy.bool = bool
out = {}
def look(name):
    o = list(bpy.data.objects)
    out[name] = {"count": len(o), "size": list(o[0].dimensions)}
    for x in o: bpy.data.objects.remove(x)
at = sys.argv[-1]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=at + ".glb"); look("glb")
bpy.ops.import_scene.obj(filepath=at + ".obj"); look("obj")
bpy.ops.object.volume_import(filepath=at + ".vdb")
v = bpy.context.object.data
v.grids.load()
out["grids"] = sorted(g.name for g in v.grids)
print("RESULT" + json.dumps(out))
)");
    const test::Outcome o = test::runCommand("blender -b --python " + (results() / "check.py") + " -- " + at);
    const size_t start = o.text.find("RESULT{");
    ASSERT_NE(start, std::string::npos) << o.text;
    const nlohmann::json found = nlohmann::json::parse(o.text.substr(start + 6, o.text.find('\n', start) - start - 6));
    EXPECT_EQ(found["glb"]["count"], 1);
    EXPECT_EQ(found["obj"]["count"], 1);
    EXPECT_EQ(found["grids"], nlohmann::json({"base", "surface"}));
    std::vector<double> want;
    const Vec3 size = meshBounds(readMesh(at + ".obj")).size();
    for (int k = 0; k < 3; ++k) want.push_back(size[k]);
    std::vector<double> glb = found["glb"]["size"], obj = found["obj"]["size"];
    // glTF is in metres; either importer may turn the axes by a quarter.
    for (auto* v : {&want, &glb, &obj}) std::sort(v->begin(), v->end());
    for (size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(glb[k] * 1000, want[k], 1e-2);
        EXPECT_NEAR(obj[k], want[k], 1e-2);
    }
}

}  // namespace
}  // namespace pavel
