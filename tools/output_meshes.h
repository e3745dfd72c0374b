#pragma once
// The meshes that a run leaves.
#include <optional>

#include "pavel/core/run_context.h"
#include "pavel/core/scene.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_write.h"
#include "pavel/tools/objects.h"
#include "pavel/vdb/pack.h"

namespace pavel {

struct OutputMeshes {
    std::vector<MeshObject> objects;               ///< what is written
    std::optional<std::vector<MeshObject>> fused;  ///< for the picture, where the objects are apart
    uint64_t extractedTriangles = 0;               ///< before remeshing
};

/// One fused object, coloured by element, or one for each element and the base; remeshed where that is asked for: all
/// to so many vertices in sum, each to its share of the surface. Times itself as the stages extract and remesh.
OutputMeshes extractMeshes(const Packing& packing, const std::vector<ElementKind>& kinds,
                           const std::vector<PlacedElement>& placed, const BaseLook& baseLook,
                           const OutputOptions& options, RunContext& context);
/// An object for each element that is not swallowed, each a little lighter or darker than its kind: for pictures.
std::vector<MeshObject> elementObjects(const Packing& packing, const std::vector<ElementKind>& kinds,
                                       const std::vector<PlacedElement>& placed);
/// Remeshes all objects to `vertices` in sum, each to its share of the area. Where they have no more they stay as they
/// are, and the context is warned.
void remeshObjects(std::vector<MeshObject>& objects, size_t vertices, RunContext& context);
/// decoration.<format> for each format; STL has no objects, so it gets a file for each.
void writeMeshes(const AtomicOutput& out, const OutputOptions& options, const std::vector<MeshObject>& objects,
                 double metresPerUnit);

}  // namespace pavel
