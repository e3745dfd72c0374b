#include "pavel/vdb/redistance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

namespace pavel {
namespace {

constexpr int kBrick = 32, kHalo = 8, kSide = kBrick + 2 * kHalo, kMargin = 4;

struct Foot {
    Vec3f point, normal;
};

/// One brick's window; index = (x * side + y) * side + z.
class Window {
  public:
    Window() : phi_(kSide * kSide * kSide), nearest_(phi_.size()), distance2_(phi_.size()), queued_(phi_.size(), 0) {}

    template <class Tree>
    bool load(const Tree& tree, const Coord& origin) {
        openvdb::tree::ValueAccessor<const Tree, false> reader(tree);
        bool in = false, out = false;
        for (int bx = 0; bx < kSide; bx += 8)
            for (int by = 0; by < kSide; by += 8)
                for (int bz = 0; bz < kSide; bz += 8) {
                    const Coord c = origin.offsetBy(bx - kHalo, by - kHalo, bz - kHalo);
                    const auto* leaf = reader.probeConstLeaf(c);
                    const float tile = leaf ? 0 : reader.getValue(c);
                    int negative = leaf || !(tile < 0) ? 0 : 512;
                    for (int x = 0; x < 8; ++x)
                        for (int y = 0; y < 8; ++y) {
                            float* row = &phi_[size_t(index(bx + x, by + y, bz))];
                            if (!leaf) {
                                std::fill(row, row + 8, tile);
                                continue;
                            }
                            const float* values = leaf->buffer().data() + x * 64 + y * 8;
                            std::copy(values, values + 8, row);
                            for (int z = 0; z < 8; ++z) negative += values[z] < 0;
                        }
                    sign_[size_t(block(bx, by, bz))] = negative == 0 ? 1 : negative == 512 ? -1 : 0;
                    in |= negative > 0;
                    out |= negative < 512;
                }
        return in && out;
    }

    void solve() {
        std::fill(nearest_.begin(), nearest_.end(), -1);
        std::fill(distance2_.begin(), distance2_.end(), 1e9f);
        std::fill(touched_.begin(), touched_.end(), false);
        feet_.clear();
        layer_.clear();
        for (int bx = 0; bx < kSide; bx += 8)
            for (int by = 0; by < kSide; by += 8)
                for (int bz = 0; bz < kSide; bz += 8)
                    if (mayCross(bx, by, bz)) findFeet(bx, by, bz);
        for (int step = 0; step < 3 && !layer_.empty(); ++step) spread();  // kResultBand voxels outward
    }

    float value(int x, int y, int z) const {
        const int i = index(x, y, z);
        const bool inside = phi_[size_t(i)] < 0;
        float d = kResultBand;
        if (nearest_[size_t(i)] >= 0) {
            const Foot& foot = feet_[size_t(nearest_[size_t(i)])];
            const Vec3f v = Vec3f(float(x), float(y), float(z)) - foot.point;
            const float along = dotf(v, foot.normal), aside = std::sqrt(std::max(0.f, v.sqrnorm() - along * along));
            const float rest = std::max(0.f, aside - 0.5f);
            d = std::min(kResultBand, std::sqrt(along * along + rest * rest));
        }
        // Zero would be no side at all.
        return inside ? -std::max(d, 1e-6f) : std::max(d, 1e-6f);
    }

    /// Does any voxel of the block at (x, y, z) lie in the band?
    bool touched(int x, int y, int z) const { return touched_[size_t(block(x, y, z))]; }

    static int index(int x, int y, int z) { return (x * kSide + y) * kSide + z; }

