#include "pavel/vdb/redistance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "pavel/vdb/foot_points.h"
#include "pavel/vdb/pieces.h"

namespace pavel {
namespace {

/// Largest window, in blocks a side; the outer layer is halo.
constexpr int kMostBlocks = 20;

struct Voxel {
    float distance2;
    int foot;  ///< the nearest so far, or negative; with kQueued while it is to be offered on
};
constexpr int kQueued = 1 << 30;

/// Signed distances of a block's voxels, the first at `origin`, from their feet; +-band where they have none.
PAVEL_WIDE void distances(const Voxel* voxels, const Foot* feet, const Vec3f& origin, float band,
                          const BlockValues& source, float* out, BlockMask& near) {
    // Feet sample surface and crease a voxel apart, or less: half of that may be taken off the way along them.
    constexpr float kApart = 0.5f;
    for (int row = 0; row < 64; ++row) {
        const Voxel* at = voxels + 8 * row;
        float* d = out + 8 * row;
        int any = 0;
        for (int z = 0; z < 8; ++z) any |= ~at[z].foot;
        if (any >= 0) {
            std::fill(d, d + 8, band);
            continue;
        }
        float px[8], py[8], pz[8], ax[8], ay[8], az[8];
        int feetOf[8], crease[8];
        for (int z = 0; z < 8; ++z) {
            const int i = at[z].foot;
            const Foot& foot = feet[i < 0 ? 0 : i];
            px[z] = foot.point[0], py[z] = foot.point[1], pz[z] = foot.point[2];
            ax[z] = foot.along[0], ay[z] = foot.along[1], az[z] = foot.along[2];
            feetOf[z] = i, crease[z] = foot.onCrease;
        }
        const float x = origin[0] + float(row >> 3), y = origin[1] + float(row & 7);
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) {
            const float u = x - px[z], v = y - py[z], w = origin[2] + float(z) - pz[z];
            const float along = u * ax[z] + v * ay[z] + w * az[z], along2 = along * along;
            const float rest2 = u * u + v * v + w * w - along2, aside2 = rest2 > 0 ? rest2 : 0;
            const float beside2 = crease[z] ? along2 : aside2, across2 = crease[z] ? aside2 : along2;
            const float far = std::sqrt(beside2) - kApart, beyond = far > 0 ? far : 0;
            const float distance = std::sqrt(across2 + beyond * beyond), least = distance < band ? distance : band;
            const float kept = least > 1e-6f ? least : 1e-6f;  // zero would be no side at all
            d[z] = feetOf[z] < 0 ? band : kept;
        }
    }
    for (int row = 0; row < 64; ++row) {
        unsigned within = 0;
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) within |= unsigned(out[8 * row + z] < band) << z;
        near[size_t(row)] = uint8_t(within);
    }
    if (!source.own) {
        for (int v = 0; v < 512; ++v) out[v] = source.tile < 0 ? -out[v] : out[v];
    } else if (!source.clip) {
        for (int v = 0; v < 512; ++v) out[v] = source.own[v] < 0 ? -out[v] : out[v];
    } else {
        for (int v = 0; v < 512; ++v) out[v] = (source.own[v] < 0) & (source.clip[v] < 0) ? -out[v] : out[v];
    }
}

/// A box of blocks. Only those in the band hold voxels: a slot of 512 each, index slot * 512 + voxel of the leaf.
class Window {
  public:
    /// values(origin) -> BlockValues. False where no surface passes.
    /// @param outside, inside how far the band reaches on the two sides
    template <class Values>
    bool load(const Coord& origin, const std::array<int, 3>& blocks, float outside, float inside,
              const Values& values) {
        band_ = std::max(outside, inside);
        limit_[0] = (outside + 0.25f) * (outside + 0.25f), limit_[1] = (inside + 0.25f) * (inside + 0.25f);
        for (int k = 0; k < 3; ++k) count_[k] = blocks[size_t(k)] + 2;  // one more layer, whose values alone are used
        step_[0] = count_[1] * count_[2], step_[1] = count_[2], step_[2] = 1;
        const size_t count = size_t(count_[0]) * size_t(step_[0]);
        source_.resize(count);
        sign_.resize(count);
        slot_.assign(count, kNone);
        slots_.clear(), voxels_.clear();
        bool in = false, out = false;
        size_t i = 0;
        for (int x = 0; x < count_[0]; ++x)
            for (int y = 0; y < count_[1]; ++y)
                for (int z = 0; z < count_[2]; ++z, ++i) {
                    source_[i] = values(origin.offsetBy(8 * (x - 1), 8 * (y - 1), 8 * (z - 1)));
                    sign_[i] = signOf(source_[i]);
                    if (x == 0 || y == 0 || z == 0 || x == count_[0] - 1 || y == count_[1] - 1 || z == count_[2] - 1)
                        slot_[i] = kClosed;
                    else
                        in |= sign_[i] <= 0, out |= sign_[i] >= 0;
                }
        return in && out;
    }

