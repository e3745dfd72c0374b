#pragma once
// Packing: placed elements that overlap become packed elements that fit, each with its volume back.
#include <memory>
#include <vector>

#include "pavel/core/placement.h"
#include "pavel/core/run_context.h"

namespace pavel {

struct PackedGrids;  // packed_grids.h: the OpenVDB side

struct PackOptions {
    double voxelSize = 1;                                 ///< h, scene units
    double a = 0.1, b = 0.3;                              ///< volume recovery function, shares of an element's size
    std::vector<std::pair<double, double>> kindMaterial;  ///< a, b by kind; empty: the two above for all
    /// Voxels across the thinnest element on the grid that fronts march on, at least. Arrival times are smooth, so that
    /// a grid up to 8 times coarser than the result will do; infinity: march on the result's own grid.
    double marchAcross = 12;
    /// A contested point goes to the element it lies deeper in, else (paper) to the one whose centre is nearer. For
    /// equal spheres these are the same; where a tip meets a flank, the centre gives the flank the whole tip.
    bool contactByDepth = true;
    double gap = 0;               ///< clearance left between elements and to the base, scene units
    bool recoverBaseLoss = true;  ///< what lies in the base grows back; else it is cut
    bool surface = true;          ///< make the fused surface and the ids
    bool solidWithBase = false;   ///< the base is wanted: by itself, and where `surface` is, fused with the elements
};

/// Volumes in scene units^3, one sub-voxel measure throughout.
struct ElementResult {
    int id = 0;
    double initialVolume = 0, targetVolume = 0, lostVolume = 0, finalVolume = 0, unrecoveredVolume = 0;
    std::vector<int> contacts;  ///< ids
    double widenedB = 0;        ///< the b it needed, where that is more than the material's; else 0
};

/// Voxels of the result. Where fronts march on a coarser grid (PackOptions::marchAcross), grown voxels are counted on
/// that one and taken to the result's, and decoration and overlap voxels come from the volumes.
struct PackCounts {
    uint64_t decorationVoxels = 0, overlapVoxels = 0, baseVoxels = 0, grownVoxels = 0, activeVoxels = 0;
};

struct Packing {
    std::vector<ElementResult> elements;
    PackCounts counts;
    double voxelSize = 1;
    std::shared_ptr<PackedGrids> grids;
};

/// @param base a closed solid
/// Rigid elements (ElementKind::stiffness) are only cut by the base and by each other, and do not grow.
/// @throws RunError; Interrupted when the context is cancelled
/// Elements that are swallowed or walled in are named in the context's warnings and in their results. The result does
/// not depend on the number of threads. Memory follows the elements' surfaces and the regrown volume.
Packing pack(const TriangleMesh& base, const std::vector<ElementKind>& kinds, const std::vector<PlacedElement>& placed,
             const PackOptions& options, RunContext& context);

/// How many times coarser than the result the grid is that fronts march on: 1 to 8.
/// @param across voxels of the result across the thinnest element
/// @param rise voxels of the result from a contact to where growth is fastest, a * size, the least of all elements: on
/// the coarser grid there are at least three
/// @param advance how far a front goes there, in terms of rise: the farther, the finer, up to six
int marchingFactor(double across, double rise, double marchAcross = PackOptions().marchAcross, double advance = 0);

/// Extent of the elements in voxels, and where they would leave the range that indices and floats can hold.
/// @throws InputError where the voxel size or the gap does not suit the scene
void checkVoxelSize(const TriangleMesh& base, const std::vector<ElementKind>& kinds, double voxelSize, double gap,
                    RunContext& context);

}  // namespace pavel
