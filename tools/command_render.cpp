#include <cmath>
#include <cstdio>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/picture_file.h"
#include "pavel/io/preview.h"
#include "pavel/io/vdb_file.h"
#include "pavel/tools/commands.h"

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
        const std::string name = frameName(render.picture, frame, render.frames);
        AtomicOutput out(name, false, options.force);
        renderPicture(out.place(), objects, view);
        out.commit();
        if (!options.quiet) std::printf("%s\n", name.c_str());
        view.azimuthDegrees += 360.0 / render.frames;
    }
}

}  // namespace pavel
