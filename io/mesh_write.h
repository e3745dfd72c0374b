#pragma once
// Meshes as files. OpenMesh's writers hold no named objects and refuse edges where solids touch, so OBJ, PLY, STL and
// OFF are written here, and so is USD's text. So is GLB: libraries hold the whole file in memory, several times. 3MF
// goes through lib3mf.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pavel/core/finish.h"
#include "pavel/core/frame.h"
#include "pavel/core/mesh.h"

namespace pavel {

struct MeshLook {
    Vec3 color{0.8, 0.8, 0.8};  ///< sRGB in [0, 1]
    Finish finish = Finish::clay;
    /// Of a blend of two other looks: the colour lies between theirs, the finish is the first's.
    struct Blend {
        uint32_t own = 0, other = 0;
        double share = 0;  ///< of the other
    };
    std::optional<Blend> blend{};
};

struct MeshObject {
    std::string name;
    TriangleMesh mesh;
    Vec3 color{0.8, 0.8, 0.8};  ///< sRGB in [0, 1]
    std::string material{};     ///< its name, one for each colour; empty: named by the colour
    Finish finish = Finish::clay;
    std::vector<MeshLook> looks;       ///< where colour and finish differ from place to place
    std::vector<uint32_t> vertexLook;  ///< which of `looks` each vertex has; empty: `color` and `finish` everywhere
    const Vec3& colorAt(size_t v) const { return vertexLook.empty() ? color : looks[vertexLook[v]].color; }
    /// Calls f(look, share) for the looks of a vertex without blends: one, or two of a blend. Only where vertices have
    /// looks.
    template <class F>
    void forEachLook(size_t v, F f) const {
        const auto& blend = looks[vertexLook[v]].blend;
        if (!blend) return f(vertexLook[v], 1.0);
        f(blend->own, 1 - blend->share);
        f(blend->other, blend->share);
    }
    /// The one that a triangle has most of.
    uint32_t solidLook(const Triangle& t) const;
    Finish finishOf(const Triangle& t) const { return vertexLook.empty() ? finish : looks[solidLook(t)].finish; }
    /// Where it stands, with a name each; none: as it is. GLB only, where the mesh is then stored once.
    std::vector<std::pair<std::string, Frame>> instances;
};

/// Gives an object another mesh, each of whose vertices takes the look of a vertex of the old one.
void replaceMesh(MeshObject& object, TriangleMesh mesh, const std::vector<int>& source);

struct MeshFileOptions {
    double metresPerUnit = 1e-3;  ///< GLB, 3MF and USD say how long a unit is
    bool materialFile = false;    ///< OBJ: write NAME.mtl beside it
    std::string volume{};         ///< USD: a .vdb file beside it whose grid `surface` it refers to
};

/// A mesh file that is written object by object, so that no more than one need be held (3MF: lib3mf holds all). Parts
/// whose place is not known before the end wait in files beside it.
class MeshWriter {
  public:
    MeshWriter() = default;
    MeshWriter(const MeshWriter&) = delete;
    MeshWriter& operator=(const MeshWriter&) = delete;
    virtual ~MeshWriter() = default;
    /// @throws RunError where the file cannot be written
    virtual void add(const MeshObject& object) = 0;
    /// Only now the file is whole. @throws RunError
    virtual void finish() = 0;
};

/// The ending decides: one of meshFormats(). STL, PLY and OFF join all objects into one; the others keep names and
/// colours. Lengths as they are, z up; GLB in metres, +Y up, as its standard says. Equal input gives equal bytes.
/// @throws RunError where the file cannot be written, InputError for an unknown ending
std::unique_ptr<MeshWriter> openMesh(const std::string& path, const MeshFileOptions& options = {});
/// All at once.
void writeMesh(const std::string& path, const std::vector<MeshObject>& objects, const MeshFileOptions& options = {});

/// Before the work: can openMesh write a file of this name?
/// @throws InputError for an unknown ending
void checkMeshName(const std::string& path);
/// Endings that openMesh knows, and the same for messages.
const std::vector<std::string>& meshFormats();
std::string meshFormatList();

}  // namespace pavel
