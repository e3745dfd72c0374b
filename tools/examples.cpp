#include "pavel/tools/examples.h"

namespace pavel {

const std::vector<Example>& examples() {
    static const std::vector<Example> all = {
        {"vase", "ovoid vase with 450 pebbles of three kinds, about 12 million decoration voxels", R"({
  // An ovoid vase covered with pebbles: run it with  pavel decorate scene.json -o result
  "units": "mm",
  "voxel_size": 0.36,                       // finer: more detail, more time
  "seed": 1,                                // another number, another arrangement
  "base": { "shape": "vase" },
  "elements": [
    { "name": "pebble", "shape": "pebble", "length": 15.8, "width": 13.5, "height": 9.3, "weight": 2, "color": "#c9b49a" },
    { "name": "button", "shape": "pearl", "radius": 6.7, "weight": 1, "color": "#b0785c" },
    { "name": "stone", "shape": "pebble", "length": 14.9, "width": 14, "height": 10.2, "phase": 2, "weight": 1, "color": "#7d9490" }
  ],
  "seeding": { "method": "cvt", "count": 450 },
  "orientation": { "rotation": "random" },
  "variation": { "size": 0.06 },
  "output": { "mesh": ["glb"] }
}
)"},
        {"sphere", "sphere with 400 pearls, as in the paper's figure on surface coverage", R"({
  "units": "mm",
  "resolution": 40,                         // voxels across an element
  "base": { "shape": "sphere", "radius": 40 },
  "elements": [ { "name": "pearl", "shape": "pearl", "radius": 4.78, "color": "#e3d6c0" } ],
  "seeding": { "method": "cvt", "count": 400 },
  "output": { "mesh": ["glb"], "elements": "separate" }
}
)"},
        {"mug", "mug with beans of random rotation", R"({
  "units": "mm",
  "resolution": 44,
  "base": { "shape": "mug" },
  "elements": [ { "name": "bean", "shape": "bean", "length": 10, "thickness": 5, "bend": 0.04, "color": "#9c6b4a" } ],
  "seeding": { "method": "cvt", "coverage": 1.3 },
  "output": { "mesh": ["glb"] }
}
)"},
        {"bracelet", "bracelet with small pearls and stars", R"({
  "units": "mm",
  "resolution": 40,
  "base": { "shape": "bracelet" },
  "elements": [
    { "name": "pearl", "shape": "pearl", "radius": 1.9, "weight": 3, "color": "#efe6d8" },
    { "name": "gold", "shape": "disc", "radius": 2, "height": 1.8, "weight": 1, "color": "#d4a94e" }
  ],
  "seeding": { "method": "cvt", "coverage": 1.35 },
  "output": { "mesh": ["glb", "stl"] }
}
)"},
        {"glass", "glass with 500 stones of several shapes, and its shell in printable parts", R"({
  // A decoration for a real glass: run it with  pavel decorate scene.json -o result
  // and print it from the parts that  pavel shell scene.json -o parts  writes.
  "units": "mm",
  "voxel_size": 0.25,
  "base": { "shape": "glass" },
  "elements": [
    { "name": "stone", "shape": "pebble", "length": 10, "width": 8.2, "height": 5.6, "weight": 2, "color": "#a9a295" },
    { "name": "drop", "shape": "pearl", "radius": 3.9, "weight": 1, "color": "#7d8c94" },
    { "name": "bean", "shape": "bean", "length": 10.5, "thickness": 5.2, "weight": 1, "color": "#b59a7c" }
  ],
  "seeding": { "count": 500 },
  "orientation": { "rotation": "random" },
  "variation": { "size": 0.1 },
  "refine": { "iterations": 20 },
  "output": { "mesh": ["glb", "3mf"] },
  "shell": { "parts": "auto", "bed": [180, 180, 180], "clearance": 0.3, "min_thickness": 1.2 }
}
)"},
        {"amphora", "amphora with 358 petals on stripes that cross at 60 degrees", R"({
  "units": "mm",
  "voxel_size": 0.5,
  "base": { "shape": "amphora" },
  "elements": [ { "name": "petal", "shape": "petal", "length": 29, "width": 20, "thickness": 4, "bend": 5, "anchor": 0.5, "color": "#b5654a" } ],
  "seeding": { "method": "stripes", "count": 358, "angle": 60, "field": { "type": "around" } },
  "orientation": { "rotation": "fixed", "angle": 60 },
  "output": { "mesh": ["glb"] }
}
)"},
        {"alternating", "vase with petals on stripes, every other one turned by half a turn", R"({
  "units": "mm",
  "voxel_size": 0.3,
  "base": { "shape": "vase" },
  "elements": [ { "name": "petal", "shape": "petal", "length": 15, "width": 10, "thickness": 3, "bend": 2, "anchor": 0.5, "color": "#6f8f86" } ],
  "seeding": { "method": "stripes", "coverage": 1.4, "field": { "type": "around" } },
  "orientation": { "rotation": "alternate", "angle": 90 },
  "refine": { "iterations": 10 },           // closes the gaps where stripes begin
  "output": { "mesh": ["glb"] }
}
)"},
        {"basket", "vase woven of beans on perpendicular stripes", R"({
  "units": "mm",
  "voxel_size": 0.35,
  "base": { "shape": "vase" },
  "elements": [ { "name": "bean", "shape": "bean", "length": 18, "thickness": 7, "bend": 0.03, "color": "#b08a5a" } ],
  "seeding": { "method": "stripes", "coverage": 1.35, "field": { "type": "around" } },
  "orientation": { "rotation": "fixed" },
  "refine": { "iterations": 10 },           // closes the gaps where stripes begin
  "output": { "mesh": ["glb"] }
}
)"},
        {"three", "mug with three kinds in turn on stripes, turned at random", R"({
  "units": "mm",
  "resolution": 34,
  "base": { "shape": "mug" },
  "elements": [
    { "name": "pebble", "shape": "pebble", "length": 9, "width": 8, "height": 5, "color": "#7d9490" },
    { "name": "bean", "shape": "bean", "length": 11, "thickness": 5, "color": "#c7a65a" },
    { "name": "pearl", "shape": "pearl", "radius": 3.6, "color": "#c98f9b" }
  ],
  "seeding": { "method": "stripes", "coverage": 1.4, "field": { "type": "around" } },
  "orientation": { "rotation": "random" },
  "assignment": "alternate",
  "output": { "mesh": ["glb"] }
}
)"},
        {"tile", "tile with seven petals placed by hand", R"({
  "units": "mm",
  "voxel_size": 0.25,
  "base": { "shape": "tile" },
  "elements": [
    { "name": "petal", "shape": "petal", "length": 30, "width": 22, "thickness": 6, "bend": 4, "color": "#d98c8c" },
    { "name": "heart", "shape": "pearl", "radius": 7, "color": "#e0b94f" }
  ],
  "seeding": { "method": "manual", "placements": [
    { "position": [0, 0, 4], "element": "heart" },
    { "position": [5, 0, 4], "rotation": 270, "element": "petal" },
    { "position": [2.5, 4.33, 4], "rotation": 330, "element": "petal" },
    { "position": [-2.5, 4.33, 4], "rotation": 30, "element": "petal" },
    { "position": [-5, 0, 4], "rotation": 90, "element": "petal" },
    { "position": [-2.5, -4.33, 4], "rotation": 150, "element": "petal" },
    { "position": [2.5, -4.33, 4], "rotation": 210, "element": "petal" }
  ] },
  "output": { "mesh": ["glb"] }
}
)"},
    };
    return all;
}

}  // namespace pavel
