#pragma once
// What a run is asked to do: plain options, one struct per section of the scene file. Lengths in the scene's units,
// angles in degrees. Reading and writing: io/scene_json.h.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pavel/core/shapes.h"

namespace pavel {

struct BaseOptions {
    std::string mesh;   ///< path, or
    std::string shape;  ///< name of a built-in
    ShapeParameters parameters;
    std::optional<double> scaleTo;  ///< length of the longest side
    bool fillHoles = false;
    double thicken = 0;
    std::string color, finish;  ///< empty: the built-in ones
};

struct ElementOptions {
    std::string name;
    std::string mesh;
    std::string shape;
    ShapeParameters parameters;
    double scale = 1;
    std::string up = "z";  ///< axis of a mesh that points away from the surface: x y z -x -y -z
    double weight = 1;
    double stiffness = 1;  ///< infinity: rigid
    std::string color;     ///< #rrggbb; empty: the finish's, or one of the built-in palette
    std::string finish;    ///< clay where it is empty
    double sink = 0;
    std::optional<double> a, b;
};

struct PlacementOptions {
    Vec3 position{0, 0, 0};
    std::optional<Vec3> normal, tangent;
    double rotation = 0, scale = 1;
    std::string element;  ///< empty: the first kind
};

/// A direction field on the surface: what elements and stripes follow.
struct FieldOptions {
    std::string type = "smooth";             ///< smooth | curvature | axis | around | guides
    Vec3 axis{0, 0, 1};                      ///< for axis and around
    std::vector<std::vector<Vec3>> strokes;  ///< for guides: polylines on or near the surface
};

/// Where on the base a seeding may put elements; what is not given does not limit.
struct RegionOptions {
    std::string part;  ///< "all", or a group of the mesh; empty: "outer" where the base has such a part, else all
    std::optional<Bounds> box;
    struct Ball {
        Vec3 center{0, 0, 0};
        double radius = 0;
    };
    std::optional<Ball> sphere;
    std::optional<std::pair<double, double>> height;  ///< least and most z
    struct Curve {
        std::vector<std::vector<Vec3>> lines;
        double distance = 0;
    };
    std::optional<Curve> curve;  ///< all that is as near to one of these polylines
    std::string mask;            ///< where these vertex values are above 1/2: a name of the base's file, or a file
    bool cuts() const { return box || sphere || height || curve || !mask.empty(); }
};

/// How many elements stand where.
struct DensityOptions {
    std::string map;             ///< values in [0, 1]: "curvature", a name of the base's vertex values, or a file
    double least = 1, most = 4;  ///< relative number per area where the map is 0 and 1
    bool resize = true;          ///< elements are smaller where they are denser, so that the coverage stays even
};

struct SeedingOptions {
    std::string method = "cvt";  ///< cvt | stripes | manual
    std::optional<double> coverage;
    std::optional<size_t> count;
    int iterations = 100;
    double offset = 0;        ///< height of the surface that is sampled over the base
    bool autoOffset = false;  ///< "auto": the height of the elements' widest section
    RegionOptions region;
    std::optional<DensityOptions> density;
    FieldOptions field;                                ///< what "rotation": "field" and stripes follow
    std::optional<std::pair<double, double>> spacing;  ///< of stripes: along and across
    double angle = 90;                                 ///< between the two patterns of stripes, degrees
    bool fit = false;  ///< elements on stripes are as large as the distance to their neighbours along asks
    std::vector<std::string> elements;  ///< names of the kinds it places; empty: all
    bool snap = true;
    std::vector<PlacementOptions> placements;
    std::string file;
};

struct OrientationOptions {
    std::string rotation = "random";  ///< random | fixed | field | alternate: half a turn between neighbours
    double angle = 0, jitter = 0;
};

struct MaterialOptions {
    double a = 0.1, b = 0.3;
    std::string contact = "depth";     ///< depth | center: who keeps a contested point
    double gap = 0;                    ///< clearance left between elements and to the base, scene units
    std::string baseLoss = "recover";  ///< recover | cut: whether what sinks into the base grows back
};

/// From where pictures are taken.
struct ViewOptions {
    double azimuth = -60;             ///< degrees about z
    std::optional<double> elevation;  ///< degrees; unset: 18, and higher for flat things
    double zoom = 1;
    int width = 1200, height = 1000;  ///< pixels
};

struct OutputOptions {
    bool vdb = true, fog = false, half = false;
    bool separate = false;  ///< "elements": "separate"
    std::vector<std::string> mesh{"glb"};
    std::optional<size_t> remeshVertices;  ///< of the whole output; unset: as extracted
    double adaptivity = 0;                 ///< in [0, 1]: larger triangles where it is flat
    bool withBase = true, preview = true;
    bool figure = false;  ///< also figure.jpg: seeds, placement, result, close views, sections
    ViewOptions view;
};

/// How the decoration is taken apart for printing.
struct ShellOptions {
    std::string split = "auto";  ///< auto: as few parts as fit the bed and come off | count | planes | groups
    int parts = 0;               ///< for count
    Vec3 bed{200, 200, 200};     ///< of the printer; no part is larger
    double clearance = 0.2;      ///< for glue, between parts and base
    double minThickness = 0.8;   ///< of what holds neighbours together, and of thin places
    bool layFlat = false;        ///< parts lie on z = 0 with their backs down, else they stay where they belong
};

struct Scene {
    std::string units = "mm";
    std::optional<double> voxelSize, resolution;
    uint64_t seed = 1;
    BaseOptions base;
    std::vector<ElementOptions> elements;
    std::vector<SeedingOptions> seedings{1};  ///< at least one
    OrientationOptions orientation;
    std::string assignment = "random";  ///< random | alternate | sequence: which kind goes where
    double sizeVariation = 0;
    int refineIterations = 0;
    MaterialOptions material;
    OutputOptions output;
    ShellOptions shell;
    std::string folder = ".";  ///< paths in the scene resolve against it
};

/// Length of one scene unit in metres. Throws InputError for an unknown unit.
double metresPerUnit(const std::string& units);

/// @param names of the elements; @param where the placement, for the message
/// @throws InputError where a placement cannot be used
void checkPlacement(const PlacementOptions& placement, const std::vector<std::string>& names, const std::string& where);

/// Checks values against each other and their ranges; what a single key's type says is checked on reading.
/// @throws InputError naming the key and the mend
void validate(const Scene& scene);

}  // namespace pavel
