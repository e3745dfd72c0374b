#include "pavel/io/mesh_write.h"

#include <algorithm>
#include <array>
#include <map>

#include "pavel/io/mesh_formats.h"

namespace pavel {

void replaceMesh(MeshObject& object, TriangleMesh mesh, const std::vector<int>& source) {
    if (!object.vertexLook.empty()) {
        std::vector<uint32_t> carried;
        carried.reserve(source.size());
        for (int v : source) carried.push_back(object.vertexLook[size_t(v)]);
        object.vertexLook = std::move(carried);
    }
    object.mesh = std::move(mesh);
}

uint32_t MeshObject::solidLook(const Triangle& t) const {
    const uint32_t first = vertexLook[size_t(t[0])];
    if (first == vertexLook[size_t(t[1])] && first == vertexLook[size_t(t[2])] && !looks[first].blend) return first;
    std::array<std::pair<uint32_t, double>, 6> parts;  // two at each corner
    size_t count = 0;
    const auto add = [&](uint32_t l, double part) {
        size_t i = 0;
        while (i < count && parts[i].first != l) ++i;
        if (i == count) parts[count++] = {l, 0};
        parts[i].second += part;
    };
    for (const int v : t) forEachLook(size_t(v), add);
    const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
    return std::max_element(parts.begin(), parts.begin() + std::ptrdiff_t(count), less)->first;
}

namespace {

class ObjWriter : public MeshWriter {
  public:
    ObjWriter(const std::string& path, bool materialFile)
        : library_(materialFile ? path.substr(0, path.find_last_of('.')) + ".mtl" : ""), out_(path) {
        if (materialFile) out_.text("mtllib " + library_.substr(library_.find_last_of('/') + 1) + "\n");
    }
    void add(const MeshObject& o) override {
        materials_.emplace(materialName(o), o.color);
        out_.text("o " + o.name + "\n");
        if (!library_.empty()) out_.text("usemtl " + materialName(o) + "\n");
        for (size_t v = 0; v < o.mesh.points.size(); ++v) {
            const Vec3 p = o.mesh.points[v], c = o.colorAt(v);
            out_.print("v %.9g %.9g %.9g %.4g %.4g %.4g\n", p[0], p[1], p[2], c[0], c[1], c[2]);
        }
        for (const Triangle& t : o.mesh.triangles)
            out_.print("f %zu %zu %zu\n", first_ + size_t(t[0]), first_ + size_t(t[1]), first_ + size_t(t[2]));
        first_ += o.mesh.points.size();
    }
    void finish() override {
        out_.close();
        if (library_.empty()) return;
        Output out(library_);
        for (const auto& [name, c] : materials_) {
            out.text("newmtl " + name + "\n");
            out.print("Kd %.4g %.4g %.4g\nKs 0 0 0\nillum 1\n", toLinear(c[0]), toLinear(c[1]), toLinear(c[2]));
        }
        out.close();
    }

  private:
    std::string library_;  // empty: none
    Output out_;
    std::map<std::string, Vec3> materials_;
    size_t first_ = 1;
};

/// For formats that tell the counts first, then all vertices, then all faces.
class JoiningWriter : public MeshWriter {
  public:
    explicit JoiningWriter(const std::string& path) : vertices_(path, "vertices"), faces_(path, "faces"), out_(path) {}
    void add(const MeshObject& o) override {
        for (size_t v = 0; v < o.mesh.points.size(); ++v) vertex(vertices_.out, o, v);
        const int first = int(vertexCount_);
        for (const Triangle& t : o.mesh.triangles) face(faces_.out, {first + t[0], first + t[1], first + t[2]});
        vertexCount_ += o.mesh.points.size();
        faceCount_ += o.mesh.triangles.size();
    }
    void finish() override {
        header(out_, vertexCount_, faceCount_);
        vertices_.appendTo(out_);
        faces_.appendTo(out_);
        out_.close();
    }

  protected:
    virtual void header(Output& out, size_t vertices, size_t faces) = 0;
    virtual void vertex(Output& out, const MeshObject& o, size_t v) = 0;
    virtual void face(Output& out, const Triangle& t) = 0;

