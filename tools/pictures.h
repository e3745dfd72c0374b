#pragma once
// What pictures of a run show.
#include <string>
#include <vector>

#include "pavel/core/placement.h"
#include "pavel/core/scene.h"
#include "pavel/io/preview.h"

namespace pavel {

/// The scene's camera.
View sceneView(const Scene& scene);
MeshObject baseObject(const Scene& scene, const TriangleMesh& base);
/// The base and its stripes, where it has any.
std::vector<MeshObject> seededBase(const Scene& scene, const TriangleMesh& base, const SeedSet& seeds);
/// Elements as placed, each a lighter copy.
std::vector<MeshObject> placedElements(const std::vector<ElementKind>& kinds, const std::vector<PlacedElement>& placed);

/// Eight views as the paper's figures have them: seeds, elements as placed, the result, and its inner side without the
/// base; the kinds of elements, close views before and after, and a section.
/// @param packedBase the base as it was voxelised, in one piece
/// @param elements the result, an object each
void writeFigure(const std::string& path, const Scene& scene, const TriangleMesh& base,
                 const std::vector<ElementKind>& kinds, const SeedSet& seeds, const TriangleMesh& packedBase,
                 std::vector<MeshObject> elements);

}  // namespace pavel
