#include "pavel/core/error.h"
#include "pavel/core/shapes.h"
#include "pavel/tools/examples.h"

namespace pavel {

const Example& findExample(const std::string& name) {
    std::vector<std::string> names;
    for (const Example& e : examples()) {
        if (e.name == name) return e;
        names.push_back(e.name);
    }
    throw InputError("there is no example \"" + name + "\"" + didYouMean(name, names) + "; pavel example lists them");
}

}  // namespace pavel
