#pragma once
#include <string>
#include <vector>

namespace pavel {

/// A built-in scene, as the text of a scene file.
struct Example {
    std::string name, help, scene;
};
const std::vector<Example>& examples();

}  // namespace pavel
