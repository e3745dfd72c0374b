#include "pavel/seeding/stripes.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "pavel/seeding/kd_tree.h"

namespace pavel {
namespace {

/// How many crossings two patterns have by their gradients, borders left aside: the integral of |grad a x grad b| /
/// (2 pi)^2. Singular triangles count as their share of the area.
double crossingsByGradient(const TangentFrames& f, const std::vector<TrianglePhases>& a,
                           const std::vector<TrianglePhases>& b, double cellArea) {
    double sum = 0;
    for (size_t t = 0; t < a.size(); ++t) {
        // In a triangle's own coordinates the cross product is the ratio of areas.
        const auto& p = a[t].corner;
        const auto& q = b[t].corner;
        if (a[t].flipped || a[t].turns() || b[t].turns())
            sum += triangleArea(f.mesh().corner(t, 0), f.mesh().corner(t, 1), f.mesh().corner(t, 2)) / cellArea;
        else
            sum += std::abs((p[1] - p[0]) * (q[2] - q[0]) - (p[2] - p[0]) * (q[1] - q[0])) / (8 * kPi * kPi);
    }
    return sum;
}

void swapEnds(int (&pair)[2]) {
    std::swap(pair[0], pair[1]);
}

/// Crossings as seeds, those that are too near to another left out.
std::vector<StripeSeed> thinned(const Surface& surface, StripeLines& lines, double least, size_t& dropped) {
    const auto& all = lines.crossings;
    std::vector<SurfacePoint> places(all.size());
    for (size_t i = 0; i < all.size(); ++i) places[i] = surface.pointOn(all[i].triangle, all[i].position);
    const PointCloud cloud{places};
    const KdTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8));
    const auto links = [&](size_t i) {
        int n = 0;
        for (int pattern : {0, 1}) n += (all[i].previous[pattern] >= 0) + (all[i].next[pattern] >= 0);
        return n;
    };
    std::vector<size_t> order(all.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return links(a) > links(b); });
    std::vector<char> kept(all.size(), 0);
    std::vector<std::pair<size_t, double>> near;
    for (size_t i : order) {
        tree.radiusSearch(places[i].position.data(), least * least, near, nanoflann::SearchParams(0, 0, false));
        kept[i] = std::none_of(near.begin(), near.end(), [&](const auto& n) {
            return kept[n.first] && dot(places[n.first].normal, places[i].normal) > 0;
        });
        dropped += !kept[i];
    }
    std::vector<int> number(all.size(), -1);
    std::vector<StripeSeed> seeds;
    for (size_t i = 0; i < all.size(); ++i) {
        if (!kept[i]) continue;
        number[i] = int(seeds.size());
        seeds.emplace_back();
        seeds.back().point = places[i];
        const Vec3 &d = all[i].along, &n = places[i].normal;
        seeds.back().along = normalized(d - dot(d, n) * n, anyPerpendicular(n));
    }
    for (int pattern : {0, 1})
        for (StripeLine& line : lines.lines[pattern]) {
            std::vector<int> left;
            for (int c : line.crossings)
                if (number[size_t(c)] >= 0) left.push_back(number[size_t(c)]);
            line.crossings = left;
            for (size_t k = 0; k + 1 < left.size() + (line.closed && left.size() > 2); ++k) {
                const int a = left[k], b = left[(k + 1) % left.size()];
                (pattern ? seeds[size_t(a)].onOther : seeds[size_t(a)].onMain)[1] = b;
                (pattern ? seeds[size_t(b)].onOther : seeds[size_t(b)].onMain)[0] = a;
            }
        }
    return seeds;
}

std::vector<size_t> longestFirst(const std::vector<StripeLine>& lines) {
    std::vector<size_t> order(lines.size());
    for (size_t l = 0; l < order.size(); ++l) order[l] = l;
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return lines[a].crossings.size() > lines[b].crossings.size(); });
    return order;
}

/// Turns main lines so that their tangents agree with their neighbours' and on the whole with what is preferred, and
/// the others so that they run to the left of them.
void orient(StripeLines& lines, std::vector<StripeSeed>& seeds, const std::function<Vec3(const Vec3&)>& preferred) {
    const size_t n = lines.lines[0].size();
    std::vector<int> lineOf(seeds.size(), -1);
    for (size_t l = 0; l < n; ++l)
        for (int s : lines.lines[0][l].crossings) lineOf[size_t(s)] = int(l);
    std::vector<int> sign(n, 0);
    for (size_t root : longestFirst(lines.lines[0])) {
        if (sign[root]) continue;
        std::vector<size_t> group{root};
        sign[root] = 1;
        for (size_t k = 0; k < group.size(); ++k) {
            std::vector<std::pair<int, double>> agreement;  // neighbouring line, sum of cosines
            for (int s : lines.lines[0][group[k]].crossings)
                for (int other : seeds[size_t(s)].onOther) {
                    if (other < 0 || lineOf[size_t(other)] < 0) continue;
                    const int l = lineOf[size_t(other)];
                    auto at =
                        std::find_if(agreement.begin(), agreement.end(), [&](const auto& a) { return a.first == l; });
                    if (at == agreement.end()) at = agreement.insert(agreement.end(), {l, 0});
                    at->second += dot(seeds[size_t(s)].along, seeds[size_t(other)].along);
                }
            for (const auto& [l, sum] : agreement)
                if (!sign[size_t(l)]) {
                    sign[size_t(l)] = sum >= 0 ? sign[group[k]] : -sign[group[k]];
                    group.push_back(size_t(l));
                }
        }
        double sum = 0;
        for (size_t l : group)
            for (int s : lines.lines[0][l].crossings)
                sum += sign[l] * dot(seeds[size_t(s)].along, preferred(seeds[size_t(s)].point.position));
        if (sum < 0)
            for (size_t l : group) sign[l] = -sign[l];
    }
    for (size_t l = 0; l < n; ++l) {
        if (sign[l] > 0) continue;
        StripeLine& line = lines.lines[0][l];
        std::reverse(line.points.begin(), line.points.end());
        std::reverse(line.crossings.begin(), line.crossings.end());
        for (int s : line.crossings) {
            seeds[size_t(s)].along *= -1;
            swapEnds(seeds[size_t(s)].onMain);
        }
    }
    for (StripeLine& line : lines.lines[1]) {
        double sum = 0;
        for (int s : line.crossings) {
            const StripeSeed& a = seeds[size_t(s)];
            if (a.onOther[1] < 0) continue;
            sum += dot(cross(a.point.normal, a.along), seeds[size_t(a.onOther[1])].point.position - a.point.position);
        }
        if (sum >= 0) continue;
        std::reverse(line.points.begin(), line.points.end());
        std::reverse(line.crossings.begin(), line.crossings.end());
        for (int s : line.crossings) swapEnds(seeds[size_t(s)].onOther);
    }
}

