#include "pavel/tools/bench_studies.h"

namespace pavel {

const std::vector<Study>& studies() {
    static const std::vector<Study> all = [] {
        std::vector<Study> s;
        Study coverage{
            "Surface coverage",
            "400 pearls at coverage 1.43 need a radius of 4.78 mm; here their number changes. At 1.2 they barely "
            "deform, at 1.6 they are squeezed hard. Above as placed, below packed.",
            "sphere",
            {"coverage 1.2", "coverage 1.4", "coverage 1.6"},
            {{}, {}}};
        for (const char* c : {"1.2", "1.4", "1.6"}) {
            const std::vector<std::string> sets{"seeding.count=null", std::string("seeding.coverage=") + c,
                                                "voxel_size=0.3", "output.view.zoom=1.5"};
            coverage.rows[0].push_back({std::string("coverage_") + c + "_placed", true, sets});
            coverage.rows[1].push_back({std::string("coverage_") + c, false, sets});
        }
        s.push_back(coverage);

        Study recovery{
            "Volume recovery function",
            "Two overlapping spheres: small a and b pile the displaced volume up as a crest along the contact, "
            "large ones spread it over the whole element.",
            "pair",
            {"a = 0.05, b = 0.15", "a = 0.1, b = 0.3", "a = 0.2, b = 0.6"},
            {{}, {}}};
        const char* ab[][2] = {{"0.05", "0.15"}, {"0.1", "0.3"}, {"0.2", "0.6"}};
        for (const auto& [a, b] : ab) {
            const std::vector<std::string> sets{std::string("material.a=") + a, std::string("material.b=") + b};
            std::vector<std::string> above = sets;
            above.push_back("output.view.elevation=60");
            recovery.rows[0].push_back({std::string("recovery_") + b, false, sets});
            recovery.rows[1].push_back({std::string("recovery_") + b + "_above", false, above});
        }
        s.push_back(recovery);

        Study offset{
            "Sampling on the surface, and on an offset surface",
            "Seeds that are evenly spread on the base crowd the elements in hollows and leave them apart on ridges; "
            "seeds that are evenly spread at the height of the elements' widest section do not. Above as placed, "
            "below packed.",
            "bunny",
            {"on the surface", "on the offset surface"},
            {{}, {}}};
        for (const char* o : {"0", "\"auto\""}) {
            // Large elements show it best.
            const std::vector<std::string> sets{"seeding.count=500", std::string("seeding.offset=") + o,
                                                "elements.0.radius=6.6", "voxel_size=0.4"};
            const std::string name = o[0] == '0' ? "surface" : "offset";
            offset.rows[0].push_back({name + "_placed", true, sets});
            offset.rows[1].push_back({name, false, sets});
        }
        s.push_back(offset);

        Study iterations{"Iterations of the tessellation",
                         "Fewer steps leave a hand-made look; none leaves random places, with gaps and heaps.",
                         "vase",
                         {"none", "5", "100"},
                         {{}, {}}};
        for (const char* n : {"0", "5", "100"}) {
            const std::vector<std::string> sets{std::string("seeding.iterations=") + n, "voxel_size=0.55"};
            iterations.rows[0].push_back({std::string("iterations_") + n + "_placed", true, sets});
            iterations.rows[1].push_back({std::string("iterations_") + n, false, sets});
        }
        s.push_back(iterations);
        return s;
    }();
    return all;
}

}  // namespace pavel
