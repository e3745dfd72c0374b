#include "pavel/tools/pictures.h"

#include <algorithm>

#include "pavel/seeding/remesh.h"
#include "pavel/seeding/simplify.h"
#include "pavel/tools/objects.h"

namespace pavel {
namespace {

/// A stripe as a thin tube, three-sided.
void appendTube(const SeedSet::Line& line, double radius, TriangleMesh& mesh) {
    const size_t n = line.points.size();
    if (n < 2) return;
    const int first = int(mesh.points.size());
    for (size_t i = 0; i < n; ++i) {
        const bool inner = line.closed || (i > 0 && i + 1 < n);
        const Vec3 d = normalized(inner ? line.points[(i + 1) % n] - line.points[(i + n - 1) % n]
                                  : i   ? line.points[i] - line.points[i - 1]
                                        : line.points[1] - line.points[0]);
        const Vec3 x = anyPerpendicular(d), y = cross(d, x);
        for (int k = 0; k < 3; ++k) {
            const double a = 2 * kPi * k / 3;
            mesh.points.push_back(line.points[i] + radius * (std::cos(a) * x + std::sin(a) * y));
        }
    }
    for (size_t i = 0; i + (line.closed ? 0 : 1) < n; ++i)
        for (int k = 0; k < 3; ++k) {
            const int a = first + 3 * int(i), b = first + 3 * int((i + 1) % n), l = (k + 1) % 3;
            mesh.triangles.push_back({a + k, a + l, b + l});
            mesh.triangles.push_back({a + k, b + l, b + k});
        }
}

/// A ball on each seed.
TriangleMesh markers(const SeedSet& seeds, double radius) {
    const TriangleMesh ball = simplified(makeShape("sphere", {{"radius", radius}}), 80);
    TriangleMesh all;
    for (const Seed& s : seeds.seeds) {
        TriangleMesh one = ball;
        for (Vec3& p : one.points) p += s.position;
        append(all, one);
    }
    return all;
}

/// The kinds side by side, standing on z = 0.
std::vector<MeshObject> kindsInARow(const std::vector<ElementKind>& kinds) {
    std::vector<MeshObject> row;
    double x = 0;
    for (const ElementKind& k : kinds) {
        MeshObject o;
        o.mesh = k.mesh;
        o.color = k.color;
        o.finish = k.finish;
        const Bounds b = meshBounds(k.mesh);
        for (Vec3& p : o.mesh.points) p += Vec3(x - b.min[0], -0.5 * (b.min[1] + b.max[1]), -b.min[2]);
        x += 1.15 * b.size()[0];
        row.push_back(std::move(o));
    }
    return row;
}

/// The seed that looks most straight at the camera.
Vec3 facingSeed(const SeedSet& seeds, const Vec3& towards, double size) {
    double best = -1e300;
    Vec3 position(0, 0, 0);
    for (const Seed& s : seeds.seeds) {
        const double score = dot(s.normal, towards) + 0.7 * dot(s.position, towards) / size;
        if (score > best) best = score, position = s.position;
    }
    return position;
}

/// A shape to be seen many times. Edge collapses leave long, thin triangles, whose normals show as dents; remeshing
/// frays rims that are thinner than its edges, and takes volume there.
TriangleMesh inFew(const TriangleMesh& shape, size_t triangles) {
    constexpr double kKept = 0.98;  // what is not so thin keeps more than 0.995
    TriangleMesh mesh = remeshed(shape, triangles / 2).mesh;
    return meshVolume(mesh) > kKept * meshVolume(shape) ? mesh : simplified(shape, triangles);
}

}  // namespace

View sceneView(const Scene& scene) {
    View view;
    view.azimuthDegrees = scene.output.view.azimuth;
    view.elevationDegrees = scene.output.view.elevation;
    view.zoom = scene.output.view.zoom;
    view.width = scene.output.view.width;
    view.height = scene.output.view.height;
    return view;
}

MeshObject baseObject(const Scene& scene, const TriangleMesh& base) {
    MeshObject o;
    o.name = "base";
    o.material = "base";
    o.mesh = base;
    const BaseLook l = baseLook(scene.base);
    o.color = l.color;
    o.finish = l.finish;
    return o;
}

std::vector<MeshObject> seededBase(const Scene& scene, const TriangleMesh& base, const SeedSet& seeds) {
    std::vector<MeshObject> objects{baseObject(scene, base)};
    if (!seeds.spacing) return objects;
    const Vec3 colors[2] = {{0.25, 0.32, 0.45}, {0.62, 0.66, 0.72}};  // main, across
    const double radius = 0.03 * std::min(seeds.spacing->first, seeds.spacing->second);
    for (bool main : {true, false}) {
        objects.emplace_back();
        objects.back().color = colors[main ? 0 : 1];
        for (const SeedSet::Line& line : seeds.stripes)
            if (line.main == main) appendTube(line, radius, objects.back().mesh);
    }
    return objects;
}

std::vector<MeshObject> placedElements(const std::vector<ElementKind>& kinds,
                                       const std::vector<PlacedElement>& placed) {
    // Whole where that is no more than a packed result has.
    constexpr size_t kWhole = 3000000, kPictured = 1000000, kLeast = 150, kMost = 2000;
    const size_t triangles = std::clamp(kPictured / std::max<size_t>(1, placed.size()), kLeast, kMost);
    std::vector<size_t> count(kinds.size());
    for (const PlacedElement& p : placed) ++count[size_t(p.kind)];
    std::vector<TriangleMesh> shapes;
    for (size_t k = 0; k < kinds.size(); ++k) {
        const TriangleMesh& shape = kinds[k].mesh;
        const bool whole = shape.triangles.size() <= triangles || shape.triangles.size() * count[k] <= kWhole;
        shapes.push_back(whole ? shape : inFew(shape, triangles));
    }
    std::vector<MeshObject> objects;
    for (const PlacedElement& p : placed) {
        const ElementKind& kind = kinds[size_t(p.kind)];
        MeshObject o;
        o.mesh = shapes[size_t(p.kind)];
        for (Vec3& v : o.mesh.points) v = p.worldFromElement.apply(v);
        o.color = elementColor(kind, p.id);
        o.finish = kind.finish;
        objects.push_back(std::move(o));
    }
    return objects;
}

void writeFigure(const std::string& path, const Scene& scene, const TriangleMesh& base,
                 const std::vector<ElementKind>& kinds, const SeedSet& seeds, const TriangleMesh& packedBase,
                 std::vector<MeshObject> elements) {
    View view = sceneView(scene);
    view.width = 400;
    view.height = 360;
    const Bounds bounds = meshBounds(base);
    const double size = bounds.longestSide();

    std::vector<MeshObject> seeded = seededBase(scene, base, seeds);
    seeded.emplace_back();
    seeded.back().color = {0.16, 0.34, 0.72};
    const double spacing = std::sqrt(seeds.decoratedArea / double(std::max<size_t>(1, seeds.seeds.size())));
    seeded.back().mesh = markers(seeds, std::clamp(0.16 * spacing, 0.004 * size, 0.014 * size));
    std::vector<MeshObject> initial = placedElements(kinds, placeElements(seeds.seeds, kinds));
    initial.push_back(baseObject(scene, base));
    const std::vector<MeshObject> row = kindsInARow(kinds), alone = elements;
    std::vector<MeshObject>& packed = elements;
    packed.push_back(baseObject(scene, packedBase));

    const Vec3 towards = towardsCamera(view, packed);
    View close = view;
    close.target = facingSeed(seeds, towards, size);
    // About five elements across.
    close.zoom = std::max(1.5 * view.zoom, size / (6 * spacing));
    View whole = view;
    whole.zoom = 1;
    // What is flat is cut less, and seen from below without its base.
    View unset = view;
    unset.elevationDegrees.reset();
    const bool flat = elevationOf(unset, packed) > 30;
    CutPlane cut = middleCut(view, bounds);
    if (flat) cut.offset += 0.08 * size;
    View section = view;
    section.elevationDegrees = elevationOf(view, packed);
    section.cut = cut;
    View inner = section;
    const auto kept = std::count_if(seeds.seeds.begin(), seeds.seeds.end(),
                                    [&](const Seed& s) { return cut.beyond(s.position) < 0; });
    if (flat) {
        inner.cut.reset();
        inner.elevationDegrees = -*section.elevationDegrees;
    } else if (kept < std::ptrdiff_t(seeds.seeds.size() / 4)) {  // all on the side that is cut away
        inner.cut.reset();
        inner.azimuthDegrees += 180;
    }
    const auto panel = [](const std::vector<MeshObject>& objects, const View& v) { return Panel{&objects, v}; };
    renderPicture(path,
                  {panel(seeded, view), panel(initial, view), panel(packed, view), panel(alone, inner),
                   panel(row, whole), panel(initial, close), panel(packed, close), panel(packed, section)},
                  4);
}

}  // namespace pavel
