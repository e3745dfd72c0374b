#pragma once
// The meshes that a run leaves.
#include "pavel/core/run_context.h"
#include "pavel/core/scene.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_write.h"
#include "pavel/tools/objects.h"
#include "pavel/vdb/pack.h"

namespace pavel {

/// Triangles before and after remeshing.
struct MeshCounts {
    uint64_t extracted = 0, final = 0;
};

/// All as one object, coloured by element. Times itself as the stage extract.
MeshObject fusedMesh(const Packing& packing, const std::vector<ElementKind>& kinds,
                     const std::vector<PlacedElement>& placed, const BaseLook& baseLook, const OutputOptions& options,
                     RunContext& context);
/// Writes it in one of the formats.
void writeFused(const AtomicOutput& out, const std::string& format, const std::vector<MeshObject>& fused,
                const OutputOptions& options, double metresPerUnit);
/// Writes an object for each element and the base, in all formats; STL has no objects, so it gets a file for each. They
/// are extracted, remeshed to their shares of the surface where that is asked for, written and dropped one after the
/// other: a few are held. Times itself, files included, as the stage extract or, where it remeshes, remesh.
MeshCounts writeSeparate(const AtomicOutput& out, const Packing& packing, const std::vector<ElementKind>& kinds,
                         const std::vector<PlacedElement>& placed, const BaseLook& baseLook,
                         const OutputOptions& options, double metresPerUnit, RunContext& context);
/// An object for each element that is not swallowed, each a little lighter or darker than its kind: for pictures.
std::vector<MeshObject> elementObjects(const Packing& packing, const std::vector<ElementKind>& kinds,
                                       const std::vector<PlacedElement>& placed);
/// Remeshes all objects to `vertices` in sum, each to its share of the area. Where they have no more they stay as they
/// are, the context is warned, and false comes back.
bool remeshObjects(std::vector<MeshObject>& objects, size_t vertices, RunContext& context);
/// Remeshes what fusedMesh made, as the options say.
void remeshFused(const Packing& packing, std::vector<MeshObject>& fused, const OutputOptions& options,
                 RunContext& context);

}  // namespace pavel
