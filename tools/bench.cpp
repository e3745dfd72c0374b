#include "pavel/tools/bench.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/scene_json.h"
#include "pavel/tools/bench_pages.h"
#include "pavel/tools/bench_run.h"
#include "pavel/tools/bench_studies.h"
#include "pavel/tools/examples.h"
#include "pavel/tools/paper_table.h"

namespace pavel {
namespace {

namespace fs = std::filesystem;

struct Plan {
    std::vector<std::string> paper, large;  // scenes
    bool gallery = false;
    bool hasTables() const { return !paper.empty() || !large.empty(); }
    size_t steps() const {
        size_t n = paper.size() + large.size();
        if (gallery) {
            n += examples().size();
            for (const Study& s : studies())
                for (const auto& row : s.rows) n += row.size();
        }
        return n;
    }
};

Plan planOf(std::vector<std::string> names) {
    if (names.empty()) names = {"paper", "large", "gallery"};
    Plan plan;
    const auto add = [](std::vector<std::string>& scenes, const std::string& name) {
        if (std::find(scenes.begin(), scenes.end(), name) == scenes.end()) scenes.push_back(name);
    };
    for (const std::string& n : names) {
        if (n == "gallery") {
            plan.gallery = true;
        } else if (n == "paper" || n == "large") {
            for (const PaperRow& row : paperTable()) add(n == "paper" ? plan.paper : plan.large, row.example);
        } else {
            std::vector<std::string> known{"paper", "large", "gallery"};
            for (const Example& e : examples()) known.push_back(e.name);
            if (std::find(known.begin(), known.end(), n) == known.end())
                throw InputError("there is no bench \"" + n + "\"" + didYouMean(n, known) +
                                 "; there are paper, large, gallery, and the scenes that pavel example lists");
            add(plan.paper, n);
        }
    }
    return plan;
}

/// The example's voxel size, times a factor, as an override.
std::string voxelSize(const std::string& example, double factor) {
    const Scene scene = parseScene(findExample(example).scene, example, ".");
    return scene.voxelSize ? "voxel_size=" + std::to_string(factor * *scene.voxelSize)
                           : "resolution=" + std::to_string(*scene.resolution / factor);
}

/// Runs the plan's scenes one after the other and counts them.
class Bench {
  public:
    Bench(const BenchOptions& options, const Plan& plan, const std::string& folder, RunContext& context)
        : plan_(plan),
          folder_(folder),
          context_(context),
          runner_(folder + "/runs", options.bunny, options.threads, context) {}

    BenchTables tables() {
        BenchTables t;
        t.threads = runner_.threads();
        // As the paper's: the decoration without its base, remeshed to as many triangles.
        const std::vector<std::string> plain{"output.vdb=false", "output.preview=false", "output.figure=false"};
        for (const std::string& scene : plan_.paper) {
            std::vector<std::string> sets = plain;
            sets.insert(sets.end(), {"output.mesh=[\"ply\"]", "output.with_base=false", "output.elements=separate"});
            if (const PaperRow* row = paperRow(scene))
                sets.push_back("output.remesh.vertices=" + std::to_string(int(500 * row->finalKilotriangles)));
            step(scene);
            t.paper.push_back(runner_.decorate(scene, "run", sets));
        }
        for (const std::string& scene : plan_.large) {
            std::vector<std::string> sets = plain;
            sets.insert(sets.end(), {"output.mesh=[]", voxelSize(scene, 0.5)});
            step(scene + ", large");
            t.large.push_back(runner_.decorate(scene, "run", sets));
        }
        return t;
    }

