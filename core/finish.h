#pragma once
// What a thing seems to be made of: for pictures, and for the materials of meshes that carry some.
#include <cstdint>
#include <string>
#include <vector>

#include "pavel/core/vec.h"

namespace pavel {

enum class Finish : uint8_t { clay, ceramic, gold, jade, pearl };

/// Metallic and roughness as in glTF's materials; translucency: 1 is as jade.
struct FinishLook {
    std::string name, color;  ///< sRGB, #rrggbb
    double metallic, roughness, translucency;
};

/// Ordered as the enumeration.
const std::vector<FinishLook>& finishes();
const FinishLook& look(Finish finish);

/// @param where the key in the scene or the option, for the message
/// @throws InputError for a name that there is not
Finish finishNamed(const std::string& name, const std::string& where);
/// sRGB in [0, 1] from #rrggbb.
/// @throws InputError for anything else
Vec3 parseColor(const std::string& color, const std::string& where);

}  // namespace pavel
