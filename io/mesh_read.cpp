#include "pavel/io/mesh_read.h"

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/Mesh/BaseKernel.hh>
#include <algorithm>
#include <array>
#include <boost/iostreams/copy.hpp>
#include <boost/iostreams/filter/gzip.hpp>
#include <boost/iostreams/filtering_streambuf.hpp>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <sstream>

#include "pavel/core/error.h"

namespace pavel {
namespace {

namespace fs = std::filesystem;

/// Collects vertices and polygons as the file has them. (OpenMesh's own mesh would drop faces at complex edges.)
class SoupImporter : public OpenMesh::IO::BaseImporter {
  public:
    using VertexHandle = OpenMesh::VertexHandle;
    using FaceHandle = OpenMesh::FaceHandle;
    using HalfedgeHandle = OpenMesh::HalfedgeHandle;
    using EdgeHandle = OpenMesh::EdgeHandle;
    template <class T>
    using V3 = OpenMesh::VectorT<T, 3>;

    TriangleMesh mesh;
    size_t badFaces = 0;
    std::vector<size_t> faceEnd;  // of each polygon: one past its last triangle
    std::vector<Vec3> colors, normals;

    SoupImporter() { kernel_.importer = this; }
    /// What the reader hung on the vertices.
    VertexValues values() const {
        VertexValues all;
        if (colors.size() == mesh.points.size()) {
            for (size_t k = 0; k < 3; ++k) {
                auto& channel = all[std::array<const char*, 3>{"red", "green", "blue"}[k]];
                for (const Vec3& c : colors) channel.push_back(c[int(k)]);
            }
            for (const Vec3& c : colors) all["color"].push_back(0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
        }
        for (size_t k = 0; k < 3 && normals.size() == mesh.points.size(); ++k)
            for (const Vec3& n : normals) all[std::array<const char*, 3>{"nx", "ny", "nz"}[k]].push_back(n[int(k)]);
        for (auto it = kernel_.vprops_begin(); it != kernel_.vprops_end(); ++it) {
            if (!*it) continue;
            std::vector<double> v;
            if (copy<float>(*it, v) || copy<double>(*it, v) || copy<int>(*it, v) || copy<unsigned>(*it, v) ||
                copy<short>(*it, v) || copy<unsigned short>(*it, v) || copy<signed char>(*it, v) ||
                copy<unsigned char>(*it, v))
                all[(*it)->name()] = std::move(v);
        }
        return all;
    }

    VertexHandle add_vertex(const OpenMesh::Vec3f& p) override { return add_vertex(Vec3(p[0], p[1], p[2])); }
    VertexHandle add_vertex(const OpenMesh::Vec3d& p) override {
        mesh.points.push_back(p);
        kernel_.fit();
        return VertexHandle(int(mesh.points.size()) - 1);
    }
    VertexHandle add_vertex() override { return add_vertex(Vec3(0, 0, 0)); }
    FaceHandle add_face(const VHandles& corners) override {
        for (const VertexHandle& v : corners)
            if (v.idx() < 0 || v.idx() >= int(mesh.points.size())) {
                ++badFaces;
                return FaceHandle();
            }
        for (size_t k = 1; k + 1 < corners.size(); ++k)
            mesh.triangles.push_back({corners[0].idx(), corners[k].idx(), corners[k + 1].idx()});
        faceEnd.push_back(mesh.triangles.size());
        return FaceHandle(int(faces_++));
    }
    void set_point(VertexHandle v, const OpenMesh::Vec3f& p) override {
        mesh.points[size_t(v.idx())] = Vec3(p[0], p[1], p[2]);
    }
    size_t n_vertices() const override { return mesh.points.size(); }
    size_t n_faces() const override { return faces_; }
    size_t n_edges() const override { return 0; }

    void set_color(VertexHandle v, const OpenMesh::Vec3uc& c) override { setColor(v, Vec3(c[0], c[1], c[2]) / 255.0); }
    void set_color(VertexHandle v, const OpenMesh::Vec4uc& c) override { setColor(v, Vec3(c[0], c[1], c[2]) / 255.0); }
    void set_color(VertexHandle v, const OpenMesh::Vec3f& c) override { setColor(v, Vec3(c[0], c[1], c[2])); }
    void set_color(VertexHandle v, const OpenMesh::Vec4f& c) override { setColor(v, Vec3(c[0], c[1], c[2])); }

    // Attributes and connectivity that a soup has no place for.
    HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
    FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec2f>&) override {}
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f>&) override {}
    void set_face_texindex(FaceHandle, int) override {}
    void set_halfedge(VertexHandle, HalfedgeHandle) override {}
    void set_normal(VertexHandle v, const OpenMesh::Vec3f& n) override { set_normal(v, Vec3(n[0], n[1], n[2])); }
    void set_normal(VertexHandle v, const OpenMesh::Vec3d& n) override {
        normals.resize(mesh.points.size(), Vec3(0, 0, 0));
        normals[size_t(v.idx())] = n;
    }
    void set_normal(FaceHandle, const OpenMesh::Vec3f&) override {}
    void set_normal(FaceHandle, const OpenMesh::Vec3d&) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec3uc&) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec4uc&) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec3f&) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec4f&) override {}
    void set_color(FaceHandle, const OpenMesh::Vec3uc&) override {}
    void set_color(FaceHandle, const OpenMesh::Vec4uc&) override {}
    void set_color(FaceHandle, const OpenMesh::Vec3f&) override {}
    void set_color(FaceHandle, const OpenMesh::Vec4f&) override {}
    void set_texcoord(VertexHandle, const OpenMesh::Vec2f&) override {}
    void set_texcoord(VertexHandle, const OpenMesh::Vec3f&) override {}
    void set_texcoord(HalfedgeHandle, const OpenMesh::Vec2f&) override {}
    void set_texcoord(HalfedgeHandle, const OpenMesh::Vec3f&) override {}
    void request_face_texcoords2D() override {}
    void set_status(VertexHandle, const OpenMesh::Attributes::StatusInfo&) override {}
    void set_status(HalfedgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
    void set_status(EdgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
    void set_status(FaceHandle, const OpenMesh::Attributes::StatusInfo&) override {}
    void set_next(HalfedgeHandle, HalfedgeHandle) override {}
    void set_face(HalfedgeHandle, FaceHandle) override {}
    void add_texture_information(int, std::string) override {}
    OpenMesh::BaseKernel* kernel() override { return &kernel_; }

  private:
    struct Kernel : OpenMesh::BaseKernel {  // holds the properties that a PLY gives its vertices
        const SoupImporter* importer = nullptr;
        size_t n_vertices() const override { return importer->mesh.points.size(); }
        void fit() const { vprops_resize(n_vertices()); }
    };
    void setColor(VertexHandle v, const Vec3& c) {
        colors.resize(mesh.points.size(), Vec3(0, 0, 0));
        colors[size_t(v.idx())] = c;
    }
    template <class T>
    static bool copy(const OpenMesh::BaseProperty* property, std::vector<double>& values) {
        const auto* p = dynamic_cast<const OpenMesh::PropertyT<T>*>(property);
        if (p) values.assign(p->data_vector().begin(), p->data_vector().end());
        return p;
    }
    size_t faces_ = 0;
    Kernel kernel_;
};

/// Gives the triangles of an OBJ the groups that its lines name.
void readGroups(const std::string& text, const std::vector<size_t>& faceEnd, TriangleMesh& mesh) {
    std::vector<std::string> names[2];  // groups, materials
    std::vector<int> of[2];
    int now[2] = {-1, -1};
    std::istringstream lines(text);
    std::string line, word;
    while (std::getline(lines, line)) {
        std::istringstream words(line);
        if (!(words >> word)) continue;
        if (word == "f")
            for (int k = 0; k < 2; ++k) of[k].push_back(now[k]);
        if (word != "g" && word != "usemtl") continue;
        const int k = word == "usemtl";
        std::string name = "default";
        words >> name;
        const auto at = std::find(names[k].begin(), names[k].end(), name);
        now[k] = int(at - names[k].begin());
        if (at == names[k].end()) names[k].push_back(name);
    }
    const int k = names[0].size() > 1 || names[1].empty() ? 0 : 1;
    if (names[k].empty() || of[k].size() != faceEnd.size()) return;
    mesh.groupNames = names[k];
    if (std::find(of[k].begin(), of[k].end(), -1) != of[k].end()) mesh.groupNames.push_back("default");
    for (size_t f = 0; f < faceEnd.size(); ++f)
        mesh.groups.resize(faceEnd[f], of[k][f] >= 0 ? of[k][f] : int(mesh.groupNames.size()) - 1);
}

std::string readBytes(const std::string& path, bool gzip) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw InputError(path + ": cannot be read");
    std::ostringstream text;
    try {
        boost::iostreams::filtering_istreambuf in;
        if (gzip) in.push(boost::iostreams::gzip_decompressor());
        in.push(file);
        boost::iostreams::copy(in, text);
    } catch (const std::exception& e) {
        throw InputError(path + ": the compressed data is damaged (" + e.what() + ")");
    }
    return text.str();
}

}  // namespace

