#pragma once
// Ways to sweep closed meshes, shared by the built-in shapes.
#include <functional>
#include <utility>
#include <vector>

#include "pavel/core/mesh.h"

namespace pavel {

/// A closed surface with two poles: at(u, v), u in [0,1] from pole to pole, v in [0,1) around. Counter-clockwise seen
/// from outside when v turns counter-clockwise about the direction from the u=1 pole to the u=0 pole.
TriangleMesh sweepPoles(int rows, int columns, const std::function<Vec3(double u, double v)>& at);

/// A closed surface of torus type: at(u, v), both periodic in [0,1).
TriangleMesh sweepPeriodic(int rows, int columns, const std::function<Vec3(double u, double v)>& at);

struct ProfilePoint {
    double r, z;
    int group;
};
/// Revolves a profile about z. It starts and ends on the axis (r = 0) and runs so that the solid lies to its left
/// (from the bottom, outside, up, and back inside). A segment belongs to the group of its first point.
TriangleMesh revolve(const std::vector<ProfilePoint>& profile, int steps, std::vector<std::string> groupNames);

}  // namespace pavel
