#include "pavel/vdb/contact.h"

#include <algorithm>
#include <nanoflann.hpp>

namespace pavel {
namespace {

struct Cloud {
    std::vector<Vec3f> points;
    size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(size_t i, size_t k) const { return points[i][k]; }
    template <class B>
    bool kdtree_get_bbox(B&) const {
        return false;
    }
};
using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, uint32_t>;

constexpr double kExponent = 4;

template <class Field>
Vec3 gradientOf(const Field& f, const Vec3& p) {
    constexpr double h = 0.5;
    return {f(p + Vec3(h, 0, 0)) - f(p - Vec3(h, 0, 0)), f(p + Vec3(0, h, 0)) - f(p - Vec3(0, h, 0)),
            f(p + Vec3(0, 0, h)) - f(p - Vec3(0, 0, h))};
}

/// Newton's method for the curve a = b = 0, smallest steps first found. False where it does not settle near its start.
template <class A, class B>
bool snapToCurve(const A& a, const B& b, Vec3& p) {
    const Vec3 start = p;
    for (int it = 0; it < 6; ++it) {
        const double va = a(p), vb = b(p);
        if (std::abs(va) < 0.02 && std::abs(vb) < 0.02) return length(p - start) < 2;
        const Vec3 ga = gradientOf(a, p), gb = gradientOf(b, p);
        const double aa = dot(ga, ga), ab = dot(ga, gb), bb = dot(gb, gb), det = aa * bb - ab * ab;
        if (det < 0.02) return false;  // the surfaces touch without crossing
        const double la = (-va * bb + vb * ab) / det, lb = (-vb * aa + va * ab) / det;
        Vec3 step = la * ga + lb * gb;
        const double l = length(step);
        if (l > 1) step /= l;
        p += step;
    }
    return false;
}

/// One point for each cell of a quarter voxel, so that the queries stay cheap.
std::vector<Vec3f> thinned(std::vector<Vec3f> points) {
    const auto cell = [](const Vec3f& p) {
        return std::array<int, 3>{int(std::floor(p[0] * 4)), int(std::floor(p[1] * 4)), int(std::floor(p[2] * 4))};
    };
    std::stable_sort(points.begin(), points.end(), [&](const Vec3f& a, const Vec3f& b) { return cell(a) < cell(b); });
    points.erase(
        std::unique(points.begin(), points.end(), [&](const Vec3f& a, const Vec3f& b) { return cell(a) == cell(b); }),
        points.end());
    return points;
}

}  // namespace

struct ContactDistance::Rim {
    Cloud cloud;
    KdTree tree;
    Vec3 centre{0, 0, 0};
    double radius = 0;
    explicit Rim(std::vector<Vec3f> points)
        : cloud{std::move(points)}, tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(12)) {
        for (const Vec3f& p : cloud.points) centre += Vec3(p[0], p[1], p[2]);
        centre /= double(cloud.points.size());
        for (const Vec3f& p : cloud.points) radius = std::max(radius, length(Vec3(p[0], p[1], p[2]) - centre));
    }
};

ContactDistance::ContactDistance() = default;
ContactDistance::~ContactDistance() = default;
void ContactDistance::addRim(std::vector<Vec3f> points) {
    rims_.push_back(std::make_unique<Rim>(std::move(points)));
}
const std::vector<Vec3f>& ContactDistance::rimPoints(size_t rim) const {
    return rims_[rim]->cloud.points;
}

Vec3 ContactDistance::nearest(const Vec3& p) const {
    const float q[3] = {float(p[0]), float(p[1]), float(p[2])};
    float best = 1e30f;
    Vec3 point = p;
    for (const auto& rim : rims_) {
        uint32_t index;
        float d2;
        rim->tree.knnSearch(q, 1, &index, &d2);
        if (d2 >= best) continue;
        best = d2;
        const Vec3f& r = rim->cloud.points[index];
        point = Vec3(r[0], r[1], r[2]);
    }
    return point;
}

double ContactDistance::operator()(const Vec3& p) const {
    const float q[3] = {float(p[0]), float(p[1]), float(p[2])};
    double sum = 0;
    for (const auto& rim : rims_) {
        uint32_t index;
        float d2;
        rim->tree.knnSearch(q, 1, &index, &d2);
        if (d2 < 1e-8f) return 0;
        sum += 1 / (double(d2) * double(d2));  // d^-4
    }
    static_assert(kExponent == 4, "the sum above spells the exponent out");
    return sum > 0 ? std::pow(sum, -1 / kExponent) : 1e9;
}

void findContacts(WorkElement& e, const std::vector<WorkElement>& all, const openvdb::FloatTree* base) {
    e.contact = std::make_shared<ContactDistance>();
    const WorkReader own(*e.placed);
    const auto onSurface = [&](const Vec3& p) { return sampleAt(own, p); };
    struct Cutter {
        int index;
        WorkReader reader;
        Bisector g;
        double operator()(const Vec3& p) const { return std::min(-sampleAt(reader, p), g(p)); }
    };
    std::vector<Cutter> cutters;
    for (int n : e.neighbours) cutters.push_back({n, WorkReader(*all[size_t(n)].placed), Bisector(e, all[size_t(n)])});
    static const openvdb::FloatTree nothing;
    const BaseReader solid(base ? *base : nothing);
    const auto inBase = [&](const Vec3& p) { return base ? -sampleAt(solid, p) : -double(kBand); };

    // Points of the rim lie near surface voxels where the taken region's boundary passes, too.
    const auto rimWith = [&](const auto& taken, const CoordBBox& box, int self) {
        std::vector<Vec3f> points;
        forEachBlock(box, [&](const Coord& origin) {
            const WorkLeaf* leaf = e.placed->probeConstLeaf(origin);
            if (!leaf) return;
            for (openvdb::Index v = 0; v < WorkLeaf::SIZE; ++v) {
                if (std::abs(leaf->getValue(v)) > 0.87f) continue;
                Vec3 p = centreOf(leaf->offsetToGlobalCoord(v));
                if (std::abs(taken(p)) > 0.87 || !snapToCurve(taken, onSurface, p)) continue;
                bool covered = self >= 0 && inBase(p) > 0.3;
                for (const Cutter& c : cutters) covered |= c.index != self && c(p) > 0.3;
                if (!covered) points.emplace_back(float(p[0]), float(p[1]), float(p[2]));
            }
        });
        return thinned(std::move(points));
    };
    for (const Cutter& c : cutters) {
        CoordBBox shared = e.box;
        shared.intersect(all[size_t(c.index)].box);
        if (shared.empty()) continue;
        std::vector<Vec3f> points = rimWith(c, shared, c.index);
        if (points.empty()) continue;
        e.contacts.push_back(c.index);
        e.contact->addRim(std::move(points));
    }
    if (e.contact->empty() && base && e.lost() > 0) {
        std::vector<Vec3f> points = rimWith(inBase, e.box, -1);
        if (!points.empty()) e.contact->addRim(std::move(points));
    }
}

}  // namespace pavel