  private:
    static float dotf(const Vec3f& a, const Vec3f& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

    static int block(int x, int y, int z) { return ((x >> 3) * (kSide / 8) + (y >> 3)) * (kSide / 8) + (z >> 3); }

    void touch(int i) { touched_[size_t(block(i / (kSide * kSide), i / kSide % kSide, i % kSide))] = true; }

    /// A block of one sign whose face neighbours have the same holds no voxel beside the surface.
    bool mayCross(int bx, int by, int bz) const {
        const int own = sign_[size_t(block(bx, by, bz))];
        if (own == 0) return true;
        const int at[3] = {bx, by, bz};
        for (int k = 0; k < 3; ++k)
            for (int side = -8; side <= 8; side += 16) {
                int n[3] = {bx, by, bz};
                n[k] = at[k] + side;
                if (n[k] >= 0 && n[k] < kSide && sign_[size_t(block(n[0], n[1], n[2]))] != own) return true;
            }
        return false;
    }

    void findFeet(int bx, int by, int bz) {
        const auto lo = [](int b) { return std::max(b, kMargin); };
        const auto hi = [](int b) { return std::min(b + 8, kSide - kMargin); };
        for (int x = lo(bx); x < hi(bx); ++x)
            for (int y = lo(by); y < hi(by); ++y)
                for (int z = lo(bz); z < hi(bz); ++z) {
                    const int i = index(x, y, z);
                    if (!crosses(i)) continue;
                    Foot foot;
                    findFoot(x, y, z, foot);
                    nearest_[size_t(i)] = int(feet_.size());
                    const Vec3f d = Vec3f(float(x), float(y), float(z)) - foot.point;
                    distance2_[size_t(i)] = d.sqrnorm();
                    feet_.push_back(foot);
                    layer_.push_back(i);
                    touch(i);
                }
    }

    bool crosses(int i) const {
        const bool s = phi_[size_t(i)] < 0;
        return (phi_[size_t(i - 1)] < 0) != s || (phi_[size_t(i + 1)] < 0) != s || (phi_[size_t(i - kSide)] < 0) != s ||
               (phi_[size_t(i + kSide)] < 0) != s || (phi_[size_t(i - kSide * kSide)] < 0) != s ||
               (phi_[size_t(i + kSide * kSide)] < 0) != s;
    }

    float trilinear(const Vec3f& p) const {
        const int x = int(p[0]), y = int(p[1]), z = int(p[2]);
        const float u = p[0] - float(x), v = p[1] - float(y), w = p[2] - float(z);
        const float* f = &phi_[size_t(index(x, y, z))];
        constexpr int dy = kSide, dx = kSide * kSide;
        const float a = (f[0] * (1 - w) + f[1] * w) * (1 - v) + (f[dy] * (1 - w) + f[dy + 1] * w) * v;
        const float b = (f[dx] * (1 - w) + f[dx + 1] * w) * (1 - v) + (f[dx + dy] * (1 - w) + f[dx + dy + 1] * w) * v;
        return a * (1 - u) + b * u;
    }

    /// Foot point of a voxel beside the surface: along the gradient, or along the axis that crosses soonest.
    void findFoot(int x, int y, int z, Foot& foot) const {
        const int i = index(x, y, z);
        const float f0 = phi_[size_t(i)];
        const Vec3f p{float(x), float(y), float(z)};
        constexpr int step[3] = {kSide * kSide, kSide, 1};
        Vec3f g;
        for (int k = 0; k < 3; ++k) g[k] = phi_[size_t(i + step[k])] - phi_[size_t(i - step[k])];
        const float l = g.norm();
        if (l > 0.2f) {
            g /= l;
            const Vec3f toward = f0 < 0 ? g : -g;
            float lo = 0, hi = 0, fLo = f0, fHi = f0;
            for (float s : {0.5f, 1.0f, 1.5f}) {
                hi = s;
                fHi = trilinear(p + toward * s);
                if ((fHi < 0) != (f0 < 0)) break;
                lo = s;
                fLo = fHi;
            }
            if ((fHi < 0) != (f0 < 0)) {
                float s = hi;
                for (int it = 0; it < 4; ++it) {
                    s = lo + (hi - lo) * fLo / (fLo - fHi);
                    const float f = trilinear(p + toward * s);
                    if (std::abs(f) < 1e-4f) break;
                    if ((f < 0) == (f0 < 0))
                        lo = s, fLo = f;
                    else
                        hi = s, fHi = f;
                }
                foot.point = p + toward * s;
                foot.normal = g;
                return;
            }
        }
        float best = 2;
        for (int k = 0; k < 3; ++k)
            for (int sign = -1; sign <= 1; sign += 2) {
                const float f1 = phi_[size_t(i + sign * step[k])];
                if ((f1 < 0) == (f0 < 0)) continue;
                const float t = f0 / (f0 - f1);
                if (t >= best) continue;
                best = t;
                foot.point = p;
                foot.point[k] += float(sign) * t;
                foot.normal = Vec3f(0, 0, 0);
                foot.normal[k] = f0 < 0 ? float(sign) : -float(sign);
            }
    }

    /// Offers the foot points of the last layer to the neighbours.
    void spread() {
        next_.clear();
        for (int i : layer_) {
            const int x = i / (kSide * kSide), y = i / kSide % kSide, z = i % kSide;
            const int foot = nearest_[size_t(i)];
            const Vec3f& p = feet_[size_t(foot)].point;
            for (int dx = -1; dx <= 1; ++dx)
                for (int dy = -1; dy <= 1; ++dy)
                    for (int dz = -1; dz <= 1; ++dz) {
                        const int nx = x + dx, ny = y + dy, nz = z + dz;
                        if (nx < kMargin || ny < kMargin || nz < kMargin || nx >= kSide - kMargin ||
                            ny >= kSide - kMargin || nz >= kSide - kMargin)
                            continue;
                        const float ex = float(nx) - p[0], ey = float(ny) - p[1], ez = float(nz) - p[2];
                        const float d2 = ex * ex + ey * ey + ez * ez;
                        const size_t n = size_t(index(nx, ny, nz));
                        if (d2 >= distance2_[n] || d2 > 12.25f) continue;
                        distance2_[n] = d2;
                        if (nearest_[n] < 0) touch(int(n));
                        nearest_[n] = foot;
                        if (queued_[n]) continue;
                        queued_[n] = 1;
                        next_.push_back(int(n));
                    }
        }
        layer_.swap(next_);
        for (int i : layer_) queued_[size_t(i)] = 0;
    }

    std::vector<float> phi_;
    std::vector<int> nearest_;
    std::vector<float> distance2_;
    std::vector<Foot> feet_;
    std::vector<int> layer_, next_;
    std::vector<char> queued_;
    std::array<signed char, kSide * kSide * kSide / 512> sign_{};  // -1 inside, 1 outside, 0 mixed
    std::array<bool, kSide * kSide * kSide / 512> touched_{};
};

}  // namespace

template <class Tree>
typename Tree::Ptr redistanced(const Tree& raw) {
    using Leaf = typename Tree::LeafNodeType;
    std::vector<Coord> bricks;
    const auto down = [](int v) { return v & ~(kBrick - 1); };
    for (auto leaf = raw.cbeginLeaf(); leaf; ++leaf) {
        // The band reaches kResultBand beyond the leaf: into up to eight bricks.
        const Coord lo = leaf->origin().offsetBy(-4), hi = leaf->origin().offsetBy(11);
        for (int x = down(lo[0]); x <= hi[0]; x += kBrick)
            for (int y = down(lo[1]); y <= hi[1]; y += kBrick)
                for (int z = down(lo[2]); z <= hi[2]; z += kBrick) bricks.emplace_back(x, y, z);
    }
    std::sort(bricks.begin(), bricks.end());
    bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());

