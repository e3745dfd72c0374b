#include "pavel/io/preview.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "pavel/io/shading.h"

namespace pavel {
namespace {

constexpr int kSuper = 2;  // samples per pixel along each axis

double occlusion(const Raster& r, int x, int y, double pixelsPerUnit, double reach) {
    // Horizon test: how steeply the depths rise towards the viewer around the pixel; the farther, the less it counts,
    // or its end would be seen as a line.
    const float z0 = r.depth[r.at(x, y)];
    const double radius = std::clamp(reach * pixelsPerUnit, 4.0, 80.0);
    constexpr int kDirections = 8, kSteps = 6;
    static const auto directions = [] {  // sixteen; every other pixel takes the other half
        std::array<std::pair<double, double>, 2 * kDirections> all;
        for (size_t d = 0; d < all.size(); ++d)
            all[d] = {std::cos(kPi * double(d) / kDirections), std::sin(kPi * double(d) / kDirections)};
        return all;
    }();
    double open = 0;
    for (int d = 0; d < kDirections; ++d) {
        const auto& [dx, dy] = directions[size_t(2 * d + ((x ^ y) & 1))];
        double horizon = 0;
        for (int s = 1; s <= kSteps; ++s) {
            const double share = (s - 0.5) / kSteps, l = radius * share;
            const int px = int(std::floor(x + l * dx + 0.5)), py = int(std::floor(y + l * dy + 0.5));
            if (px < 0 || py < 0 || px >= r.width || py >= r.height) continue;
            const double rise = z0 - r.depth[r.at(px, py)], run = l / pixelsPerUnit;
            if (rise > 4 * reach) continue;  // another object far in front
            horizon = std::max(horizon, (1 - share * share) * rise / std::sqrt(rise * rise + run * run));
        }
        open += 1 - horizon;
    }
    return open / kDirections;
}

/// Digits of five by seven dots, a row each.
constexpr uint8_t kDigits[10][7] = {
    {14, 17, 19, 21, 25, 17, 14}, {4, 12, 4, 4, 4, 4, 14},    {14, 17, 1, 2, 4, 8, 31},   {31, 2, 4, 2, 1, 17, 14},
    {2, 6, 10, 18, 31, 2, 2},     {31, 16, 30, 1, 1, 17, 14}, {6, 8, 16, 30, 17, 17, 14}, {31, 1, 2, 4, 8, 8, 8},
    {14, 17, 17, 14, 17, 17, 14}, {14, 17, 17, 15, 1, 2, 12}};

/// Writes each object's number where most of it is seen.
void drawLabels(const Raster& raster, const Stage& stage, const View& view, std::vector<uint8_t>& rgba) {
    if (view.labels.empty()) return;
    struct Seen {
        double x = 0, y = 0, count = 0;
    };
    std::vector<Seen> seen(view.labels.size());
    for (int y = 0; y < raster.height; ++y)
        for (int x = 0; x < raster.width; ++x) {
            const int64_t id = raster.item[raster.at(x, y)];
            if (id < 0) continue;
            Seen& s = seen[stage.locate(id).first];
            s.x += x, s.y += y, ++s.count;
        }
    // The pixel nearest to the middle of what is seen of it.
    struct Spot {
        double distance = 1e300;
        int x = 0, y = 0;
    };
    std::vector<Spot> spots(seen.size());
    for (int y = 0; y < raster.height; ++y)
        for (int x = 0; x < raster.width; ++x) {
            const int64_t id = raster.item[raster.at(x, y)];
            if (id < 0) continue;
            const size_t o = stage.locate(id).first;
            const double d = std::hypot(x - seen[o].x / seen[o].count, y - seen[o].y / seen[o].count);
            if (d < spots[o].distance) spots[o] = {d, x / kSuper, y / kSuper};
        }
    const int dot = std::max(2, view.height / 250);
    const auto paint = [&](int x, int y, uint8_t value) {
        if (x < 0 || y < 0 || x >= view.width || y >= view.height) return;
        rgba[(size_t(y) * size_t(view.width) + size_t(x)) * 4 + 3] = 255;
        for (int k = 0; k < 3; ++k) rgba[(size_t(y) * size_t(view.width) + size_t(x)) * 4 + size_t(k)] = value;
    };
    for (size_t o = 0; o < seen.size(); ++o) {
        const std::string& text = view.labels[o];
        if (seen[o].count < 0.002 * raster.width * raster.height) continue;  // hardly seen
        const int w = dot * (6 * int(text.size()) + 1), h = dot * 9, left = spots[o].x - w / 2,
                  top = spots[o].y - h / 2;
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) {
                const int column = x / dot - 1, row = y / dot - 1;
                const char c = column >= 0 && column % 6 < 5 ? text[size_t(column / 6)] : ' ';
                const bool ink =
                    c >= '0' && c <= '9' && row >= 0 && row < 7 && (kDigits[c - '0'][row] >> (4 - column % 6) & 1);
                paint(left + x, top + y, ink ? 20 : 250);
            }
    }
}

double toLinear(double c) {
    return std::pow(c, 2.2);
}
uint8_t toScreen(double c) {
    return uint8_t(std::lround(255 * std::pow(std::clamp(c, 0.0, 1.0), 1 / 2.2)));
}

Bounds boundsOf(const std::vector<MeshObject>& objects) {
    Bounds bounds;
    for (const MeshObject& o : objects)
        for (const Vec3& p : o.mesh.points) bounds.add(p);
    return bounds;
}

/// What the lamp reaches, from where it stands.
class ShadowMap {
  public:
    ShadowMap(const Stage& stage, const Vec3& towardsLamp, const Vec3& middle, double radius,
              const std::optional<CutPlane>& cut)
        : raster_(kSize, kSize), camera_(orthonormalCamera(towardsLamp)) {
        camera_.eye = middle + 2 * radius * towardsLamp;
        camera_.scale = 0.49 * kSize / radius;
        camera_.cx = camera_.cy = 0.5 * kSize;
        stage.draw(camera_, raster_, cut);
    }
    struct Light {
        double lit = 0;    ///< share of the lamp
        double depth = 0;  ///< mean way from where its light enters
    };
    /// Percentage-closer filtering over a few texels, moved off the surface by as many. Each is held against the plane
    /// through the point: where light grazes, the surface itself would shade it in stripes.
    Light at(const Vec3& p, const Vec3& normal) const {
        constexpr int kReach = 2, kStep = 2;
        constexpr double kSteepest = 4;
        const Vec3 l = camera_.project(p + (3.0 / camera_.scale) * normal);
        const double toLamp = std::max(dot(normal, camera_.back), 1 / kSteepest),
                     alongX = dot(normal, camera_.right) / toLamp * kStep / camera_.scale,
                     alongY = -dot(normal, camera_.up) / toLamp * kStep / camera_.scale;
        Light light;
        for (int i = -kReach; i <= kReach; ++i)
            for (int j = -kReach; j <= kReach; ++j) {
                const int x = std::clamp(int(l[0]) + i * kStep, 0, kSize - 1),
                          y = std::clamp(int(l[1]) + j * kStep, 0, kSize - 1);
                const double gap = l[2] - double(raster_.depth[raster_.at(x, y)]);
                light.lit += gap + alongX * i + alongY * j <= 2.0 / camera_.scale;
                light.depth += std::max(0.0, gap);
            }
        constexpr double kTaps = (2 * kReach + 1) * (2 * kReach + 1);
        light.lit /= kTaps;
        light.depth /= kTaps;
        return light;
    }

