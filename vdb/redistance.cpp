#include "pavel/vdb/redistance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <new>

namespace pavel {
namespace {

/// Largest window, in blocks a side; the outer layer is halo.
constexpr int kMostBlocks = 20;
/// Voxels at a window's rim that only lend their values.
constexpr int kMargin = 3;
/// Nearer to both fields than this, a voxel may have its foot on the crease between them.
constexpr float kCrease = 1.8f;

struct Foot {
    Vec3f point, along;  ///< unit normal of the surface, or direction of the crease
    bool onCrease;
};

/// Values of one block: own and, where a second field cuts it, clip; null where `tile` stands for all.
struct BlockValues {
    const float *own = nullptr, *clip = nullptr;
    float tile = kBand;
};

float dotf(const Vec3f& a, const Vec3f& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// A box of blocks; voxel index = (x * side[1] + y) * side[2] + z. Only cells of 4^3 voxels near the surface are
/// filled.
class Window {
  public:
    /// values(origin) -> BlockValues. False where no surface passes.
    template <class Values>
    bool load(const Coord& origin, const std::array<int, 3>& blocks, float band, const Values& values) {
        band_ = band;
        for (int k = 0; k < 3; ++k) cells_[k] = 2 * blocks[size_t(k)], side_[k] = 4 * cells_[k];
        dx_ = side_[1] * side_[2], dy_ = side_[2];
        const size_t count = size_t(cells_[0]) * size_t(cells_[1]) * size_t(cells_[2]), voxels = count * 64;
        if (room_ < voxels) {
            // Left without values: only what lies near a surface is touched, and the rest takes no memory.
            for (auto* field : {&phi_, &own_, &clip_, &distance2_}) field->reset(new float[voxels]);
            nearest_.reset(new int[voxels]);
            queued_.reset(static_cast<char*>(std::calloc(voxels, 1)));
            if (!queued_) throw std::bad_alloc();
            room_ = voxels;
        }
        sign_.assign(count, 0);
        used_.assign(count, 0);
        touched_.assign(count / 8, 0);
        source_.resize(count / 8);
        bool in = false, out = false;
        for (int x = 0; x < cells_[0]; x += 2)
            for (int y = 0; y < cells_[1]; y += 2)
                for (int z = 0; z < cells_[2]; z += 2) {
                    const BlockValues& f = source_[size_t(block(x / 2, y / 2, z / 2))] =
                        values(origin.offsetBy(4 * x, 4 * y, 4 * z));
                    signed char signs[8];
                    if (f.own)
                        signsOf(f, signs);
                    else
                        std::fill(signs, signs + 8, f.tile < 0 ? -1 : 1);
                    for (int c = 0; c < 8; ++c) {
                        sign_[size_t(cell(x + (c >> 2), y + (c >> 1 & 1), z + (c & 1)))] = signs[c];
                        in |= signs[c] <= 0;
                        out |= signs[c] >= 0;
                    }
                }
        if (!in || !out) return false;
        crossing_.clear();
        int i = 0;
        for (int x = 0; x < cells_[0]; ++x)
            for (int y = 0; y < cells_[1]; ++y)
                for (int z = 0; z < cells_[2]; ++z, ++i) {
                    if (!mayCross(i, x, y, z)) continue;
                    crossing_.push_back({x, y, z});
                    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, cells_[0] - 1); ++u)
                        for (int v = std::max(y - 1, 0); v <= std::min(y + 1, cells_[1] - 1); ++v)
                            for (int w = std::max(z - 1, 0); w <= std::min(z + 1, cells_[2] - 1); ++w)
                                used_[size_t(cell(u, v, w))] = 1;
                }
        i = 0;
        for (int x = 0; x < cells_[0]; ++x)
            for (int y = 0; y < cells_[1]; ++y)
                for (int z = 0; z < cells_[2]; ++z, ++i)
                    if (used_[size_t(i)]) copyIn(x, y, z);
        return true;
    }

