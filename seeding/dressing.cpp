#include "pavel/seeding/dressing.h"

#include <algorithm>

#include "pavel/core/rng.h"
#include "pavel/seeding/nearest.h"

namespace pavel {
namespace {

enum Stream : uint64_t { kKindStream = 2, kRotationStream, kSizeStream };

/// Seeds that are looked at to make neighbours differ.
constexpr size_t kAround = 6;

template <class T>
void shuffle(std::vector<T>& v, Rng& rng) {
    for (size_t i = v.size(); i > 1; --i) std::swap(v[i - 1], v[std::min(i - 1, size_t(rng.uniform() * double(i)))]);
}

/// Kinds in random order, each as often as its weight says, to one.
std::vector<int> byWeight(const std::vector<ElementKind>& kinds, const std::vector<int>& of, size_t count, Rng& rng) {
    double sum = 0, at = 0;
    for (int k : of) sum += kinds[size_t(k)].weight;
    std::vector<int> result;
    for (int k : of) {
        at += kinds[size_t(k)].weight;
        result.resize(size_t(std::llround(double(count) * at / sum)), k);
    }
    result.resize(count, of.back());
    shuffle(result, rng);
    return result;
}

/// Gives every point a class, one for each weight, that is rare among its neighbours; of equally rare ones that which
/// is behind its share.
std::vector<int> alternating(const std::vector<SurfacePoint>& points, const std::vector<double>& weights) {
    const std::vector<std::vector<size_t>> around = nearestOf(points, kAround);
    std::vector<int> classes(points.size(), -1);
    std::vector<double> used(weights.size(), 0);
    constexpr int kSweeps = 3;  // later ones know all the neighbours
    for (int sweep = 0; sweep < kSweeps; ++sweep)
        for (size_t i = 0; i < points.size(); ++i) {
            std::vector<int> near(weights.size(), 0);
            for (size_t n : around[i])
                if (classes[n] >= 0) ++near[size_t(classes[n])];
            if (classes[i] >= 0) --used[size_t(classes[i])];
            int best = -1;
            for (size_t c = 0; c < weights.size(); ++c) {
                if (!(weights[c] > 0)) continue;
                const size_t b = size_t(best);
                if (best < 0 || near[c] < near[b] ||
                    (near[c] == near[b] && used[c] / weights[c] < used[b] / weights[b]))
                    best = int(c);
            }
            classes[i] = best;
            ++used[size_t(best)];
        }
    return classes;
}

}  // namespace

Vec3 upTangent(const Vec3& normal) {
    const Vec3 t = Vec3(0, 0, 1) - normal[2] * normal;
    return length(t) > 0.05 ? normalized(t) : anyPerpendicular(normal);
}

void dress(const std::vector<SurfacePoint>& points, const Dressing& d, std::vector<Seed>& seeds) {
    const Scene& scene = d.scene;
    const size_t n = points.size();
    Rng kindRng(scene.seed, d.stream + kKindStream), rotationRng(scene.seed, d.stream + kRotationStream),
        sizeRng(scene.seed, d.stream + kSizeStream);
    std::vector<int> kinds(n), turns;
    const auto inTurn = [&](int place) {
        const int count = int(d.of.size());
        return d.of[size_t(((place % count) + count) % count)];
    };
    if (d.stripes && scene.assignment != "random") {
        for (size_t i = 0; i < n; ++i) {
            const auto& index = (*d.stripes)[i].index;
            kinds[i] = inTurn(scene.assignment == "sequence" ? index[1] : index[0] + index[1]);
        }
    } else if (scene.assignment == "alternate") {
        std::vector<double> weights;
        for (int k : d.of) weights.push_back(d.kinds[size_t(k)].weight);
        const std::vector<int> classes = alternating(points, weights);
        for (size_t i = 0; i < n; ++i) kinds[i] = d.of[size_t(classes[i])];
    } else if (scene.assignment == "sequence") {
        for (size_t i = 0; i < n; ++i) kinds[i] = d.of[i % d.of.size()];
    } else {
        kinds = byWeight(d.kinds, d.of, n, kindRng);
    }
    std::vector<double> sizes(n);  // from -1 to 1
    for (size_t i = 0; i < n; ++i) sizes[i] = 2 * (double(i) + sizeRng.uniform()) / double(n) - 1;
    shuffle(sizes, sizeRng);
    const OrientationOptions& o = scene.orientation;
    if (o.rotation == "alternate" && !d.stripes) turns = alternating(points, {1, 1});
    for (size_t i = 0; i < n; ++i) {
        Seed s;
        s.id = int(seeds.size()) + 1;
        s.position = points[i].position;
        s.normal = points[i].normal;
        s.tangent = upTangent(s.normal);
        if (d.field) {
            const Vec3 t = d.field->at(points[i]);
            s.tangent = normalized(t - dot(t, s.normal) * s.normal, s.tangent);
        }
        if (d.stripes) {
            const StripeSeed& stripe = (*d.stripes)[i];
            s.tangent = stripe.along;
            s.stripe.emplace();
            s.stripe->index = stripe.index;
            const int first = s.id - int(i);
            for (size_t end : {size_t(0), size_t(1)}) {
                if (stripe.onMain[end] >= 0) s.stripe->along[end] = first + stripe.onMain[end];
                if (stripe.onOther[end] >= 0) s.stripe->across[end] = first + stripe.onOther[end];
            }
        }
        s.kind = kinds[i];
        const double u = rotationRng.uniform();
        s.rotation = o.rotation == "random" ? 360 * u : o.angle + o.jitter * (2 * u - 1);
        if (!turns.empty() && turns[i]) s.rotation += 180;
        if (d.stripes && o.rotation == "alternate" && (*d.stripes)[i].index[1] % 2) s.rotation += 180;
        s.scale = (d.scale.empty() ? 1 : d.scale[i]) * (1 + scene.sizeVariation * sizes[i]);
        seeds.push_back(s);
    }
}

}  // namespace pavel
