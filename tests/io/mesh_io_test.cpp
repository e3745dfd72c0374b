#include <boost/iostreams/filter/gzip.hpp>
#include <boost/iostreams/filtering_stream.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/core/shapes.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/mesh_write.h"
#include "pavel/io/preview.h"
#include "support/meshes.h"

namespace pavel {
namespace {

std::string textOf(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {(std::istreambuf_iterator<char>(file)), {}};
}

class MeshRoundTrip : public testing::TestWithParam<const char*> {};

TEST_P(MeshRoundTrip, KeepsTheSolid) {
    const test::TemporaryFolder folder;
    MeshObject o;
    o.name = "pearl";
    o.mesh = makeShape("pearl");
    const std::string path = folder / (std::string("pearl.") + GetParam());
    writeMesh(path, {o});
    TriangleMesh back = readMesh(path);
    EXPECT_EQ(back.triangles.size(), o.mesh.triangles.size());
    makeSolid(back, path);
    EXPECT_NEAR(meshVolume(back) / meshVolume(o.mesh), 1, 1e-5);
}
INSTANTIATE_TEST_SUITE_P(Formats, MeshRoundTrip, testing::Values("obj", "ply", "stl", "off"));

TEST(MeshWrite, ObjNamesItsObjects) {
    const test::TemporaryFolder folder;
    MeshObject a, b;
    a.name = "element_00001_petal";
    a.mesh = test::box({0, 0, 0}, {1, 1, 1});
    b.name = "base";
    b.mesh = test::box({2, 0, 0}, {3, 1, 1});
    writeMesh(folder / "two.obj", {a, b});
    std::ifstream file(folder / "two.obj");
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    EXPECT_NE(text.find("o element_00001_petal\n"), std::string::npos);
    EXPECT_NE(text.find("o base\n"), std::string::npos);
    const MeshFacts f = meshFacts(readMesh(folder / "two.obj"));
    EXPECT_EQ(f.components, 2u);
    EXPECT_NEAR(f.volume, 2, 1e-9);
}

TEST(MeshWrite, ObjHasItsMaterialsBesideIt) {
    const test::TemporaryFolder folder;
    MeshObject o;
    o.name = "thing";
    o.mesh = test::box({0, 0, 0}, {1, 1, 1});
    o.color = Vec3(1, 0.5, 0);
    MeshFileOptions options;
    options.materialFile = true;
    writeMesh(folder / "t.obj", {o}, options);
    EXPECT_NE(textOf(folder / "t.obj").find("mtllib t.mtl\no thing\nusemtl rgb_ff8000\n"), std::string::npos);
    EXPECT_NE(textOf(folder / "t.mtl").find("newmtl rgb_ff8000\nKd 1 0.214 0\n"), std::string::npos);
    EXPECT_NEAR(meshFacts(readMesh(folder / "t.obj")).volume, 1, 1e-9);
}

TEST(MeshWrite, UsdRefersToTheVolume) {
    const test::TemporaryFolder folder;
    MeshObject o;
    o.name = "element_00001_a-b";
    o.mesh = test::box({0, 0, 0}, {1, 2, 3});
    MeshFileOptions options;
    options.metresPerUnit = 0.01;
    options.volume = "decoration.vdb";
    writeMesh(folder / "t.usda", {o}, options);
    const std::string text = textOf(folder / "t.usda");
    EXPECT_EQ(text.find("#usda 1.0\n"), 0u);
    for (const char* part :
         {"metersPerUnit = 0.01\n", "upAxis = \"Z\"", "def Mesh \"element_00001_a_b\"",
          "extent = [(0, 0, 0), (1, 2, 3)]", "asset filePath = @./decoration.vdb@", "subdivisionScheme = \"none\""})
        EXPECT_NE(text.find(part), std::string::npos) << part;
    EXPECT_EQ(std::count(text.begin(), text.end(), '{'), std::count(text.begin(), text.end(), '}'));
    EXPECT_EQ(std::count(text.begin(), text.end(), '['), std::count(text.begin(), text.end(), ']'));
}

/// What python's zip reader finds in a 3MF file: unit, objects, triangles, colour groups.
TEST(MeshWrite, ThreeMfHoldsUnitsNamesAndColours) {
    const test::TemporaryFolder folder;
    MeshObject a, b;
    a.name = "first";
    a.mesh = test::box({0, 0, 0}, {1, 1, 1});
    a.color = Vec3(1, 0, 0);
    b.name = "second";
    b.mesh = test::box({2, 0, 0}, {3, 1, 1});
    b.looks = {{Vec3(0, 1, 0)}, {Vec3(0, 0.5, 0.5), Finish::clay, MeshLook::Blend{0, 0, 0.5}}};
    b.vertexLook.assign(b.mesh.points.size(), 0);
    for (size_t v = 0; v < 4; ++v) b.vertexLook[v] = 1;  // a blend, of which slicers shall see nothing
    MeshFileOptions options;
    options.metresPerUnit = 0.0254;
    writeMesh(folder / "t.3mf", {a, b}, options);
    writeMesh(folder / "again.3mf", {a, b}, options);
    EXPECT_EQ(textOf(folder / "t.3mf"), textOf(folder / "again.3mf"));
    const std::string command = "/usr/bin/python3 -c \"import zipfile;print(zipfile.ZipFile('" + (folder / "t.3mf") +
                                "').read('3D/3dmodel.model').decode())\" > " + (folder / "model.xml");
    ASSERT_EQ(std::system(command.c_str()), 0);
    const std::string xml = textOf(folder / "model.xml");
    for (const char* part : {"unit=\"inch\"", "name=\"first\"", "name=\"second\"", "#FF0000FF", "#00FF00FF"})
        EXPECT_NE(xml.find(part), std::string::npos) << part;
    EXPECT_EQ(xml.find("#008080FF"), std::string::npos);
    size_t triangles = 0, items = 0;
    for (size_t at = 0; (at = xml.find("<triangle ", at)) != std::string::npos; ++at) ++triangles;
    for (size_t at = 0; (at = xml.find("<item ", at)) != std::string::npos; ++at) ++items;
    EXPECT_EQ(triangles, 24u);
    EXPECT_EQ(items, 2u);
}

TEST(MeshWrite, GlbIsInMetresWithYUp) {
    const test::TemporaryFolder folder;
    MeshObject o;
    o.name = "thing";
    o.mesh = test::box({0, 0, 0}, {10, 20, 30});
    writeMesh(folder / "t.glb", {o});
    std::ifstream file(folder / "t.glb", std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    uint32_t total;
    std::memcpy(&total, bytes.data() + 8, 4);
    EXPECT_EQ(total, bytes.size());
    EXPECT_NE(bytes.find("\"name\":\"thing\""), std::string::npos);
    // z up 30 mm becomes y up 0.03 m
    EXPECT_NE(bytes.find("0.02999999"), std::string::npos);
    EXPECT_THROW(writeMesh(folder / "t.xyz", {o}), InputError);
}

/// Object by object into one file: every number where the tables say, materials by finish, no waiting parts left.
TEST(MeshWrite, GlbTablesHold) {
    const test::TemporaryFolder folder;
    MeshObject a, b;
    a.name = "first";
    a.mesh = test::box({0, 0, 0}, {1, 1, 1});
    b.name = "second";
    b.mesh = test::sphere(5);
    b.looks = {{Vec3(1, 0, 0), Finish::clay}, {Vec3(0, 1, 0), Finish::gold}};
    for (const Vec3& p : b.mesh.points) b.vertexLook.push_back(p[2] > 0);
    const std::unique_ptr<MeshWriter> writer = openMesh(folder / "t.glb");
    writer->add(a);
    writer->add(b);
    writer->finish();
    const std::string bytes = textOf(folder / "t.glb");
    const auto word = [&](size_t at) {
        uint32_t w;
        std::memcpy(&w, bytes.data() + at, 4);
        return w;
    };
    const size_t text = word(12), binaryAt = 20 + text + 8, binary = word(20 + text);
    ASSERT_EQ(bytes.size(), binaryAt + binary);
    EXPECT_EQ(word(20 + text + 4), 0x004e4942u);  // "BIN"
    const auto j = nlohmann::json::parse(bytes.substr(20, text));
    EXPECT_EQ(j["buffers"][0]["byteLength"], binary);
    size_t end = 0;
    for (const auto& view : j["bufferViews"]) {
        EXPECT_EQ(view["byteOffset"], end);
        EXPECT_EQ(end % 4, 0u);
        end += view["byteLength"].get<size_t>();
    }
    EXPECT_EQ(end, binary);
    ASSERT_EQ(j["meshes"].size(), 2u);
    ASSERT_EQ(j["nodes"].size(), 2u);
    EXPECT_EQ(j["scenes"][0]["nodes"], nlohmann::json({0, 1}));
    ASSERT_EQ(j["meshes"][1]["primitives"].size(), 2u);
    EXPECT_EQ(j["materials"].size(), 3u);
    size_t triangles = 0;
    for (const auto& primitive : j["meshes"][1]["primitives"]) {
        const auto& accessor = j["accessors"][primitive["indices"].get<size_t>()];
        const size_t at = binaryAt + j["bufferViews"][accessor["bufferView"].get<size_t>()]["byteOffset"].get<size_t>();
        const bool gold =
            j["materials"][primitive["material"].get<size_t>()]["pbrMetallicRoughness"]["metallicFactor"] > 0.5;
        for (size_t i = 0; i < accessor["count"]; i += 3) {
            ASSERT_LT(word(at + 4 * i), b.mesh.points.size());
            int above = 0;
            for (size_t k = i; k < i + 3; ++k) above += b.mesh.points[word(at + 4 * k)][2] > 0;
            EXPECT_EQ(above >= 2, gold);
        }
        triangles += accessor["count"].get<size_t>() / 3;
    }
    EXPECT_EQ(triangles, b.mesh.triangles.size());
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / ""), {}), 1);
}

