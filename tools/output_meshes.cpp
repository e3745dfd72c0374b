#include "pavel/tools/output_meshes.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "pavel/seeding/remesh.h"
#include "pavel/tools/objects.h"
#include "pavel/vdb/extract.h"

namespace pavel {
namespace {

MeshObject fusedObject(LabelledMesh fused, const std::vector<ElementKind>& kinds,
                       const std::vector<PlacedElement>& placed) {
    MeshObject object;
    object.name = object.material = "decoration";
    object.mesh = std::move(fused.mesh);
    object.vertexColors.assign(object.mesh.points.size(), kBaseColor);
    std::vector<char> decorated(object.mesh.points.size(), 0);
    for (size_t t = 0; t < fused.ids.size(); ++t) {
        const int id = fused.ids[t];
        if (id == 0) continue;
        const Vec3 c = elementColor(kinds[size_t(placed[size_t(id) - 1].kind)], id);
        for (int v : object.mesh.triangles[t])
            if (!decorated[size_t(v)]) object.vertexColors[size_t(v)] = c, decorated[size_t(v)] = 1;
    }
    return object;
}

std::vector<MeshObject> separateObjects(const Packing& packing, const std::vector<ElementKind>& kinds,
                                        const std::vector<PlacedElement>& placed, const OutputOptions& options) {
    std::vector<MeshObject> objects(placed.size());
    tbb::parallel_for(size_t(0), placed.size(), [&](size_t i) {
        const PlacedElement& p = placed[i];
        objects[i].mesh = extractElement(packing, p.id, options.adaptivity);
        objects[i].name = objectName(p.id, kinds[size_t(p.kind)].name);
        objects[i].color = kinds[size_t(p.kind)].color;
        objects[i].material = kinds[size_t(p.kind)].name;
    });
    objects.erase(
        std::remove_if(objects.begin(), objects.end(), [](const MeshObject& o) { return o.mesh.triangles.empty(); }),
        objects.end());
    if (options.withBase) {
        MeshObject base;
        base.name = "base";
        base.mesh = extractBase(packing, options.adaptivity);
        base.color = kBaseColor;
        base.material = "base";
        objects.push_back(std::move(base));
    }
    return objects;
}

void remeshObject(MeshObject& object, size_t vertices, const std::function<void(double)>& progress) {
    Remeshed fine = remeshed(object.mesh, vertices, progress);
    std::vector<Vec3> colors;
    if (!object.vertexColors.empty()) {
        colors.resize(fine.mesh.points.size());
        for (size_t t = fine.source.size(); t-- > 0;)
            for (int v : fine.mesh.triangles[t])
                colors[size_t(v)] = object.vertexColors[size_t(object.mesh.triangles[size_t(fine.source[t])][0])];
    }
    object.mesh = std::move(fine.mesh);
    object.vertexColors = std::move(colors);
}

}  // namespace

OutputMeshes extractMeshes(const Packing& packing, const std::vector<ElementKind>& kinds,
                           const std::vector<PlacedElement>& placed, const OutputOptions& options) {
    OutputMeshes out;
    const bool wanted = !options.mesh.empty();
    std::vector<MeshObject> fused;
    if ((wanted && !options.separate) || options.preview)
        fused.push_back(fusedObject(extractFused(packing, options.withBase, options.adaptivity), kinds, placed));
    if (!options.separate || !wanted) {
        out.objects = std::move(fused);
    } else {
        out.objects = separateObjects(packing, kinds, placed, options);
        out.fused = std::move(fused);
    }
    return out;
}

void remeshObjects(std::vector<MeshObject>& objects, size_t vertices, RunContext& context) {
    size_t had = 0;
    double area = 0;
    for (const MeshObject& o : objects) had += o.mesh.points.size(), area += meshArea(o.mesh);
    if (had <= vertices) {
        context.warn("output.remesh.vertices: the surface has only " + std::to_string(had) +
                     " vertices; it is left as it is");
        return;
    }
    tbb::parallel_for(size_t(0), objects.size(), [&](size_t i) {
        MeshObject& o = objects[i];
        const size_t share = std::max<size_t>(16, size_t(double(vertices) * meshArea(o.mesh) / area));
        if (share < o.mesh.points.size())
            remeshObject(o, share, [&](double part) {
                context.check();
                if (objects.size() == 1) context.progress("remesh", part);
            });
    });
    context.progress("remesh", 1);
}

void writeMeshes(const AtomicOutput& out, const OutputOptions& options, const std::vector<MeshObject>& objects,
                 double metresPerUnit) {
    MeshFileOptions file;
    file.metresPerUnit = metresPerUnit;
    file.materialFile = true;
    if (options.vdb) file.volume = "decoration.vdb";
    for (const std::string& format : options.mesh) {
        if (format == "stl" && options.separate) {
            for (const MeshObject& o : objects) writeMesh(out.place(o.name + ".stl"), {o}, file);
        } else {
            writeMesh(out.place("decoration." + format), objects, file);
        }
    }
}

}  // namespace pavel
