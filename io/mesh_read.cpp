#include "pavel/io/mesh_read.h"

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/Mesh/BaseKernel.hh>
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

    VertexHandle add_vertex(const OpenMesh::Vec3f& p) override { return add_vertex(Vec3(p[0], p[1], p[2])); }
    VertexHandle add_vertex(const OpenMesh::Vec3d& p) override {
        mesh.points.push_back(p);
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
        return FaceHandle(int(faces_++));
    }
    void set_point(VertexHandle v, const OpenMesh::Vec3f& p) override {
        mesh.points[size_t(v.idx())] = Vec3(p[0], p[1], p[2]);
    }
    size_t n_vertices() const override { return mesh.points.size(); }
    size_t n_faces() const override { return faces_; }
    size_t n_edges() const override { return 0; }

    // Attributes and connectivity that a soup has no place for.
    HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
    FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec2f>&) override {}
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f>&) override {}
    void set_face_texindex(FaceHandle, int) override {}
    void set_halfedge(VertexHandle, HalfedgeHandle) override {}
    void set_normal(VertexHandle, const OpenMesh::Vec3f&) override {}
    void set_normal(VertexHandle, const OpenMesh::Vec3d&) override {}
    void set_normal(FaceHandle, const OpenMesh::Vec3f&) override {}
    void set_normal(FaceHandle, const OpenMesh::Vec3d&) override {}
    void set_color(VertexHandle, const OpenMesh::Vec3uc&) override {}
    void set_color(VertexHandle, const OpenMesh::Vec4uc&) override {}
    void set_color(VertexHandle, const OpenMesh::Vec3f&) override {}
    void set_color(VertexHandle, const OpenMesh::Vec4f&) override {}
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
    size_t faces_ = 0;
    OpenMesh::BaseKernel kernel_;  // some readers hang custom properties on it
};

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

TriangleMesh readMesh(const std::string& path) {
    fs::path p(path);
    std::error_code error;
    if (!fs::exists(p, error)) throw InputError(path + ": no such file");
    if (fs::is_directory(p, error)) throw InputError(path + ": is a folder, not a mesh");
    const bool gzip = p.extension() == ".gz";
    if (gzip) p.replace_extension();
    std::string ending = p.extension().string();
    for (char& c : ending) c = char(std::tolower(c));
    if (ending != ".obj" && ending != ".ply" && ending != ".stl" && ending != ".off")
        throw InputError(path + ": unknown kind of mesh; use OBJ, PLY, STL or OFF (also with .gz)");
    const std::string bytes = readBytes(path, gzip);
    if (bytes.empty()) throw InputError(path + ": the file is empty");

    SoupImporter importer;
    OpenMesh::IO::Options options;
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
    if (importer.mesh.triangles.empty()) throw InputError(path + ": holds no faces");
    return std::move(importer.mesh);
}

}  // namespace pavel