    void solve() {
        feet_.clear();
        layer_.clear();
        for (const auto& c : crossing_) findFeet(4 * c[0], 4 * c[1], 4 * c[2]);
        while (!layer_.empty()) spread();
    }

    /// Does any voxel of the block lie in the band?
    bool touched(int x, int y, int z) const { return touched_[size_t(block(x, y, z))]; }

    /// The clean distances of a touched block; true where any is inside the band.
    bool read(int bx, int by, int bz, float* out) const {
        bool near = false;
        for (int c = 0; c < 8; ++c) {
            const int u = c >> 2, v = c >> 1 & 1, w = c & 1;
            float* to = out + u * 256 + v * 32 + w * 4;
            const size_t from = size_t(cell(2 * bx + u, 2 * by + v, 2 * bz + w));
            for (int x = 0; x < 4; ++x)
                for (int y = 0; y < 4; ++y)
                    for (int z = 0; z < 4; ++z) {
                        const float d = used_[from] ? value(8 * bx + 4 * u + x, 8 * by + 4 * v + y, 8 * bz + 4 * w + z)
                                                    : float(sign_[from]) * band_;
                        near |= std::abs(d) < band_;
                        to[x * 64 + y * 8 + z] = d;
                    }
        }
        return near;
    }

  private:
    using Field = std::unique_ptr<float[]>;
    struct Place {
        int16_t x, y, z;
    };

    int cell(int x, int y, int z) const { return (x * cells_[1] + y) * cells_[2] + z; }
    int block(int x, int y, int z) const { return (x * (cells_[1] / 2) + y) * (cells_[2] / 2) + z; }
    int index(int x, int y, int z) const { return x * dx_ + y * dy_ + z; }

    /// -1 inside, 1 outside, 0 mixed for the eight cells of a block.
    static void signsOf(const BlockValues& f, signed char* signs) {
        int negative[8] = {};
        for (int row = 0; row < 64; ++row) {
            const float *own = f.own + row * 8, *clip = f.clip ? f.clip + row * 8 : own;
            int lo = 0, hi = 0;
            for (int z = 0; z < 4; ++z) lo += (own[z] < 0) & (clip[z] < 0);
            for (int z = 4; z < 8; ++z) hi += (own[z] < 0) & (clip[z] < 0);
            const int c = (row >> 5) * 4 + (row >> 2 & 1) * 2;
            negative[c] += lo, negative[c + 1] += hi;
        }
        for (int c = 0; c < 8; ++c)
            signs[c] = static_cast<signed char>(negative[c] == 0 ? 1 : negative[c] == 64 ? -1 : 0);
    }

    /// A cell of one sign whose face neighbours have the same holds no voxel beside the surface.
    bool mayCross(int i, int x, int y, int z) const {
        const int own = sign_[size_t(i)], dx = cells_[1] * cells_[2], dy = cells_[2];
        const signed char* s = &sign_[size_t(i)];
        return own == 0 || (x > 0 && s[-dx] != own) || (x + 1 < cells_[0] && s[dx] != own) ||
               (y > 0 && s[-dy] != own) || (y + 1 < cells_[1] && s[dy] != own) || (z > 0 && s[-1] != own) ||
               (z + 1 < cells_[2] && s[1] != own);
    }

    void copyIn(int cx, int cy, int cz) {
        const BlockValues& f = source_[size_t(block(cx / 2, cy / 2, cz / 2))];
        const int from = (cx & 1) * 256 + (cy & 1) * 32 + (cz & 1) * 4;
        for (int x = 0; x < 4; ++x)
            for (int y = 0; y < 4; ++y) {
                const size_t at = size_t(index(4 * cx + x, 4 * cy + y, 4 * cz));
                const int row = from + x * 64 + y * 8;
                for (int z = 0; z < 4; ++z) {
                    const float own = f.own ? f.own[row + z] : f.tile, clip = f.clip ? f.clip[row + z] : -kBand;
                    own_[at + size_t(z)] = own;
                    clip_[at + size_t(z)] = clip;
                    phi_[at + size_t(z)] = own > clip ? own : clip;
                    nearest_[at + size_t(z)] = -1;
                    distance2_[at + size_t(z)] = (band_ + 0.5f) * (band_ + 0.5f);
                }
            }
    }

