#include "pavel/vdb/shell_parts.h"

#include <algorithm>
#include <numeric>
#include <queue>
#include <tuple>

#include "pavel/core/error.h"

namespace pavel {
namespace {

constexpr int kMostParts = 48;

Bounds boundsOf(const ShellGraph& g, const std::vector<int>& members) {
    Bounds b;
    for (int i : members) b.add(g.bounds[size_t(i)].min), b.add(g.bounds[size_t(i)].max);
    return b;
}

/// Middle of a part, in place and in direction.
struct Centre {
    Vec3 position, normal;
};

/// Balanced growth: the smallest part takes the nearest element that touches it. Distances count place and direction,
/// so that parts do not bend around the base.
class Grower {
  public:
    Grower(const ShellGraph& graph, size_t count) : g_(graph), count_(count) {
        Bounds all;
        for (const Vec3& p : g_.position) all.add(p);
        reach2_ = 0.25 * std::max(dot(all.size(), all.size()), 1e-30);
    }

    std::vector<int> grow() {
        placeSeeds();
        std::vector<int> part;
        for (int round = 0; round < 12; ++round) {
            part = growOnce();
            recentre(part);
        }
        return part;
    }

  private:
    double distance2(const Centre& c, size_t i) const {
        const Vec3 d = c.position - g_.position[i], n = c.normal - g_.normal[i];
        return dot(d, d) / reach2_ + dot(n, n);
    }
    Centre at(size_t i) const { return {g_.position[i], g_.normal[i]}; }

