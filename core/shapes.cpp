#include "pavel/core/shapes.h"

#include <algorithm>

#include "pavel/core/error.h"
#include "pavel/core/shape_bases.h"

namespace pavel {
namespace {

const std::vector<ShapeRecipe>& recipes() {
    static const std::vector<ShapeRecipe> all = [] {
        std::vector<ShapeRecipe> r = baseRecipes();
        for (ShapeRecipe& s : sculptureRecipes()) r.push_back(std::move(s));
        for (ShapeRecipe& e : elementRecipes()) r.push_back(std::move(e));
        return r;
    }();
    return all;
}

size_t editDistance(const std::string& a, const std::string& b) {
    std::vector<size_t> row(b.size() + 1);
    for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (size_t i = 1; i <= a.size(); ++i) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= b.size(); ++j) {
            const size_t next = std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])});
            diagonal = row[j];
            row[j] = next;
        }
    }
    return row[b.size()];
}

std::string formatNumber(double v) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", v);
    return text;
}

}  // namespace

std::string didYouMean(const std::string& word, const std::vector<std::string>& known) {
    size_t best = std::max<size_t>(2, word.size() / 3) + 1;
    std::string name;
    for (const std::string& k : known) {
        const size_t d = editDistance(word, k);
        if (d < best) best = d, name = k;
    }
    return name.empty() ? "" : " (did you mean \"" + name + "\"?)";
}

const std::vector<ShapeInfo>& builtinShapes() {
    static const std::vector<ShapeInfo> infos = [] {
        std::vector<ShapeInfo> i;
        for (const ShapeRecipe& r : recipes()) i.push_back(r.info);
        return i;
    }();
    return infos;
}

const ShapeInfo* findShape(const std::string& name) {
    for (const ShapeInfo& s : builtinShapes())
        if (s.name == name) return &s;
    return nullptr;
}

TriangleMesh makeShape(const std::string& name, const ShapeParameters& parameters) {
    const ShapeInfo* info = findShape(name);
    if (!info) {
        std::vector<std::string> names;
        for (const ShapeInfo& s : builtinShapes()) names.push_back(s.name);
        throw InputError("there is no built-in shape \"" + name + "\"" + didYouMean(name, names));
    }
    ShapeParameters full;
    std::vector<std::string> names;
    for (const ShapeParameter& p : info->parameters) {
        full[p.name] = p.value;
        names.push_back(p.name);
    }
    for (const auto& [key, value] : parameters) {
        if (!full.count(key))
            throw InputError("shape \"" + name + "\" has no parameter \"" + key + "\"" + didYouMean(key, names));
        full[key] = value;
    }
    for (const ShapeParameter& p : info->parameters) {
        const double v = full[p.name];
        if (!std::isfinite(v) || v > p.max || v < p.min || (v == p.min && !p.inclusiveMin))
            throw InputError("shape \"" + name + "\": " + p.name + " = " + formatNumber(v) + " must be " +
                             (p.inclusiveMin ? "at least " : "above ") + formatNumber(p.min) +
                             (p.max < 1e6 ? " and below " + formatNumber(p.max) : ""));
    }
    for (const ShapeRecipe& r : recipes())
        if (r.info.name == name) return r.make(full);
    throw RunError("no recipe for shape " + name);
}

}  // namespace pavel
