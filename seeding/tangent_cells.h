#pragma once
// Voronoi cells drawn in the seeds' tangent planes: a cheap stand-in for the restricted Voronoi diagram where a surface
// is smooth. Internal to this folder.
#include "pavel/seeding/restricted_voronoi.h"

namespace pavel {

class TangentCells {
  public:
    /// @param exact the seeds' cells on the surface; where the cell in the plane differs much (at creases, borders and
    ///        rims) it does not fit, and the seed rests
    TangentCells(const std::vector<SurfacePoint>& seeds, const std::vector<VoronoiCell>& exact);

    /// Even density. Some 20 times faster than on the surface. O(seeds), and O(seeds log seeds) where they
    /// have moved far since the last call.
    std::vector<VoronoiCell> cells(const std::vector<SurfacePoint>& seeds,
                                   std::vector<std::vector<int>>* neighbours = nullptr);
    /// Whether a seed's cell in the plane is like its cell on the surface.
    bool fits(size_t seed) const { return fit_[seed]; }
    /// The others rest: they have no cell, only neighbours have.
    void moveOnly(const std::vector<char>& moving);
    void moveAll();
    double spacing() const { return spacing_; }

  private:
    void updateNear(const std::vector<SurfacePoint>& seeds);

    static constexpr size_t kNear = 28;
    double spacing_ = 0;
    std::vector<char> fit_, resting_;
    std::vector<Vec3> reference_;  // where the seeds were when their lists were made
    std::vector<int> near_;        // kNear for each seed, nearest first, -1 where there are fewer
};

}  // namespace pavel
