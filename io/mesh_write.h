#pragma once
// Meshes as files. OpenMesh's writers hold no named objects and refuse edges where solids touch, so OBJ, PLY and STL
// are written here; GLB goes through tinygltf.
#include <string>
#include <vector>

#include "pavel/core/frame.h"
#include "pavel/core/mesh.h"

namespace pavel {

struct MeshObject {
    std::string name;
    TriangleMesh mesh;
    Vec3 color{0.8, 0.8, 0.8};       ///< sRGB in [0, 1]
    std::vector<Vec3> vertexColors;  ///< sRGB; empty: `color` everywhere
    /// Where it stands, with a name each; none: as it is. GLB only, where the mesh is then stored once.
    std::vector<std::pair<std::string, Frame>> instances;
};

/// The ending decides: obj, ply, stl, glb. STL and PLY join all objects into one. Lengths as they are, z up; GLB in
/// metres, +Y up, as its standard says (`metresPerUnit`).
/// @throws RunError where the file cannot be written, InputError for an unknown ending
void writeMesh(const std::string& path, const std::vector<MeshObject>& objects, double metresPerUnit);

/// Endings that writeMesh knows.
const std::vector<std::string>& meshFormats();

}  // namespace pavel
