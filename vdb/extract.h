#pragma once
// Meshes from packed grids.
#include "pavel/vdb/pack.h"

namespace pavel {

/// A mesh whose triangles carry the id of their element; 0: base.
struct LabelledMesh {
    TriangleMesh mesh;
    std::vector<int> ids;
};

/// `adaptivity` everywhere: in [0, 1], larger triangles where the surface is flat.

/// One packed element; empty where it was swallowed. Closed, 2-manifold, world frame, scene units.
TriangleMesh extractElement(const Packing& packing, int id, double adaptivity = 0);
/// The base as voxelised.
TriangleMesh extractBase(const Packing& packing, double adaptivity = 0);
/// Narrow-band voxels of an element or (id 0) of the base: in proportion to its surface, and known without a mesh.
uint64_t surfaceVoxels(const Packing& packing, int id);
/// All elements fused into one solid, with the base if it was asked for in the packing; triangles labelled by element.
LabelledMesh extractFused(const Packing& packing, bool withBase, double adaptivity = 0);

/// Frees the grid of elements and base as one solid, or those of the elements: to make room when no mesh of them will
/// be asked for any more.
void dropSolid(Packing& packing);
void dropElements(Packing& packing);

}  // namespace pavel
