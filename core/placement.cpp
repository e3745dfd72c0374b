#include "pavel/core/placement.h"

namespace pavel {

std::vector<PlacedElement> placeElements(const std::vector<Seed>& seeds, const std::vector<ElementKind>& kinds) {
    std::vector<PlacedElement> placed;
    placed.reserve(seeds.size());
    for (const Seed& s : seeds) {
        const Vec3 n = normalized(s.normal);
        const Vec3 origin = s.position - kinds[size_t(s.kind)].sink * s.scale * n;
        placed.push_back({s.id, s.kind, frameFromNormal(origin, n, s.tangent, s.rotation, s.scale)});
    }
    return placed;
}

}  // namespace pavel