    void findFeet(int bx, int by, int bz) {
        const auto lo = [](int b) { return std::max(b, kMargin); };
        const auto hi = [&](int b, int k) { return std::min(b + 4, side_[k] - kMargin); };
        for (int x = lo(bx); x < hi(bx, 0); ++x)
            for (int y = lo(by); y < hi(by, 1); ++y)
                for (int z = lo(bz); z < hi(bz, 2); ++z) {
                    const int i = index(x, y, z);
                    if (!crosses(i)) continue;
                    Foot foot;
                    findFoot(x, y, z, foot);
                    const Vec3f d = Vec3f(float(x), float(y), float(z)) - foot.point;
                    nearest_[size_t(i)] = int(feet_.size());
                    distance2_[size_t(i)] = d.sqrnorm();
                    feet_.push_back(foot);
                    layer_.push_back({int16_t(x), int16_t(y), int16_t(z)});
                    touched_[size_t(block(x >> 3, y >> 3, z >> 3))] = 1;
                }
    }

    bool crosses(int i) const {
        const float* f = &phi_[size_t(i)];
        const bool s = *f < 0;
        return (f[-1] < 0) != s || (f[1] < 0) != s || (f[-dy_] < 0) != s || (f[dy_] < 0) != s || (f[-dx_] < 0) != s ||
               (f[dx_] < 0) != s;
    }

    float trilinear(const Field& field, const Vec3f& p) const {
        const int x = int(p[0]), y = int(p[1]), z = int(p[2]);
        const float u = p[0] - float(x), v = p[1] - float(y), w = p[2] - float(z);
        const float* f = &field[size_t(index(x, y, z))];
        const float *g = f + dy_, *h = f + dx_, *k = h + dy_;
        const float a = (f[0] * (1 - w) + f[1] * w) * (1 - v) + (g[0] * (1 - w) + g[1] * w) * v;
        const float b = (h[0] * (1 - w) + h[1] * w) * (1 - v) + (k[0] * (1 - w) + k[1] * w) * v;
        return a * (1 - u) + b * u;
    }

    Vec3f gradient(const Field& field, int i) const {
        const float* f = &field[size_t(i)];
        return {0.5f * (f[dx_] - f[-dx_]), 0.5f * (f[dy_] - f[-dy_]), 0.5f * (f[1] - f[-1])};
    }

    /// Point of the field's zero set along its gradient, at most 1.75 voxels away. Normal: unit gradient.
    bool dropOnto(const Field& field, int i, const Vec3f& p, Vec3f& point, Vec3f& normal) const {
        const float f0 = field[size_t(i)];
        normal = gradient(field, i);
        const float l = normal.norm();
        if (l < 0.1f) return false;
        normal /= l;
        const Vec3f toward = f0 < 0 ? normal : -normal;
        // First the step that the slope asks for, then the secant between the two.
        float lo = 0, fLo = f0, hi = std::min(1.2f * std::abs(f0) / l + 0.1f, 1.75f), fHi = 0;
        bool found = false;
        for (int it = 0; it < 3 && !found; ++it) {
            fHi = trilinear(field, p + toward * hi);
            found = (fHi < 0) != (f0 < 0);
            if (!found) {
                if (hi >= 1.75f) return false;
                lo = hi, fLo = fHi, hi = std::min(2 * hi + 0.2f, 1.75f);
            }
        }
        if (!found) return false;
        float s = hi;
        for (int it = 0; it < 3; ++it) {
            s = lo + (hi - lo) * fLo / (fLo - fHi);
            const float f = trilinear(field, p + toward * s);
            if (std::abs(f) < 1e-3f) break;
            if ((f < 0) == (f0 < 0))
                lo = s, fLo = f;
            else
                hi = s, fHi = f;
        }
        point = p + toward * s;
        return true;
    }

