#pragma once
// Evenly spaced stripes along a direction field (F. Knöppel, K. Crane, U. Pinkall, P. Schröder, Stripe patterns on
// surfaces, 2015): a phase on the surface whose gradient follows the field at a given frequency as well as one can.
// Other than there phases have the same weight everywhere, so that stripes that converge give way to fewer ones.
//
// The field is one of lines, so phases are defined up to their sign: carried from vertex to vertex they keep it or
// change it. A triangle around which they change it an odd number of times holds a singularity of the field; one around
// which the phase grows by whole turns holds a dislocation, where stripes begin or end.
#include <array>
#include <vector>

#include "pavel/seeding/direction_field.h"

namespace pavel {

/// Phases around a triangle, from its first corner over the others back to the first, each in the sheet of the first:
/// the last is the first plus whole turns, or where `flipped` its mirror image.
struct TrianglePhases {
    std::array<double, 4> corner{};
    bool flipped = false;
    /// Whole turns by which the phase grows around the triangle.
    int turns() const;
};

/// Finds stripe patterns along one field.
class StripeSolver {
  public:
    /// @param field of lines (symmetry 2); must outlive the solver
    explicit StripeSolver(const DirectionField& field);

    /// @param turned angle in radians from the field to the phase's gradient
    /// @param spacing distance between stripes
    /// @return the phases around every triangle; may be called from several threads. O(vertices^1.5)
    std::vector<TrianglePhases> solve(double turned, double spacing) const;

  private:
    const DirectionField& field_;
    std::vector<double> mass_;
};

}  // namespace pavel
