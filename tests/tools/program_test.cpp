// The program as a user meets it: exit statuses, messages, what lies in the folder afterwards.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pavel/core/mesh_check.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/scene_json.h"
#include "pavel/io/vdb_file.h"
#include "pavel/tools/examples.h"
#include "support/meshes.h"
#include "support/process.h"

namespace pavel {
namespace {

namespace fs = std::filesystem;

using test::Outcome;

Outcome run(const std::string& arguments) {
    return test::runCommand(std::string(PAVEL_PROGRAM) + " " + arguments);
}

std::string slurp(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {(std::istreambuf_iterator<char>(file)), {}};
}

const char* const kSmall = R"({ "voxel_size": 0.5, "base": { "shape": "sphere", "radius": 22 },
  "elements": [ { "shape": "pearl", "radius": 7, "name": "big" }, { "shape": "disc", "radius": 7, "height": 6 } ],
  "seeding": { "coverage": 1.35, "iterations": 20 }, "output": { "mesh": ["glb", "ply", "obj", "stl"], "elements": "separate", "fog": true } })";

TEST(Program, HelpVersionAndUsage) {
    EXPECT_EQ(run("--help").status, 0);
    EXPECT_EQ(run("--version").text.substr(0, 6), "pavel ");
    EXPECT_EQ(run("").status, 2);
    EXPECT_EQ(run("decorate").status, 2);
    EXPECT_EQ(run("fly").status, 2);
    EXPECT_EQ(run("decorate x.json --threads 0").status, 2);
    const Outcome o = run("bench spere");
    EXPECT_EQ(o.status, 2);
    EXPECT_NE(o.text.find("did you mean \"sphere\""), std::string::npos);
}

TEST(Program, MissingInputsAreNamed) {
    const test::TemporaryFolder folder;
    Outcome o = run("decorate " + (folder / "none.json"));
    EXPECT_EQ(o.status, 2);
    EXPECT_NE(o.text.find("none.json"), std::string::npos);
    writeText(folder / "scene.json",
              R"({"voxel_size":1,"base":{"mesh":"nowhere.obj"},"elements":[{"shape":"pearl"}],"seeding":{"count":3}})");
    o = run("decorate " + (folder / "scene.json") + " -o " + (folder / "out"));
    EXPECT_EQ(o.status, 2);
    EXPECT_NE(o.text.find("nowhere.obj"), std::string::npos);
    EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(Program, VoxelSizeThatDoesNotSuit) {
    const test::TemporaryFolder folder;
    writeText(folder / "scene.json", kSmall);
    Outcome o = run("decorate " + (folder / "scene.json") + " -o " + (folder / "out") + " --voxel 5");
    EXPECT_EQ(o.status, 2);
    EXPECT_NE(o.text.find("voxel_size is too large"), std::string::npos) << o.text;
    o = run("decorate " + (folder / "scene.json") + " -o " + (folder / "out") + " --set voxel_size=0.000001");
    EXPECT_EQ(o.status, 2);
    EXPECT_NE(o.text.find("voxel_size is too small"), std::string::npos) << o.text;
}

TEST(Program, SeedsAloneAndTheirFiles) {
    const test::TemporaryFolder folder;
    writeText(folder / "scene.json", R"({ "resolution": 30, "base": { "shape": "sphere", "radius": 30 },
      "elements": [ { "shape": "bean", "length": 12, "thickness": 5 }, { "shape": "pearl", "radius": 4 } ],
      "assignment": "alternate",
      "seeding": [ { "count": 60, "region": { "height": [0, 40] }, "offset": "auto" },
                   { "count": 30, "region": { "height": [-40, 0] }, "elements": ["pearl"] } ] })");
    Outcome o = run("seed " + (folder / "scene.json") + " -o " + (folder / "a"));
    ASSERT_EQ(o.status, 0) << o.text;
    EXPECT_NE(o.text.find("90 elements"), std::string::npos) << o.text;
    for (const char* name : {"seeds.json", "seeds.ply", "seeds.vdb", "placed.glb", "preview.png"})
        EXPECT_TRUE(fs::exists(folder / "a/" + name)) << name;
    const std::string ply = slurp(folder / "a/seeds.ply");
    EXPECT_NE(ply.find("element vertex 90\n"), std::string::npos);
    EXPECT_EQ(ply.size(), ply.find("end_header\n") + 11 + 90 * (11 * 4 + 2 * 4));
    const auto grids = vdbInfo(folder / "a/seeds.vdb");
    ASSERT_EQ(grids.size(), 1u);
    EXPECT_EQ(grids[0].name, "seeds");
    // The same seeds feed back, and come out the same.
    const auto seeds = nlohmann::json::parse(slurp(folder / "a/seeds.json"))["seeds"];
    writeText(folder / "again.json", R"({ "resolution": 30, "base": { "shape": "sphere", "radius": 30 },
      "elements": [ { "shape": "bean", "length": 12, "thickness": 5 }, { "shape": "pearl", "radius": 4 } ],
      "seeding": { "method": "manual", "file": "a/seeds.json" } })");
    o = run("seed " + (folder / "again.json") + " -o " + (folder / "b") + " --quiet");
    ASSERT_EQ(o.status, 0) << o.text;
    const auto again = nlohmann::json::parse(slurp(folder / "b/seeds.json"))["seeds"];
    ASSERT_EQ(again.size(), seeds.size());
    for (size_t i = 0; i < seeds.size(); ++i) {
        EXPECT_EQ(again[i]["element"], seeds[i]["element"]);
        for (int k = 0; k < 3; ++k)
            EXPECT_NEAR(again[i]["position"][k].get<double>(), seeds[i]["position"][k].get<double>(), 1e-9);
    }
    o = run("seed " + (folder / "scene.json") + " -o " + (folder / "a"));
    EXPECT_EQ(o.status, 2);  // nothing is overwritten unasked
}

