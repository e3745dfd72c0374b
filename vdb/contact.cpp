#include "pavel/vdb/contact.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "pavel/vdb/bisector.h"
#include "pavel/vdb/voxelize.h"

namespace pavel {
namespace {

/// A field at a point.
struct Sample {
    double value;
    Vec3 gradient;
};

/// The values around a voxel, null where its block has none.
const float* blockAt(const CompactReader& reader, const Coord& c) {
    return reader.probe(leafOrigin(c));
}
const float* blockAt(const BaseReader& reader, const Coord& c) {
    const auto* leaf = reader.probeConstLeaf(c);
    return leaf ? leaf->buffer().data() : nullptr;
}

/// Both from the trilinear form of the eight nodes around, so that these are read once.
template <class Reader>
Sample sampleWithGradient(const Reader& reader, const Vec3& p) {
    const Coord lo(int(std::floor(p[0])), int(std::floor(p[1])), int(std::floor(p[2])));
    const double u = p[0] - lo[0], v = p[1] - lo[1], w = p[2] - lo[2];
    double c[8];
    const float* block = blockAt(reader, lo);
    if (block && (lo[0] & 7) < 7 && (lo[1] & 7) < 7 && (lo[2] & 7) < 7) {
        const float* at = block + WorkLeaf::coordToOffset(lo);
        for (int n = 0; n < 8; ++n) c[n] = double(at[64 * (n >> 2) + 8 * (n >> 1 & 1) + (n & 1)]);
    } else {
        for (int n = 0; n < 8; ++n) c[n] = double(reader.getValue(lo.offsetBy(n >> 2, n >> 1 & 1, n & 1)));
    }
    const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
    const double a = mix(c[0], c[1], w), b = mix(c[2], c[3], w), d = mix(c[4], c[5], w), e = mix(c[6], c[7], w);
    return {mix(mix(a, b, v), mix(d, e, v), u),
            {mix(d, e, v) - mix(a, b, v), mix(b - a, e - d, u),
             mix(mix(c[1] - c[0], c[3] - c[2], v), mix(c[5] - c[4], c[7] - c[6], v), u)}};
}

/// Newton's method for the curve a = b = 0, smallest steps first found; the gradients there. False where it does not
/// settle near its start.
template <class A, class B>
bool snapToCurve(const A& a, const B& b, Vec3& p, Vec3& ga, Vec3& gb) {
    const Vec3 start = p;
    for (int it = 0; it < 6; ++it) {
        const Sample atA = a(p), atB = b(p);
        const double va = atA.value, vb = atB.value;
        ga = atA.gradient, gb = atB.gradient;
        if (std::abs(va) < 0.02 && std::abs(vb) < 0.02) return length(p - start) < 2;
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
std::vector<RimPoint> thinned(std::vector<RimPoint> points) {
    const auto cell = [](const RimPoint& r) {
        const Vec3f& p = r.place;
        return std::array<int, 3>{int(std::floor(p[0] * 4)), int(std::floor(p[1] * 4)), int(std::floor(p[2] * 4))};
    };
    std::stable_sort(points.begin(), points.end(),
                     [&](const RimPoint& a, const RimPoint& b) { return cell(a) < cell(b); });
    points.erase(std::unique(points.begin(), points.end(),
                             [&](const RimPoint& a, const RimPoint& b) { return cell(a) == cell(b); }),
                 points.end());
    return points;
}

/// Down the slope of what is taken, along the surface.
Vec3f awayFrom(const Vec3& taken, const Vec3& surface) {
    const Vec3 along = (dot(taken, surface) / std::max(dot(surface, surface), 1e-9)) * surface - taken;
    const double l = length(along);
    return l > 0.05 ? Vec3f(along / l) : Vec3f{0, 0, 0};
}

/// Voxels to start from are no farther than this from both surfaces: half the diagonal of a square, so that there is
/// one in every layer of voxels that a rim crosses.
constexpr float kBeside = 0.71f;

/// What another keeps, in a block.
PAVEL_WIDE void keptBy(const float* theirs, const float* bisector, float* kept) {
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) kept[v] = -theirs[v] < bisector[v] ? -theirs[v] : bisector[v];
}

struct SurfaceBlock {
    Coord origin;
    const float* values;
    BlockMask mask;
};

std::vector<SurfaceBlock> surfaceBlocks(const CompactLevelSet& of, const CompactReader& reader) {
    std::vector<SurfaceBlock> blocks;
    SurfaceBlock block;
    for (int b = 0; b < int(of.size()); ++b) {
        block.origin = of.origin(b);
        block.values = reader.probe(block.origin);
        if (nearMask(block.values, kBeside, block.mask)) blocks.push_back(block);
    }
    std::sort(blocks.begin(), blocks.end(),
              [](const SurfaceBlock& a, const SurfaceBlock& b) { return a.origin < b.origin; });
    return blocks;
}

/// What another element takes of the one at hand.
struct Cutter {
    int index;
    CoordBBox box;
    CompactReader reader;
    Bisector g;
    /// At a point on the element's own surface, given its distance to the other's. By depth, all of the own surface
    /// that lies in the other is taken.
    double taken(double phi, const Vec3& p) const { return g.byDepth() ? -phi : std::min(-phi, g(p)); }
    Sample operator()(const Vec3& p) const {
        const auto [phi, gradient] = sampleWithGradient(reader, p);
        if (g.byDepth()) return {-phi, -gradient};
        const double side = g(p);
        if (-phi <= side) return {-phi, -gradient};
        Vec3 slope;
        for (int k = 0; k < 3; ++k) {
            Vec3 half(0, 0, 0);
            half[k] = 0.5;
            slope[k] = g(p + half) - g(p - half);
        }
        return {side, slope};
    }
    /// Does a point on the element's own surface lie well within what the other takes?
    bool covers(const Vec3& p) const {
        constexpr double kWell = 0.3;  // from the border between what both keep, which is half as far as the surface
        const Coord nearest(int(std::lround(p[0])), int(std::lround(p[1])), int(std::lround(p[2])));
        // A voxel farther out than 1 is no less than 0.13 away from the point on it.
        if (!box.isInside(nearest) || reader.getValue(nearest) > 1) return false;
        const double phi = sampleAt(reader, p);
        return g.byDepth() ? phi < -2 * kWell : phi < -kWell && taken(phi, p) > kWell;
    }
};

/// A point on the rim of two elements, moved onto that of the result's grid. On the one at hand, lines between voxels
/// cut the bends of surfaces by some hundredths of a voxel, which the result shows as bumps along its seams. `taken`,
/// `own`: values and gradients at hand.
template <class Own>
Vec3f settled(const WorkElement& e, const WorkElement& other, const Cutter& taken, const Own& own, const Vec3f& start) {
    constexpr double kMost = 0.3;  // farther off, what is there is not what the other grid shows
    const Vec3 from(start[0], start[1], start[2]);
    Vec3 p = from;
    for (int it = 0; it < 3; ++it) {
        const Vec3 a = taken(p).gradient, b = own(p).gradient;
        const double va = taken.taken(placedDistance(*other.fine, other.indexFromElement, p), p),
                     vb = placedDistance(*e.fine, e.indexFromElement, p);
        const double aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), det = aa * bb - ab * ab;
        if (det < 0.02) return start;
        p += (-va * bb + vb * ab) / det * a + (-vb * aa + va * ab) / det * b;
        if (length(p - from) > kMost) return start;
    }
    return Vec3f(p);
}

const openvdb::FloatTree& noBase() {
    static const openvdb::FloatTree nothing;
    return nothing;
}

/// Finds the rims of one element.
class RimFinder {
  public:
    RimFinder(const WorkElement& e, const std::vector<WorkElement>& all, const openvdb::FloatTree* base)
        : e_(e), all_(all), hasBase_(base), own_(e.placed), solid_(base ? *base : noBase()) {
        for (int n : e.neighbours) {
            const WorkElement& other = all[size_t(n)];
            cutters_.push_back({n, other.box, CompactReader(other.placed), Bisector(e, other)});
        }
        surface_ = surfaceBlocks(e.placed, own_);
    }

