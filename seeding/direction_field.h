#pragma once
// Direction fields on a surface: the smoothest there is, or following curvature, an axis or strokes (F. Knöppel, K.
// Crane, U. Pinkall, P. Schröder, Globally optimal direction fields, 2013).
#include <memory>
#include <vector>

#include "pavel/core/scene.h"
#include "pavel/seeding/surface.h"
#include "pavel/seeding/tangent_frames.h"

namespace pavel {

class DirectionField {
  public:
    /// @param symmetry 1: directions, 2: lines (a direction and its opposite are the same), 4: crosses
    /// @throws InputError where strokes lie nowhere near the surface
    DirectionField(const Surface& surface, const FieldOptions& options, int symmetry);

    int symmetry() const { return symmetry_; }
    const TangentFrames& frames() const { return frames_; }
    /// Angle of one of the field's directions in the polar coordinates of a vertex of frames().mesh().
    double angle(int vertex) const { return angle_[size_t(vertex)]; }
    /// One of the field's directions at a point, a unit tangent of its triangle.
    Vec3 at(const SurfacePoint& p) const;
    /// How often the field turns around each triangle, in 1 / symmetry turns; 0 but at singularities.
    std::vector<int> indices() const;

  private:
    int symmetry_;
    TangentFrames frames_;
    std::vector<double> angle_;
};

}  // namespace pavel
