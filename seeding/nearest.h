#pragma once
#include <vector>

#include "pavel/seeding/surface.h"

namespace pavel {

/// For every point the indices of the `count` points nearest to it, nearest first, itself left out. O(n log n).
std::vector<std::vector<size_t>> nearestOf(const std::vector<SurfacePoint>& points, size_t count);

}  // namespace pavel
