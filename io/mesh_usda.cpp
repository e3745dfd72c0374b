#include "pavel/io/mesh_formats.h"

namespace pavel {
namespace {

/// Names of prims hold letters, digits and underscores.
std::string primName(const std::string& name) {
    std::string out = name;
    for (char& c : out)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return out.empty() || std::isdigit(static_cast<unsigned char>(out[0])) ? "_" + out : out;
}

void writePrim(Output& out, const MeshObject& o) {
    const auto list = [&](const char* head, size_t count, const auto& item) {
        out.text(std::string("        ") + head + " = [");
        for (size_t i = 0; i < count; ++i) {
            if (i) out.text(i % 16 ? ", " : ",\n            ");
            item(i);
        }
        out.text("]\n");
    };
    const std::vector<Vec3>& points = o.mesh.points;
    const Bounds b = meshBounds(o.mesh);
    out.text("    def Mesh \"" + primName(o.name) + "\"\n    {\n");
    out.print("        float3[] extent = [(%.9g, %.9g, %.9g), (%.9g, %.9g, %.9g)]\n", b.min[0], b.min[1], b.min[2],
              b.max[0], b.max[1], b.max[2]);
    out.text("        uniform token subdivisionScheme = \"none\"\n");
    list("int[] faceVertexCounts", o.mesh.triangles.size(), [&](size_t) { out.text("3"); });
    list("int[] faceVertexIndices", o.mesh.triangles.size(), [&](size_t i) {
        const Triangle& t = o.mesh.triangles[i];
        out.print("%d, %d, %d", t[0], t[1], t[2]);
    });
    const auto tuple = [&](const Vec3& v, const char* format) { out.print(format, v[0], v[1], v[2]); };
    list("point3f[] points", points.size(), [&](size_t i) { tuple(points[i], "(%.9g, %.9g, %.9g)"); });
    // Linear, as USD takes colours.
    const auto color = [&](size_t i) {
        const Vec3 c = o.colorAt(i);
        tuple({toLinear(c[0]), toLinear(c[1]), toLinear(c[2])}, "(%.4g, %.4g, %.4g)");
    };
    list("color3f[] primvars:displayColor", o.vertexLook.empty() ? 1 : points.size(), color);
    if (!o.vertexLook.empty()) {
        out.text("        (\n            interpolation = \"vertex\"\n        )\n");
    }
    out.text("    }\n");
}

class UsdaWriter : public MeshWriter {
  public:
    UsdaWriter(const std::string& path, const MeshFileOptions& options) : out_(path), volume_(options.volume) {
        out_.print(
            "#usda 1.0\n(\n    defaultPrim = \"decoration\"\n    metersPerUnit = %.9g\n    upAxis = \"Z\"\n)\n\n",
            options.metresPerUnit);
        out_.text("def Xform \"decoration\"\n{\n");
    }
    void add(const MeshObject& o) override {
        if (!o.mesh.triangles.empty()) writePrim(out_, o);
    }
    void finish() override {
        if (!volume_.empty()) {
            out_.text("    def Volume \"volume\"\n    {\n        token visibility = \"invisible\"\n");
            out_.text("        rel field:surface = </decoration/volume/surface>\n");
            out_.text("        def OpenVDBAsset \"surface\"\n        {\n");
            out_.text("            asset filePath = @./" + volume_ + "@\n");
            out_.text("            token fieldName = \"surface\"\n            token fieldDataType = \"float\"\n");
            out_.text("            token fieldClass = \"levelSet\"\n        }\n    }\n");
        }
        out_.text("}\n");
        out_.close();
    }

  private:
    Output out_;
    std::string volume_;  // empty: none
};

}  // namespace

std::unique_ptr<MeshWriter> openUsda(const std::string& path, const MeshFileOptions& options) {
    return std::make_unique<UsdaWriter>(path, options);
}

}  // namespace pavel
