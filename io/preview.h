#pragma once
// Pictures of meshes, headless: a z-buffer with a shadow map, ambient occlusion from the depths, and supersampling.
#include <string>
#include <vector>

#include "pavel/io/mesh_write.h"

namespace pavel {

struct View {
    int width = 1200, height = 1000;
    double azimuthDegrees = -60, elevationDegrees = 18;  ///< of the camera, seen from the middle of the bounds; z up
    double zoom = 1;
    std::vector<std::string> labels{};  ///< numbers, by object: drawn on what is seen of it
    bool sharpCreases = false;          ///< shading breaks where neighbours differ by more than 40 degrees
};

/// @throws RunError where the file cannot be written
void renderPng(const std::string& path, const std::vector<MeshObject>& objects, const View& view = {});
/// Several views of one size side by side.
void renderPng(const std::string& path, const std::vector<MeshObject>& objects, const std::vector<View>& views);

}  // namespace pavel
