#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include <cstring>
#include <fstream>
#include <map>
#include <tuple>

#include "pavel/io/mesh_formats.h"

namespace pavel {
namespace {

template <class T>
int addAccessor(tinygltf::Model& model, const std::vector<T>& data, int componentType, int type, int target,
                size_t count) {
    auto& buffer = model.buffers[0].data;
    while (buffer.size() % 4) buffer.push_back(0);
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = buffer.size();
    view.byteLength = data.size() * sizeof(T);
    view.target = target;
    buffer.resize(buffer.size() + view.byteLength);
    std::memcpy(&buffer[view.byteOffset], data.data(), view.byteLength);
    model.bufferViews.push_back(view);
    tinygltf::Accessor a;
    a.bufferView = int(model.bufferViews.size()) - 1;
    a.componentType = componentType;
    a.type = type;
    a.count = count;
    model.accessors.push_back(a);
    return int(model.accessors.size()) - 1;
}

/// A material for each name, colour and finish.
class Materials {
  public:
    explicit Materials(tinygltf::Model& model) : model_(model) {}
    int find(const MeshObject& o, Finish finish) {
        const Vec3 color = o.vertexColors.empty() ? o.color : Vec3(1, 1, 1);
        const bool several = !o.vertexFinish.empty();
        const std::string name = several ? materialName(o) + "_" + look(finish).name : materialName(o);
        for (size_t i = 0; i < known_.size(); ++i)
            if (known_[i] == std::make_tuple(name, color, finish)) return int(i);
        known_.emplace_back(name, color, finish);
        tinygltf::Material m;
        m.name = name;
        m.pbrMetallicRoughness.baseColorFactor = {toLinear(color[0]), toLinear(color[1]), toLinear(color[2]), 1};
        m.pbrMetallicRoughness.metallicFactor = look(finish).metallic;
        m.pbrMetallicRoughness.roughnessFactor = look(finish).roughness;
        model_.materials.push_back(m);
        return int(known_.size()) - 1;
    }

  private:
    tinygltf::Model& model_;
    std::vector<std::tuple<std::string, Vec3, Finish>> known_;
};

std::map<Finish, std::vector<uint32_t>> indicesByFinish(const MeshObject& o) {
    std::map<Finish, std::vector<uint32_t>> indices;
    for (const Triangle& t : o.mesh.triangles) {
        auto& list = indices[o.vertexFinish.empty() ? o.finish : o.vertexFinish[size_t(t[0])]];
        list.insert(list.end(), {uint32_t(t[0]), uint32_t(t[1]), uint32_t(t[2])});
    }
    return indices;
}

/// A frame as a node's matrix, columns first, in metres and +Y up.
std::vector<double> gltfMatrix(const Frame& frame, double metres) {
    const auto turned = [](const Vec3& v) { return Vec3(v[0], v[2], -v[1]); };
    const Vec3 columns[4] = {frame.scale * turned(frame.x), frame.scale * turned(frame.z),
                             -frame.scale * turned(frame.y), metres * turned(frame.origin)};
    std::vector<double> m;
    for (int c = 0; c < 4; ++c) m.insert(m.end(), {columns[c][0], columns[c][1], columns[c][2], c == 3 ? 1.0 : 0.0});
    return m;
}

}  // namespace

void writeGlb(const std::string& path, const std::vector<MeshObject>& objects, double metres) {
    tinygltf::Model model;
    model.asset.version = "2.0";
    model.asset.generator = "Pavel";
    model.buffers.resize(1);
    model.scenes.resize(1);
    model.defaultScene = 0;
    Materials materials(model);
    for (const MeshObject& o : objects) {
        if (o.mesh.triangles.empty()) continue;
        const size_t n = o.mesh.points.size();
        std::vector<float> positions, normals;
        std::vector<uint8_t> colors;
        const std::vector<Vec3> vn = vertexNormals(o.mesh);
        float lo[3] = {1e30f, 1e30f, 1e30f}, hi[3] = {-1e30f, -1e30f, -1e30f};
        for (size_t v = 0; v < n; ++v) {
            const Vec3 p = metres * o.mesh.points[v];
            const float q[3] = {float(p[0]), float(p[2]), float(-p[1])};  // z up to +Y up
            for (int k = 0; k < 3; ++k) lo[k] = std::min(lo[k], q[k]), hi[k] = std::max(hi[k], q[k]);
            positions.insert(positions.end(), q, q + 3);
            normals.insert(normals.end(), {float(vn[v][0]), float(vn[v][2]), float(-vn[v][1])});
            if (o.vertexColors.empty()) continue;
            for (int k = 0; k < 3; ++k) colors.push_back(toByte(toLinear(o.vertexColors[v][k])));
            colors.push_back(255);
        }
        tinygltf::Primitive primitive;
        primitive.mode = TINYGLTF_MODE_TRIANGLES;
        const int position = addAccessor(model, positions, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3,
                                         TINYGLTF_TARGET_ARRAY_BUFFER, n);
        model.accessors[size_t(position)].minValues.assign(lo, lo + 3);
        model.accessors[size_t(position)].maxValues.assign(hi, hi + 3);
        primitive.attributes["POSITION"] = position;
        primitive.attributes["NORMAL"] = addAccessor(model, normals, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3,
                                                     TINYGLTF_TARGET_ARRAY_BUFFER, n);
        if (!colors.empty()) {
            primitive.attributes["COLOR_0"] = addAccessor(model, colors, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE,
                                                          TINYGLTF_TYPE_VEC4, TINYGLTF_TARGET_ARRAY_BUFFER, n);
            model.accessors.back().normalized = true;
        }
        tinygltf::Mesh mesh;
        mesh.name = o.name;
        for (const auto& [finish, indices] : indicesByFinish(o)) {  // primitives share the vertices
            primitive.material = materials.find(o, finish);
            primitive.indices = addAccessor(model, indices, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR,
                                            TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER, indices.size());
            mesh.primitives.push_back(primitive);
        }
        model.meshes.push_back(mesh);
        const auto addNode = [&](const std::string& name, const std::vector<double>& matrix) {
            tinygltf::Node node;
            node.name = name;
            node.mesh = int(model.meshes.size()) - 1;
            node.matrix = matrix;
            model.nodes.push_back(node);
            model.scenes[0].nodes.push_back(int(model.nodes.size()) - 1);
        };
        if (o.instances.empty()) addNode(o.name, {});
        for (const auto& [name, frame] : o.instances) addNode(name, gltfMatrix(frame, metres));
    }
    if (model.buffers[0].data.size() > 0xfff00000u)
        throw RunError(path + ": a GLB file cannot hold more than 4 GB; choose ply, obj or stl");
    std::ofstream stream(path, std::ios::binary);
    tinygltf::TinyGLTF writer;
    if (!stream || !writer.WriteGltfSceneToStream(&model, stream, false, true) || !stream.flush())
        throwWriteFailed(path);
}

}  // namespace pavel