/// Numbers the main lines and the places along them: places follow each other on every line; lines, and where on each
/// the count begins, follow their neighbours as most of the links between them say.
void number(const StripeLines& lines, std::vector<StripeSeed>& seeds) {
    const size_t n = lines.lines[0].size();
    std::vector<int> lineOf(seeds.size(), -1), place(seeds.size(), 0);
    for (size_t l = 0; l < n; ++l)
        for (size_t k = 0; k < lines.lines[0][l].crossings.size(); ++k) {
            const size_t s = size_t(lines.lines[0][l].crossings[k]);
            lineOf[s] = int(l);
            place[s] = int(k);
        }
    std::vector<char> done(n, 0);
    std::vector<std::array<int, 2>> first(n, {0, 0});  // number of the line, and of its first place
    for (size_t root : longestFirst(lines.lines[0])) {
        if (done[root]) continue;
        std::vector<size_t> group{root};
        done[root] = 1;
        for (size_t k = 0; k < group.size(); ++k) {
            const std::array<int, 2> own = first[group[k]];
            std::map<int, std::map<std::array<int, 2>, int>> votes;  // of the links, for each neighbouring line
            for (int s : lines.lines[0][group[k]].crossings)
                for (int side : {0, 1}) {
                    const int other = seeds[size_t(s)].onOther[side];
                    if (other < 0 || lineOf[size_t(other)] < 0 || done[size_t(lineOf[size_t(other)])]) continue;
                    ++votes[lineOf[size_t(other)]]
                           [{own[0] + 2 * side - 1, own[1] + place[size_t(s)] - place[size_t(other)]}];
                }
            for (const auto& [line, says] : votes) {
                const auto most = std::max_element(says.begin(), says.end(),
                                                   [](const auto& a, const auto& b) { return a.second < b.second; });
                first[size_t(line)] = most->first;
                done[size_t(line)] = 1;
                group.push_back(size_t(line));
            }
        }
    }
    for (size_t s = 0; s < seeds.size(); ++s)
        if (lineOf[s] >= 0) seeds[s].index = {first[size_t(lineOf[s])][0], first[size_t(lineOf[s])][1] + place[s]};
}

/// Looks for the scale of a pattern that makes a ratio 1: the larger the scale, the smaller the ratio, in steps that
/// nobody knows beforehand.
class ScaleSearch {
  public:
    double next(double scale, double ratio) {
        (ratio > 1 ? least_ : most_) = scale;
        const double step = scale * std::sqrt(std::clamp(ratio, 0.25, 4.0)), margin = 0.1 * (most_ - least_);
        return least_ == 0 || std::isinf(most_) ? step : std::clamp(step, least_ + margin, most_ - margin);
    }

  private:
    double least_ = 0, most_ = std::numeric_limits<double>::infinity();  // known to be too small, and too large
};

}  // namespace

StripeSeeds stripeSeeds(const Surface& surface, const DirectionField& field, const StripeOptions& options,
                        const std::function<Vec3(const Vec3&)>& preferred) {
    StripeSolver solver(field);
    const double a = degreesToRadians(options.angle);
    StripeSeeds best;
    double scale = 1, bestError = 1e300;
    ScaleSearch search;
    constexpr int kAttempts = 5;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        StripeSeeds now;
        now.along = options.along * scale;
        now.across = options.across * scale;
        std::vector<TrianglePhases> main, other;
        tbb::parallel_invoke([&] { main = solver.solve(kPi / 2, now.across); },
                             [&] { other = solver.solve(a + kPi / 2, now.along * std::sin(a)); });
        const double least = std::min(now.along, now.across);
        now.lines = traceStripes(field.frames(), main, other, 1e-4 * least);
        now.seeds = thinned(surface, now.lines, 0.5 * least, now.dropped);
        for (size_t t = 0; t < main.size(); ++t) {
            now.singularities += main[t].flipped;
            now.branches += size_t(std::abs(main[t].turns()) + std::abs(other[t].turns()));
        }
        const double cell = options.along * options.across;
        const double ratio = options.count ? double(now.seeds.size()) / double(options.count)
                                           : crossingsByGradient(field.frames(), main, other, now.along * now.across) *
                                                 cell / surface.area();
        const double error = std::abs(ratio - 1);
        if (error < bestError) bestError = error, best = std::move(now);
        if (error <= (options.count ? 0.015 : 0.03) || !(ratio > 0)) break;
        scale = search.next(scale, ratio);
    }
    orient(best.lines, best.seeds, preferred);
    number(best.lines, best.seeds);
    return best;
}

}  // namespace pavel
