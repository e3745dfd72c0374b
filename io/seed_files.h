#pragma once
// Seeds for other programs.
#include <string>

#include "pavel/core/placement.h"
#include "pavel/io/vdb_file.h"

namespace pavel {

/// Points with normal (nx ny nz), tangent (tx ty tz), rotation in degrees, scale, kind (index) and id; binary PLY.
/// @throws RunError where the file cannot be written
void writeSeedsPly(const std::string& path, const SeedSet& set);

/// VDB points as Houdini's copy to points reads them: P, id, orient (quaternion: +z to the normal, +x to the main
/// direction), pscale, kind; one grid, `seeds`.
void writeSeedsVdb(const std::string& path, const SeedSet& set, const VdbOptions& options);

/// The stripes as polylines of an OBJ, objects "main" and "across"; a closed one ends where it began.
void writeStripesObj(const std::string& path, const SeedSet& set);

}  // namespace pavel
