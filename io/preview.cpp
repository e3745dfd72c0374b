#include "pavel/io/preview.h"

#include <png.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <mutex>

#include "pavel/core/error.h"

namespace pavel {
namespace {

constexpr int kSuper = 2;  // samples per pixel along each axis

struct Camera {
    Vec3 right, up, back;  // orthonormal; the camera looks along -back
    Vec3 eye;
    double focal = 0;  // pixels; 0: orthographic with `scale` pixels per unit
    double scale = 1, cx = 0, cy = 0;

    /// Pixel coordinates and depth (larger is farther).
    Vec3 project(const Vec3& p) const {
        const Vec3 d = p - eye;
        const double depth = -dot(d, back), s = focal > 0 ? focal / depth : scale;
        return {cx + s * dot(d, right), cy - s * dot(d, up), depth};
    }
};

Camera orthonormalCamera(const Vec3& back) {
    Camera c;
    c.back = normalized(back);
    c.right = normalized(cross(std::abs(c.back[2]) < 0.99 ? Vec3(0, 0, 1) : Vec3(0, 1, 0), c.back));
    c.up = cross(c.back, c.right);
    return c;
}

/// Depth buffer with, for each pixel, the triangle seen and its barycentric weights' interpolation done by the visitor.
class Raster {
  public:
    Raster(int w, int h) : width(w), height(h), depth(size_t(w) * size_t(h), 1e30f), item(depth.size(), -1) {}
    int width, height;
    std::vector<float> depth;
    std::vector<int64_t> item;

    /// Draws rows [y0, y1) of a triangle.
    void draw(const Vec3 (&p)[3], int64_t id, int y0, int y1) {
        const double area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
        if (area == 0 || !(p[0][2] > 0 && p[1][2] > 0 && p[2][2] > 0)) return;
        const int top = std::max(y0, int(std::ceil(std::min({p[0][1], p[1][1], p[2][1]}) - 0.5)));
        const int bottom = std::min(y1 - 1, int(std::floor(std::max({p[0][1], p[1][1], p[2][1]}) - 0.5)));
        const int left = std::max(0, int(std::ceil(std::min({p[0][0], p[1][0], p[2][0]}) - 0.5)));
        const int right = std::min(width - 1, int(std::floor(std::max({p[0][0], p[1][0], p[2][0]}) - 0.5)));
        for (int y = top; y <= bottom; ++y)
            for (int x = left; x <= right; ++x) {
                double w[3];
                weights(p, area, x + 0.5, y + 0.5, w);
                if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
                const float z = float(w[0] * p[0][2] + w[1] * p[1][2] + w[2] * p[2][2]);
                const size_t at = size_t(y) * size_t(width) + size_t(x);
                if (z >= depth[at]) continue;
                depth[at] = z;
                item[at] = id;
            }
    }
    static void weights(const Vec3 (&p)[3], double area, double x, double y, double (&w)[3]) {
        w[1] = ((x - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (y - p[0][1])) / area;
        w[2] = ((p[1][0] - p[0][0]) * (y - p[0][1]) - (x - p[0][0]) * (p[1][1] - p[0][1])) / area;
        w[0] = 1 - w[1] - w[2];
    }
};

struct Stage {
    const std::vector<MeshObject>& objects;
    std::vector<std::vector<Vec3>> normals;
    std::vector<int64_t> first;  // running number of each object's first triangle