    void solve() {
        feet_.clear();
        layer_.clear();
        for (int x = 1; x + 1 < count_[0]; ++x)
            for (int y = 1; y + 1 < count_[1]; ++y)
                for (int z = 1; z + 1 < count_[2]; ++z)
                    if (crosses(block(x, y, z))) findFeet(x, y, z);
        while (!layer_.empty()) spread();
    }

    /// The clean distances of a block, one of the window's own or its halo, and which are in the band; false where none
    /// is.
    bool read(int bx, int by, int bz, float* out, BlockMask& near) const {
        const size_t b = size_t(block(bx + 1, by + 1, bz + 1));
        const int slot = slot_[b];
        if (slot < 0) return false;
        distances(&voxels_[size_t(slot) * 512], feet_.data(), Vec3f(float(8 * bx), float(8 * by), float(8 * bz)), band_,
                  source_[b], out, near);
        return std::any_of(near.begin(), near.end(), [](uint8_t row) { return row != 0; });
    }

  private:
    static constexpr int kNone = -1, kClosed = -2;
    static constexpr float kBetween = 1;
    struct Slot {
        int block;
        Vec3f origin;  // of its first voxel
    };

    int block(int x, int y, int z) const { return x * step_[0] + y * step_[1] + z; }

    /// -1 inside, 1 outside, 0 mixed.
    static signed char signOf(const BlockValues& f) {
        if (!f.own) return f.tile < 0 ? -1 : 1;
        int negative = 0;
        if (f.clip)
            for (int v = 0; v < 512; ++v) negative += (f.own[v] < 0) & (f.clip[v] < 0);
        else
            for (int v = 0; v < 512; ++v) negative += f.own[v] < 0;
        return static_cast<signed char>(negative == 0 ? 1 : negative == 512 ? -1 : 0);
    }

    /// Does a block hold voxels beside the surface? One of a single sign may by its face neighbours only.
    bool crosses(int b) const {
        const int own = sign_[size_t(b)];
        if (own == 0) return true;
        for (int side = 0; side < 6; ++side) {
            const int axis = side / 2, n = side % 2 ? b + step_[axis] : b - step_[axis];
            const int other = sign_[size_t(n)];
            if (other == -own || (other == 0 && facesOther(source_[size_t(n)], axis, side % 2 ? 0 : 7, own < 0)))
                return true;
        }
        return false;
    }

