#include <cstdio>

#include "pavel/core/shapes.h"
#include "pavel/io/scene_json.h"
#include "pavel/tools/examples.h"
#include "pavel/vdb/pack.h"

int main() {
    const pavel::Scene scene = pavel::parseScene(pavel::findExample("vase").scene, "vase", ".");
    std::printf("%s: %zu kinds, %.0f mm^3\n", pavel::version(), scene.elements.size(),
                pavel::meshVolume(pavel::makeShape("pearl")));
}
