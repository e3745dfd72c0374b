#include "pavel/core/finish.h"

#include "pavel/core/error.h"
#include "pavel/core/shapes.h"

namespace pavel {

const std::vector<FinishLook>& finishes() {
    static const std::vector<FinishLook> all = {{"clay", "#d1a88c", 0, 0.6, 0},
                                                {"ceramic", "#efebe3", 0, 0.08, 0},
                                                {"gold", "#f0c068", 1, 0.25, 0},
                                                {"jade", "#6fae8a", 0, 0.15, 1},
                                                {"pearl", "#f3ece4", 0, 0.3, 0.3}};
    return all;
}

const FinishLook& look(Finish finish) {
    return finishes()[size_t(finish)];
}

Finish finishNamed(const std::string& name, const std::string& where) {
    std::vector<std::string> names;
    std::string list;
    for (const FinishLook& f : finishes()) {
        if (f.name == name) return Finish(names.size());
        names.push_back(f.name);
        list += (list.empty() ? "" : ", ") + f.name;
    }
    throw InputError(where + ": there is no finish \"" + name + "\"" + didYouMean(name, names) + "; there are " + list);
}

Vec3 parseColor(const std::string& color, const std::string& where) {
    if (color.size() != 7 || color[0] != '#' ||
        color.find_first_not_of("0123456789abcdefABCDEF", 1) != std::string::npos)
        throw InputError(where + ": write the colour as \"#rrggbb\"");
    const long v = std::stol(color.substr(1), nullptr, 16);
    return Vec3(double(v >> 16 & 255), double(v >> 8 & 255), double(v & 255)) / 255.0;
}

}  // namespace pavel