TEST(MeshRead, PolygonsOffAndGzip) {
    const test::TemporaryFolder folder;
    writeText(folder / "cube.off",
              "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
              "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
    TriangleMesh m = readMesh(folder / "cube.off");
    EXPECT_EQ(m.triangles.size(), 12u);
    EXPECT_NEAR(meshVolume(m), 1, 1e-12);
    std::ofstream file(folder / "cube.off.gz", std::ios::binary);
    boost::iostreams::filtering_ostream out;
    out.push(boost::iostreams::gzip_compressor());
    out.push(file);
    std::ifstream plain(folder / "cube.off");
    out << plain.rdbuf();
    out.reset();
    file.close();
    EXPECT_EQ(readMesh(folder / "cube.off.gz").triangles.size(), 12u);
}

TEST(MeshRead, BadFilesAreNamed) {
    const test::TemporaryFolder folder;
    const auto fails = [&](const std::string& name, const std::string& text, const std::string& says) {
        if (!text.empty()) writeText(folder / name, text);
        try {
            readMesh(folder / name);
            ADD_FAILURE() << name << " was read";
        } catch (const InputError& e) {
            EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
            EXPECT_NE(std::string(e.what()).find(says), std::string::npos) << e.what();
        }
    };
    fails("missing.obj", "", "no such file");
    fails("a.fbx", "x", "unknown kind");
    fails("nofaces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces");
    fails("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "faces name vertices");
    fails("cut.stl", std::string(90, 'x'), "STL");
    fails("text.ply", "not a ply\n", "ply");
    fails("broken.obj.gz", "this is not gzip", "damaged");
}

TEST(MeshRead, DevelopmentSetAgreesWithItsTable) {
    PAVEL_NEED_MESH(spot, "spot.obj");
    const MeshFacts f = meshFacts(readMesh(spot));
    EXPECT_EQ(f.vertices, 2930u);
    EXPECT_EQ(f.triangles, 5856u);
    EXPECT_TRUE(f.fit());
    EXPECT_NEAR(f.volume, 0.7183, 1e-4);
    const MeshFacts binary = meshFacts(readMesh(test::developmentMesh("spot_binary.ply")));
    EXPECT_EQ(binary.triangles, f.triangles);
    EXPECT_NEAR(binary.volume / f.volume, 1, 1e-5);
    const MeshFacts quads = meshFacts(readMesh(test::developmentMesh("spot_quads.obj")));
    EXPECT_EQ(quads.euler, 2);
    EXPECT_NEAR(quads.volume, 0.8448, 2e-3);
    TriangleMesh open = readMesh(test::developmentMesh("bunny_raw_open.obj"));
    EXPECT_EQ(boundaryLoops(open).size(), 5u);
    EXPECT_THROW(makeSolid(open, "bunny_raw_open.obj"), InputError);
    RepairOptions fill;
    fill.fillHoles = true;
    makeSolid(open, "bunny_raw_open.obj", fill);
    EXPECT_TRUE(meshFacts(open).fit());
}

TEST(Preview, ShowsALitSphere) {
    const test::TemporaryFolder folder;
    MeshObject o;
    o.mesh = test::sphere(1);
    o.color = Vec3(1, 0, 0);
    View view;
    view.width = view.height = 64;
    renderPicture(folder / "s.png", {o}, view);
    EXPECT_GT(std::filesystem::file_size(folder / "s.png"), 500u);
    EXPECT_THROW(renderPicture(folder / "none/s.png", {o}, view), RunError);
}

TEST(Preview, CutsShowClosedSections) {
    std::vector<MeshObject> ball(1);
    ball[0].mesh = makeShape("sphere");
    ball[0].color = Vec3(1, 0, 0);
    View view;
    view.width = view.height = 100;
    view.azimuthDegrees = 0;
    view.elevationDegrees = 0;
    view.transparent = true;
    const auto covered = [](const Picture& p) {
        double sum = 0;
        for (size_t i = 3; i < p.rgba.size(); i += 4) sum += p.rgba[i] / 255.0;
        return sum;
    };
    const Picture whole = rendered({Panel{&ball, view}}, 1);
    // A disc that fills 94 % of the picture.
    EXPECT_NEAR(covered(whole), kPi * 47 * 47, 60);
    // Seen from the side, half of it is gone; seen from the front, the section is as wide and flat.
    view.cut = CutPlane{{0, 1, 0}, 0, 0.1};
    EXPECT_NEAR(covered(rendered({Panel{&ball, view}}, 1)), kPi * 47 * 47 / 2, 60);
    view.cut = CutPlane{{1, 0, 0}, 0, 0.1};
    const Picture flat = rendered({Panel{&ball, view}}, 1);
    const auto red = [](const Picture& p, int x, int y) { return int(p.rgba[size_t(4 * (y * p.width + x))]); };
    EXPECT_GT(covered(flat), 0.9 * kPi * 47 * 47);
    EXPECT_NEAR(red(flat, 50, 30), red(flat, 50, 70), 12);
    EXPECT_GT(std::abs(red(whole, 30, 20) - red(whole, 70, 80)), 30);
}

TEST(Preview, FinishesDiffer) {
    std::vector<MeshObject> ball(1);
    ball[0].mesh = makeShape("sphere");
    View view;
    view.width = view.height = 64;
    std::set<std::vector<uint8_t>> pictures;
    for (const FinishLook& f : finishes()) {
        ball[0].finish = finishNamed(f.name, "");
        ball[0].color = parseColor("#c0c0c0", "");
        pictures.insert(rendered({Panel{&ball, view}}, 1).rgba);
    }
    EXPECT_EQ(pictures.size(), finishes().size());
    // Finishes by vertex are as good as by object.
    const std::vector<uint8_t> byObject = rendered({Panel{&ball, view}}, 1).rgba;
    ball[0].looks = {{ball[0].color, ball[0].finish}};
    ball[0].vertexLook.assign(ball[0].mesh.points.size(), 0);
    ball[0].finish = Finish::clay;
    EXPECT_EQ(rendered({Panel{&ball, view}}, 1).rgba, byObject);
    // Vertices that are split at creases take theirs along: every edge of a tetrahedron is one.
    ball[0].mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    ball[0].mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    ball[0].looks = {{ball[0].color, Finish::gold}};
    ball[0].vertexLook.assign(4, 0);
    view.sharpCreases = true;
    const std::vector<uint8_t> byVertex = rendered({Panel{&ball, view}}, 1).rgba;
    ball[0].vertexLook.clear();
    ball[0].finish = Finish::gold;
    EXPECT_EQ(rendered({Panel{&ball, view}}, 1).rgba, byVertex);
}

TEST(AtomicOutput, WholeOrNotAtAll) {
    const test::TemporaryFolder folder;
    const std::string target = folder / "result";
    {
        AtomicOutput out(target, true, false);
        writeText(out.place("scene.json"), "{}");
    }
    EXPECT_FALSE(std::filesystem::exists(target));
    {
        AtomicOutput out(target, true, false);
        writeText(out.place("scene.json"), "{}");
        out.commit();
    }
    EXPECT_TRUE(std::filesystem::exists(target + "/scene.json"));
    EXPECT_THROW(AtomicOutput(target, true, false), InputError);
    {
        AtomicOutput out(target, true, true);
        writeText(out.place("seeds.json"), "{}");
        out.commit();
    }
    EXPECT_FALSE(std::filesystem::exists(target + "/scene.json"));
    EXPECT_TRUE(std::filesystem::exists(target + "/seeds.json"));
    // Somebody else's folder is not overwritten, even with force.
    std::filesystem::create_directory(folder / "photos");
    writeText(folder / "photos/cat.png", "x");
    EXPECT_THROW(AtomicOutput(folder / "photos", true, true), InputError);
    EXPECT_THROW(AtomicOutput(folder / "none/deep", true, false), InputError);
    size_t entries = 0;
    for (const auto& e : std::filesystem::directory_iterator(folder / ".")) entries += e.exists();
    EXPECT_EQ(entries, 2u);  // nothing temporary is left
}

TEST(ReadMesh, KeepsGroupsMaterialsAndVertexValues) {
    const test::TemporaryFolder folder;
    const auto write = [&](const char* name, const std::string& text) {
        std::ofstream(folder / name) << text;
        return folder / name;
    };
    const std::string points = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nv 0 0 1 1 1 1\n";
    VertexValues values;
    const TriangleMesh grouped =
        readMesh(write("g.obj", points + "g lid\nf 1 2 3\ng body\nf 1 2 4\nf 2 3 4 1\n"), &values);
    EXPECT_EQ(grouped.groupNames, (std::vector<std::string>{"lid", "body"}));
    EXPECT_EQ(grouped.groups, (std::vector<int>{0, 1, 1, 1}));
    EXPECT_EQ(values.at("red"), (std::vector<double>{1, 0, 0, 1}));
    EXPECT_NEAR(values.at("color")[1], 0.7152, 1e-6);
    const TriangleMesh materials = readMesh(write("m.obj", points + "usemtl gold\nf 1 2 3\nusemtl clay\nf 1 2 4\n"));
    EXPECT_EQ(materials.groupNames, (std::vector<std::string>{"gold", "clay"}));
    EXPECT_TRUE(readMesh(write("n.obj", points + "f 1 2 3\n")).groups.empty());
    const std::string ply = write(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty "
        "float weight\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0.25\n1 0 0 0.5\n0 "
        "1 0 1\n3 0 1 2\n");
    readMesh(ply, &values);
    ASSERT_EQ(values.count("weight"), 1u);
    EXPECT_EQ(values.at("weight"), (std::vector<double>{0.25, 0.5, 1}));
    EXPECT_EQ(values.count("color"), 0u);
}

}  // namespace
}  // namespace pavel
