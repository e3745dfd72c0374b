#include "pavel/tools/output_meshes.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>

#include "pavel/seeding/remesh.h"
#include "pavel/tools/objects.h"
#include "pavel/vdb/extract.h"

namespace pavel {
namespace {

size_t triangleCount(const std::vector<MeshObject>& objects) {
    size_t n = 0;
    for (const MeshObject& o : objects) n += o.mesh.triangles.size();
    return n;
}

MeshObject fusedObject(LabelledMesh fused, const std::vector<ElementKind>& kinds,
                       const std::vector<PlacedElement>& placed, const BaseLook& baseLook) {
    MeshObject object;
    object.name = object.material = "decoration";
    object.mesh = std::move(fused.mesh);
    const size_t n = object.mesh.points.size();
    object.vertexColors.assign(n, baseLook.color);
    object.vertexFinish.assign(n, baseLook.finish);
    std::vector<char> decorated(n, 0);
    for (size_t t = 0; t < fused.ids.size(); ++t) {
        const int id = fused.ids[t];
        if (id == 0) continue;
        const ElementKind& kind = kinds[size_t(placed[size_t(id) - 1].kind)];
        const Vec3 c = elementColor(kind, id);
        for (int v : object.mesh.triangles[t]) {
            if (decorated[size_t(v)]) continue;
            object.vertexColors[size_t(v)] = c;
            object.vertexFinish[size_t(v)] = kind.finish;
            decorated[size_t(v)] = 1;
        }
    }
    const Finish first = n ? object.vertexFinish[0] : Finish::clay;
    if (std::all_of(object.vertexFinish.begin(), object.vertexFinish.end(), [&](Finish f) { return f == first; })) {
        object.finish = first;
        object.vertexFinish.clear();
    }
    return object;
}

void remeshObject(MeshObject& object, size_t vertices, const std::function<void(double)>& progress) {
    Remeshed fine = remeshed(object.mesh, vertices, progress);
    std::vector<int> nearest(fine.mesh.points.size(), 0);  // a vertex of the old mesh for each of the new
    for (size_t t = fine.source.size(); t-- > 0;)
        for (int v : fine.mesh.triangles[t]) nearest[size_t(v)] = object.mesh.triangles[size_t(fine.source[t])][0];
    replaceMesh(object, std::move(fine.mesh), nearest);
}

void remeshToShare(MeshObject& object, double vertices, const std::function<void(double)>& progress) {
    const size_t share = std::max<size_t>(16, size_t(vertices));
    if (share < object.mesh.points.size()) remeshObject(object, share, progress);
}

/// An element, or (id 0) the base, whose mesh is still to be extracted.
struct Part {
    int id = 0;
    MeshObject object;
};

std::vector<Part> elementParts(const Packing& packing, const std::vector<ElementKind>& kinds,
                               const std::vector<PlacedElement>& placed) {
    std::vector<Part> parts;
    for (const PlacedElement& p : placed) {
        if (surfaceVoxels(packing, p.id) == 0) continue;  // swallowed
        const ElementKind& kind = kinds[size_t(p.kind)];
        parts.emplace_back();
        parts.back().id = p.id;
        MeshObject& o = parts.back().object;
        o.name = objectName(p.id, kind.name);
        o.material = kind.name;
        o.color = kind.color;
        o.finish = kind.finish;
    }
    return parts;
}

void extract(const Packing& packing, double adaptivity, Part& part) {
    part.object.mesh = part.id ? extractElement(packing, part.id, adaptivity) : extractBase(packing, adaptivity);
}

std::vector<MeshObject> objectsOf(std::vector<Part> parts) {
    std::vector<MeshObject> objects;
    for (Part& p : parts)
        if (!p.object.mesh.triangles.empty()) objects.push_back(std::move(p.object));
    return objects;
}

}  // namespace

std::vector<MeshObject> elementObjects(const Packing& packing, const std::vector<ElementKind>& kinds,
                                       const std::vector<PlacedElement>& placed) {
    std::vector<Part> parts = elementParts(packing, kinds, placed);
    tbb::parallel_for(size_t(0), parts.size(), [&](size_t i) {
        extract(packing, 0, parts[i]);
        parts[i].object.color = elementColor(kinds[size_t(placed[size_t(parts[i].id) - 1].kind)], parts[i].id);
    });
    return objectsOf(std::move(parts));
}

OutputMeshes extractMeshes(const Packing& packing, const std::vector<ElementKind>& kinds,
                           const std::vector<PlacedElement>& placed, const BaseLook& baseLook,
                           const OutputOptions& options, RunContext& context) {
    OutputMeshes out;
    const bool wanted = !options.mesh.empty(), separate = wanted && options.separate;
    std::vector<MeshObject> fused;
    if ((wanted && !options.separate) || options.preview) {
        const StageTimer timer(context, "extract");
        fused.push_back(
            fusedObject(extractFused(packing, options.withBase, options.adaptivity), kinds, placed, baseLook));
    }
    if (!separate) {
        out.extractedTriangles = triangleCount(fused);
        if (wanted && options.remeshVertices) {
            const StageTimer timer(context, "remesh");
            remeshObjects(fused, *options.remeshVertices, context);
        }
        out.objects = std::move(fused);
        return out;
    }
    out.fused = std::move(fused);
    std::vector<Part> parts = elementParts(packing, kinds, placed);
    if (options.withBase) {
        parts.emplace_back();
        parts.back().object.name = parts.back().object.material = "base";
        parts.back().object.color = baseLook.color;
        parts.back().object.finish = baseLook.finish;
    }
    // One after the other, so that no more than a few are held as finely as they are extracted.
    const StageTimer timer(context, options.remeshVertices ? "remesh" : "extract");
    double surface = 0;
    for (const Part& p : parts) surface += double(surfaceVoxels(packing, p.id));
    std::atomic<uint64_t> triangles{0}, vertices{0}, left{0};
    const auto make = [&](Part& part) {
        context.check();
        extract(packing, options.adaptivity, part);
        triangles += part.object.mesh.triangles.size();
        vertices += part.object.mesh.points.size();
        if (options.remeshVertices)
            remeshToShare(part.object,
                          double(*options.remeshVertices) * double(surfaceVoxels(packing, part.id)) / surface,
                          [&](double) { context.check(); });
        left += part.object.mesh.points.size();
    };
    // A thread that waits within one does not begin another.
    tbb::parallel_for(size_t(0), parts.size(),
                      [&](size_t i) { tbb::this_task_arena::isolate([&] { make(parts[i]); }); });
    if (options.remeshVertices && vertices <= *options.remeshVertices)
        context.warn("output.remesh.vertices: the surface has only " + std::to_string(vertices) + " vertices; " +
                     std::to_string(left) + " are left");
    out.extractedTriangles = triangles;
    out.objects = objectsOf(std::move(parts));
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
        remeshToShare(o, double(vertices) * meshArea(o.mesh) / area, [&](double part) {
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