    /// Nearest point of the line in which two planes meet: p - a n - b m.
    static bool crease(const Vec3f& p, float dn, const Vec3f& n, float dm, const Vec3f& m, Foot& foot) {
        const float c = dotf(n, m), det = 1 - c * c;
        if (det < 0.05f) return false;
        const float a = (dn - c * dm) / det, b = (dm - c * dn) / det;
        foot.point = p - n * a - m * b;
        if ((foot.point - p).sqrnorm() > 4) return false;
        foot.along = Vec3f(n[1] * m[2] - n[2] * m[1], n[2] * m[0] - n[0] * m[2], n[0] * m[1] - n[1] * m[0]);
        foot.along /= foot.along.norm();
        foot.onCrease = true;
        return true;
    }

    void findFoot(int x, int y, int z, Foot& foot) const {
        const int i = index(x, y, z);
        const Vec3f p{float(x), float(y), float(z)};
        const float own = own_[size_t(i)], clip = clip_[size_t(i)];
        foot.onCrease = false;
        const bool ownFirst = own >= clip;
        const Field &first = ownFirst ? own_ : clip_, &second = ownFirst ? clip_ : own_;
        const bool landed = dropOnto(first, i, p, foot.point, foot.along);
        if (std::min(own, clip) < -kCrease) {  // one field alone decides here
            if (!landed) stepAcross(i, p, foot);
            return;
        }
        if (landed && trilinear(second, foot.point) <= 0) return;
        // The foot on one surface is cut away by the other.
        Vec3f point, normal;
        if (landed && dropOnto(second, i, p, point, normal)) {
            const float dn = dotf(p - foot.point, foot.along), dm = dotf(p - point, normal);
            if (phi_[size_t(i)] < 0 && trilinear(first, point) <= 0) {
                foot.point = point, foot.along = normal;
                return;
            }
            if (crease(p, dn, foot.along, dm, normal, foot)) return;
        }
        stepAcross(i, p, foot);
    }

    /// Where the gradient helps nothing: the crossing of an axis that comes soonest.
    void stepAcross(int i, const Vec3f& p, Foot& foot) const {
        const float f0 = phi_[size_t(i)];
        const int step[3] = {dx_, dy_, 1};
        float best = 2;
        foot.onCrease = false;
        for (int k = 0; k < 3; ++k)
            for (int sign = -1; sign <= 1; sign += 2) {
                const float f1 = phi_[size_t(i + sign * step[k])];
                if ((f1 < 0) == (f0 < 0)) continue;
                const float t = f0 / (f0 - f1);
                if (t >= best) continue;
                best = t;
                foot.point = p;
                foot.point[k] += float(sign) * t;
                foot.along = Vec3f(0, 0, 0);
                foot.along[k] = f0 < 0 ? float(sign) : -float(sign);
            }
    }

    /// Offers the foot points of the last layer to the face neighbours.
    void spread() {
        next_.clear();
        for (const Place& q : layer_) {
            const int i = index(q.x, q.y, q.z), foot = nearest_[size_t(i)];
            queued_[size_t(i)] = 0;
            const Vec3f& p = feet_[size_t(foot)].point;
            const auto offer = [&](int x, int y, int z) {
                const float ex = float(x) - p[0], ey = float(y) - p[1], ez = float(z) - p[2];
                const float d2 = ex * ex + ey * ey + ez * ez;
                const size_t n = size_t(index(x, y, z));
                if (d2 >= distance2_[n] || !used_[size_t(cell(x >> 2, y >> 2, z >> 2))]) return;
                distance2_[n] = d2;
                if (nearest_[n] < 0) touched_[size_t(block(x >> 3, y >> 3, z >> 3))] = 1;
                nearest_[n] = foot;
                if (queued_[n]) return;
                queued_[n] = 1;
                next_.push_back({int16_t(x), int16_t(y), int16_t(z)});
            };
            if (q.x > kMargin) offer(q.x - 1, q.y, q.z);
            if (q.x + 1 < side_[0] - kMargin) offer(q.x + 1, q.y, q.z);
            if (q.y > kMargin) offer(q.x, q.y - 1, q.z);
            if (q.y + 1 < side_[1] - kMargin) offer(q.x, q.y + 1, q.z);
            if (q.z > kMargin) offer(q.x, q.y, q.z - 1);
            if (q.z + 1 < side_[2] - kMargin) offer(q.x, q.y, q.z + 1);
        }
        layer_.swap(next_);
    }

