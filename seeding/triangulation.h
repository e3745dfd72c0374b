#pragma once
// Internal: the connectivity that remeshing works on, with the steps that keep its topology.
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <vector>

#include "pavel/seeding/surface.h"

namespace pavel {

struct TriangulationTraits : OpenMesh::DefaultTraits {
    VertexAttributes(OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    FaceAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
};
using Connectivity = OpenMesh::TriMesh_ArrayKernelT<TriangulationTraits>;

/// Fit to be a triangulation: fans that touch in a vertex get one each.
/// @throws InputError where an edge has more than two triangles, or neighbours face opposite ways
TriangleMesh manifold(const TriangleMesh& mesh);

/// Triangles whose vertices have their places outside of the connectivity.
class Triangulation {
  public:
    using Halfedge = OpenMesh::HalfedgeHandle;
    using Vertex = OpenMesh::VertexHandle;

    Triangulation() = default;
    explicit Triangulation(const TriangleMesh& mesh);
    /// @param neighbours of its triangles, as triangleNeighbours
    Triangulation(const TriangleMesh& mesh, const std::vector<std::array<int, 3>>& neighbours);

    Connectivity mesh;
    std::vector<Vec3> place;
    size_t vertices = 0;  ///< that are left

    const Vec3& at(Vertex v) const { return place[size_t(v.idx())]; }
    bool straightAt(Vertex v) const;
    bool keepsTopology(Halfedge h) const;
    bool branches(Vertex v) const;
    /// Merges a half-edge's first vertex into its second, where that keeps the topology, turns no triangle by more than
    /// the angle of this cosine, and leaves no edge longer than `longest`.
    bool collapse(Halfedge h, double longest, double turn);
    /// The other diagonal of the two triangles around an edge, where topology allows.
    bool flip(OpenMesh::EdgeHandle e);
    void connect(const std::vector<Triangle>& triangles, const std::vector<std::array<int, 3>>& neighbours);
    /// What is left, with numbers from 0 on; `kept`: the old numbers of its vertices.
    TriangleMesh compact(std::vector<int>& kept) const;
};

}  // namespace pavel
