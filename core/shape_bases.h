#pragma once
#include <functional>

#include "pavel/core/shapes.h"

namespace pavel {

/// A built-in shape and the recipe that makes it; parameters arrive complete and within range.
struct ShapeRecipe {
    ShapeInfo info;
    std::function<TriangleMesh(const ShapeParameters&)> make;
};
std::vector<ShapeRecipe> baseRecipes();
std::vector<ShapeRecipe> sculptureRecipes();
std::vector<ShapeRecipe> elementRecipes();

}  // namespace pavel