    /// Without pieces where there is none.
    ContactDistance::RimOfTwo withNeighbour(size_t k) const {
        const Cutter& c = cutters_[k];
        const WorkElement& other = all_[size_t(c.index)];
        CoordBBox shared = e_.box;
        shared.intersect(other.box);
        if (shared.empty()) return {};
        // The rim lies on the other's surface, or, where centres decide and that is the farther one, on the bisector
        // within it.
        const auto nearCutter = [&](const SurfaceBlock& block, float* values) {
            const float* known = c.reader.probe(block.origin);
            if (!known && c.reader.getValue(block.origin) > 0) return false;
            const float* theirs = known ? known : uniformValues(true);
            if (c.g.byDepth()) {
                // Some starts do not settle: a few more, on both sides alike.
                constexpr float kShare = 0.67f;
                std::transform(theirs, theirs + 512, values, [](float v) { return -kShare * v; });
                return true;
            }
            float bisector[512];
            c.g.over(block.origin, 1, block.values, theirs, bisector);
            keptBy(theirs, bisector, values);
            return true;
        };
        const std::vector<RimPoint> points = pointsWith(c, nearCutter, shared, c.index);
        if (points.empty()) return {};
        if (!e_.fine || !other.fine) return ContactDistance::join(points);
        const auto onSurface = [&](const Vec3& p) { return sampleWithGradient(own_, p); };
        return ContactDistance::join(points, [&](const Vec3f& p) { return settled(e_, other, c, onSurface, p); });
    }

