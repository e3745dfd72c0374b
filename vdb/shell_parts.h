#pragma once
// Which elements of a decoration are printed together (paper, Printable shells).
#include <vector>

#include "pavel/core/mesh.h"
#include "pavel/core/scene.h"

namespace pavel {

/// The elements as clustering sees them. World frame, scene units; all by index.
struct ShellGraph {
    std::vector<int> id;                 ///< of the element, for messages; swallowed ones are left out
    std::vector<Vec3> position, normal;  ///< centre and outward direction
    std::vector<Bounds> bounds;
    std::vector<double> volume;
    std::vector<std::vector<int>> neighbours;    ///< that it touches, ascending
    std::vector<std::vector<Vec3>> backNormals;  ///< outward normals of the base under it
};

/// The direction in which a part comes off most easily: the one whose least cosine with the base's normals under the
/// part is largest, by M. Badoiu and K. Clarkson's steps towards the worst normal (2003).
struct Release {
    Vec3 direction{0, 0, 1};
    double undercut = 0;  ///< share of the part's back that leans over by more than two degrees
    /// Less than a half of a per cent is within the clearance and the grid's noise at edges of the base.
    bool free() const { return undercut < 0.005; }
};
Release releaseOf(const ShellGraph& graph, const std::vector<int>& members);

/// Members of each part. Parts are connected where the graph is, and balanced by volume.
/// auto: the least number of parts of which each fits the bed and comes off; where there is no such number up to 48,
/// one that fits, with few parts that do not come off. count: so many. planes: quarters about the vertical line through
/// the middle.
/// @throws InputError where more parts are asked for than elements
std::vector<std::vector<int>> shellParts(const ShellGraph& graph, const ShellOptions& options);
/// Takes elements that touch none of their own part to one that they touch.
std::vector<std::vector<int>> connected(const ShellGraph& graph, std::vector<int> partOf);

/// @throws InputError where an element alone is larger than the bed
void checkBed(const ShellGraph& graph, const Vec3& bed);
/// Does a part fit the bed, standing as it is?
bool fitsBed(const Bounds& bounds, const Vec3& bed);

}  // namespace pavel
