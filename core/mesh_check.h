#pragma once
// Is a mesh fit to be voxelised? Facts first, then the safe repairs; what was done is reported, never silent.
#include <string>
#include <vector>

#include "pavel/core/mesh.h"

namespace pavel {

struct MeshFacts {
    size_t vertices = 0, triangles = 0, components = 0;
    size_t boundaryEdges = 0, nonManifoldEdges = 0, misorientedEdges = 0;
    size_t degenerateTriangles = 0, unusedVertices = 0, doubledVertices = 0;
    long euler = 0;
    Bounds bounds;
    double area = 0, volume = 0;
    bool closed() const { return boundaryEdges == 0 && nonManifoldEdges == 0; }
    bool fit() const { return closed() && misorientedEdges == 0 && volume > 0; }
};

MeshFacts meshFacts(const TriangleMesh& mesh);

/// Boundary loops as vertex rings, in the direction that would close the surface consistently.
std::vector<std::vector<int>> boundaryLoops(const TriangleMesh& mesh);

struct RepairOptions {
    bool fillHoles = false;
    /// Thickness that an open sheet is given inward, against its normals; 0: none.
    double thicken = 0;
};

/// Makes `mesh` a closed, outward oriented solid or says why it can't: welds vertices at equal places, drops degenerate
/// triangles and unused vertices, turns components that face inward; fills holes or thickens where asked.
/// @param name for messages, such as the file's path
/// @return what was done, a sentence each
/// @throws InputError naming the loops of an open mesh, or the fault
std::vector<std::string> makeSolid(TriangleMesh& mesh, const std::string& name, const RepairOptions& options = {});

/// Which connected part each triangle belongs to, from 0 on; parts are connected by shared vertices.
std::vector<int> triangleComponents(const TriangleMesh& mesh, size_t* count);

struct MeshPart {
    TriangleMesh mesh;        ///< without groups
    std::vector<int> source;  ///< for each of its triangles the number in the whole
};
/// The connected parts, each with its own vertices. O(triangles).
std::vector<MeshPart> connectedParts(const TriangleMesh& mesh);

}  // namespace pavel