    /// The gallery's page; pictures are left beside it.
    std::string gallery() {
        std::string page =
            "# Gallery\n\nThe objects of the paper, rebuilt from built-in shapes. Each is a built-in scene, to run or "
            "to edit: "
            "`pavel example NAME -o DIR`. Made by `pavel bench`, at twice the scenes' voxel size.\n\nFrom the left, "
            "above: "
            "seeds, elements as placed, the packed result, its inner side without the base; below: the elements, close "
            "views before and after, and a section.\n";
        if (plan_.hasTables()) page += "\n[The paper's tables, and ours](tables.md)\n";
        for (const Example& e : examples()) {
            step(e.name);
            const BenchRun run = runner_.decorate(e.name, "run",
                                                  {voxelSize(e.name, 2), "output.figure=true", "output.preview=false",
                                                   "output.vdb=false", "output.mesh=[]"});
            keep("figure.jpg", e.name + ".jpg");
            page += "\n## " + e.name + "\n\n" + sentence(e.help) + ". " + describe(run) + "\n\n![" + e.name + "](" +
                    e.name + ".jpg)\n";
        }
        page += "\n# Studies\n";
        for (const Study& s : studies()) page += studyPage(s);
        return page;
    }

  private:
    void step(const std::string& name) {
        context_.check();
        context_.progress(name, double(done_++) / double(plan_.steps()));
    }

    /// Takes a file of the last run to the page.
    void keep(const std::string& file, const std::string& name) {
        fs::rename(folder_ + "/runs/run/" + file, folder_ + "/" + name);
    }

    static std::string sentence(std::string text) {
        if (!text.empty()) text[0] = char(std::toupper(text[0]));
        return text;
    }

    static std::string describe(const BenchRun& run) {
        char text[400];
        std::snprintf(text, sizeof text, "%.0f elements, coverage %.2f, %.1f %% of the placed volume displaced",
                      run.elements, run.coverage, run.overlapPercent);
        std::string t = text;
        if (const PaperRow* row = paperRow(run.scene)) {
            std::snprintf(text, sizeof text, " (in the paper %.1f %%)", row->overlapPercent);
            t += text;
        }
        std::snprintf(text, sizeof text, "; volumes kept to %.2g %%.", 100 * run.worstError);
        t += text;
        if (run.shortElements > 0) {
            std::snprintf(text, sizeof text,
                          " Walled in by their neighbours and without room for all of their volume: %d, "
                          "and %.2g %% of the whole is missing; the report names them.",
                          run.shortElements, run.unrecoveredPercent);
            t += text;
        }
        return t;
    }

    std::string studyPage(const Study& s) {
        std::string page = "\n## " + s.title + "\n\n" + s.text + "\n\n|", line = "|";
        for (const std::string& c : s.columns) page += " " + c + " |", line += "---|";
        page += "\n" + line + "\n";
        for (const auto& row : s.rows) {
            page += "|";
            for (const StudyPicture& p : row) {
                step(p.file);
                std::vector<std::string> sets = p.overrides;
                sets.insert(sets.end(), {"output.view.width=420", "output.view.height=380", "output.preview=true",
                                         "output.vdb=false", "output.mesh=[]"});
                if (p.placed)
                    runner_.seed(s.scene, "run", sets);
                else
                    runner_.decorate(s.scene, "run", sets);
                keep("preview.png", p.file + ".png");
                page += " ![" + p.file + "](" + p.file + ".png) |";
            }
            page += "\n";
        }
        return page;
    }

    const Plan& plan_;
    std::string folder_;
    RunContext& context_;
    BenchRunner runner_;
    size_t done_ = 0;
};

}  // namespace

std::string bench(const BenchOptions& options, RunContext& context) {
    const Plan plan = planOf(options.names);
    AtomicOutput out(options.folder, true, options.force);
    Bench bench(options, plan, out.place(), context);
    const BenchTables tables = bench.tables();
    std::string text;
    if (plan.hasTables()) {
        writeText(out.place("tables.json"), tablesJson(tables));
        text = tablesPage(tables);
        writeText(out.place("tables.md"), text);
        writeText(out.place("time-and-memory.svg"), tablesPlot(tables));
    }
    if (plan.gallery) writeText(out.place("README.md"), bench.gallery());
    fs::remove_all(out.place("runs"));
    context.check();
    out.commit();
    return text;
}

}  // namespace pavel
