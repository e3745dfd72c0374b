#include "pavel/io/report_json.h"

#include <nlohmann/json.hpp>

namespace pavel {

std::string reportJson(const Scene& scene, const SeedSet& seeds, const std::vector<ElementKind>& kinds,
                       const Packing& packing, const Report& report, const RunContext& context) {
    using json = nlohmann::ordered_json;
    const auto vec = [](const Vec3& v) { return json::array({v[0], v[1], v[2]}); };
    json root{{"version", version()},
              {"units", scene.units},
              {"voxel_size", report.voxelSize},
              {"threads", report.threads},
              {"seed", scene.seed},
              {"coverage", seeds.coverage},
              {"decorated_area", seeds.decoratedArea},
              {"warnings", context.warnings}};
    const PackCounts& c = packing.counts;
    root["counts"] = {
        {"elements", packing.elements.size()},
        {"decoration_voxels", c.decorationVoxels},
        {"overlap_voxels", c.overlapVoxels},
        {"overlap_percent", c.decorationVoxels ? 100.0 * double(c.overlapVoxels) / double(c.decorationVoxels) : 0.0},
        {"base_voxels", c.baseVoxels},
        {"grown_voxels", c.grownVoxels},
        {"active_voxels", c.activeVoxels},
        {"extracted_triangles", report.extractedTriangles},
        {"final_triangles", report.finalTriangles}};
    double initial = 0, target = 0, lost = 0, final_ = 0, unrecovered = 0, worst = 0;
    for (const ElementResult& e : packing.elements) {
        initial += e.initialVolume;
        target += e.targetVolume;
        lost += e.lostVolume;
        final_ += e.finalVolume;
        unrecovered += e.unrecoveredVolume;
        if (e.targetVolume > 0)
            worst = std::max(worst, std::abs(e.finalVolume + e.unrecoveredVolume - e.targetVolume) / e.targetVolume);
    }
    root["volume"] = {{"initial", initial},
                      {"lost", lost},
                      {"recovered", final_ - (target - lost)},
                      {"unrecovered", unrecovered},
                      {"max_relative_error", worst}};
    json wall, cpu;
    double wallSum = 0, cpuSum = 0;
    for (const char* stage : {"seeding", "voxelize", "overlap", "growth", "extract", "remesh", "write"}) {
        wall[stage] = cpu[stage] = 0.0;
        for (const StageTime& s : context.stages)
            if (s.name == stage)
                wall[stage] = s.seconds, cpu[stage] = s.cpuSeconds, wallSum += s.seconds, cpuSum += s.cpuSeconds;
    }
    wall["total"] = wallSum;
    cpu["total"] = cpuSum;
    root["seconds"] = wall;
    root["cpu_seconds"] = cpu;
    root["memory"] = {{"peak_rss_bytes", peakResidentBytes()}};
    root["elements"] = json::array();
    for (size_t i = 0; i < packing.elements.size(); ++i) {
        const ElementResult& e = packing.elements[i];
        const Seed& s = seeds.seeds[i];
        json j{{"id", e.id},
               {"kind", kinds[size_t(s.kind)].name},
               {"position", vec(s.position)},
               {"normal", vec(s.normal)},
               {"rotation", s.rotation},
               {"scale", s.scale},
               {"initial_volume", e.initialVolume},
               {"target_volume", e.targetVolume},
               {"lost_volume", e.lostVolume},
               {"final_volume", e.finalVolume},
               {"unrecovered_volume", e.unrecoveredVolume},
               {"contacts", e.contacts}};
        if (e.widenedB > 0) j["widened_b"] = e.widenedB;
        root["elements"].push_back(j);
    }
    root["outputs"] = json::array();
    for (const OutputFile& f : report.outputs) root["outputs"].push_back({{"file", f.file}, {"bytes", f.bytes}});
    return root.dump(1) + "\n";
}

}  // namespace pavel
