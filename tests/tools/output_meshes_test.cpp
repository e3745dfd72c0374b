#include "pavel/tools/output_meshes.h"

#include <gtest/gtest.h>

#include "pavel/io/scene_json.h"
#include "pavel/tools/examples.h"
#include "pavel/tools/load.h"

namespace pavel {
namespace {

/// Two equal pearls that meet in a plane x = const, fused without their base.
TEST(OutputMeshes, ColoursChangeAtTheSeamAlsoAfterRemeshing) {
    Scene scene = parseScene(findExample("pair").scene, "pair", ".", {"voxel_size=0.25"});
    scene.output.withBase = false;
    scene.output.remeshVertices = 3000;
    RunContext context;
    const TriangleMesh base = loadBase(scene, context);
    const std::vector<ElementKind> kinds = loadKinds(scene, context);
    const std::vector<PlacedElement> placed = placeElements(loadSeeds(scene, base, kinds, context).seeds, kinds);
    const Packing packing = pack(base, kinds, placed, packOptions(scene, 0.25), context);
    std::vector<MeshObject> fused{fusedMesh(packing, kinds, placed, baseLook(scene.base), scene.output, context)};
    const double middle = 0.5 * (placed[0].worldFromElement.origin[0] + placed[1].worldFromElement.origin[0]);
    const auto check = [&](const MeshObject& o, double edge) {
        size_t blends = 0, triangles = 0;
        for (size_t v = 0; v < o.mesh.points.size(); ++v) {
            const double x = o.mesh.points[v][0] - middle;
            const MeshLook& look = o.looks[o.vertexLook[v]];
            const uint32_t own = look.blend ? look.blend->own : o.vertexLook[v];
            if (std::abs(x) > 0.1) {
                EXPECT_EQ(own, x < 0 ? 1u : 2u) << x;
            }
            if (std::abs(x) > 3 * 0.25) {
                EXPECT_FALSE(look.blend) << x;
            }
            blends += look.blend.has_value();
        }
        EXPECT_GT(blends, 20u);
        EXPECT_LT(blends, o.mesh.points.size() / 4);
        for (const Triangle& t : o.mesh.triangles) {
            double x = 0;
            for (const int v : t) x += (o.mesh.points[size_t(v)][0] - middle) / 3;
            if (std::abs(x) < edge) continue;
            EXPECT_EQ(o.solidLook(t), x < 0 ? 1u : 2u) << x;
            ++triangles;
        }
        EXPECT_GT(triangles, o.mesh.triangles.size() / 2);
    };
    check(fused[0], 0.25);
    const size_t before = fused[0].mesh.points.size();
    remeshFused(packing, fused, scene.output, context);
    ASSERT_LT(fused[0].mesh.points.size(), before / 2);
    check(fused[0], 0.5);
}

}  // namespace
}  // namespace pavel
