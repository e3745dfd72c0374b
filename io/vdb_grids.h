#pragma once
// Internal: it pulls in OpenVDB.
#include <openvdb/openvdb.h>

#include "pavel/io/vdb_file.h"

namespace pavel {

/// Writes grids with the file's metadata and a UUID that depends on the scene alone.
/// @throws RunError where the file cannot be written
void writeGrids(const std::string& path, const openvdb::GridPtrVec& grids, const VdbOptions& options);

}  // namespace pavel
