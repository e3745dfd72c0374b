#include <cstdio>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/preview.h"
#include "pavel/io/vdb_file.h"
#include "pavel/tools/commands.h"

namespace pavel {

void commandRender(const std::string& input, const std::string& png, int width, int height, double azimuth,
                   double elevation, double zoom, const CommonOptions& options) {
    const bool vdb = input.size() > 4 && input.compare(input.size() - 4, 4, ".vdb") == 0;
    if (png.size() < 5 || png.compare(png.size() - 4, 4, ".png") != 0)
        throw InputError(png + ": the picture's name must end in .png");
    MeshObject object;
    object.mesh = vdb ? readVdbSurface(input) : readMesh(input);
    object.color = Vec3(0.82, 0.66, 0.55);
    View view;
    view.width = width;
    view.height = height;
    view.azimuthDegrees = azimuth;
    view.elevationDegrees = elevation;
    view.zoom = zoom;
    view.sharpCreases = true;
    AtomicOutput out(png, false, options.force);
    std::vector<MeshObject> objects;
    objects.push_back(std::move(object));
    renderPng(out.place(), objects, view);
    out.commit();
    if (!options.quiet) std::printf("%s\n", png.c_str());
}

}  // namespace pavel
