#pragma once
#include "pavel/core/mesh.h"

namespace pavel {

/// About the same surface in few triangles, by edge collapses (meshoptimizer) that go no farther from it than two
/// hundredths of its extent; a mesh that has no more is left as it is. Groups are dropped.
TriangleMesh simplified(const TriangleMesh& mesh, size_t triangles);

}  // namespace pavel
