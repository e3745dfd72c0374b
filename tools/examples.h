#pragma once
#include <string>
#include <vector>

namespace pavel {

/// A built-in scene, as the text of a scene file (tools/examples/NAME.json).
struct Example {
    std::string name, help, scene;
};
/// By name.
const std::vector<Example>& examples();
/// @throws InputError where there is none of that name
const Example& findExample(const std::string& name);

}  // namespace pavel
