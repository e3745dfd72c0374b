#pragma once
// Seeds for other programs.
#include <string>

#include "pavel/core/placement.h"
#include "pavel/core/scene.h"
#include "pavel/io/vdb_file.h"

namespace pavel {

/// Points with normal (nx ny nz), tangent (tx ty tz), rotation in degrees, scale, kind (index) and id; binary PLY.
/// @throws RunError where the file cannot be written
void writeSeedsPly(const std::string& path, const SeedSet& set);

/// Reads them back, also where another program has changed, added or left out properties: only positions are needed.
/// @param names of the element kinds, in order
/// @throws InputError naming the file and what is wrong with it
std::vector<PlacementOptions> readSeedsPly(const std::string& path, const std::vector<std::string>& names);

/// VDB points as Houdini's copy to points reads them: P, id, orient (quaternion: +z to the normal, +x to the main
/// direction), pscale, kind; one grid, `seeds`.
void writeSeedsVdb(const std::string& path, const SeedSet& set, const VdbOptions& options);

/// The stripes as polylines of an OBJ, objects "main" and "across"; a closed one ends where it began.
void writeStripesObj(const std::string& path, const SeedSet& set);

}  // namespace pavel
