#include "pavel/io/mesh_write.h"

#include <map>

#include "pavel/io/mesh_formats.h"

namespace pavel {

void replaceMesh(MeshObject& object, TriangleMesh mesh, const std::vector<int>& source) {
    const auto carry = [&](auto& values) {
        if (values.empty()) return;
        std::remove_reference_t<decltype(values)> carried;
        for (int v : source) carried.push_back(values[size_t(v)]);
        values = std::move(carried);
    };
    carry(object.vertexColors);
    carry(object.vertexFinish);
    object.mesh = std::move(mesh);
}

void writeObj(const std::string& path, const std::vector<MeshObject>& objects, bool materialFile) {
    std::map<std::string, Vec3> materials;
    for (const MeshObject& o : objects) materials.emplace(materialName(o), o.color);
    const std::string library = path.substr(0, path.find_last_of('.')) + ".mtl";
    if (materialFile) {
        Output out(library);
        for (const auto& [name, c] : materials) {
            out.text("newmtl " + name + "\n");
            out.print("Kd %.4g %.4g %.4g\nKs 0 0 0\nillum 1\n", toLinear(c[0]), toLinear(c[1]), toLinear(c[2]));
        }
        out.close();
    }
    Output out(path);
    if (materialFile) out.text("mtllib " + library.substr(library.find_last_of('/') + 1) + "\n");
    size_t first = 1;
    for (const MeshObject& o : objects) {
        out.text("o " + o.name + "\n");
        if (materialFile) out.text("usemtl " + materialName(o) + "\n");
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

void writeOff(const std::string& path, const std::vector<MeshObject>& objects) {
    size_t vertices = 0, faces = 0;
    for (const MeshObject& o : objects) vertices += o.mesh.points.size(), faces += o.mesh.triangles.size();
    Output out(path);
    out.print("OFF\n%zu %zu 0\n", vertices, faces);
    for (const MeshObject& o : objects)
        for (const Vec3& p : o.mesh.points) out.print("%.9g %.9g %.9g\n", p[0], p[1], p[2]);
    int first = 0;
    for (const MeshObject& o : objects) {
        for (const Triangle& t : o.mesh.triangles) out.print("3 %d %d %d\n", first + t[0], first + t[1], first + t[2]);
        first += int(o.mesh.points.size());
    }
    out.close();
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

void writeMesh(const std::string& path, const std::vector<MeshObject>& objects, const MeshFileOptions& options) {
    const std::string ending = path.substr(path.find_last_of('.') + 1);
    if (ending == "obj")
        writeObj(path, objects, options.materialFile);
    else if (ending == "ply")
        writePly(path, objects);
    else if (ending == "stl")
        writeStl(path, objects);
    else if (ending == "off")
        writeOff(path, objects);
    else if (ending == "glb")
        writeGlb(path, objects, options.metresPerUnit);
    else if (ending == "3mf")
        write3mf(path, objects, options.metresPerUnit);
    else if (ending == "usda")
        writeUsda(path, objects, options);
    else
        checkMeshName(path);
}

}  // namespace pavel
