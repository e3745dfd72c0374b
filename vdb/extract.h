#pragma once
// Meshes from packed grids.
#include "pavel/vdb/pack.h"

namespace pavel {

/// A vertex near a seam: whose it is (0: the base's), who is next, and how much of that one shows there: from 0 to 1/2
/// at the seam itself, evenly across it.
struct SeamVertex {
    int vertex = 0, id = 0, other = 0;
    float share = 0;
};

/// A mesh whose triangles carry the id of their element; 0: base. Where labels meet, `seams` know better.
struct LabelledMesh {
    TriangleMesh mesh;
    std::vector<int> ids;
    std::vector<SeamVertex> seams;  ///< by vertex, ascending
};

/// `adaptivity` everywhere: in [0, 1], larger triangles where the surface is flat.

/// One packed element; empty where it was swallowed. Closed, 2-manifold, world frame, scene units.
TriangleMesh extractElement(const Packing& packing, int id, double adaptivity = 0);
/// The base as voxelised.
TriangleMesh extractBase(const Packing& packing, double adaptivity = 0);
/// Narrow-band voxels of an element or (id 0) of the base: in proportion to its surface, and known without a mesh.
uint64_t surfaceVoxels(const Packing& packing, int id);
/// All elements fused into one solid, with the base if it was asked for in the packing; triangles labelled by element.
/// Before the elements are dropped. @throws RunError
LabelledMesh extractFused(const Packing& packing, bool withBase, double adaptivity = 0);
/// Whose the vertices of another mesh of that surface are: of all but those that are far from it. Before the elements
/// are dropped. @throws RunError
std::vector<SeamVertex> vertexOwners(const Packing& packing, bool withBase, const TriangleMesh& mesh);

/// Frees the grid of elements and base as one solid, or those of the elements: to make room when no mesh of them will
/// be asked for any more.
void dropSolid(Packing& packing);
void dropElements(Packing& packing);

}  // namespace pavel