    float value(int x, int y, int z) const {
        const size_t i = size_t(index(x, y, z));
        float d = band_;
        if (nearest_[i] >= 0) {
            const Foot& foot = feet_[size_t(nearest_[i])];
            const Vec3f v = Vec3f(float(x), float(y), float(z)) - foot.point;
            const float along = dotf(v, foot.along), along2 = along * along;
            const float aside2 = std::max(0.f, v.sqrnorm() - along2);
            // Feet sample surface and crease a voxel apart, or less: half of that may be taken off the way along them.
            const auto beyond = [](float d2) { return d2 <= 0.25f ? 0.f : std::sqrt(d2) - 0.5f; };
            const float rest = beyond(foot.onCrease ? along2 : aside2), across2 = foot.onCrease ? aside2 : along2;
            d = std::min(band_, std::sqrt(across2 + rest * rest));
        }
        d = std::max(d, 1e-6f);  // zero would be no side at all
        return phi_[i] < 0 ? -d : d;
    }

    float band_ = kResultBand;
    int cells_[3] = {}, side_[3] = {}, dx_ = 0, dy_ = 0;
    size_t room_ = 0;
    Field phi_, own_, clip_, distance2_;
    std::unique_ptr<int[]> nearest_;
    std::unique_ptr<char[], decltype(&std::free)> queued_{nullptr, &std::free};
    std::vector<Foot> feet_;
    std::vector<Place> layer_, next_;
    std::vector<std::array<int, 3>> crossing_;
    std::vector<signed char> sign_;  // -1 inside, 1 outside, 0 mixed
    std::vector<char> touched_, used_;
    std::vector<BlockValues> source_;
};

/// One window's work: `size` blocks from `origin`, the halo not counted.
struct Part {
    Coord origin;
    std::array<int, 3> size;
};

template <class Leaf, class Values>
std::vector<Leaf*> solvePart(const Part& part, float band, const Values& values) {
    static thread_local Window window;  // scratch that would else be mapped anew for every element
    std::vector<Leaf*> made;
    const std::array<int, 3> blocks{part.size[0] + 2, part.size[1] + 2, part.size[2] + 2};
    if (!window.load(part.origin.offsetBy(-8), blocks, band, values)) return made;
    window.solve();
    float d[512];
    for (int x = 1; x <= part.size[0]; ++x)
        for (int y = 1; y <= part.size[1]; ++y)
            for (int z = 1; z <= part.size[2]; ++z) {
                if (!window.touched(x, y, z) || !window.read(x, y, z, d)) continue;
                auto leaf =
                    std::make_unique<Leaf>(part.origin.offsetBy(8 * (x - 1), 8 * (y - 1), 8 * (z - 1)), 0.f, false);
                typename Leaf::NodeMaskType on;
                for (openvdb::Index v = 0; v < 512; ++v)
                    if (std::abs(d[v]) < band) on.setOn(v);
                std::copy(d, d + 512, leaf->buffer().data());
                leaf->setValueMask(on);
                made.push_back(leaf.release());
            }
    return made;
}

template <class Tree>
typename Tree::Ptr treeOf(const std::vector<std::vector<typename Tree::LeafNodeType*>>& leaves, float band) {
    auto tree = std::make_shared<Tree>(band);
    for (const auto& list : leaves)
        for (auto* leaf : list) tree->addLeaf(leaf);
    openvdb::tools::signedFloodFillWithValues(*tree, band, -band);
    return tree;
}

/// Windows on a fixed lattice wherever the tree has leaves.
template <class Tree>
typename Tree::Ptr redistancedTree(const Tree& raw) {
    using Leaf = typename Tree::LeafNodeType;
    constexpr int kBlocks = 8, kVoxels = 8 * kBlocks;
    std::vector<Coord> origins;
    const auto down = [](int v) { return v & ~(kVoxels - 1); };
    for (auto leaf = raw.cbeginLeaf(); leaf; ++leaf) {
        // The band reaches kResultBand beyond the leaf: into up to eight windows.
        const Coord lo = leaf->origin().offsetBy(-4), hi = leaf->origin().offsetBy(11);
        for (int x = down(lo[0]); x <= hi[0]; x += kVoxels)
            for (int y = down(lo[1]); y <= hi[1]; y += kVoxels)
                for (int z = down(lo[2]); z <= hi[2]; z += kVoxels) origins.emplace_back(x, y, z);
        if (origins.size() > 1000000) {
            std::sort(origins.begin(), origins.end());
            origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
        }
    }
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    std::vector<std::vector<Leaf*>> made(origins.size());
    tbb::parallel_for(size_t(0), origins.size(), [&](size_t k) {
        const openvdb::tree::ValueAccessor<const Tree, false> reader(raw);
        made[k] = solvePart<Leaf>(Part{origins[k], {kBlocks, kBlocks, kBlocks}}, kResultBand, [&](const Coord& origin) {
            BlockValues f;
            if (const Leaf* leaf = reader.probeConstLeaf(origin))
                f.own = leaf->buffer().data();
            else
                f.tile = reader.getValue(origin);
            return f;
        });
    });
    return treeOf<Tree>(made, kResultBand);
}

}  // namespace