  private:
    static constexpr int kSize = 3000;
    Raster raster_;
    Camera camera_;
};

/// The finishes at a point, and how much there is of each: mostly but one.
struct FinishShares {
    static constexpr int kMost = 6;  // two at each of three corners
    Finish finish[kMost];
    double share[kMost];
    int count = 0;
    void add(Finish of, double part) {
        int i = 0;
        while (i < count && finish[i] != of) ++i;
        if (i == count) finish[count] = of, share[count++] = 0;
        share[i] += part;
    }
    void add(const MeshObject& object, size_t v, double part) {
        if (object.vertexLook.empty()) return add(object.finish, part);
        object.forEachLook(v, [&](uint32_t l, double share) { add(object.looks[l].finish, part * share); });
    }
};

/// RGBA, row by row.
std::vector<uint8_t> render(const std::vector<MeshObject>& objects, const View& view) {
    const Bounds bounds = boundsOf(objects);
    const Vec3 middle = 0.5 * (bounds.min + bounds.max);
    Camera camera = orthonormalCamera(towardsCamera(view, objects));
    const int w = view.width * kSuper, h = view.height * kSuper;
    double radius = 1e-9;
    for (const MeshObject& o : objects)
        for (const Vec3& p : o.mesh.points) radius = std::max(radius, length(p - middle));
    camera.eye = middle + 4 * radius * camera.back;
    // Fit the projected bounds: start from the sphere, then zoom to what is really covered.
    camera.focal = 1;
    Bounds covered;
    for (const MeshObject& o : objects)
        for (const Vec3& p : o.mesh.points) covered.add(camera.project(p));
    const Vec3 extent = 0.5 * covered.size(), centre = 0.5 * (covered.min + covered.max);
    camera.focal =
        0.94 * view.zoom * std::min(0.5 * w / std::max(1e-9, extent[0]), 0.5 * h / std::max(1e-9, extent[1]));
    const Vec3 aim = view.target ? camera.project(*view.target) : camera.focal * centre;
    camera.cx = 0.5 * w - aim[0];
    camera.cy = 0.5 * h - aim[1];

    Stage stage(objects);
    const Studio studio(camera);
    const ShadowMap shadow(stage, studio.key(), middle, radius, view.cut);
    Raster raster(w, h);
    stage.draw(camera, raster, view.cut);
    stage.makeNormals(raster);
    // Where the cut opens a solid, its inner side is seen: what is meant is the section.
    std::vector<char> section(view.cut ? raster.item.size() : 0, 0);
    if (view.cut)
        tbb::parallel_for(0, h, [&](int y) {
            for (int x = 0; x < w; ++x) {
                const size_t at = raster.at(x, y);
                if (raster.item[at] < 0) continue;
                const auto [o, t] = stage.locate(raster.item[at]);
                const Vec3 ray = camera.ray(x + 0.5, y + 0.5);
                const double slope = dot(ray, view.cut->normal);
                if (dot(triangleNormal(objects[o].mesh, t), ray) <= 0 || slope >= 0) continue;
                raster.depth[at] = float(-view.cut->beyond(camera.eye) / slope);
                section[at] = 1;
            }
        });

    std::vector<uint8_t> rgba(size_t(view.width) * size_t(view.height) * 4);
    tbb::parallel_for(0, view.height, [&](int py) {
        for (int px = 0; px < view.width; ++px) {
            Vec3 sum(0, 0, 0);
            int hits = 0;
            double ao = 0, aoDepth = -1e30;  // shared by the samples of a pixel that see the same ground
            for (int s = 0; s < kSuper * kSuper; ++s) {
                const int x = px * kSuper + s % kSuper, y = py * kSuper + s / kSuper;
                const size_t at = raster.at(x, y);
                if (raster.item[at] < 0) {
                    if (!view.transparent) sum += (0.93 - 0.18 * double(y) / h) * Vec3(1, 1, 1);
                    continue;
                }
                ++hits;
                const auto [o, t] = stage.locate(raster.item[at]);
                const MeshObject& object = objects[o];
                const Triangle& tri = object.mesh.triangles[t];
                Vec3 q[3];
                for (int k = 0; k < 3; ++k) q[k] = camera.project(object.mesh.corner(t, k));
                double b[3];
                Raster::weights(q, x + 0.5, y + 0.5, b);
                Vec3 n(0, 0, 0), p(0, 0, 0), color(0, 0, 0);
                FinishShares finishes;
                for (size_t k = 0; k < 3; ++k) {
                    const size_t v = size_t(tri[k]);
                    n += b[k] * stage.normal(o, v);
                    p += b[k] * object.mesh.points[v];
                    color += b[k] * object.colorAt(v);
                    finishes.add(object, v, b[k]);
                }
                const double depth = raster.depth[at];
                if (view.cut && section[at]) {
                    n = view.cut->normal;
                    p = camera.eye + depth * camera.ray(x + 0.5, y + 0.5);
                }
                constexpr double kSameGround = 0.003;  // of the radius
                if (std::abs(depth - aoDepth) > kSameGround * radius) {
                    ao = occlusion(raster, x, y, camera.focal / depth, 0.03 * radius);
                    aoDepth = depth;
                }
                Studio::Point point;
                point.normal = normalized(n);
                point.toEye = normalized(camera.eye - p);
                for (int k = 0; k < 3; ++k) point.albedo[k] = toLinear(color[k]);
                const ShadowMap::Light light = shadow.at(p, point.normal);
                point.open = ao;
                point.lit = light.lit;
                point.depth = light.depth / (0.05 * radius);
                for (int k = 0; k < finishes.count; ++k)
                    sum += finishes.share[k] * studio.shade(point, look(finishes.finish[k]));
            }
            uint8_t* pixel = &rgba[(size_t(py) * size_t(view.width) + size_t(px)) * 4];
            const double samples = view.transparent ? std::max(1, hits) : kSuper * kSuper;
            for (int k = 0; k < 3; ++k) pixel[k] = toScreen(sum[k] / samples);
            pixel[3] = view.transparent ? uint8_t(255 * hits / (kSuper * kSuper)) : 255;
        }
    });
    drawLabels(raster, stage, view, rgba);
    return rgba;
}

/// Copies whose vertices are split at creases, so that normals break there.
std::vector<MeshObject> creased(std::vector<MeshObject> objects) {
    tbb::parallel_for(size_t(0), objects.size(), [&](size_t i) {
        MeshObject& o = objects[i];
        std::vector<int> source;
        TriangleMesh split = splitAtCreases(o.mesh, 40, source);
        replaceMesh(o, std::move(split), source);
    });
    return objects;
}

}  // namespace