    explicit Stage(const std::vector<MeshObject>& o) : objects(o), normals(o.size()) {
        int64_t n = 0;
        for (const MeshObject& m : o) first.push_back(n), n += int64_t(m.mesh.triangles.size());
        tbb::parallel_for(size_t(0), o.size(), [&](size_t i) { normals[i] = vertexNormals(o[i].mesh); });
    }
    std::pair<size_t, size_t> locate(int64_t id) const {
        const size_t object = size_t(std::upper_bound(first.begin(), first.end(), id) - first.begin()) - 1;
        return {object, size_t(id - first[object])};
    }
    void draw(Raster& raster) const {
        // Bands of rows, so that threads write apart; within a band triangles come in order: equal pictures on any
        // number.
        constexpr int kBand = 64;
        tbb::parallel_for(0, (raster.height + kBand - 1) / kBand, [&](int band) {
            const int y0 = band * kBand, y1 = std::min(raster.height, y0 + kBand);
            for (size_t o = 0; o < objects.size(); ++o) {
                const TriangleMesh& m = objects[o].mesh;
                for (size_t run = 0; run < rows[o].size(); ++run) {
                    if (rows[o][run].second < y0 || rows[o][run].first > y1) continue;
                    for (size_t t = run * kRun; t < std::min(m.triangles.size(), (run + 1) * kRun); ++t) {
                        const Vec3 p[3] = {projected[o][size_t(m.triangles[t][0])],
                                           projected[o][size_t(m.triangles[t][1])],
                                           projected[o][size_t(m.triangles[t][2])]};
                        if (std::max({p[0][1], p[1][1], p[2][1]}) < y0 || std::min({p[0][1], p[1][1], p[2][1]}) > y1)
                            continue;
                        raster.draw(p, first[o] + int64_t(t), y0, y1);
                    }
                }
            }
        });
    }
    void project(const Camera& camera) {
        projected.resize(objects.size());
        tbb::parallel_for(size_t(0), objects.size(), [&](size_t o) {
            const auto& points = objects[o].mesh.points;
            projected[o].resize(points.size());
            tbb::parallel_for(size_t(0), points.size(), [&](size_t i) { projected[o][i] = camera.project(points[i]); });
        });
        rows.resize(objects.size());
        tbb::parallel_for(size_t(0), objects.size(), [&](size_t o) {
            const auto& triangles = objects[o].mesh.triangles;
            rows[o].assign((triangles.size() + kRun - 1) / kRun, {1e30, -1e30});
            tbb::parallel_for(size_t(0), rows[o].size(), [&](size_t run) {
                auto& [lo, hi] = rows[o][run];
                for (size_t t = run * kRun; t < std::min(triangles.size(), (run + 1) * kRun); ++t)
                    for (int v : triangles[t])
                        lo = std::min(lo, projected[o][size_t(v)][1]), hi = std::max(hi, projected[o][size_t(v)][1]);
            });
        });
    }
    /// Triangles whose rows are kept together: meshes come in order of place, so most bands skip most runs.
    static constexpr size_t kRun = 1024;
    std::vector<std::vector<Vec3>> projected;
    std::vector<std::vector<std::pair<double, double>>> rows;
};

double occlusion(const Raster& r, int x, int y, double pixelsPerUnit, double reach) {
    // Horizon test: how steeply the depths rise towards the viewer around the pixel.
    const float z0 = r.depth[size_t(y) * size_t(r.width) + size_t(x)];
    const double radius = std::clamp(reach * pixelsPerUnit, 4.0, 80.0);
    constexpr int kDirections = 8, kSteps = 5;
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
            const double l = radius * s / kSteps;
            const int px = int(std::floor(x + l * dx + 0.5)), py = int(std::floor(y + l * dy + 0.5));
            if (px < 0 || py < 0 || px >= r.width || py >= r.height) continue;
            const double rise = z0 - r.depth[size_t(py) * size_t(r.width) + size_t(px)], run = l / pixelsPerUnit;
            if (rise > 4 * reach) continue;  // another object far in front
            horizon = std::max(horizon, rise / std::sqrt(rise * rise + run * run));
        }
        open += 1 - horizon;
    }
    return open / kDirections;
}

void writePng(const std::string& path, int width, int height, const std::vector<uint8_t>& rgb) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = unsigned(width);
    image.height = unsigned(height);
    image.format = PNG_FORMAT_RGB;
    if (!png_image_write_to_file(&image, path.c_str(), 0, rgb.data(), 0, nullptr))
        throw RunError(path + ": the picture cannot be written (" + image.message + ")");
}

/// Digits of five by seven dots, a row each.
constexpr uint8_t kDigits[10][7] = {
    {14, 17, 19, 21, 25, 17, 14}, {4, 12, 4, 4, 4, 4, 14},    {14, 17, 1, 2, 4, 8, 31},   {31, 2, 4, 2, 1, 17, 14},
    {2, 6, 10, 18, 31, 2, 2},     {31, 16, 30, 1, 1, 17, 14}, {6, 8, 16, 30, 17, 17, 14}, {31, 1, 2, 4, 8, 8, 8},
    {14, 17, 17, 14, 17, 17, 14}, {14, 17, 17, 15, 1, 2, 12}};