openvdb::FloatTree::Ptr redistanced(const openvdb::FloatTree& raw) {
    return redistancedTree(raw);
}

WorkTree::Ptr redistanced(const WorkTree& raw) {
    return redistancedTree(raw);
}

WorkTree::Ptr redistanced(const Region& raw, float band) {
    if (raw.size() == 0) return std::make_shared<WorkTree>(band);
    // The band may leave the region's blocks by one; cut into equal parts that fit a window.
    const Coord lo = raw.lower().offsetBy(-8), hi = raw.upper().offsetBy(8);
    int count[3], parts[3];
    for (int k = 0; k < 3; ++k) {
        count[k] = (hi[k] - lo[k]) / 8 + 1;
        parts[k] = (count[k] + kMostBlocks - 3) / (kMostBlocks - 2);
    }
    std::vector<Part> list;
    const auto cut = [&](int k, int i) { return count[k] * i / parts[k]; };
    for (int x = 0; x < parts[0]; ++x)
        for (int y = 0; y < parts[1]; ++y)
            for (int z = 0; z < parts[2]; ++z)
                list.push_back({lo.offsetBy(8 * cut(0, x), 8 * cut(1, y), 8 * cut(2, z)),
                                {cut(0, x + 1) - cut(0, x), cut(1, y + 1) - cut(1, y), cut(2, z + 1) - cut(2, z)}});
    std::vector<std::vector<WorkLeaf*>> made(list.size());
    tbb::parallel_for(size_t(0), list.size(), [&](size_t k) {
        made[k] = solvePart<WorkLeaf>(list[k], band, [&](const Coord& origin) {
            BlockValues f;
            const int b = raw.at(origin);
            if (b >= 0)
                f.own = raw.own(b), f.clip = raw.clip(b);
            else
                f.tile = b == Region::kInside ? -kBand : kBand;
            return f;
        });
    });
    return treeOf<WorkTree>(made, band);
}

}  // namespace pavel
