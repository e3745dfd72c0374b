#include "pavel/seeding/refine.h"

#include <algorithm>
#include <cmath>

#include "pavel/core/footprint.h"
#include "pavel/seeding/kd_tree.h"

namespace pavel {
namespace {

/// Where an element stands: its footprint lies in the plane of x and y.
struct Stand {
    Vec3 position, normal, x, y;
};

Stand standOf(const Seed& s) {
    Stand f;
    f.position = s.position;
    f.normal = s.normal;
    f.x = rotatedAbout(s.tangent, s.normal, degreesToRadians(s.rotation));
    f.y = cross(s.normal, f.x);
    return f;
}

/// The numbers of footprints over points of a surface.
class Cover {
  public:
    struct Local {
        double x, y, distance2;
        size_t sample;
    };

    Cover(const Surface& surface, size_t seeds, const std::vector<ElementKind>& kinds, uint64_t seed)
        : samples_(makeSamples(surface, seeds, seed)), count_(samples_.size(), 0) {
        for (const ElementKind& k : kinds) footprints_.emplace_back(k.mesh);
    }

    const Footprint& footprint(int kind) const { return footprints_[size_t(kind)]; }
    int& count(size_t sample) { return count_[sample]; }
    size_t size() const { return samples_.size(); }

    /// The samples within `reach` of a stand that face like it, in its plane.
    void around(const Stand& s, double reach, std::vector<Local>& found) {
        matches_.clear();
        tree_.radiusSearch(s.position.data(), reach * reach, matches_, nanoflann::SearchParams(0, 0, false));
        found.clear();
        for (const auto& m : matches_) {
            if (dot(samples_[m.first].normal, s.normal) <= 0) continue;
            const Vec3 d = samples_[m.first].position - s.position;
            found.push_back({dot(d, s.x), dot(d, s.y), dot(d, d), m.first});
        }
    }
    /// Adds an element's footprint to the counts, or takes it away. `local`: the samples around it.
    void add(const Seed& s, int what, const std::vector<Local>& local) {
        const Footprint& f = footprint(s.kind);
        const double reach = f.radius() * s.scale;  // on a bent surface a footprint reaches only so far
        for (const Local& l : local)
            if (l.distance2 <= reach * reach && f.covers(l.x / s.scale, l.y / s.scale)) count_[l.sample] += what;
    }
    void add(const Seed& s) {
        around(standOf(s), footprint(s.kind).radius() * s.scale * (1 + 1e-9), local_);
        add(s, 1, local_);
    }

  private:
    static std::vector<SurfacePoint> makeSamples(const Surface& surface, size_t seeds, uint64_t seed) {
        constexpr size_t kForEach = 80, kLeast = 5000, kMost = 4000000;
        Rng rng(seed, 9);
        return surface.sample(std::clamp(kForEach * seeds, kLeast, kMost), rng);
    }
    std::vector<SurfacePoint> samples_;
    PointCloud cloud_{samples_};
    KdTree tree_{3, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(16)};
    std::vector<int> count_;
    std::vector<Footprint> footprints_;
    std::vector<std::pair<size_t, double>> matches_;
    std::vector<Local> local_;
};

}  // namespace

CoverMeasure measureCover(const Surface& surface, const std::vector<Seed>& seeds,
                          const std::vector<ElementKind>& kinds) {
    Cover cover(surface, seeds.size(), kinds, 0);
    for (const Seed& s : seeds) cover.add(s);
    double none = 0, sum = 0, squares = 0;
    const double n = double(cover.size());
    for (size_t i = 0; i < cover.size(); ++i) {
        const double c = cover.count(i);
        none += c == 0;
        sum += c;
        squares += c * c;
    }
    return {none / n, std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)))};
}

void refine(const Surface& ground, const Surface& region, const std::vector<ElementKind>& kinds,
            const RefineOptions& options, std::vector<SurfacePoint>& points, Seed* seeds) {
    const size_t n = points.size();
    if (options.iterations <= 0 || n == 0) return;
    Cover cover(region, n, kinds, options.seed);
    double area = 0;
    for (size_t i = 0; i < n; ++i) {
        cover.add(seeds[i]);
        area += kinds[size_t(seeds[i].kind)].footprint * seeds[i].scale * seeds[i].scale;
    }
    // What one footprint more costs at a point that has c.
    constexpr int kCounts = 32;
    constexpr double kHole = 1.5;
    double cost[kCounts];
    const double mean = area / region.area();
    for (int c = 0; c < kCounts; ++c) cost[c] = 2 * (c - mean) + 1 - (c == 0 ? kHole : 0);

    const double spacing = std::sqrt(region.area() / double(n));
    std::vector<Cover::Local> local;
    std::vector<size_t> order(n);
    for (size_t i = 0; i < n; ++i) order[i] = i;
    Rng rng(options.seed, 10);
    for (int it = 0; it < options.iterations; ++it) {
        const double left = 1 - double(it) / options.iterations, step = 0.3 * spacing * left * left + 0.01 * spacing,
                     turn = 40 * left * left + 1;
        for (size_t i = n; i > 1; --i)
            std::swap(order[i - 1], order[std::min(i - 1, size_t(rng.uniform() * double(i)))]);
        for (size_t i : order) {
            Seed& s = seeds[i];
            const Footprint& f = cover.footprint(s.kind);
            const Stand stand = standOf(s);
            cover.around(stand, f.radius() * s.scale + step, local);
            cover.add(s, -1, local);
            struct Move {
                double dx = 0, dy = 0, turn = 0;
            } best;
            double least = 1e300;
            const auto attempt = [&](const Move& m) {
                const double c = std::cos(degreesToRadians(m.turn)) / s.scale,
                             sn = std::sin(degreesToRadians(m.turn)) / s.scale;
                double sum = 0;
                for (const Cover::Local& l : local) {
                    const double x = l.x - m.dx, y = l.y - m.dy;
                    if (f.covers(c * x + sn * y, c * y - sn * x))
                        sum += cost[std::min(cover.count(l.sample), kCounts - 1)];
                }
                if (sum < least) least = sum, best = m;
            };
            attempt({});
            bool moved = false;
            constexpr int kDirections = 8;
            const double phase = rng.uniform();
            for (int k = 0; k < kDirections; ++k) {
                const double a = 2 * kPi * (k + phase) / kDirections;
                attempt({step * std::cos(a), step * std::sin(a), 0});
            }
            if (options.turn) {
                attempt({0, 0, turn});
                attempt({0, 0, -turn});
                attempt({0, 0, 360 * rng.uniform()});
            }
            if (best.dx != 0 || best.dy != 0) {
                const SurfacePoint to = ground.walked(points[i], best.dx * stand.x + best.dy * stand.y);
                if (&ground == &region || region.closest(to.position).distance < 1e-6 * spacing) {
                    // The tangent is carried along, so that the rotation keeps its meaning.
                    const Vec3 axis = cross(s.normal, to.normal);
                    const double angle = std::atan2(length(axis), dot(s.normal, to.normal));
                    const Vec3 t = rotatedAbout(s.tangent, normalized(axis, s.normal), angle);
                    s.tangent = normalized(t - dot(t, to.normal) * to.normal, anyPerpendicular(to.normal));
                    s.position = to.position;
                    s.normal = to.normal;
                    points[i] = to;
                    moved = true;
                }
            }
            s.rotation = std::fmod(s.rotation + best.turn + 360, 360.0);
            if (moved || best.turn != 0)
                cover.add(s);
            else
                cover.add(s, 1, local);
        }
    }
}

}  // namespace pavel
