#include "pavel/io/mesh_write.h"

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "pavel/core/error.h"

namespace pavel {
namespace {

/// Buffered file that reports every failure (a full disk shows on flush).
class Output {
  public:
    explicit Output(const std::string& path) : path_(path), file_(std::fopen(path.c_str(), "wb")) {
        if (!file_) throw RunError(path + ": cannot be written");
        buffer_.reserve(kFlush + 4096);
    }
    ~Output() {
        if (file_) std::fclose(file_);
    }
    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;
    template <class... A>
    void print(const char* format, A... values) {
        char line[256];
        const int n = std::snprintf(line, sizeof line, format, values...);
        bytes(line, size_t(n));
    }
    void text(const std::string& s) { bytes(s.data(), s.size()); }
    void bytes(const void* data, size_t n) {
        buffer_.append(static_cast<const char*>(data), n);
        if (buffer_.size() >= kFlush) flush();
    }
    template <class T>
    void raw(T value) {
        bytes(&value, sizeof value);
    }
    void close() {
        flush();
        const bool ok = std::fclose(file_) == 0;
        file_ = nullptr;
        if (!ok) fail();
    }

  private:
    static constexpr size_t kFlush = size_t(1) << 20;
    void flush() {
        if (std::fwrite(buffer_.data(), 1, buffer_.size(), file_) != buffer_.size()) fail();
        buffer_.clear();
    }
    [[noreturn]] void fail() { throw RunError(path_ + ": writing failed (is the disk full?)"); }
    std::string path_, buffer_;
    FILE* file_;
};

Vec3 vertexColor(const MeshObject& o, size_t v) {
    return o.vertexColors.empty() ? o.color : o.vertexColors[v];
}
uint8_t toByte(double c) {
    return uint8_t(std::lround(255 * std::clamp(c, 0.0, 1.0)));
}
double toLinear(double c) {
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

void writeObj(const std::string& path, const std::vector<MeshObject>& objects) {
    Output out(path);
    size_t first = 1;
    for (const MeshObject& o : objects) {
        out.text("o " + o.name + "\n");
        for (size_t v = 0; v < o.mesh.points.size(); ++v) {
            const Vec3 p = o.mesh.points[v], c = vertexColor(o, v);
            out.print("v %.9g %.9g %.9g %.4g %.4g %.4g\n", p[0], p[1], p[2], c[0], c[1], c[2]);
        }
        for (const Triangle& t : o.mesh.triangles)
            out.print("f %zu %zu %zu\n", first + size_t(t[0]), first + size_t(t[1]), first + size_t(t[2]));
        first += o.mesh.points.size();
    }
    out.close();
}

void writePly(const std::string& path, const std::vector<MeshObject>& objects) {
    size_t vertices = 0, faces = 0;
    for (const MeshObject& o : objects) vertices += o.mesh.points.size(), faces += o.mesh.triangles.size();
    Output out(path);
    out.print("ply\nformat binary_little_endian 1.0\ncomment Pavel\nelement vertex %zu\n", vertices);
    out.text(
        "property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty "
        "uchar blue\n");
    out.print("element face %zu\nproperty list uchar int vertex_indices\nend_header\n", faces);
    for (const MeshObject& o : objects)
        for (size_t v = 0; v < o.mesh.points.size(); ++v) {
            for (int k = 0; k < 3; ++k) out.raw(float(o.mesh.points[v][k]));
            const Vec3 c = vertexColor(o, v);
            for (int k = 0; k < 3; ++k) out.raw(toByte(c[k]));
        }
    int first = 0;
    for (const MeshObject& o : objects) {
        for (const Triangle& t : o.mesh.triangles) {
            out.raw(uint8_t(3));
            for (int v : t) out.raw(int32_t(first + v));
        }
        first += int(o.mesh.points.size());
    }
    out.close();
}

void writeStl(const std::string& path, const std::vector<MeshObject>& objects) {
    uint32_t faces = 0;
    for (const MeshObject& o : objects) faces += uint32_t(o.mesh.triangles.size());
    Output out(path);
    char header[80] = "Pavel binary STL";
    out.bytes(header, sizeof header);
    out.raw(faces);
    for (const MeshObject& o : objects)
        for (size_t t = 0; t < o.mesh.triangles.size(); ++t) {
            const Vec3 n = triangleNormal(o.mesh, t);
            for (int k = 0; k < 3; ++k) out.raw(float(n[k]));
            for (int c = 0; c < 3; ++c)
                for (int k = 0; k < 3; ++k) out.raw(float(o.mesh.corner(t, c)[k]));
            out.raw(uint16_t(0));
        }
    out.close();
}

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

/// A frame as a node's matrix, columns first, in metres and +Y up.
std::vector<double> gltfMatrix(const Frame& frame, double metres) {
    const auto turned = [](const Vec3& v) { return Vec3(v[0], v[2], -v[1]); };
    const Vec3 columns[4] = {frame.scale * turned(frame.x), frame.scale * turned(frame.z),
                             -frame.scale * turned(frame.y), metres * turned(frame.origin)};
    std::vector<double> m;
    for (int c = 0; c < 4; ++c) m.insert(m.end(), {columns[c][0], columns[c][1], columns[c][2], c == 3 ? 1.0 : 0.0});
    return m;
}

void writeGlb(const std::string& path, const std::vector<MeshObject>& objects, double metres) {
    tinygltf::Model model;
    model.asset.version = "2.0";
    model.asset.generator = "Pavel";
    model.buffers.resize(1);
    model.scenes.resize(1);
    model.defaultScene = 0;
    std::vector<Vec3> materialColors;
    for (const MeshObject& o : objects) {
        if (o.mesh.triangles.empty()) continue;
        const Vec3 color = o.vertexColors.empty() ? o.color : Vec3(1, 1, 1);
        size_t material = 0;
        while (material < materialColors.size() && !(materialColors[material] == color)) ++material;
        if (material == materialColors.size()) {
            materialColors.push_back(color);
            tinygltf::Material m;
            m.name = "material_" + std::to_string(material + 1);
            m.pbrMetallicRoughness.baseColorFactor = {toLinear(color[0]), toLinear(color[1]), toLinear(color[2]), 1};
            m.pbrMetallicRoughness.metallicFactor = 0;
            m.pbrMetallicRoughness.roughnessFactor = 0.6;
            model.materials.push_back(m);
        }
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
        std::vector<uint32_t> indices;
        for (const Triangle& t : o.mesh.triangles)
            indices.insert(indices.end(), {uint32_t(t[0]), uint32_t(t[1]), uint32_t(t[2])});
        tinygltf::Primitive primitive;
        primitive.mode = TINYGLTF_MODE_TRIANGLES;
        primitive.material = int(material);
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
        primitive.indices = addAccessor(model, indices, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR,
                                        TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER, indices.size());
        tinygltf::Mesh mesh;
        mesh.name = o.name;
        mesh.primitives.push_back(primitive);
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
        throw RunError(path + ": writing failed (is the disk full?)");
}

}  // namespace

const std::vector<std::string>& meshFormats() {
    static const std::vector<std::string> formats = {"glb", "ply", "obj", "stl"};
    return formats;
}

void writeMesh(const std::string& path, const std::vector<MeshObject>& objects, double metresPerUnit) {
    const std::string ending = path.substr(path.find_last_of('.') + 1);
    if (ending == "obj")
        writeObj(path, objects);
    else if (ending == "ply")
        writePly(path, objects);
    else if (ending == "stl")
        writeStl(path, objects);
    else if (ending == "glb")
        writeGlb(path, objects, metresPerUnit);
    else
        throw InputError(path + ": unknown kind of mesh; use .obj, .ply, .stl or .glb");
}

}  // namespace pavel