/// Writes each object's number where most of it is seen.
void drawLabels(const Raster& raster, const Stage& stage, const View& view, std::vector<uint8_t>& rgb) {
    if (view.labels.empty()) return;
    struct Seen {
        double x = 0, y = 0, count = 0;
    };
    std::vector<Seen> seen(view.labels.size());
    for (int y = 0; y < raster.height; ++y)
        for (int x = 0; x < raster.width; ++x) {
            const int64_t id = raster.item[size_t(y) * size_t(raster.width) + size_t(x)];
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
            const int64_t id = raster.item[size_t(y) * size_t(raster.width) + size_t(x)];
            if (id < 0) continue;
            const size_t o = stage.locate(id).first;
            const double d = std::hypot(x - seen[o].x / seen[o].count, y - seen[o].y / seen[o].count);
            if (d < spots[o].distance) spots[o] = {d, x / kSuper, y / kSuper};
        }
    const int dot = std::max(2, view.height / 250);
    const auto paint = [&](int x, int y, uint8_t value) {
        if (x < 0 || y < 0 || x >= view.width || y >= view.height) return;
        for (int k = 0; k < 3; ++k) rgb[(size_t(y) * size_t(view.width) + size_t(x)) * 3 + size_t(k)] = value;
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
double fortieth(double c) {
    const double c2 = c * c, c4 = c2 * c2, c8 = c4 * c4;
    return c8 * c8 * c8 * c8 * c8;
}
uint8_t toScreen(double c) {
    return uint8_t(std::lround(255 * std::pow(std::clamp(c, 0.0, 1.0), 1 / 2.2)));
}

}  // namespace

namespace {

std::vector<uint8_t> render(const std::vector<MeshObject>& objects, const View& view) {
    Bounds bounds;
    for (const MeshObject& o : objects)
        for (const Vec3& p : o.mesh.points) bounds.add(p);
    const Vec3 middle = 0.5 * (bounds.min + bounds.max);
    const double a = degreesToRadians(view.azimuthDegrees), e = degreesToRadians(view.elevationDegrees);
    Camera camera = orthonormalCamera({std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)});
    const int w = view.width * kSuper, h = view.height * kSuper;
    double radius = 0;
    for (const MeshObject& o : objects)
        for (const Vec3& p : o.mesh.points) radius = std::max(radius, length(p - middle));
    camera.eye = middle + 4 * radius * camera.back;
    // Fit the projected bounds: start from the sphere, then zoom to what is really covered.
    camera.focal = 1;
    double extentX = 1e-9, extentY = 1e-9;
    for (const MeshObject& o : objects)
        for (const Vec3& p : o.mesh.points) {
            const Vec3 q = camera.project(p);
            extentX = std::max(extentX, std::abs(q[0]));
            extentY = std::max(extentY, std::abs(q[1]));
        }
    camera.focal = 0.94 * view.zoom * std::min(0.5 * w / extentX, 0.5 * h / extentY);
    camera.cx = 0.5 * w;
    camera.cy = 0.5 * h;

    Stage stage(objects);
    const Vec3 key = normalized(-0.55 * camera.right + 0.75 * camera.up + 0.75 * camera.back);
    const Vec3 fill = normalized(0.9 * camera.right + 0.1 * camera.up + 0.6 * camera.back);
    Camera sun = orthonormalCamera(key);
    const int shadowSize = 3000;
    sun.eye = middle + 2 * radius * key;
    sun.scale = 0.49 * shadowSize / radius;
    sun.cx = sun.cy = 0.5 * shadowSize;
    Raster shadow(shadowSize, shadowSize);
    stage.project(sun);
    stage.draw(shadow);
    Raster raster(w, h);
    stage.project(camera);
    stage.draw(raster);

    std::vector<uint8_t> rgb(size_t(view.width) * size_t(view.height) * 3);
    tbb::parallel_for(0, view.height, [&](int py) {
        for (int px = 0; px < view.width; ++px) {
            Vec3 sum(0, 0, 0);
            double ao = 0, aoDepth = -1e30;  // shared by the samples of a pixel that see the same ground
            for (int s = 0; s < kSuper * kSuper; ++s) {
                const int x = px * kSuper + s % kSuper, y = py * kSuper + s / kSuper;
                const int64_t id = raster.item[size_t(y) * size_t(w) + size_t(x)];
                if (id < 0) {
                    sum += (0.93 - 0.18 * double(y) / h) * Vec3(1, 1, 1);
                    continue;
                }
                const auto [o, t] = stage.locate(id);
                const Triangle& tri = objects[o].mesh.triangles[t];
                const Vec3 q[3] = {stage.projected[o][size_t(tri[0])], stage.projected[o][size_t(tri[1])],
                                   stage.projected[o][size_t(tri[2])]};
                const double area =
                    (q[1][0] - q[0][0]) * (q[2][1] - q[0][1]) - (q[2][0] - q[0][0]) * (q[1][1] - q[0][1]);
                double b[3];
                Raster::weights(q, area, x + 0.5, y + 0.5, b);
                Vec3 n(0, 0, 0), p(0, 0, 0), color(0, 0, 0);
                for (size_t k = 0; k < 3; ++k) {
                    const size_t v = size_t(tri[k]);
                    n += b[k] * stage.normals[o][v];
                    p += b[k] * objects[o].mesh.points[v];
                    color += b[k] * (objects[o].vertexColors.empty() ? objects[o].color : objects[o].vertexColors[v]);
                }
                n = normalized(n);
                const double depth = raster.depth[size_t(y) * size_t(w) + size_t(x)], perUnit = camera.focal / depth;
                constexpr double kSameGround = 0.003;  // of the radius
                if (std::abs(depth - aoDepth) > kSameGround * radius) {
                    ao = occlusion(raster, x, y, perUnit, 0.03 * radius);
                    aoDepth = depth;
                }
                // Percentage-closer shadow, moved off the surface by about a texel.
                const Vec3 l = sun.project(p + (1.5 / sun.scale) * n);
                double lit = 0;
                for (int i = -1; i <= 1; ++i)
                    for (int j = -1; j <= 1; ++j) {
                        const int sx = std::clamp(int(l[0]) + i, 0, shadowSize - 1),
                                  sy = std::clamp(int(l[1]) + j, 0, shadowSize - 1);
                        lit += l[2] <=
                               double(shadow.depth[size_t(sy) * size_t(shadowSize) + size_t(sx)]) + 1.0 / sun.scale;
                    }
                lit /= 9;
                const Vec3 half = normalized(key + normalized(camera.eye - p));
                const double diffuse = 0.85 * lit * std::max(0.0, dot(n, key)) + ao * (0.30 + 0.12 * n[2]) +
                                       0.18 * ao * std::max(0.0, dot(n, fill));
                const double shine = 0.14 * lit * fortieth(std::max(0.0, dot(n, half)));
                for (int k = 0; k < 3; ++k) sum[k] += toLinear(color[k]) * diffuse + shine;
            }
            sum /= double(kSuper * kSuper);
            for (int k = 0; k < 3; ++k)
                rgb[(size_t(py) * size_t(view.width) + size_t(px)) * 3 + size_t(k)] = toScreen(sum[k]);
        }
    });
    drawLabels(raster, stage, view, rgb);
    return rgb;
}

/// Copies whose vertices are split at creases, so that normals break there.
std::vector<MeshObject> creased(std::vector<MeshObject> objects) {
    tbb::parallel_for(size_t(0), objects.size(), [&](size_t i) {
        MeshObject& o = objects[i];
        std::vector<int> source;
        o.mesh = splitAtCreases(o.mesh, 40, source);
        if (o.vertexColors.empty()) return;
        std::vector<Vec3> colors;
        for (int v : source) colors.push_back(o.vertexColors[size_t(v)]);
        o.vertexColors = std::move(colors);
    });
    return objects;
}

}  // namespace

void renderPng(const std::string& path, const std::vector<MeshObject>& objects, const View& view) {
    renderPng(path, objects, std::vector<View>{view});
}

void renderPng(const std::string& path, const std::vector<MeshObject>& objects, const std::vector<View>& views) {
    const bool sharp = std::any_of(views.begin(), views.end(), [](const View& v) { return v.sharpCreases; });
    std::vector<MeshObject> split;
    if (sharp) split = creased(objects);
    const int height = views[0].height, width = views[0].width, all = width * int(views.size());
    std::vector<uint8_t> rgb(size_t(all) * size_t(height) * 3);
    for (size_t i = 0; i < views.size(); ++i) {
        const std::vector<uint8_t> one = render(sharp ? split : objects, views[i]);
        for (int y = 0; y < height; ++y)
            std::copy_n(&one[size_t(y) * size_t(width) * 3], size_t(width) * 3,
                        &rgb[(size_t(y) * size_t(all) + i * size_t(width)) * 3]);
    }
    writePng(path, all, height, rgb);
}

}  // namespace pavel