TEST(Program, AMemoryLimitChangesNothingButMemory) {
    const test::TemporaryFolder folder;
    writeText(folder / "scene.json", R"({ "resolution": 44, "base": { "shape": "sphere", "radius": 40 },
      "elements": [ { "shape": "bean", "length": 15, "thickness": 6 } ], "seeding": { "count": 250, "iterations": 20 },
      "output": { "mesh": [], "preview": false } })");
    for (const char* limit : {"", " --memory-limit 256M"}) {
        const Outcome o =
            run("decorate " + (folder / "scene.json") + " --quiet -o " + (folder / (*limit ? "b" : "a")) + limit);
        ASSERT_EQ(o.status, 0) << o.text;
    }
    for (const char* file : {"decoration.vdb", "element_id.vdb", "seeds.json"})
        EXPECT_TRUE(slurp(folder / "a/" + file) == slurp(folder / "b/" + file)) << file;
    const auto peak = [&](const char* run) {
        return nlohmann::json::parse(slurp(folder / run + "/report.json"))["memory"]["peak_rss_bytes"].get<double>();
    };
    // Pages that are just coming back may overshoot.
    EXPECT_GT(peak("a"), 400e6);
    EXPECT_LT(peak("b"), 370e6);
    for (const std::string& command : {"decorate -o " + (folder / "c"), std::string("validate")}) {
        const Outcome o = run(command + " " + (folder / "scene.json") + " --memory-limit 10M");
        EXPECT_EQ(o.status, 2) << command;
        EXPECT_NE(o.text.find("256M"), std::string::npos) << o.text;
    }
}

