#include <cstdio>
#include <cstdlib>

#include "pavel/core/error.h"
#include "pavel/core/shapes.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_write.h"
#include "pavel/tools/commands.h"

namespace pavel {

std::string shapeHelp(const std::string& name) {
    std::string text;
    char line[200];
    if (const ShapeInfo* s = findShape(name)) {
        text = s->name + ": " + s->help + "\n";
        for (const ShapeParameter& p : s->parameters) {
            std::snprintf(line, sizeof line, "  --%-12s %-8g %s\n", p.name.c_str(), p.value, p.help.c_str());
            text += line;
        }
        return text;
    }
    for (bool base : {true, false}) {
        text += base ? "bases:\n" : "elements:\n";
        for (const ShapeInfo& s : builtinShapes()) {
            if (s.isBase != base) continue;
            std::snprintf(line, sizeof line, "  %-11s %s\n", s.name.c_str(), s.help.c_str());
            text += line;
        }
    }
    return text;
}

void commandShape(const std::string& name, const std::vector<std::string>& parameters, const std::string& file,
                  const CommonOptions& options) {
    checkMeshName(file);
    ShapeParameters values;
    for (size_t i = 0; i < parameters.size(); ++i) {
        std::string key = parameters[i], value;
        if (key.compare(0, 2, "--") != 0)
            throw InputError("shape " + name + ": \"" + key + "\" is not a parameter; write --name value");
        key = key.substr(2);
        if (const size_t equals = key.find('='); equals != std::string::npos) {
            value = key.substr(equals + 1);
            key.resize(equals);
        } else if (++i < parameters.size()) {
            value = parameters[i];
        }
        char* end = nullptr;
        values[key] = std::strtod(value.c_str(), &end);
        if (value.empty() || *end) throw InputError("--" + key + ": \"" + value + "\" is not a number");
    }
    const TriangleMesh mesh = makeShape(name, values);
    AtomicOutput out(file, false, options.force);
    MeshObject object;
    object.name = name;
    object.mesh = mesh;
    writeMesh(out.place(), {object});
    out.commit();
    if (!options.quiet) std::printf("%s: %zu triangles\n", file.c_str(), mesh.triangles.size());
}

}  // namespace pavel
