#pragma once
// Pictures of meshes, headless: a z-buffer with soft shadows, ambient occlusion from the depths, and supersampling.
#include <optional>
#include <string>
#include <vector>

#include "pavel/io/mesh_write.h"
#include "pavel/io/picture_file.h"
#include "pavel/io/raster.h"

namespace pavel {

struct View {
    int width = 1200, height = 1000;
    double azimuthDegrees = -60;               ///< of the camera, seen from the middle of the bounds; z up
    std::optional<double> elevationDegrees{};  ///< unset: 18; flat things are seen from higher up
    double zoom = 1;
    std::optional<Vec3> target{};       ///< in the picture's middle, world frame; unset: all is seen
    std::optional<CutPlane> cut{};      ///< what lies beyond is taken away; sections show closed
    std::vector<std::string> labels{};  ///< numbers, by object: drawn on what is seen of it
    bool sharpCreases = false;          ///< shading breaks where neighbours differ by more than 40 degrees
    bool transparent = false;           ///< no background
};

/// Some objects as seen in one way.
struct Panel {
    const std::vector<MeshObject>* objects = nullptr;
    View view;
};

/// The elevation that a view of these objects has.
double elevationOf(const View& view, const std::vector<MeshObject>& objects);
/// Unit, from the middle towards the camera.
Vec3 towardsCamera(const View& view, const std::vector<MeshObject>& objects);

/// A vertical plane through the middle of these bounds, turned a little from the camera.
CutPlane middleCut(const View& view, const Bounds& bounds);

/// PNG or JPEG, by the ending.
/// @throws RunError where the file cannot be written
void renderPicture(const std::string& path, const std::vector<MeshObject>& objects, const View& view = {});
/// Pictures of one size in rows of `columns`.
Picture rendered(const std::vector<Panel>& panels, int columns);
void renderPicture(const std::string& path, const std::vector<Panel>& panels, int columns);

}  // namespace pavel
