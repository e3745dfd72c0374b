#pragma once
// Meshes as files. OpenMesh's writers hold no named objects and refuse edges where solids touch, so OBJ, PLY, STL and
// OFF are written here, and so is USD's text; GLB goes through tinygltf, 3MF through lib3mf.
#include <string>
#include <vector>

#include "pavel/core/finish.h"
#include "pavel/core/frame.h"
#include "pavel/core/mesh.h"

namespace pavel {

struct MeshObject {
    std::string name;
    TriangleMesh mesh;
    Vec3 color{0.8, 0.8, 0.8};       ///< sRGB in [0, 1]
    std::string material{};          ///< its name, one for each colour; empty: named by the colour
    std::vector<Vec3> vertexColors;  ///< sRGB; empty: `color` everywhere
    Finish finish = Finish::clay;
    std::vector<Finish> vertexFinish;  ///< empty: `finish` everywhere
    /// Where it stands, with a name each; none: as it is. GLB only, where the mesh is then stored once.
    std::vector<std::pair<std::string, Frame>> instances;
};

/// Gives an object another mesh, each of whose vertices takes colour and finish of a vertex of the old one.
void replaceMesh(MeshObject& object, TriangleMesh mesh, const std::vector<int>& source);

struct MeshFileOptions {
    double metresPerUnit = 1e-3;  ///< GLB, 3MF and USD say how long a unit is
    bool materialFile = false;    ///< OBJ: write NAME.mtl beside it
    std::string volume{};         ///< USD: a .vdb file beside it whose grid `surface` it refers to
};

/// The ending decides: one of meshFormats(). STL, PLY and OFF join all objects into one; the others keep names and
/// colours. Lengths as they are, z up; GLB in metres, +Y up, as its standard says. Equal input gives equal bytes.
/// @throws RunError where the file cannot be written, InputError for an unknown ending
void writeMesh(const std::string& path, const std::vector<MeshObject>& objects, const MeshFileOptions& options = {});

/// Before the work: can writeMesh write a file of this name?
/// @throws InputError for an unknown ending
void checkMeshName(const std::string& path);
/// Endings that writeMesh knows, and the same for messages.
const std::vector<std::string>& meshFormats();
std::string meshFormatList();

}  // namespace pavel
