#include <cstdio>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/mesh_write.h"
#include "pavel/seeding/remesh.h"
#include "pavel/tools/commands.h"
#include "pavel/tools/progress.h"

namespace pavel {

void commandRemesh(const std::string& input, const std::string& file, size_t vertices, const CommonOptions& options) {
    checkMeshName(file);
    CommandContext context(options);
    AtomicOutput out(file, false, options.force);
    MeshObject object;
    object.name = "remeshed";
    {
        const StageTimer timer(context, "remesh");
        const TriangleMesh mesh = readMesh(input);
        try {
            object.mesh = remeshed(mesh, vertices, [&](double done) { context.progress("remesh", done); }).mesh;
        } catch (const InputError& e) {
            throw InputError(input + ": " + e.what());
        }
    }
    const size_t reached = object.mesh.points.size(), triangles = object.mesh.triangles.size();
    writeMesh(out.place(), {std::move(object)});
    out.commit();
    context.finish();
    if (reached != vertices && !options.quiet)
        std::fprintf(stderr, "warning: its parts, handles and boundaries need %zu vertices\n", reached);
    if (!options.quiet && !options.json)
        std::printf("%s: %zu vertices, %zu triangles\n", file.c_str(), reached, triangles);
    if (options.json)
        std::printf("{\"result\":\"%s\",\"vertices\":%zu,\"triangles\":%zu}\n", file.c_str(), reached, triangles);
}

}  // namespace pavel
