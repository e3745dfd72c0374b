#pragma once
#include "pavel/seeding/triangulation.h"

namespace pavel {

/// Collapses short edges first, by rising thresholds, which leaves a sampling whose points keep their distance, all of
/// them vertices of the surface. Ends with `count` vertices, or with more where topology asks for them or, if
/// `faithful`, where no edge shorter than `spacing` can go without losing a part of the shape.
Triangulation coarsened(const Surface& surface, size_t count, double spacing, bool faithful);

}  // namespace pavel
