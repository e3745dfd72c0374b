#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "pavel/io/mesh_formats.h"

namespace pavel {
namespace {

using json = nlohmann::ordered_json;

// Numbers of the standard.
constexpr int kFloat = 5126, kUint8 = 5121, kUint32 = 5125;             // component types
constexpr int kVertices = 34962, kIndices = 34963;                      // targets
constexpr uint32_t kMagic = 0x46546c67, kVersion = 2;                   // "glTF"
constexpr uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;  // "JSON", "BIN"

using Float3 = std::array<float, 3>;

/// To metres, z up to +Y up.
Float3 turned(const Vec3& p) {
    return {float(p[0]), float(p[2]), float(-p[1])};
}

/// A frame as a node's matrix, columns first, in metres and +Y up.
std::vector<double> gltfMatrix(const Frame& frame, double metres) {
    const auto turn = [](const Vec3& v) { return Vec3(v[0], v[2], -v[1]); };
    const Vec3 columns[4] = {frame.scale * turn(frame.x), frame.scale * turn(frame.z), -frame.scale * turn(frame.y),
                             metres * turn(frame.origin)};
    std::vector<double> m;
    for (int c = 0; c < 4; ++c) m.insert(m.end(), {columns[c][0], columns[c][1], columns[c][2], c == 3 ? 1.0 : 0.0});
    return m;
}

/// The tables of the file grow as objects come, their numbers wait in a file.
class GlbWriter : public MeshWriter {
  public:
    GlbWriter(const std::string& path, double metres)
        : path_(path), metres_(metres), binary_(path, "binary"), out_(path) {
        root_["asset"] = {{"generator", "Pavel"}, {"version", "2.0"}};
        root_["scene"] = 0;
        root_["scenes"] = {{{"nodes", json::array()}}};
        for (const char* list : {"nodes", "meshes", "materials", "accessors", "bufferViews"})
            root_[list] = json::array();
    }

    void add(const MeshObject& o) override {
        if (o.mesh.triangles.empty()) return;
        json primitive{{"attributes", attributes(o)}, {"mode", 4}};  // triangles
        json mesh{{"name", o.name}, {"primitives", json::array()}};
        std::map<Finish, size_t> counts;
        for (const Triangle& t : o.mesh.triangles) ++counts[o.finishOf(t)];
        for (const auto& [finish, count] : counts) {  // primitives share the vertices
            primitive["material"] = material(o, finish, counts.size() > 1);
            primitive["indices"] = beginAccessor(kUint32, "SCALAR", kIndices, 3 * count, sizeof(uint32_t));
            for (const Triangle& t : o.mesh.triangles)
                if (o.finishOf(t) == finish)
                    binary_.out.raw(std::array<uint32_t, 3>{uint32_t(t[0]), uint32_t(t[1]), uint32_t(t[2])});
            mesh["primitives"].push_back(primitive);
        }
        root_["meshes"].push_back(mesh);
        if (o.instances.empty()) addNode(o.name, {});
        for (const auto& [name, frame] : o.instances) addNode(name, gltfMatrix(frame, metres_));
        if (binary_.out.size() > kMost) throw tooLarge();
    }

    void finish() override {
        for (const char* list : {"nodes", "meshes", "materials", "accessors", "bufferViews"})
            if (root_[list].empty()) root_.erase(list);  // empty lists are not allowed
        const uint64_t bytes = binary_.out.size();
        if (bytes > 0) root_["buffers"] = {{{"byteLength", bytes}}};
        std::string text = root_.dump(-1, ' ', false, json::error_handler_t::replace);
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const uint64_t total = 12 + 8 + text.size() + (bytes > 0 ? 8 + bytes : 0);
        if (total > kMost) throw tooLarge();
        for (uint32_t word : {kMagic, kVersion, uint32_t(total), uint32_t(text.size()), kJsonChunk}) out_.raw(word);
        out_.text(text);
        if (bytes > 0) {
            for (uint32_t word : {uint32_t(bytes), kBinaryChunk}) out_.raw(word);
            binary_.appendTo(out_);
        }
        out_.close();
    }

