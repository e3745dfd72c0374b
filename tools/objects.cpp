#include "pavel/tools/objects.h"

#include <cstdio>

#include "pavel/core/rng.h"

namespace pavel {

Vec3 elementColor(const ElementKind& kind, int id) {
    Rng rng(uint64_t(id), 7);
    return kind.color * rng.uniform(0.92, 1.06);
}

std::string objectName(int id, const std::string& kind) {
    char name[32];
    std::snprintf(name, sizeof name, "element_%05d_", id);
    return name + kind;
}

}  // namespace pavel