    /// Does the layer of a block at a place on an axis hold a voxel that is not `inside`?
    static bool facesOther(const BlockValues& f, int axis, int place, bool inside) {
        constexpr int step[3] = {64, 8, 1};
        const int u = step[axis == 0 ? 1 : 0], w = step[axis == 2 ? 1 : 2];
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j)
                if (f.inside(place * step[axis] + i * u + j * w) != inside) return true;
        return false;
    }

    /// The block's slot, made where it has none yet; negative outside the window.
    int slotAt(int b) {
        int& slot = slot_[size_t(b)];
        if (slot != kNone) return slot;
        slot = int(slots_.size());
        const int x = b / step_[0], y = b / step_[1] % count_[1], z = b % count_[2];
        slots_.push_back({b, Vec3f(float(8 * x - 8), float(8 * y - 8), float(8 * z - 8))});
        voxels_.resize(voxels_.size() + 512, Voxel{std::max(limit_[0], limit_[1]), -1});
        return slot;
    }

    /// Places of feet count from the first block that is not closed.
    void findFeet(int bx, int by, int bz) {
        const int b = block(bx, by, bz);
        const BlockValues* around[27];
        for (int part = 0; part < 27; ++part)
            around[part] = &source_[size_t(b + block(part / 9 - 1, part / 3 % 3 - 1, part % 3 - 1))];
        patch_.load(around);
        const Vec3f shift(float(8 * bx - 8 - Patch::kHalo), float(8 * by - 8 - Patch::kHalo),
                          float(8 * bz - 8 - Patch::kHalo));
        for (int x = 0; x < 8; ++x)
            for (int y = 0; y < 8; ++y) {
                const unsigned row = patch_.crossing(x, y);
                if (!row) continue;
                const int first = slotAt(b) * 512 + x * 64 + y * 8;
                for (int z = 0; z < 8; ++z) {
                    if (!(row >> z & 1)) continue;
                    Foot foot = patch_.findFoot(x + Patch::kHalo, y + Patch::kHalo, z + Patch::kHalo);
                    const Vec3f at(float(x + Patch::kHalo), float(y + Patch::kHalo), float(z + Patch::kHalo));
                    voxels_[size_t(first + z)] = {(at - foot.point).sqrnorm(), int(feet_.size())};
                    foot.point += shift;
                    feet_.push_back(foot);
                    layer_.push_back(first + z);
                }
            }
    }

    /// Offers the foot points of the last layer to the face neighbours.
    void spread() {
        next_.resize(6 * layer_.size());
        int* next = next_.data();
        const bool oneLimit = limit_[0] == limit_[1];
        for (const int i : layer_) {
            const int foot = voxels_[size_t(i)].foot & ~kQueued;
            voxels_[size_t(i)].foot = foot;
            const Slot& own = slots_[size_t(i >> 9)];
            const int v = i & 511, x = v >> 6, y = v >> 3 & 7, z = v & 7, b = own.block;
            const Vec3f e = own.origin + Vec3f(float(x), float(y), float(z)) - feet_[size_t(foot)].point;
            const float ex = e[0], ey = e[1], ez = e[2];
            const float xx = ex * ex, yy = ey * ey, zz = ez * ez;
            const float limit = oneLimit ? limit_[0] : limit_[source_[size_t(b)].inside(v)];
            float d2[6];
            int at[6];
            unsigned better = 0;
            // Voxels between this one and its foot have nearer ones of their own.
            const auto look = [&](int side, float along, float aside2, int place, int stride)
                __attribute__((always_inline)) {
                const bool up = side & 1;
                const float away = up ? along + 1 : along - 1;
                const bool asked = up ? along >= -kBetween : along <= kBetween;
                d2[side] = away * away + aside2;
                at[side] = up ? i + stride : i - stride;
                if (up ? place < 7 : place > 0) {
                    better |= unsigned(asked & (d2[side] < limit) & (d2[side] < voxels_[size_t(at[side])].distance2))
                              << side;
                    return;
                }
                if (!asked || d2[side] >= limit) return;
                const int slot = slotAt(up ? b + step_[side / 2] : b - step_[side / 2]);
                if (slot < 0) return;
                at[side] = slot * 512 + (up ? v - 7 * stride : v + 7 * stride);
                better |= unsigned(d2[side] < voxels_[size_t(at[side])].distance2) << side;
            };
            look(0, ex, yy + zz, x, 64), look(1, ex, yy + zz, x, 64);
            look(2, ey, xx + zz, y, 8), look(3, ey, xx + zz, y, 8);
            look(4, ez, xx + yy, z, 1), look(5, ez, xx + yy, z, 1);
            for (; better; better &= better - 1) {
                const int side = __builtin_ctz(better);
                Voxel& taker = voxels_[size_t(at[side])];
                *next = at[side];
                next += taker.foot < kQueued;
                taker = {d2[side], foot | kQueued};
            }
        }
        next_.resize(size_t(next - next_.data()));
        layer_.swap(next_);
    }

    float band_ = kResultBand, limit_[2] = {};  // squared; outside, inside
    int count_[3] = {}, step_[3] = {};
    std::vector<BlockValues> source_;
    std::vector<signed char> sign_;
    std::vector<int> slot_;  // of each block
    std::vector<Slot> slots_;
    std::vector<Voxel> voxels_;
    std::vector<Foot> feet_;
    std::vector<int> layer_, next_;
    Patch patch_;
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
    if (!window.load(part.origin.offsetBy(-8), blocks, band, band, values)) return made;
    window.solve();
    float d[512];
    BlockMask near;
    for (int x = 1; x <= part.size[0]; ++x)
        for (int y = 1; y <= part.size[1]; ++y)
            for (int z = 1; z <= part.size[2]; ++z) {
                if (!window.read(x, y, z, d, near)) continue;
                auto leaf =
                    std::make_unique<Leaf>(part.origin.offsetBy(8 * (x - 1), 8 * (y - 1), 8 * (z - 1)), 0.f, false);
                std::copy(d, d + 512, leaf->buffer().data());
                typename Leaf::NodeMaskType on;
                for (openvdb::Index slab = 0; slab < 8; ++slab)
                    std::memcpy(&on.template getWord<uint64_t>(slab), &near[slab * 8], 8);
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
    constexpr openvdb::Index kAboveLeaves = 1;
    openvdb::tools::signedFloodFillWithValues(*tree, band, -band, true, 1, kAboveLeaves);
    return tree;
}