namespace {

/// Lower-case ending of a path, that of the file inside where it is compressed.
std::string meshEnding(const std::string& path) {
    fs::path p(path);
    if (p.extension() == ".gz") p.replace_extension();
    std::string ending = p.extension().string();
    for (char& c : ending) c = char(std::tolower(c));
    return ending;
}

}  // namespace

bool isMeshFile(const std::string& path) {
    const std::string ending = meshEnding(path);
    return ending == ".obj" || ending == ".ply" || ending == ".stl" || ending == ".off";
}

namespace {

/// What a mesh file holds, as it is; `attributes`: also colours, normals and properties of the vertices.
void readSoup(const std::string& path, bool attributes, SoupImporter& importer) {
    const fs::path p(path);
    std::error_code error;
    if (!fs::exists(p, error)) throw InputError(path + ": no such file");
    if (fs::is_directory(p, error)) throw InputError(path + ": is a folder, not a mesh");
    const bool gzip = p.extension() == ".gz";
    const std::string ending = meshEnding(path);
    if (!isMeshFile(path)) throw InputError(path + ": unknown kind of mesh; use OBJ, PLY, STL or OFF (also with .gz)");
    const std::string bytes = readBytes(path, gzip);
    if (bytes.empty()) throw InputError(path + ": the file is empty");

    OpenMesh::IO::Options options;
    if (attributes) {
        options += OpenMesh::IO::Options::VertexNormal;
        options += OpenMesh::IO::Options::VertexColor;
        options += OpenMesh::IO::Options::Custom;
    }
    // ASCII STL starts with "solid", but so do some binary ones: their length tells.
    if (ending == ".stl") {
        uint32_t count = 0;
        if (bytes.size() >= 84) std::memcpy(&count, bytes.data() + 80, 4);
        if (bytes.size() >= 84 && bytes.size() == 84 + 50 * size_t(count))
            options += OpenMesh::IO::Options::Binary;
        else if (bytes.compare(0, 5, "solid") != 0)
            throw InputError(path + ": neither an ASCII nor a whole binary STL file");
    }
    static std::mutex reading;  // OpenMesh's reader modules are shared objects with state
    const std::lock_guard<std::mutex> lock(reading);
    omerr().disable();
    omlog().disable();
    bool ok = false;
    try {
        std::istringstream stream(bytes);
        ok = OpenMesh::IO::IOManager().read(stream, ending, importer, options);
    } catch (const std::exception&) {
        ok = false;
    }
    omerr().enable();
    omlog().enable();
    if (!ok) throw InputError(path + ": not a valid " + ending.substr(1) + " file, or cut short");
    if (importer.badFaces)
        throw InputError(path + ": " + std::to_string(importer.badFaces) +
                         " faces name vertices that the file does not have");
    if (ending == ".obj") readGroups(bytes, importer.faceEnd, importer.mesh);
}

}  // namespace

TriangleMesh readMesh(const std::string& path, VertexValues* values) {
    SoupImporter importer;
    readSoup(path, values, importer);
    if (importer.mesh.triangles.empty()) throw InputError(path + ": holds no faces");
    if (values) *values = importer.values();
    return std::move(importer.mesh);
}

std::vector<Vec3> readPoints(const std::string& path, VertexValues& values) {
    SoupImporter importer;
    readSoup(path, true, importer);
    values = importer.values();
    return std::move(importer.mesh.points);
}

}  // namespace pavel
