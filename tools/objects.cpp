#include "pavel/tools/objects.h"

#include <cstdio>

#include "pavel/core/rng.h"

namespace pavel {

BaseLook baseLook(const BaseOptions& base) {
    BaseLook l;
    if (!base.finish.empty()) {
        l.finish = finishNamed(base.finish, "base.finish");
        l.color = parseColor(look(l.finish).color, "base.finish");
    }
    if (!base.color.empty()) l.color = parseColor(base.color, "base.color");
    return l;
}

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
