// The program `pavel`: reads the command line and maps failures to exit statuses.
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>

#include "pavel/core/error.h"
#include "pavel/core/shapes.h"
#include "pavel/io/mesh_write.h"
#include "pavel/tools/commands.h"
#include "pavel/tools/paged_heap.h"

namespace {

using pavel::CommonOptions;

void addCommon(CLI::App& app, CommonOptions& o, bool scene, double& voxel) {
    app.add_option("--threads", o.threads, "number of threads (default: all)")->check(CLI::PositiveNumber);
    app.add_flag("--quiet", o.quiet, "print errors only");
    app.add_flag("--verbose", o.verbose, "print more");
    app.add_flag("--force", o.force, "overwrite what is there");
    if (!scene) return;
    app.add_flag("--json", o.json, "progress and result as JSON lines on stdout");
    app.add_option("--set", o.overrides, "override a value of the scene: key.path=value (repeatable)")
        ->allow_extra_args(false);
    app.add_option("--memory-limit", o.memoryLimit, "memory to keep within, paging to disk: 800M, 16G")
        ->transform(CLI::AsSizeValue(false))
        ->check(CLI::PositiveNumber);
    app.add_option("--voxel", voxel, "voxel size in scene units, instead of the scene's")->check(CLI::PositiveNumber);
}

/// The folder that a result is made in, on a disk with room for it.
std::string parentOf(const std::string& folder) {
    const std::filesystem::path parent = std::filesystem::absolute(folder).lexically_normal().parent_path();
    return std::filesystem::exists(parent) ? parent.string() : std::filesystem::temp_directory_path().string();
}

int run(int argc, char** argv) {
    CLI::App app{"Pavel decorates surfaces with packed volumetric elements."};
    app.set_version_flag("--version", std::string("pavel ") + pavel::version());
    app.require_subcommand(1);
    CommonOptions common;
    double voxel = 0;
    std::string scene, folder = "pavel-out", name, file;

    auto* decorate =
        app.add_subcommand("decorate", "the main job: seeds, packed elements, meshes, .vdb, report, picture");
    decorate->add_option("SCENE", scene, "scene file")->required();
    decorate->add_option("-o,--output", folder, "folder for the result (default: pavel-out)");
    addCommon(*decorate, common, true, voxel);

    auto* seed = app.add_subcommand("seed", "placement only, in a moment: seeds and a picture, to try options");
    seed->add_option("SCENE", scene, "scene file")->required();
    seed->add_option("-o,--output", folder, "folder for the result (default: pavel-out)");
    addCommon(*seed, common, true, voxel);

    auto* shell = app.add_subcommand("shell", "printable parts of the decoration, without the base");
    shell->add_option("SCENE", scene, "scene file, or the folder of a run")->required();
    shell->add_option("-o,--output", folder, "folder for the parts (default: pavel-out)");
    addCommon(*shell, common, true, voxel);

    auto* example = app.add_subcommand("example", "lists the built-in scenes, or writes one");
    example->add_option("NAME", name, "scene to write");
    example->add_option("-o,--output", folder, "folder to write scene.json into");
    addCommon(*example, common, false, voxel);

    auto* shape = app.add_subcommand("shape", "writes a built-in base or element as a mesh");
    shape->add_option("NAME", name, "shape")->required();
    shape->add_option("-o,--output", file, "mesh file: " + pavel::meshFormatList())->required();
    shape->allow_extras();
    shape->footer([&] { return pavel::shapeHelp(name); });
    addCommon(*shape, common, false, voxel);

    size_t vertices = 0;
    auto* remesh = app.add_subcommand("remesh", "centroidal Voronoi remeshing: few, well-shaped triangles");
    remesh->add_option("IN", name, "mesh")->required();
    remesh->add_option("-o,--output", file, "mesh file: " + pavel::meshFormatList())->required();
    remesh->add_option("--vertices", vertices, "of the result")->required()->check(CLI::Range(4, 2000000000));
    addCommon(*remesh, common, false, voxel);

    pavel::RenderOptions picture;
    auto* render = app.add_subcommand("render", "a picture of a mesh or .vdb file, headless");
    render->add_option("FILE", picture.input, "mesh or .vdb")->required();
    render->add_option("-o,--output", picture.picture, "picture: .png or .jpg")->required();
    render->add_option("--width", picture.width, "pixels")->check(CLI::Range(16, 8192));
    render->add_option("--height", picture.height, "pixels")->check(CLI::Range(16, 8192));
    render->add_option("--azimuth", picture.azimuth, "of the camera, degrees about z (default: -60)");
    render
        ->add_option("--elevation", picture.elevation,
                     "of the camera, degrees (default: 18; flat things from higher up)")
        ->check(CLI::Range(-89.0, 89.0));
    render->add_option("--zoom", picture.zoom, "enlargement")->check(CLI::PositiveNumber);
    render->add_option("--finish", picture.finish, "clay, ceramic, gold, jade or pearl");
    render->add_option("--color", picture.color, "#rrggbb, instead of the finish's own");
    render->add_flag("--back", picture.back, "from behind");
    render->add_flag("--cut", picture.cut, "cut open through the middle");
    render->add_flag("--transparent", picture.transparent, "no background (PNG)");
    render->add_option("--turntable", picture.frames, "pictures of a full turn, NAME_01.png and on")
        ->check(CLI::Range(1, 3600));
    addCommon(*render, common, false, voxel);

    std::vector<std::string> files;
    auto* info = app.add_subcommand("info", "what is in a mesh, .vdb, seeds or scene file");
    info->add_option("FILE", files, "files")->required();
    addCommon(*info, common, false, voxel);

    auto* validate = app.add_subcommand("validate", "checks a scene and its inputs and forecasts the cost");
    validate->add_option("SCENE", scene, "scene file")->required();
    addCommon(*validate, common, true, voxel);

    std::vector<std::string> names;
    std::string bunny, benchFolder = "pavel-bench";
    auto* bench = app.add_subcommand("bench", "rebuilds the paper's tables and gallery, and compares");
    bench->add_option(
        "NAME", names,
        "paper (its tables), large (at eight times the voxels), gallery, or built-in scenes (default: the "
        "first three)");
    bench->add_option("-o,--output", benchFolder, "folder for pages, JSON and pictures (default: pavel-bench)");
    bench->add_option("--bunny", bunny, "mesh for the scene `bunny`, instead of the built-in stand-in")
        ->check(CLI::ExistingFile);
    addCommon(*bench, common, false, voxel);

    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& e) {
        return app.exit(e);
    } catch (const CLI::ParseError& e) {
        app.exit(e, std::cerr, std::cerr);
        return 2;
    }
    std::unique_ptr<tbb::global_control> threads;
    if (common.threads > 0)
        threads =
            std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, size_t(common.threads));
    if (voxel > 0) {
        common.overrides.push_back("voxel_size=" + std::to_string(voxel));
        common.overrides.push_back("resolution=null");
    }
    if ((*decorate || *seed || *shell) && common.memoryLimit > 0)
        pavel::enablePagedHeap(common.memoryLimit, parentOf(folder));
    if (*decorate)
        pavel::commandDecorate(scene, folder, common);
    else if (*seed)
        pavel::commandSeed(scene, folder, common);
    else if (*shell)
        pavel::commandShell(scene, folder, common);
    else if (*example)
        pavel::commandExample(name, folder, common);
    else if (*shape)
        pavel::commandShape(name, shape->remaining(), file, common);
    else if (*remesh)
        pavel::commandRemesh(name, file, vertices, common);
    else if (*render)
        pavel::commandRender(picture, common);
    else if (*info)
        pavel::commandInfo(files, common);
    else if (*validate)
        pavel::commandValidate(scene, common);
    else
        pavel::commandBench(names, benchFolder, bunny, common);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const pavel::Error& e) {
        std::fprintf(stderr, "pavel: %s\n", e.what());
        return e.exitStatus();
    } catch (const std::bad_alloc&) {
        std::fprintf(stderr, "pavel: out of memory; use a larger voxel_size\n");
    } catch (const std::exception& e) {
        std::fprintf(stderr, "pavel: internal error: %s\n", e.what());
    }
    return 1;
}
