#include <cmath>
#include <cstdio>
#include <deque>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/picture_file.h"
#include "pavel/io/preview.h"
#include "pavel/io/vdb_file.h"
#include "pavel/tools/progress.h"

namespace pavel {
namespace {

/// picture.png, or picture_01.png of several.
std::string frameName(const std::string& path, int frame, int frames) {
    if (frames <= 1) return path;
    char number[16];
    std::snprintf(number, sizeof number, "_%0*d", frames < 100 ? 2 : 4, frame + 1);
    const size_t dot = path.find_last_of('.');
    return path.substr(0, dot) + number + path.substr(dot);
}

}  // namespace

void commandRender(const RenderOptions& render, const CommonOptions& options) {
    checkPictureName(render.picture);
    if (!std::isfinite(render.azimuth) || !(render.zoom <= 1e4) || !std::isfinite(render.elevation.value_or(0)))
        throw InputError("--azimuth, --elevation and --zoom must be numbers, and the zoom at most 10000");
    const bool jpeg = render.picture.compare(render.picture.size() - 4, 4, ".jpg") == 0;
    if (render.transparent && jpeg) throw InputError(render.picture + ": only a .png can be transparent");
    CommandContext context(options);
    std::deque<AtomicOutput> outs;  // all or none
    for (int frame = 0; frame < render.frames; ++frame)
        outs.emplace_back(frameName(render.picture, frame, render.frames), false, options.force);
    const std::string& input = render.input;
    const bool vdb = input.size() > 4 && input.compare(input.size() - 4, 4, ".vdb") == 0;
    std::vector<MeshObject> objects(1);
    MeshObject& object = objects[0];
    object.finish = finishNamed(render.finish, "--finish");
    object.color = parseColor(render.color.empty() ? look(object.finish).color : render.color, "--color");
    object.mesh = vdb ? readVdbSurface(input) : readMesh(input);
    View view;
    view.width = render.width;
    view.height = render.height;
    view.azimuthDegrees = render.azimuth + (render.back ? 180 : 0);
    view.elevationDegrees = render.elevation;
    view.zoom = render.zoom;
    view.sharpCreases = true;
    view.transparent = render.transparent;
    for (int frame = 0; frame < render.frames; ++frame) {
        if (render.cut) view.cut = middleCut(view, meshBounds(object.mesh));
        context.check();
        renderPicture(outs[size_t(frame)].place(), objects, view);
        view.azimuthDegrees += 360.0 / render.frames;
    }
    for (AtomicOutput& out : outs) out.commit();
    for (int frame = 0; frame < render.frames && !options.quiet; ++frame)
        std::printf("%s\n", frameName(render.picture, frame, render.frames).c_str());
}

}  // namespace pavel
