#pragma once
// Names and colours of what is written.
#include <string>

#include "pavel/core/placement.h"
#include "pavel/core/scene.h"

namespace pavel {

struct BaseLook {
    Vec3 color{0.86, 0.83, 0.78};
    Finish finish = Finish::clay;
};
BaseLook baseLook(const BaseOptions& base);
/// Kind's colour, a little lighter or darker by id, so that neighbours of one kind can be told apart.
Vec3 elementColor(const ElementKind& kind, int id);
/// element_00001_kind
std::string objectName(int id, const std::string& kind);

}  // namespace pavel
