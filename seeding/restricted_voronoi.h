#pragma once
// Exact restricted Voronoi diagram: the partition of a surface by the nearest seed.
//
// Every triangle is clipped by the bisectors of all seeds that can own a part of it: those no farther from its centre
// than the nearest seed plus twice its circumscribed radius, which is the security radius of B. Levy and N. Bonneel
// (Variational anisotropic surface meshing with Voronoi parallel linear enumeration, 2013) applied to a triangle.
// Both sides of a thin wall are partitioned apart: a triangle belongs to seeds whose surface faces the same way, up to
// about 152 degrees, unless there are none; and a cell counts only the piece connected to its seed. Orphaned pieces are
// clipped again among the seeds that are connected to them, so that areas always sum to the surface's.
#include <utility>
#include <vector>

#include "pavel/seeding/surface.h"

namespace pavel {

/// Integrals over a cell; all but the area are weighted by the density.
struct VoronoiCell {
    double area = 0;
    double mass = 0;
    Vec3 moment{0, 0, 0};  ///< integral of x: centroid * mass
    double energy = 0;     ///< integral of |x - seed|^2
};

class RestrictedVoronoi {
  public:
    /// @param density one value above 0 for each triangle; empty: 1 everywhere
    explicit RestrictedVoronoi(const Surface& surface, std::vector<double> density = {});

    /// @param seeds points on the surface, each with the triangle it lies on
    /// @param neighbours where given, set to each cell's neighbours across an edge, in ascending order
    /// @return one cell per seed, equal for any number of threads and whatever was asked before. O((triangles + seeds)
    ///         log seeds) where triangles are not larger than cells (subdivideLongEdges); faster where the seeds have
    ///         moved little since the last call.
    std::vector<VoronoiCell> cells(const std::vector<SurfacePoint>& seeds,
                                   std::vector<std::vector<int>>* neighbours = nullptr);

  private:
    struct Search;
    struct Near {
        int seed = -1;
        double distance = 0;
    };
    using Candidate = std::pair<double, int>;  // squared distance, seed
    void updateNear(Search& search);
    void findCandidates(size_t triangle, int guess, const Search& search, std::vector<Candidate>& found) const;

    static constexpr size_t kNear = 24;       // seeds listed around every seed
    static constexpr double kFacing = -0.88;  // cosine of the angle at which a triangle no longer sees a seed
    const Surface& surface_;
    std::vector<double> density_;
    std::vector<Vec3> centre_;
    std::vector<double> radius_;   // of each triangle, about its centre
    std::vector<int> owner_;       // the seed nearest to each centre, last time
    std::vector<Vec3> reference_;  // where the seeds were when their lists were made
    std::vector<double> reach_;    // of each list: what was nearer is in it
    std::vector<Near> near_;       // kNear for each seed, nearest first
};

}  // namespace pavel