    ContactDistance::Rim withBase() const {
        const auto inBase = [&](const Vec3& p) {
            const Sample s = sampleWithGradient(solid_, p);
            return Sample{-s.value, -s.gradient};
        };
        const auto nearBase = [&](const SurfaceBlock& block, float* values) {
            const auto* leaf = solid_.probeConstLeaf(block.origin);
            if (leaf) std::copy_n(leaf->buffer().data(), 512, values);
            return leaf != nullptr;
        };
        return ContactDistance::join(pointsWith(inBase, nearBase, e_.box, -1)).own;
    }

  private:
    /// Points of the rim lie near surface voxels where the taken region's boundary passes, too. near(block, values):
    /// its values in a block, without interpolation, or false where it does not come there.
    template <class Taken, class Near>
    std::vector<RimPoint> pointsWith(const Taken& taken, const Near& near, const CoordBBox& box, int self) const {
        const auto onSurface = [&](const Vec3& p) { return sampleWithGradient(own_, p); };
        std::vector<RimPoint> points;
        float values[512];
        BlockMask mask;
        for (const SurfaceBlock& block : surface_) {
            if (!box.hasOverlap(CoordBBox(block.origin, block.origin.offsetBy(7)))) continue;
            if (!near(block, values) || !nearMask(values, kBeside, mask)) continue;
            for (size_t row = 0; row < 64; ++row) mask[row] &= block.mask[row];
            for (int v = 0; v < 512; ++v) {
                if (!testMask(mask, v)) continue;
                Vec3 p = centreOf(block.origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)));
                Vec3 slope, normal;
                if (!snapToCurve(taken, onSurface, p, slope, normal)) continue;
                const bool covered = (self >= 0 && hasBase_ && sampleAt(solid_, p) < -0.3) ||
                                     std::any_of(cutters_.begin(), cutters_.end(),
                                                 [&](const Cutter& c) { return c.index != self && c.covers(p); });
                if (!covered) points.push_back({Vec3f(p), awayFrom(slope, normal), awayFrom(-normal, slope)});
            }
        }
        return thinned(std::move(points));
    }

    const WorkElement& e_;
    const std::vector<WorkElement>& all_;
    bool hasBase_;
    CompactReader own_;
    BaseReader solid_;
    std::vector<Cutter> cutters_;
    std::vector<SurfaceBlock> surface_;
};

/// Where depth decides, both lie on the same rim: the curve in which their surfaces cross.
bool shareRim(const WorkElement& a, const WorkElement& b) {
    return Bisector(a, b).byDepth();
}

}  // namespace

void findContacts(std::vector<WorkElement>& elements, const openvdb::FloatTree* base) {
    struct Found {
        int other;
        ContactDistance::RimOfTwo rim;
    };
    // A shared rim is found by the lower one of the two.
    std::vector<std::vector<Found>> found(elements.size());
    tbb::parallel_for(size_t(0), elements.size(), [&](size_t i) {
        const WorkElement& e = elements[i];
        std::unique_ptr<const RimFinder> rims;
        for (size_t k = 0; k < e.neighbours.size(); ++k) {
            const int n = e.neighbours[k];
            const WorkElement& other = elements[size_t(n)];
            const bool shared = shareRim(e, other), asked = e.bodyVoxels || (shared && other.bodyVoxels);
            if (!asked || (shared && n < int(i))) continue;
            if (!rims) rims = std::make_unique<RimFinder>(e, elements, base);
            ContactDistance::RimOfTwo rim = rims->withNeighbour(k);
            if (!rim.own.away.empty()) found[i].push_back({n, std::move(rim)});
        }
    });
    tbb::parallel_for(size_t(0), elements.size(), [&](size_t i) {
        WorkElement& e = elements[i];
        if (!e.bodyVoxels) return;
        e.contact = std::make_shared<ContactDistance>();
        const auto take = [&](size_t by, int other) -> ContactDistance::RimOfTwo* {
            const auto at = std::lower_bound(found[by].begin(), found[by].end(), other,
                                             [](const Found& f, int n) { return f.other < n; });
            return at == found[by].end() || at->other != other ? nullptr : &at->rim;
        };
        for (int n : e.neighbours) {
            const bool othersWork = n < int(i) && shareRim(e, elements[size_t(n)]);
            ContactDistance::RimOfTwo* rim = othersWork ? take(size_t(n), int(i)) : take(i, n);
            if (!rim) continue;
            e.contacts.push_back(n);
            e.contact->add(std::move(othersWork ? rim->others : rim->own));
        }
        if (!e.contact->empty() || !base || !(e.lost() > 0)) return;
        ContactDistance::Rim rim = RimFinder(e, elements, base).withBase();
        if (!rim.away.empty()) e.contact->add(std::move(rim));
    });
}

}  // namespace pavel