/// A tree's blocks, for a window.
template <class Reader>
auto valuesOf(const Reader& reader) {
    return [&reader](const Coord& origin) {
        BlockValues f;
        if (const auto* leaf = reader.probeConstLeaf(origin))
            f.own = leaf->buffer().data();
        else
            f.tile = reader.getValue(origin);
        return f;
    };
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
        made[k] = solvePart<Leaf>(Part{origins[k], {kBlocks, kBlocks, kBlocks}}, kResultBand, valuesOf(reader));
    });
    return treeOf<Tree>(made, kResultBand);
}

}  // namespace

openvdb::FloatTree::Ptr widened(const openvdb::FloatTree& narrow, float outside, float inside) {
    constexpr float kGood = 2;  // nearer to the surface, values are taken over
    CoordBBox box;
    auto tree = std::make_shared<openvdb::FloatTree>(outside);
    if (!narrow.evalLeafBoundingBox(box)) return tree;
    const int reach = 8 * (int(outside) / 8 + 1);
    const Coord lo = box.min().offsetBy(-reach), hi = box.max().offsetBy(reach + 1);
    const std::array<int, 3> blocks{(hi[0] - lo[0]) / 8, (hi[1] - lo[1]) / 8, (hi[2] - lo[2]) / 8};
    const BaseReader reader(narrow);
    Window window;
    if (!window.load(lo, blocks, outside, inside, valuesOf(reader))) return tree;
    window.solve();
    float d[512];
    BlockMask near;
    for (int x = 0; x < blocks[0]; ++x)
        for (int y = 0; y < blocks[1]; ++y)
            for (int z = 0; z < blocks[2]; ++z) {
                if (!window.read(x, y, z, d, near)) continue;
                auto leaf = std::make_unique<WorkLeaf>(lo.offsetBy(8 * x, 8 * y, 8 * z), outside, true);
                const auto* known = reader.probeConstLeaf(leaf->origin());
                float* values = leaf->buffer().data();
                for (int v = 0; v < 512; ++v) {
                    const bool good = known && std::abs(known->buffer().data()[v]) < kGood;
                    values[v] = std::clamp(good ? known->buffer().data()[v] : d[v], -inside, outside);
                }
                tree->addLeaf(leaf.release());
            }
    openvdb::tools::signedFloodFillWithValues(*tree, outside, -inside);
    return tree;
}

openvdb::FloatTree::Ptr redistanced(const openvdb::FloatTree& raw) {
    return redistancedTree(raw);
}

WorkTree::Ptr redistanced(const WorkTree& raw) {
    return redistancedTree(raw);
}

WorkTree::Ptr redistanced(const Region& raw, float band) {
    if (raw.size() == 0) return std::make_shared<WorkTree>(band);
    // The band may leave the region's blocks by one; cut into equal parts that fit a window.
    const Coord lo = raw.numbers().lower().offsetBy(-8), hi = raw.numbers().upper().offsetBy(8);
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