  private:
    WaitingPart vertices_, faces_;
    Output out_;
    size_t vertexCount_ = 0, faceCount_ = 0;
};

class PlyWriter : public JoiningWriter {
    using JoiningWriter::JoiningWriter;
    void header(Output& out, size_t vertices, size_t faces) override {
        out.print("ply\nformat binary_little_endian 1.0\ncomment Pavel\nelement vertex %zu\n", vertices);
        out.text(
            "property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty "
            "uchar blue\n");
        out.print("element face %zu\nproperty list uchar int vertex_indices\nend_header\n", faces);
    }
    void vertex(Output& out, const MeshObject& o, size_t v) override {
        for (int k = 0; k < 3; ++k) out.raw(float(o.mesh.points[v][k]));
        const Vec3& c = o.colorAt(v);
        for (int k = 0; k < 3; ++k) out.raw(toByte(c[k]));
    }
    void face(Output& out, const Triangle& t) override {
        out.raw(uint8_t(3));
        for (int v : t) out.raw(int32_t(v));
    }
};

class OffWriter : public JoiningWriter {
    using JoiningWriter::JoiningWriter;
    void header(Output& out, size_t vertices, size_t faces) override { out.print("OFF\n%zu %zu 0\n", vertices, faces); }
    void vertex(Output& out, const MeshObject& o, size_t v) override {
        const Vec3& p = o.mesh.points[v];
        out.print("%.9g %.9g %.9g\n", p[0], p[1], p[2]);
    }
    void face(Output& out, const Triangle& t) override { out.print("3 %d %d %d\n", t[0], t[1], t[2]); }
};

class StlWriter : public MeshWriter {
  public:
    explicit StlWriter(const std::string& path) : out_(path) {
        char header[kCountAt] = "Pavel binary STL";
        out_.bytes(header, sizeof header);
        out_.raw(faces_);
    }
    void add(const MeshObject& o) override {
        faces_ += uint32_t(o.mesh.triangles.size());
        for (size_t t = 0; t < o.mesh.triangles.size(); ++t) {
            const Vec3 n = triangleNormal(o.mesh, t);
            for (int k = 0; k < 3; ++k) out_.raw(float(n[k]));
            for (int c = 0; c < 3; ++c)
                for (int k = 0; k < 3; ++k) out_.raw(float(o.mesh.corner(t, c)[k]));
            out_.raw(uint16_t(0));
        }
    }
    void finish() override {
        out_.patch(kCountAt, &faces_, sizeof faces_);
        out_.close();
    }

  private:
    static constexpr size_t kCountAt = 80;
    Output out_;
    uint32_t faces_ = 0;
};

}  // namespace

std::unique_ptr<MeshWriter> openObj(const std::string& path, bool materialFile) {
    return std::make_unique<ObjWriter>(path, materialFile);
}
std::unique_ptr<MeshWriter> openPly(const std::string& path) {
    return std::make_unique<PlyWriter>(path);
}
std::unique_ptr<MeshWriter> openStl(const std::string& path) {
    return std::make_unique<StlWriter>(path);
}
std::unique_ptr<MeshWriter> openOff(const std::string& path) {
    return std::make_unique<OffWriter>(path);
}

const std::vector<std::string>& meshFormats() {
    static const std::vector<std::string> formats = {"glb", "ply", "obj", "stl", "off", "3mf", "usda"};
    return formats;
}

std::string meshFormatList() {
    std::string text;
    for (const std::string& f : meshFormats()) text += (text.empty() ? "" : ", ") + f;
    return text;
}

void checkMeshName(const std::string& path) {
    const std::string ending = path.substr(path.find_last_of('.') + 1);
    if (std::find(meshFormats().begin(), meshFormats().end(), ending) == meshFormats().end())
        throw InputError(path + ": unknown kind of mesh; use " + meshFormatList());
}

std::unique_ptr<MeshWriter> openMesh(const std::string& path, const MeshFileOptions& options) {
    checkMeshName(path);
    const std::string ending = path.substr(path.find_last_of('.') + 1);
    if (ending == "obj") return openObj(path, options.materialFile);
    if (ending == "ply") return openPly(path);
    if (ending == "stl") return openStl(path);
    if (ending == "off") return openOff(path);
    if (ending == "glb") return openGlb(path, options.metresPerUnit);
    if (ending == "3mf") return open3mf(path, options.metresPerUnit);
    return openUsda(path, options);
}

void writeMesh(const std::string& path, const std::vector<MeshObject>& objects, const MeshFileOptions& options) {
    const std::unique_ptr<MeshWriter> writer = openMesh(path, options);
    for (const MeshObject& o : objects) writer->add(o);
    writer->finish();
}

}  // namespace pavel