    /// Farthest points.
    void placeSeeds() {
        const size_t n = g_.position.size();
        std::vector<double> nearest(n, 1e300);
        size_t next = 0;
        for (size_t i = 1; i < n; ++i)
            if (g_.position[i][2] > g_.position[next][2]) next = i;
        for (size_t k = 0; k < count_; ++k) {
            seeds_.push_back(int(next));
            centres_.push_back(at(next));
            for (size_t i = 0; i < n; ++i) nearest[i] = std::min(nearest[i], distance2(centres_.back(), i));
            next = size_t(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
        }
    }

    std::vector<int> growOnce() const {
        using Offer = std::pair<double, int>;
        std::vector<std::priority_queue<Offer, std::vector<Offer>, std::greater<>>> front(count_);
        std::vector<int> part(g_.position.size(), -1);
        std::vector<double> volume(count_, 0);
        const auto take = [&](size_t k, int i) {
            part[size_t(i)] = int(k);
            volume[k] += g_.volume[size_t(i)];
            for (int j : g_.neighbours[size_t(i)])
                if (part[size_t(j)] < 0) front[k].emplace(distance2(centres_[k], size_t(j)), j);
        };
        for (size_t k = 0; k < count_; ++k)
            if (part[size_t(seeds_[k])] < 0) take(k, seeds_[k]);
        for (;;) {
            size_t smallest = count_;
            for (size_t k = 0; k < count_; ++k) {
                while (!front[k].empty() && part[size_t(front[k].top().second)] >= 0) front[k].pop();
                if (!front[k].empty() && (smallest == count_ || volume[k] < volume[smallest])) smallest = k;
            }
            if (smallest < count_) {
                take(smallest, front[smallest].top().second);
                continue;
            }
            // What touches nothing that is taken goes to the nearest part.
            const auto left = std::find(part.begin(), part.end(), -1);
            if (left == part.end()) return part;
            const size_t i = size_t(left - part.begin());
            size_t best = 0;
            for (size_t k = 1; k < count_; ++k)
                if (distance2(centres_[k], i) < distance2(centres_[best], i)) best = k;
            take(best, int(i));
        }
    }

    void recentre(const std::vector<int>& part) {
        std::vector<Centre> sum(count_, {Vec3(0, 0, 0), Vec3(0, 0, 0)});
        std::vector<double> volume(count_, 0);
        for (size_t i = 0; i < part.size(); ++i) {
            const size_t k = size_t(part[i]);
            sum[k].position += g_.volume[i] * g_.position[i];
            sum[k].normal += g_.volume[i] * g_.normal[i];
            volume[k] += g_.volume[i];
        }
        for (size_t k = 0; k < count_; ++k)
            if (volume[k] > 0) centres_[k] = {sum[k].position / volume[k], sum[k].normal / volume[k]};
        std::vector<double> best(count_, 1e300);
        for (size_t i = 0; i < part.size(); ++i) {
            const size_t k = size_t(part[i]);
            if (const double d = distance2(centres_[k], i); d < best[k]) best[k] = d, seeds_[k] = int(i);
        }
    }

    const ShellGraph& g_;
    size_t count_;
    double reach2_ = 1;
    std::vector<int> seeds_;
    std::vector<Centre> centres_;
};

std::vector<std::vector<int>> membersOf(const std::vector<int>& part) {
    std::vector<std::vector<int>> members;
    for (size_t i = 0; i < part.size(); ++i) {
        if (size_t(part[i]) >= members.size()) members.resize(size_t(part[i]) + 1);
        members[size_t(part[i])].push_back(int(i));
    }
    members.erase(std::remove_if(members.begin(), members.end(), [](const auto& m) { return m.empty(); }),
                  members.end());
    return members;
}

std::vector<int> quarters(const ShellGraph& g) {
    Bounds all;
    for (const Bounds& b : g.bounds) all.add(b.min), all.add(b.max);
    const Vec3 middle = 0.5 * (all.min + all.max);
    std::vector<int> part;
    for (const Vec3& p : g.position) part.push_back((p[0] > middle[0] ? 1 : 0) + (p[1] > middle[1] ? 2 : 0));
    return part;
}

}  // namespace

bool fitsBed(const Bounds& b, const Vec3& bed) {
    const Vec3 s = b.size();
    return s[0] <= bed[0] && s[1] <= bed[1] && s[2] <= bed[2];
}

void checkBed(const ShellGraph& graph, const Vec3& bed) {
    for (size_t i = 0; i < graph.bounds.size(); ++i)
        if (!fitsBed(graph.bounds[i], bed))
            throw InputError("shell.bed: element " + std::to_string(graph.id[i]) + " alone is larger than the bed");
}

Release releaseOf(const ShellGraph& graph, const std::vector<int>& members) {
    std::vector<Vec3> normals;
    Vec3 sum(0, 0, 0);
    for (int i : members)
        for (const Vec3& n : graph.backNormals[size_t(i)]) normals.push_back(n), sum += n;
    Release r;
    if (normals.empty()) return r;
    Vec3 d = normalized(sum);
    double best = -2;
    for (int step = 1; step <= 400; ++step) {
        size_t worst = 0;
        double least = 2;
        for (size_t k = 0; k < normals.size(); ++k)
            if (const double c = dot(normals[k], d); c < least) least = c, worst = k;
        if (least > best) best = least, r.direction = d;
        d = normalized(d + 1.0 / (step + 1) * normals[worst], d);
    }
    const double leans = -std::sin(degreesToRadians(2));
    const auto under = [&](const Vec3& n) { return dot(n, r.direction) < leans; };
    r.undercut = double(std::count_if(normals.begin(), normals.end(), under)) / double(normals.size());
    return r;
}

std::vector<std::vector<int>> connected(const ShellGraph& graph, std::vector<int> part) {
    const size_t n = part.size();
    for (int round = 0; round < 4; ++round) {
        // Pieces of each part; all but its largest may move.
        std::vector<int> piece(n, -1), stack;
        std::vector<size_t> size;
        for (size_t s = 0; s < n; ++s) {
            if (piece[s] >= 0) continue;
            const int number = int(size.size());
            size.push_back(0);
            piece[s] = number;
            stack.assign(1, int(s));
            while (!stack.empty()) {
                const int i = stack.back();
                stack.pop_back();
                ++size.back();
                for (int j : graph.neighbours[size_t(i)])
                    if (piece[size_t(j)] < 0 && part[size_t(j)] == part[size_t(i)])
                        piece[size_t(j)] = number, stack.push_back(j);
            }
        }
        std::vector<size_t> largest(size_t(*std::max_element(part.begin(), part.end())) + 1, 0);
        for (size_t i = 0; i < n; ++i)
            largest[size_t(part[i])] = std::max(largest[size_t(part[i])], size[size_t(piece[i])]);
        const std::vector<int> before = part;
        for (size_t i = 0; i < n; ++i) {
            if (size[size_t(piece[i])] == largest[size_t(before[i])]) continue;
            for (int j : graph.neighbours[i])
                if (before[size_t(j)] != before[i] && size[size_t(piece[size_t(j)])] > size[size_t(piece[i])])
                    part[i] = before[size_t(j)];
        }
        if (part == before) break;
    }
    return membersOf(part);
}

std::vector<std::vector<int>> shellParts(const ShellGraph& g, const ShellOptions& options) {
    const size_t n = g.position.size();
    if (options.split == "planes") return connected(g, quarters(g));
    if (options.split == "count") {
        if (size_t(options.parts) > n)
            throw InputError("shell.parts: " + std::to_string(options.parts) + " parts are more than the " +
                             std::to_string(n) + " elements");
        return connected(g, Grower(g, size_t(options.parts)).grow());
    }
    std::vector<std::vector<int>> best;
    size_t least = 0;
    for (size_t count = 1; count <= std::min<size_t>(n, kMostParts); ++count) {
        std::vector<std::vector<int>> parts = connected(g, Grower(g, count).grow());
        size_t failing = 0, locked = 0;
        for (const auto& p : parts) {
            failing += !fitsBed(boundsOf(g, p), options.bed);
            locked += !releaseOf(g, p).free();
        }
        if (failing + locked == 0) return parts;
        // A part that does not fit can't be printed at all; one that is locked is worth four more parts to glue.
        const size_t cost = failing * 1000 + locked * 4 + parts.size();
        if (best.empty() || cost < least) least = cost, best = std::move(parts);
    }
    return best;
}

}  // namespace pavel
