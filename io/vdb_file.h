#pragma once
// .vdb files for Houdini, Blender and the rest: standard grids, one transform, values in scene units.
#include <string>

#include "pavel/vdb/pack.h"

namespace pavel {

struct VdbOptions {
    bool half = false, fog = false;
    std::string units;
    std::string digest;  ///< of the scene, 32 hex digits: names the file's UUID, so that equal runs give equal files
};

/// `surface`, `base` and, where asked, `density`. Takes the two out of the packing, so that they are not held twice.
/// Returns what OpenVDB's own checks find wrong with them.
std::vector<std::string> writeDecorationVdb(const std::string& path, Packing& packing, const VdbOptions& options);
/// `element_id`: its own file, because some readers refuse a file with an Int32 grid.
void writeElementIdVdb(const std::string& path, const Packing& packing, const VdbOptions& options);
/// One level set per element, `element_00001` ..., with id, kind and volume as metadata, made, written and dropped one
/// after the other. Returns the same.
std::vector<std::string> writeElementsVdb(const std::string& path, const Packing& packing,
                                          const std::vector<std::string>& kindOfElement, const VdbOptions& options);

/// A surface mesh of the level sets in a file (all of them, or the one named `surface` where there is one), for
/// pictures.
TriangleMesh readVdbSurface(const std::string& path);

struct VdbGridInfo {
    std::string name, type, gridClass;
    double voxelSize = 0;
    uint64_t activeVoxels = 0, bytes = 0;
    Bounds bounds;  ///< of the active voxels, world
};
/// @throws InputError where the file is no .vdb
std::vector<VdbGridInfo> vdbInfo(const std::string& path);

}  // namespace pavel
