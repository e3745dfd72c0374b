#pragma once
#include <map>

#include "pavel/core/mesh.h"

namespace pavel {

/// Numbers that a file gives its vertices: "color" (brightness) and "red", "green", "blue" where it has vertex colours,
/// in [0, 1], and every property of a PLY by its name.
using VertexValues = std::map<std::string, std::vector<double>>;

/// Whether a name ends like that of a mesh that readMesh reads.
bool isMeshFile(const std::string& path);

/// Reads OBJ, PLY, STL or OFF (by its ending) through OpenMesh, gzip-compressed too (.obj.gz). Polygons are cut into
/// fans; nothing else is changed or dropped. Groups ("g") of an OBJ, or where it has none its materials ("usemtl"), are
/// the mesh's groups.
/// @throws InputError naming the file and what is wrong with it
TriangleMesh readMesh(const std::string& path, VertexValues* values = nullptr);

/// Reads the vertices of a PLY, which needs no faces, with all their properties, normals as "nx", "ny", "nz".
std::vector<Vec3> readPoints(const std::string& path, VertexValues& values);

}  // namespace pavel
