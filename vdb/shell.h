#pragma once
// Printable parts: the decoration without the base, fused piece by piece (paper, Printable shells).
#include <map>

#include "pavel/core/placement.h"
#include "pavel/vdb/pack.h"
#include "pavel/vdb/shell_parts.h"

namespace pavel {

struct ShellPart {
    std::vector<int> ids;
    TriangleMesh mesh;  ///< closed, one component; world frame, scene units
    Release release;
    double volume = 0;
    size_t bonds = 0;       ///< places where neighbours were held together by too little, and were thickened
    size_t thickened = 0;   ///< thin places that were thickened
    double lostVolume = 0;  ///< crumbs that touch nothing and were left away
};

/// Builds parts from packed elements.
class ShellBuilder {
  public:
    /// @throws InputError where the clearance takes an element whole
    ShellBuilder(const Packing& packing, const TriangleMesh& base, const std::vector<PlacedElement>& placed,
                 const ShellOptions& options, double gap);
    ~ShellBuilder();
    const ShellGraph& graph() const { return graph_; }
    /// Fuses the members (indices), bonds neighbours that hold by less than the least thickness, thickens what is
    /// thinner, and leaves the clearance to the base. O(surface of the members).
    ShellPart build(const std::vector<int>& members) const;

  private:
    struct Bond {
        double area = 0;  // voxels^2
        Vec3 centre, axis;
    };
    struct Grids;
    void measureElement(size_t i);
    Bond bondOf(size_t i, size_t j) const;

    ShellOptions options_;
    double h_, gap_;
    std::unique_ptr<Grids> grids_;
    ShellGraph graph_;
    std::map<std::pair<int, int>, Bond> bonds_;
};

}  // namespace pavel
