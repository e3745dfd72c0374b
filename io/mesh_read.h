#pragma once
#include "pavel/core/mesh.h"

namespace pavel {

/// Reads OBJ, PLY, STL or OFF (by its ending) through OpenMesh, gzip-compressed too (.obj.gz). Polygons are cut into
/// fans; nothing else is changed or dropped.
/// @throws InputError naming the file and what is wrong with it
TriangleMesh readMesh(const std::string& path);

}  // namespace pavel