TEST(Program, DecoratesRepeatably) {
    const test::TemporaryFolder folder;
    writeText(folder / "scene.json", kSmall);
    const std::string first = folder / "a", second = folder / "b";
    Outcome o = run("decorate " + (folder / "scene.json") + " -o " + first + " --threads 1 --set output.figure=true");
    ASSERT_EQ(o.status, 0) << o.text;
    EXPECT_NE(o.text.find("growth"), std::string::npos);
    // The scene that the run wrote repeats it; the second time with two threads.
    o = run("decorate " + first + "/scene.json -o " + second + " --threads 2 --quiet");
    ASSERT_EQ(o.status, 0) << o.text;
    EXPECT_EQ(o.text, "");
    size_t compared = 0;
    for (const auto& entry : fs::directory_iterator(first)) {
        const std::string name = entry.path().filename().string();
        if (name == "report.json") continue;
        EXPECT_TRUE(slurp(first + "/" + name) == slurp(second + "/" + name)) << name;
        ++compared;
    }
    EXPECT_GT(compared, 30u);  // one STL for each element, and the rest
    for (const char* name : {"decoration.glb", "decoration.ply", "decoration.obj", "decoration.vdb", "element_id.vdb",
                             "elements.vdb", "preview.png", "figure.jpg", "seeds.json", "scene.json"})
        EXPECT_TRUE(fs::exists(first + "/" + name)) << name;

    const auto report = nlohmann::json::parse(slurp(first + "/report.json"));
    EXPECT_LT(report["volume"]["max_relative_error"].get<double>(), 2e-3);
    EXPECT_NEAR(report["coverage"].get<double>(), 1.35, 0.05);
    EXPECT_EQ(report["elements"].size(), report["counts"]["elements"].get<size_t>());
    EXPECT_GT(report["counts"]["overlap_percent"].get<double>(), 1);
    EXPECT_GT(report["memory"]["peak_rss_bytes"].get<double>(), 1e6);
    for (const auto& f : report["outputs"])
        EXPECT_EQ(fs::file_size(first + "/" + f["file"].get<std::string>()), f["bytes"].get<size_t>());

    std::map<std::string, VdbGridInfo> grids;
    for (const VdbGridInfo& g : vdbInfo(first + "/decoration.vdb")) grids[g.name] = g;
    EXPECT_EQ(grids.size(), 3u);
    EXPECT_EQ(grids["surface"].gridClass, "level set");
    EXPECT_EQ(grids["density"].gridClass, "fog volume");
    EXPECT_NEAR(grids["base"].voxelSize, 0.5, 1e-12);
    EXPECT_NEAR(grids["base"].bounds.max[0], 22 + 3 * 0.5, 1.1);
    EXPECT_EQ(vdbInfo(first + "/elements.vdb").size(), report["elements"].size());

    // The seeds feed back as manual placements.
    writeText(folder / "again.json", R"({ "voxel_size": 0.5, "base": { "shape": "sphere", "radius": 22 },
      "elements": [ { "shape": "pearl", "radius": 7, "name": "big" }, { "shape": "disc", "radius": 7, "height": 6 } ],
      "seeding": { "method": "manual", "file": "a/seeds.json" }, "output": { "mesh": [], "preview": false } })");
    o = run("decorate " + (folder / "again.json") + " -o " + (folder / "c"));
    ASSERT_EQ(o.status, 0) << o.text;
    EXPECT_EQ(nlohmann::json::parse(slurp((folder / "c") + "/report.json"))["counts"]["decoration_voxels"],
              report["counts"]["decoration_voxels"]);

    o = run("decorate " + (folder / "scene.json") + " -o " + first);
    EXPECT_EQ(o.status, 2);
    EXPECT_NE(o.text.find("--force"), std::string::npos);
    EXPECT_EQ(run("info " + first + "/decoration.vdb " + first + "/decoration.ply " + first + "/seeds.json " + first +
                  "/scene.json")
                  .status,
              0);
    EXPECT_EQ(run("render " + first + "/decoration.vdb -o " + (folder / "r.png") + " --width 200 --height 200").status,
              0);

    if (std::system("/usr/bin/python3 -c 'import pyopenvdb' 2>/dev/null") != 0)
        GTEST_SKIP() << "python3-openvdb is not installed: the independent reader was not tried";
    std::ofstream(folder / "read.py")
        << "import pyopenvdb as v, sys\ngs = v.readAllGridMetadata(sys.argv[1])\ng = v.read(sys.argv[1], 'surface')\n"
           "assert {x.name for x in gs} == {'surface', 'base', 'density'}\nassert g.gridClass == 'level set' and "
           "abs(g.background - 1.5) < 1e-6\n"
           "assert g.getConstAccessor().getValue((0, 0, 44 + 6)) < 0 or g.activeVoxelCount() > 10000\n";
    EXPECT_EQ(std::system(("/usr/bin/python3 " + (folder / "read.py") + " " + first + "/decoration.vdb").c_str()), 0);
}

