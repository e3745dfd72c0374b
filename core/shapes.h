#pragma once
// The built-in bases and decorative elements, as closed meshes in millimetres, +z up.
// Bases carry groups ("outer" is the side to decorate). Elements stand in their own frame: origin = the point that sits
// on the surface, +z = the surface's normal, +x = main direction.
#include <map>
#include <string>
#include <vector>

#include "pavel/core/mesh.h"

namespace pavel {

using ShapeParameters = std::map<std::string, double>;

struct ShapeParameter {
    std::string name;
    double value;  ///< default
    std::string help;
    double min = 0, max = 1e9;  ///< allowed range, both ends excluded unless inclusiveMin
    bool inclusiveMin = false;
};

struct ShapeInfo {
    std::string name;
    bool isBase;
    std::string help;
    std::vector<ShapeParameter> parameters;
};

const std::vector<ShapeInfo>& builtinShapes();
/// nullptr where there is none of that name.
const ShapeInfo* findShape(const std::string& name);

/// @throws InputError for an unknown name or parameter, or a value outside its range
TriangleMesh makeShape(const std::string& name, const ShapeParameters& parameters = {});

/// The entry of `known` that is nearest to `word` in edit distance, as " (did you mean \"x\"?)"; empty where none is
/// near.
std::string didYouMean(const std::string& word, const std::vector<std::string>& known);

}  // namespace pavel
