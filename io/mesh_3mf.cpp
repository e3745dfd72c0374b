#include <Model/COM/NMR_DLLInterfaces.h>

#include <memory>

#include "pavel/io/mesh_formats.h"

namespace pavel {
namespace {

/// Owner of one of the library's objects.
template <class T>
class Handle {
  public:
    Handle() = default;
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle() {
        if (pointer_) NMR::lib3mf_release(pointer_);
    }
    T** out() { return &pointer_; }
    operator T*() const { return pointer_; }

  private:
    T* pointer_ = nullptr;
};

void require(LIB3MFRESULT result, const std::string& path) {
    if (result != 0) throwWriteFailed(path);
}

DWORD unitOf(double metres, double& scale) {
    scale = 1;
    for (const auto& [length, unit] :
         {std::make_pair(1e-6, NMR::MODELUNIT_MICROMETER), std::make_pair(1e-3, NMR::MODELUNIT_MILLIMETER),
          std::make_pair(1e-2, NMR::MODELUNIT_CENTIMETER), std::make_pair(0.0254, NMR::MODELUNIT_INCH),
          std::make_pair(0.3048, NMR::MODELUNIT_FOOT), std::make_pair(1.0, NMR::MODELUNIT_METER)})
        if (std::abs(metres - length) < 1e-9 * length) return DWORD(unit);
    scale = metres / 1e-3;
    return DWORD(NMR::MODELUNIT_MILLIMETER);
}

NMR::MODELMESHCOLOR_SRGB colorOf(const Vec3& c) {
    NMR::MODELMESHCOLOR_SRGB out;
    out.m_Red = toByte(c[0]), out.m_Green = toByte(c[1]), out.m_Blue = toByte(c[2]), out.m_Alpha = 255;
    return out;
}

/// The library would draw random ids; equal input shall give equal files.
std::string uuid(int kind, size_t number) {
    char text[40];
    std::snprintf(text, sizeof text, "%08x-0000-4000-8000-%012zx", unsigned(kind), number);
    return text;
}

/// One object of the build, with its colours.
void addObject(NMR::PLib3MFModel* model, const MeshObject& o, size_t number, double scale, const std::string& path) {
    std::vector<NMR::MODELMESHVERTEX> vertices;
    vertices.reserve(o.mesh.points.size());
    for (const Vec3& p : o.mesh.points)
        vertices.push_back({{float(scale * p[0]), float(scale * p[1]), float(scale * p[2])}});
    std::vector<NMR::MODELMESHTRIANGLE> triangles;
    triangles.reserve(o.mesh.triangles.size());
    for (const Triangle& t : o.mesh.triangles) triangles.push_back({{DWORD(t[0]), DWORD(t[1]), DWORD(t[2])}});
    Handle<NMR::PLib3MFModelMeshObject> object;
    require(NMR::lib3mf_model_addmeshobject(model, object.out()), path);
    require(NMR::lib3mf_object_setnameutf8(object, o.name.c_str()), path);
    require(NMR::lib3mf_object_setuuidutf8(object, uuid(1, number).c_str()), path);
    require(NMR::lib3mf_meshobject_setgeometry(object, vertices.data(), DWORD(vertices.size()), triangles.data(),
                                               DWORD(triangles.size())),
            path);
    Handle<NMR::PLib3MFDefaultPropertyHandler> all;
    require(NMR::lib3mf_object_createdefaultpropertyhandler(object, all.out()), path);
    NMR::MODELMESHCOLOR_SRGB color = colorOf(o.color);
    require(NMR::lib3mf_defaultpropertyhandler_setcolor(all, &color), path);
    if (!o.vertexLook.empty()) {
        // One colour for each triangle: slicers do not blend.
        std::vector<NMR::MODELMESHCOLOR_SRGB> colors;
        for (const Triangle& t : o.mesh.triangles) colors.push_back(colorOf(o.looks[o.solidLook(t)].color));
        Handle<NMR::PLib3MFPropertyHandler> each;
        require(NMR::lib3mf_meshobject_createpropertyhandler(object, each.out()), path);
        require(NMR::lib3mf_propertyhandler_setsinglecolorarray(each, colors.data()), path);
    }
    Handle<NMR::PLib3MFModelBuildItem> item;
    require(NMR::lib3mf_model_addbuilditem(model, object, nullptr, item.out()), path);
    require(NMR::lib3mf_builditem_setuuidutf8(item, uuid(2, number).c_str()), path);
}

class ThreeMfWriter : public MeshWriter {
  public:
    ThreeMfWriter(const std::string& path, double metresPerUnit) : path_(path) {
        require(NMR::lib3mf_createmodel(model_.out()), path);
        require(NMR::lib3mf_model_setunit(model_, unitOf(metresPerUnit, scale_)), path);
        require(NMR::lib3mf_model_addmetadatautf8(model_, "Application", "Pavel"), path);
    }
    void add(const MeshObject& o) override {
        ++objects_;
        if (!o.mesh.triangles.empty()) addObject(model_, o, objects_, scale_, path_);
    }
    void finish() override {
        require(NMR::lib3mf_model_setbuilduuidutf8(model_, uuid(3, objects_).c_str()), path_);
        Handle<NMR::PLib3MFModelWriter> writer;
        require(NMR::lib3mf_model_querywriter(model_, "3mf", writer.out()), path_);
        if (NMR::lib3mf_writer_writetofileutf8(writer, path_.c_str()) != 0) {
            DWORD code = 0;
            LPCSTR message = nullptr;
            NMR::lib3mf_getlasterror(writer, &code, &message);
            throw RunError(path_ + ": writing failed (" + (message && *message ? message : "is the disk full?") + ")");
        }
    }

  private:
    std::string path_;
    Handle<NMR::PLib3MFModel> model_;
    double scale_ = 1;
    size_t objects_ = 0;
};

}  // namespace

std::unique_ptr<MeshWriter> open3mf(const std::string& path, double metresPerUnit) {
    return std::make_unique<ThreeMfWriter>(path, metresPerUnit);
}

}  // namespace pavel