TEST(Program, ShapesAndExamples) {
    const test::TemporaryFolder folder;
    EXPECT_EQ(run("shape vase --height 90 -o " + (folder / "v.stl")).status, 0);
    EXPECT_TRUE(fs::exists(folder / "v.stl"));
    EXPECT_EQ(run("shape vase -o " + (folder / "v.stl")).status, 2);  // there already
    EXPECT_EQ(run("shape vaze -o " + (folder / "w.stl")).status, 2);
    EXPECT_EQ(run("shape vase --height tall -o " + (folder / "w.stl")).status, 2);
    EXPECT_EQ(run("shape pearl -o " + (folder / "w.doc")).status, 2);
    EXPECT_FALSE(fs::exists(folder / "w.stl"));
    EXPECT_NE(run("example").text.find("vase"), std::string::npos);
    EXPECT_EQ(run("example vase -o " + (folder / "ex")).status, 0);
    EXPECT_EQ(run("example vasse").status, 2);
    const Outcome o = run("validate " + (folder / "ex") + "/scene.json");
    EXPECT_EQ(o.status, 0);
    EXPECT_NE(o.text.find("decoration voxels"), std::string::npos);
}

TEST(Program, ForecastsElementsPlacedByHandAsTheyAre) {
    const test::TemporaryFolder folder;
    // Of three kinds of very different sizes; packing it, the report says 5,580,000.
    ASSERT_EQ(run("example roses -o " + (folder / "ex")).status, 0);
    const Outcome o = run("validate " + (folder / "ex") + "/scene.json");
    EXPECT_NE(o.text.find("elements           about 92\n"), std::string::npos) << o.text;
    EXPECT_NE(o.text.find("decoration voxels  about 5.6 million"), std::string::npos) << o.text;
    // It used 0.53 GB.
    EXPECT_NE(o.text.find("memory             about 0.50 GB"), std::string::npos) << o.text;
    double seconds = 0;
    const size_t at = o.text.find("time               about ");
    ASSERT_NE(at, std::string::npos) << o.text;
    ASSERT_EQ(std::sscanf(o.text.c_str() + at, "time about %lf s of CPU", &seconds), 1);
    EXPECT_GT(seconds, 1);
}

TEST(Program, RendersFinishesCutsAndTurns) {
    const test::TemporaryFolder folder;
    ASSERT_EQ(run("shape ring -o " + (folder / "ring.ply")).status, 0);
    const std::string render = "render " + (folder / "ring.ply") + " --width 60 --height 50 ";
    EXPECT_EQ(run(render + "--finish gold --cut --back -o " + (folder / "cut.jpg")).status, 0);
    EXPECT_EQ(slurp(folder / "cut.jpg").substr(0, 2), "\xff\xd8");
    EXPECT_EQ(run(render + "--transparent --turntable 3 -o " + (folder / "turn.png")).status, 0);
    for (const char* name : {"turn_01.png", "turn_02.png", "turn_03.png"})
        EXPECT_EQ(slurp(folder / name).substr(1, 3), "PNG") << name;
    const Outcome o = run(render + "--finish glod -o " + (folder / "x.png"));
    EXPECT_EQ(o.status, 2);
    EXPECT_NE(o.text.find("did you mean \"gold\""), std::string::npos) << o.text;
    EXPECT_EQ(run(render + "-o " + (folder / "x.gif")).status, 2);
    EXPECT_EQ(run(render + "--color red -o " + (folder / "x.png")).status, 2);
    EXPECT_EQ(run(render + "--zoom nan -o " + (folder / "x.png")).status, 2);
    EXPECT_EQ(run(render + "--transparent -o " + (folder / "x.jpg")).status, 2);
    EXPECT_EQ(run(render + "--turntable 5 -o " + (folder / "turn.png")).status, 2);  // some are there
    EXPECT_FALSE(fs::exists(folder / "turn_04.png"));
}

TEST(Program, BenchWritesTablesBesideThePapers) {
    const test::TemporaryFolder folder;
    const std::string out = folder / "bench";
    const Outcome o = run("bench tile_round pair -o " + out + " --quiet");
    ASSERT_EQ(o.status, 0) << o.text;
    const nlohmann::json tables = nlohmann::json::parse(slurp(out + "/tables.json"));
    ASSERT_EQ(tables["paper"].size(), 2u);
    const auto& tile = tables["paper"][0];
    EXPECT_EQ(tile["elements"], 65);
    EXPECT_NEAR(tile["coverage"], 1.32, 0.01);
    EXPECT_NEAR(tile["decoration_voxels"], 5.27e6, 0.1e6);
    EXPECT_NEAR(tile["overlap_percent"], tile["paper"]["overlap_percent"].get<double>(), 11.8 / 3);
    EXPECT_NEAR(tile["final_triangles"], 260e3, 5e3);
    EXPECT_LT(tile["max_relative_error"], 1e-3);
    EXPECT_FALSE(tables["paper"][1].contains("paper"));  // the paper's table has no row for the pair
    EXPECT_NE(slurp(out + "/tables.md").find("tile, gallery bottom"), std::string::npos);
    EXPECT_FALSE(fs::exists(out + "/runs"));
    EXPECT_EQ(run("bench pair -o " + out + " --quiet").status, 2);  // there already
}

