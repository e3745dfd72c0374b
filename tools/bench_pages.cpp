#include "pavel/tools/bench_pages.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pavel/core/run_context.h"
#include "pavel/tools/paper_table.h"

namespace pavel {
namespace {

std::string print(const char* format, ...) __attribute__((format(printf, 1, 2)));
std::string print(const char* format, ...) {
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return text;
}

std::string modelOf(const BenchRun& run) {
    const PaperRow* p = paperRow(run.scene);
    return p ? p->model : run.scene;
}

/// "ours / paper's", or ours alone.
std::string both(const char* format, double ours, const std::optional<double>& paper) {
    const auto one = [&](double v) {
        char text[64];
        std::snprintf(text, sizeof text, format, v);
        return std::string(text);
    };
    return one(ours) + (paper ? " / " + one(*paper) : "");
}

std::optional<double> of(const PaperRow* row, double PaperRow::*value) {
    return row ? std::optional<double>(row->*value) : std::nullopt;
}

std::string samplingTable(const std::vector<BenchRun>& runs) {
    std::string t = "| model | decorations | coverage | seconds |\n|---|---:|---:|---:|\n";
    for (const BenchRun& r : runs) {
        const PaperRow* p = paperRow(r.scene);
        t += "| " + modelOf(r) + print(" | %.0f | ", r.elements) +
             both("%.2f", r.coverage, p ? p->coverage : std::nullopt) + " | " +
             both("%.2f", r.seeding, p ? p->seedingSeconds : std::nullopt) + " |\n";
    }
    return t;
}

/// How many times less core time a voxel takes than in the paper.
double cheaper(const BenchRun& r, const PaperRow& p, int threads) {
    return p.deformationSeconds * kPaperCores / (1e6 * p.decorationMegavoxels) /
           (r.deformation * threads / r.decorationVoxels);
}

std::string timesTable(const std::vector<BenchRun>& runs, int threads) {
    std::string t =
        "| model | decoration voxels, M | overlap, % | base voxels, M | deformation, s | core time per voxel | "
        "extraction "
        "and remeshing, s | both | triangles extracted, k | final, k | peak memory, GB | volume error, % | short |\n"
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    for (const BenchRun& r : runs) {
        const PaperRow* p = paperRow(r.scene);
        const double output = r.extract + r.remesh;
        t += "| " + modelOf(r) + " | " +
             both("%.1f", r.decorationVoxels / 1e6, of(p, &PaperRow::decorationMegavoxels)) + " | " +
             both("%.1f", r.overlapPercent, of(p, &PaperRow::overlapPercent)) + " | " +
             both("%.1f", r.baseVoxels / 1e6, of(p, &PaperRow::baseMegavoxels)) + " | " +
             both("%.1f", r.deformation, of(p, &PaperRow::deformationSeconds)) + " | " +
             (p ? print("%.0f times less", cheaper(r, *p, threads)) : "") + " | " +
             both("%.1f", output, of(p, &PaperRow::outputSeconds)) + " | " +
             (p ? print("%.1f times faster", (p->deformationSeconds + p->outputSeconds) / (r.deformation + output))
                : "") +
             " | " + both("%.0f", r.extractedTriangles / 1e3, of(p, &PaperRow::extractedKilotriangles)) + " | " +
             both("%.0f", r.finalTriangles / 1e3, of(p, &PaperRow::finalKilotriangles)) +
             print(" | %.2f | %.4f | %s |\n", r.peakBytes / 1e9, 100 * r.worstError,
                   r.shortElements ? print("%d (%.2g %%)", r.shortElements, r.unrecoveredPercent).c_str() : "");
    }
    return t;
}

std::string largeTable(const std::vector<BenchRun>& runs) {
    std::string t =
        "| model | decoration voxels, M | base voxels, M | deformation, s | CPU ns per decoration voxel "
        "| peak memory, GB | volume error, % | short |\n|---|---:|---:|---:|---:|---:|---:|---:|\n";
    for (const BenchRun& r : runs)
        t += "| " + modelOf(r) +
             print(" | %.1f | %.1f | %.1f | %.0f | %.2f | %.4f | %s |\n", r.decorationVoxels / 1e6, r.baseVoxels / 1e6,
                   r.deformation, 1e9 * r.deformationCpu / r.decorationVoxels, r.peakBytes / 1e9, 100 * r.worstError,
                   r.shortElements ? print("%d (%.2g %%)", r.shortElements, r.unrecoveredPercent).c_str() : "");
    return t;
}

nlohmann::ordered_json runJson(const BenchRun& r) {
    nlohmann::ordered_json j{{"scene", r.scene},
                             {"elements", r.elements},
                             {"coverage", r.coverage},
                             {"decoration_voxels", r.decorationVoxels},
                             {"overlap_percent", r.overlapPercent},
                             {"base_voxels", r.baseVoxels},
                             {"seeding_seconds", r.seeding},
                             {"deformation_seconds", r.deformation},
                             {"deformation_cpu_seconds", r.deformationCpu},
                             {"extract_seconds", r.extract},
                             {"remesh_seconds", r.remesh},
                             {"extracted_triangles", r.extractedTriangles},
                             {"final_triangles", r.finalTriangles},
                             {"peak_rss_bytes", r.peakBytes},
                             {"max_relative_error", r.worstError},
                             {"short_elements", r.shortElements},
                             {"unrecovered_percent", r.unrecoveredPercent}};
    if (const PaperRow* p = paperRow(r.scene)) {
        j["paper"] = {{"deformation_seconds", p->deformationSeconds},
                      {"output_seconds", p->outputSeconds},
                      {"decoration_voxels", 1e6 * p->decorationMegavoxels},
                      {"overlap_percent", p->overlapPercent},
                      {"base_voxels", 1e6 * p->baseMegavoxels},
                      {"extracted_triangles", 1e3 * p->extractedKilotriangles},
                      {"final_triangles", 1e3 * p->finalKilotriangles}};
        if (p->coverage) j["paper"]["coverage"] = *p->coverage;
        if (p->seedingSeconds) j["paper"]["seeding_seconds"] = *p->seedingSeconds;
    }
    return j;
}

struct Series {
    std::string name, color;
    std::vector<std::pair<double, double>> points;
};

/// Both axes logarithmic.
std::string plotPanel(double left, const std::string& title, const std::string& unit, const std::vector<Series>& all) {
    constexpr double kWidth = 380, kHeight = 300, kTop = 40;
    double lo[2] = {1e300, 1e300}, hi[2] = {-1e300, -1e300};
    for (const Series& s : all)
        for (const auto& [x, y] : s.points) {
            lo[0] = std::min(lo[0], std::floor(std::log10(x))), hi[0] = std::max(hi[0], std::ceil(std::log10(x)));
            lo[1] = std::min(lo[1], std::floor(std::log10(y))), hi[1] = std::max(hi[1], std::ceil(std::log10(y)));
        }
    if (lo[0] > hi[0]) return {};
    const auto at = [&](double x, double y) {
        return std::make_pair(left + kWidth * (std::log10(x) - lo[0]) / std::max(1.0, hi[0] - lo[0]),
                              kTop + kHeight * (1 - (std::log10(y) - lo[1]) / std::max(1.0, hi[1] - lo[1])));
    };
    std::string svg = print("<text x=\"%g\" y=\"26\" text-anchor=\"middle\" font-weight=\"bold\">%s</text>\n",
                            left + kWidth / 2, title.c_str());
    for (double e = lo[0]; e <= hi[0]; ++e) {
        const double x = at(std::pow(10, e), std::pow(10, lo[1])).first;
        svg += print(
            "<path d=\"M%.1f %gv%g\" stroke=\"#ddd\"/><text x=\"%.1f\" y=\"%g\" text-anchor=\"middle\">%g M</text>\n",
            x, kTop, kHeight, x, kTop + kHeight + 18, std::pow(10, e - 6));
    }
    for (double e = lo[1]; e <= hi[1]; ++e) {
        const double y = at(std::pow(10, lo[0]), std::pow(10, e)).second;
        svg += print(
            "<path d=\"M%g %.1fh%g\" stroke=\"#ddd\"/><text x=\"%g\" y=\"%.1f\" text-anchor=\"end\">%g %s</text>\n",
            left, y, kWidth, left - 6, y + 4, std::pow(10, e), unit.c_str());
    }
    double row = kTop + kHeight - 8 - 16 * double(all.size() - 1);
    for (const Series& s : all) {
        for (const auto& [px, py] : s.points) {
            const auto [x, y] = at(px, py);
            svg += print("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" fill=\"%s\"/>\n", x, y, s.color.c_str());
        }
        svg += print("<text x=\"%g\" y=\"%g\" text-anchor=\"end\" fill=\"%s\">%s</text>\n", left + kWidth - 8, row,
                     s.color.c_str(), s.name.c_str());
        row += 16;
    }
    return svg;
}

}  // namespace

std::string machineName(int threads) {
    std::ifstream info("/proc/cpuinfo");
    std::string line, name = "an unknown processor";
    while (std::getline(info, line))
        if (line.rfind("model name", 0) == 0) {
            name = line.substr(line.find(": ") + 2);
            break;
        }
    return name + print(", %d thread%s", threads, threads > 1 ? "s" : "");
}

std::string tablesPage(const BenchTables& t) {
    std::string page = "# The paper's tables, and ours\n\nMade by `pavel bench` " + std::string(version()) + " on " +
                       machineName(t.threads) +
                       print(
                           ". Where two numbers stand, the first is ours and the second the paper's, which was "
                           "measured on the %d cores of a Ryzen 3900X with 32 GB.\n",
                           kPaperCores);
    if (!t.paper.empty()) {
        page += "\n## Placement\n\n" + samplingTable(t.paper);
        page += "\n## Deformation and output\n\n" + timesTable(t.paper, t.threads);
        page +=
            "\nDeformation is everything from placed elements to packed level sets. *Core time per voxel* compares its "
            "wall time by cores and decoration voxels. Meshes hold the decoration alone, remeshed to as many triangles "
            "as the paper's. *Volume error* is the largest of any element, against what it should have, with what is "
            "reported as unrecovered; *short* are elements that found no room for more than a thousandth of their "
            "volume, and the share of the whole volume that is missing.\n";
    }
    if (!t.large.empty()) page += "\n## Eight times the voxels\n\n" + largeTable(t.large);
    page += "\n![Time and memory against voxels](time-and-memory.svg)\n";
    return page;
}

std::string tablesJson(const BenchTables& t) {
    nlohmann::ordered_json root{{"version", version()}, {"machine", machineName(t.threads)}, {"threads", t.threads}};
    root["paper"] = root["large"] = nlohmann::ordered_json::array();
    for (const BenchRun& r : t.paper) root["paper"].push_back(runJson(r));
    for (const BenchRun& r : t.large) root["large"].push_back(runJson(r));
    return root.dump(1) + "\n";
}

std::string tablesPlot(const BenchTables& t) {
    Series paper{"the paper, 12 cores", "#999", {}}, ours{"Pavel", "#b0785c", {}},
        large{"Pavel, half the voxel size", "#3f6f8f", {}};
    Series memory = ours, largeMemory = large;
    for (const BenchRun& r : t.paper) {
        if (const PaperRow* p = paperRow(r.scene))
            paper.points.emplace_back(1e6 * p->decorationMegavoxels, p->deformationSeconds);
        ours.points.emplace_back(r.decorationVoxels, r.deformation);
        memory.points.emplace_back(r.decorationVoxels, r.peakBytes / 1e9);
    }
    for (const BenchRun& r : t.large) {
        large.points.emplace_back(r.decorationVoxels, r.deformation);
        largeMemory.points.emplace_back(r.decorationVoxels, r.peakBytes / 1e9);
    }
    return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"930\" height=\"390\" font-family=\"sans-serif\" "
           "font-size=\"12\"><rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" +
           plotPanel(60, "deformation, wall time", "s", {paper, ours, large}) +
           plotPanel(520, "peak memory", "GB", {memory, largeMemory}) + "</svg>\n";
}

}  // namespace pavel
