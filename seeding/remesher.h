#pragma once
// Internal: the state of a remeshing and its steps. See remesh.h.
#include <Eigen/Core>
#include <functional>

#include "pavel/seeding/remesh.h"
#include "pavel/seeding/triangulation.h"

namespace pavel {

/// What a vertex stands on; later ones are kept when two merge.
enum class Kind : char { smooth, crease, corner, boundary };

/// The planes of the triangles around a vertex, weighted by area, relative to it: a quadric.
struct Planes {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    Vec3 normal{0, 0, 0};
    double area = 0;
    /// The plane with normal n through the point `to`.
    void add(double area_, const Vec3& n, const Vec3& to);
    /// Another vertex's, which stands at `from`.
    void add(const Planes& o, const Vec3& from);
    /// Do they face so many ways that the surface must fold between them?
    bool folded() const;
    /// The way to the point nearest to all planes, in directions in which they differ by more than a share of the sum:
    /// 1 on a smooth surface, 2 at a crease, whose direction is `along`, 3 at a corner. At most so many, and not
    /// farther than `reach`.
    int solve(double share, int most, double reach, Vec3& move, Vec3& along) const;
};

struct Turns;

class Remesher {
  public:
    using Vertex = Triangulation::Vertex;
    using Halfedge = Triangulation::Halfedge;
    using Edge = OpenMesh::EdgeHandle;

    Remesher(TriangleMesh mesh, size_t vertices, double spacing)
        : surface_(std::move(mesh)), count_(vertices), spacing_(spacing) {
        const TriangleMesh& m = surface_.mesh();
        for (size_t t = 0; t < m.triangles.size(); ++t)
            middle_.push_back((m.corner(t, 0) + m.corner(t, 1) + m.corner(t, 2)) / 3);
    }

    Remeshed run(const std::function<void(double)>& progress);

  private:
    friend class PlaceFit;
    void startFrom(const Triangulation& dense);
    void standOn(std::vector<SurfacePoint> points);
    Vec3 normal(Vertex a, Vertex b, Vertex c) const { return cross(tri_.at(b) - tri_.at(a), tri_.at(c) - tri_.at(a)); }
    double cosineAt(Vertex v, Vertex a, Vertex b) const {
        return dot(normalized(tri_.at(a) - tri_.at(v)), normalized(tri_.at(b) - tri_.at(v)));
    }
    bool follows(Vertex a, Vertex b) const;
    bool wantsFlip(Edge e, bool byValence) const;
    bool evensValence(Vertex a, Vertex b, Vertex c, Vertex d) const;
    void flipEdges(bool byValence);
    double sharpestAround(Vertex v, const Vec3& p) const;
    bool facesOut(Vertex v, const Vec3& p) const;
    template <class Scores>
    bool improvePlace(Vertex v, std::initializer_list<double> reaches, const Turns& around, Scores scores);
    void improveAngles();
    void improveWorst();
    void fitPlaces();
    Vec3 centroidStep(Vertex v) const;
    Vec3 creaseStep(Vertex v) const;
    void relax();
    void assignTriangles();
    std::vector<Planes> planesAround() const;
    void findGrades(const std::vector<Planes>& planes);
    double gradeAt(Vertex v) const { return grade_.empty() ? 1 : grade_[size_t(on_[size_t(v.idx())].triangle)]; }
    void findCorners(const std::vector<Planes>& planes);
    void findCreases(bool classify);
    double lengthOf(Edge e) const;
    double relativeLengthOf(Edge e) const;
    bool fits(Vertex a, Vertex b, Vertex c) const;
    bool fits(Edge e) const;
    bool staysClose(Halfedge h) const;
    bool collapse(Edge e, double longest, double turn);
    void split(Edge e);
    void anneal();
    void meetCount();
    void dissolveTiny();
    void subdivide();
    void placeVertices();
    void settle(int rounds, const std::function<void(double)>& report);
    bool alive(Edge e) const { return !tri_.mesh.status(e).deleted(); }

    Surface surface_;
    size_t count_;
    double spacing_, fit_ = 0;
    Triangulation tri_;
    std::vector<SurfacePoint> on_;  // where each vertex stands on the surface
    std::vector<Kind> kind_;
    std::vector<Vec3> along_;    // of a crease
    std::vector<Vec3> optimum_;  // that the quadrics ask for
    std::vector<int> valence_;   // while edges are flipped
    std::vector<Vec3> middle_;   // of each triangle of the surface
    std::vector<int> owner_;     // nearest vertex of each triangle of the surface
    std::vector<double> grade_;  // how long edges are to be over each triangle of the surface, in spacings
};

}  // namespace pavel