TEST(Program, RemeshesAnyMesh) {
    const test::TemporaryFolder folder;
    ASSERT_EQ(run("shape pebble -o " + (folder / "pebble.ply")).status, 0);
    const Outcome o = run("remesh " + (folder / "pebble.ply") + " -o " + (folder / "light.obj") + " --vertices 600");
    EXPECT_EQ(o.status, 0) << o.text;
    const TriangleMesh light = readMesh(folder / "light.obj"), dense = readMesh(folder / "pebble.ply");
    EXPECT_EQ(light.points.size(), 600u);
    EXPECT_TRUE(meshFacts(light).fit());
    EXPECT_NEAR(meshVolume(light), meshVolume(dense), 1e-2 * meshVolume(dense));
    const std::pair<const char*, const char*> wrong[] = {{"--vertices 0", "vertices"},
                                                         {"--vertices -3", "vertices"},
                                                         {"--vertices 1000000", "ask for fewer"},
                                                         {"", "--vertices"}};
    for (const auto& [arguments, word] : wrong) {
        const Outcome e = run("remesh " + (folder / "pebble.ply") + " -o " + (folder / "x.ply") + " " + arguments);
        EXPECT_EQ(e.status, 2);
        EXPECT_NE(e.text.find(word), std::string::npos) << e.text;
        EXPECT_FALSE(fs::exists(folder / "x.ply"));
    }
    EXPECT_EQ(run("remesh " + (folder / "pebble.ply") + " -o " + (folder / "x.abc") + " --vertices 600").status, 2);
    EXPECT_EQ(run("remesh " + (folder / "pebble.ply") + " -o " + (folder / "light.obj") + " --vertices 600").status, 2);
}

TEST(Program, RemeshesItsOutput) {
    const test::TemporaryFolder folder;
    writeText(folder / "scene.json", kSmall);
    for (const char* elements : {"merged", "separate"}) {
        const std::string out = folder / elements;
        const Outcome o =
            run("decorate " + (folder / "scene.json") + " -o " + out +
                " --set output.remesh.vertices=6000 --set 'output.mesh=[\"obj\"]' --set output.elements=" + elements +
                " --quiet");
        ASSERT_EQ(o.status, 0) << o.text;
        const MeshFacts facts = meshFacts(readMesh(out + "/decoration.obj"));
        EXPECT_TRUE(facts.closed());
        EXPECT_NEAR(double(facts.vertices), 6000, 60);
        const nlohmann::json report = nlohmann::json::parse(slurp(out + "/report.json"));
        EXPECT_EQ(report["counts"]["final_triangles"], facts.triangles);
        EXPECT_GT(report["counts"]["extracted_triangles"], 3 * facts.triangles);
        EXPECT_TRUE(fs::exists(out + "/decoration.mtl"));
    }
}

TEST(Program, ShellNamesWhatItCannotDo) {
    const test::TemporaryFolder folder;
    writeText(folder / "scene.json", kSmall);
    const std::pair<const char*, const char*> wrong[] = {{"shell.bed=[5,5,5]", "shell.bed"},
                                                         {"shell.clearance=9", "shell.clearance"},
                                                         {"shell.parts=900", "shell.parts"},
                                                         {"shell.parts.groups=true", "groups"}};
    for (const auto& [set, word] : wrong) {
        const Outcome o =
            run("shell " + (folder / "scene.json") + " -o " + (folder / "parts") + " --voxel 0.9 --set " + set);
        EXPECT_EQ(o.status, 2) << o.text;
        EXPECT_NE(o.text.find(word), std::string::npos) << o.text;
        EXPECT_FALSE(fs::exists(folder / "parts"));
    }
}

TEST(Examples, AllParse) {
    for (const Example& e : examples()) EXPECT_NO_THROW(parseScene(e.scene, e.name, ".")) << e.name;
}

}  // namespace
}  // namespace pavel