  private:
    static constexpr uint64_t kMost = 0xfff00000u;

    RunError tooLarge() const {
        return RunError(path_ + ": a GLB file cannot hold more than 4 GB; choose ply, obj or stl");
    }

    /// Of what is written next. Returns its number.
    size_t beginAccessor(int componentType, const char* type, int target, size_t count, size_t bytesEach) {
        json& views = root_["bufferViews"];
        views.push_back(
            {{"buffer", 0}, {"byteOffset", binary_.out.size()}, {"byteLength", count * bytesEach}, {"target", target}});
        root_["accessors"].push_back(
            {{"bufferView", views.size() - 1}, {"componentType", componentType}, {"count", count}, {"type", type}});
        return root_["accessors"].size() - 1;
    }

    json attributes(const MeshObject& o) {
        const size_t n = o.mesh.points.size();
        const size_t position = beginAccessor(kFloat, "VEC3", kVertices, n, sizeof(Float3));
        Float3 lo, hi;
        lo.fill(std::numeric_limits<float>::max());
        hi.fill(std::numeric_limits<float>::lowest());
        for (const Vec3& p : o.mesh.points) {
            const Float3 q = turned(metres_ * p);
            for (size_t k = 0; k < 3; ++k) lo[k] = std::min(lo[k], q[k]), hi[k] = std::max(hi[k], q[k]);
            binary_.out.raw(q);
        }
        root_["accessors"].back()["min"] = lo;
        root_["accessors"].back()["max"] = hi;
        json attributes{{"POSITION", position}};
        attributes["NORMAL"] = beginAccessor(kFloat, "VEC3", kVertices, n, sizeof(Float3));
        for (const Vec3& normal : vertexNormals(o.mesh)) binary_.out.raw(turned(normal));
        if (o.vertexLook.empty()) return attributes;
        attributes["COLOR_0"] = beginAccessor(kUint8, "VEC4", kVertices, n, 4);
        root_["accessors"].back()["normalized"] = true;
        std::vector<std::array<uint8_t, 4>> colors;
        for (const MeshLook& l : o.looks)
            colors.push_back(
                {toByte(toLinear(l.color[0])), toByte(toLinear(l.color[1])), toByte(toLinear(l.color[2])), 255});
        for (const uint32_t l : o.vertexLook) binary_.out.raw(colors[l]);
        return attributes;
    }

    /// One for each name, colour and finish.
    size_t material(const MeshObject& o, Finish finish, bool several) {
        const Vec3 color = o.vertexLook.empty() ? o.color : Vec3(1, 1, 1);
        const std::string name = several ? materialName(o) + "_" + look(finish).name : materialName(o);
        const auto sought = std::make_tuple(name, color, finish);
        for (size_t i = 0; i < materials_.size(); ++i)
            if (materials_[i] == sought) return i;
        materials_.push_back(sought);
        root_["materials"].push_back(
            {{"name", name},
             {"pbrMetallicRoughness",
              {{"baseColorFactor", {toLinear(color[0]), toLinear(color[1]), toLinear(color[2]), 1}},
               {"metallicFactor", look(finish).metallic},
               {"roughnessFactor", look(finish).roughness}}}});
        return materials_.size() - 1;
    }

    void addNode(const std::string& name, const std::vector<double>& matrix) {
        json node{{"name", name}, {"mesh", root_["meshes"].size() - 1}};
        if (!matrix.empty()) node["matrix"] = matrix;
        root_["nodes"].push_back(node);
        root_["scenes"][0]["nodes"].push_back(root_["nodes"].size() - 1);
    }

    std::string path_;
    double metres_;
    WaitingPart binary_;
    Output out_;
    json root_;
    std::vector<std::tuple<std::string, Vec3, Finish>> materials_;
};

}  // namespace

std::unique_ptr<MeshWriter> openGlb(const std::string& path, double metresPerUnit) {
    return std::make_unique<GlbWriter>(path, metresPerUnit);
}

}  // namespace pavel