    std::vector<std::vector<Leaf*>> made(bricks.size());
    tbb::parallel_for(size_t(0), bricks.size(), [&](size_t b) {
        static thread_local Window window;  // scratch: 1.4 MB that would else be mapped anew for every element
        if (!window.load(raw, bricks[b])) return;
        window.solve();
        for (int bx = 0; bx < kBrick; bx += 8)
            for (int by = 0; by < kBrick; by += 8)
                for (int bz = 0; bz < kBrick; bz += 8) {
                    if (!window.touched(kHalo + bx, kHalo + by, kHalo + bz)) continue;
                    auto leaf = std::make_unique<Leaf>(bricks[b].offsetBy(bx, by, bz), kResultBand, false);
                    bool near = false;
                    for (openvdb::Index v = 0; v < Leaf::SIZE; ++v) {
                        const float value = window.value(kHalo + bx + int(v >> 6), kHalo + by + int(v >> 3 & 7),
                                                         kHalo + bz + int(v & 7));
                        leaf->setValueOnly(v, value);
                        const bool on = std::abs(value) < kResultBand;
                        leaf->setActiveState(v, on);
                        near |= on;
                    }
                    if (near) made[b].push_back(leaf.release());
                }
    });
    auto tree = std::make_shared<Tree>(kResultBand);
    for (auto& leaves : made)
        for (Leaf* leaf : leaves) tree->addLeaf(leaf);
    openvdb::tools::signedFloodFillWithValues(*tree, kResultBand, -kResultBand);
    return tree;
}

template WorkTree::Ptr redistanced(const WorkTree&);
template openvdb::FloatTree::Ptr redistanced(const openvdb::FloatTree&);

}  // namespace pavel