double elevationOf(const View& view, const std::vector<MeshObject>& objects) {
    if (view.elevationDegrees) return *view.elevationDegrees;
    const Vec3 size = boundsOf(objects).size();
    return size[2] < 0.22 * std::max(size[0], size[1]) ? 42 : 18;
}

Vec3 towardsCamera(const View& view, const std::vector<MeshObject>& objects) {
    const double a = degreesToRadians(view.azimuthDegrees), e = degreesToRadians(elevationOf(view, objects));
    return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

CutPlane middleCut(const View& view, const Bounds& bounds) {
    const double a = degreesToRadians(view.azimuthDegrees + 25);
    CutPlane cut;
    cut.normal = Vec3(std::cos(a), std::sin(a), 0);
    cut.offset = dot(0.5 * (bounds.min + bounds.max), cut.normal);
    cut.bias = 0.003 * bounds.longestSide();
    return cut;
}

void renderPicture(const std::string& path, const std::vector<MeshObject>& objects, const View& view) {
    renderPicture(path, {Panel{&objects, view}}, 1);
}

void renderPicture(const std::string& path, const std::vector<Panel>& panels, int columns) {
    writePicture(path, rendered(panels, columns));
}

Picture rendered(const std::vector<Panel>& panels, int columns) {
    const int width = panels[0].view.width, height = panels[0].view.height;
    Picture all;
    all.width = width * columns;
    all.height = height * ((int(panels.size()) + columns - 1) / columns);
    all.rgba.assign(size_t(all.width) * size_t(all.height) * 4, 255);
    for (size_t i = 0; i < panels.size(); ++i) {
        const Panel& p = panels[i];
        const std::vector<uint8_t> one =
            p.view.sharpCreases ? render(creased(*p.objects), p.view) : render(*p.objects, p.view);
        const size_t left = i % size_t(columns) * size_t(width), top = i / size_t(columns) * size_t(height);
        for (size_t y = 0; y < size_t(height); ++y)
            std::copy_n(&one[y * size_t(width) * 4], size_t(width) * 4,
                        &all.rgba[((top + y) * size_t(all.width) + left) * 4]);
    }
    return all;
}

}  // namespace pavel
