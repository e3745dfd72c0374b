#include "pavel/tools/output_meshes.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>

#include "pavel/seeding/remesh.h"
#include "pavel/tools/objects.h"
#include "pavel/vdb/extract.h"

namespace pavel {
namespace {

/// Gives vertices the looks that are theirs, blended near seams.
void colourSeams(MeshObject& object, const std::vector<SeamVertex>& seams) {
    constexpr int kSteps = 8;  // so that there are few looks
    std::map<std::array<int, 3>, uint32_t> blends;
    for (const SeamVertex& s : seams) {
        uint32_t& l = object.vertexLook[size_t(s.vertex)] = uint32_t(s.id);
        const int step = int(std::lround(kSteps * s.share));
        if (step == 0) continue;
        const auto [known, isNew] = blends.try_emplace({s.id, s.other, step}, uint32_t(object.looks.size()));
        l = known->second;
        if (!isNew) continue;
        const MeshLook::Blend blend{uint32_t(s.id), uint32_t(s.other), double(step) / kSteps};
        const MeshLook own = object.looks[blend.own], other = object.looks[blend.other];
        object.looks.push_back({own.color + blend.share * (other.color - own.color), own.finish, blend});
    }
}

MeshObject fusedObject(LabelledMesh fused, const std::vector<ElementKind>& kinds,
                       const std::vector<PlacedElement>& placed, const BaseLook& baseLook) {
    MeshObject object;
    object.name = object.material = "decoration";
    object.mesh = std::move(fused.mesh);
    object.looks.resize(placed.size() + 1);  // by id, the base first
    object.looks[0] = {baseLook.color, baseLook.finish};
    for (const PlacedElement& p : placed) {
        const ElementKind& kind = kinds[size_t(p.kind)];
        object.looks[size_t(p.id)] = {elementColor(kind, p.id), kind.finish};
    }
    object.vertexLook.assign(object.mesh.points.size(), 0);
    for (size_t t = 0; t < fused.ids.size(); ++t)
        for (int v : object.mesh.triangles[t])
            if (uint32_t& l = object.vertexLook[size_t(v)]; l == 0) l = uint32_t(fused.ids[t]);
    colourSeams(object, fused.seams);
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

MeshFileOptions meshFileOptions(const OutputOptions& options, double metresPerUnit) {
    MeshFileOptions file;
    file.metresPerUnit = metresPerUnit;
    file.materialFile = true;
    if (options.vdb) file.volume = "decoration.vdb";
    return file;
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

MeshObject fusedMesh(const Packing& packing, const std::vector<ElementKind>& kinds,
                     const std::vector<PlacedElement>& placed, const BaseLook& baseLook, const OutputOptions& options,
                     RunContext& context) {
    const StageTimer timer(context, "extract");
    return fusedObject(extractFused(packing, options.withBase, options.adaptivity), kinds, placed, baseLook);
}

MeshCounts writeSeparate(const AtomicOutput& out, const Packing& packing, const std::vector<ElementKind>& kinds,
                         const std::vector<PlacedElement>& placed, const BaseLook& baseLook,
                         const OutputOptions& options, double metresPerUnit, RunContext& context) {
    std::vector<Part> parts = elementParts(packing, kinds, placed);
    if (options.withBase) {
        parts.emplace_back();
        parts.back().object.name = parts.back().object.material = "base";
        parts.back().object.color = baseLook.color;
        parts.back().object.finish = baseLook.finish;
    }
    const StageTimer timer(context, options.remeshVertices ? "remesh" : "extract");
    double surface = 0;
    for (const Part& p : parts) surface += double(surfaceVoxels(packing, p.id));
    std::atomic<uint64_t> vertices{0}, left{0}, triangles{0};
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
    const MeshFileOptions file = meshFileOptions(options, metresPerUnit);
    std::vector<std::unique_ptr<MeshWriter>> writers;
    bool stl = false;
    for (const std::string& format : options.mesh) {
        if (format == "stl")
            stl = true;
        else
            writers.push_back(openMesh(out.place("decoration." + format), file));
    }
    MeshCounts counts;
    const auto write = [&](Part& part) {
        MeshObject o = std::move(part.object);
        if (o.mesh.triangles.empty()) return;
        counts.final += o.mesh.triangles.size();
        for (const auto& writer : writers) writer->add(o);
        if (!stl) return;
        const std::string path = out.place(o.name + ".stl");
        writeMesh(path, {std::move(o)}, file);
    };
    // In order, and no more of them at once than keep all threads busy.
    const auto atOnce = size_t(3 * tbb::this_task_arena::max_concurrency());
    size_t next = 0;
    const auto take = [&](tbb::flow_control& flow) -> Part* {
        if (next == parts.size()) {
            flow.stop();
            return nullptr;
        }
        return &parts[next++];
    };
    // A thread that waits within one does not begin another.
    const auto makeAlone = [&](Part* part) {
        tbb::this_task_arena::isolate([&] { make(*part); });
        return part;
    };
    tbb::parallel_pipeline(atOnce, tbb::make_filter<void, Part*>(tbb::filter_mode::serial_in_order, take) &
                                       tbb::make_filter<Part*, Part*>(tbb::filter_mode::parallel, makeAlone) &
                                       tbb::make_filter<Part*, void>(tbb::filter_mode::serial_in_order,
                                                                     [&](Part* part) { write(*part); }));
    for (const auto& writer : writers) writer->finish();
    if (options.remeshVertices && vertices <= *options.remeshVertices)
        context.warn("output.remesh.vertices: the surface has only " + std::to_string(vertices) + " vertices; " +
                     std::to_string(left) + " are left");
    counts.extracted = triangles;
    return counts;
}

void writeFused(const AtomicOutput& out, const std::string& format, const std::vector<MeshObject>& fused,
                const OutputOptions& options, double metresPerUnit) {
    writeMesh(out.place("decoration." + format), fused, meshFileOptions(options, metresPerUnit));
}

bool remeshObjects(std::vector<MeshObject>& objects, size_t vertices, RunContext& context) {
    size_t had = 0;
    double area = 0;
    for (const MeshObject& o : objects) had += o.mesh.points.size(), area += meshArea(o.mesh);
    if (had <= vertices) {
        context.warn("output.remesh.vertices: the surface has only " + std::to_string(had) +
                     " vertices; it is left as it is");
        return false;
    }
    tbb::parallel_for(size_t(0), objects.size(), [&](size_t i) {
        MeshObject& o = objects[i];
        remeshToShare(o, double(vertices) * meshArea(o.mesh) / area, [&](double part) {
            context.check();
            if (objects.size() == 1) context.progress("remesh", part);
        });
    });
    context.progress("remesh", 1);
    return true;
}

void remeshFused(const Packing& packing, std::vector<MeshObject>& fused, const OutputOptions& options,
                 RunContext& context) {
    if (!remeshObjects(fused, *options.remeshVertices, context)) return;
    for (MeshObject& o : fused) {
        for (uint32_t& l : o.vertexLook)
            if (const auto& blend = o.looks[l].blend) l = blend->own;
        const auto isBlend = [](const MeshLook& l) { return l.blend.has_value(); };
        o.looks.erase(std::find_if(o.looks.begin(), o.looks.end(), isBlend), o.looks.end());
        // Edges run along creases: what was carried over from triangles would tell nothing about vertices there.
        colourSeams(o, vertexOwners(packing, options.withBase, o.mesh));
    }
}

}  // namespace pavel
