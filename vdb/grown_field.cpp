#include "pavel/vdb/grown_field.h"

#include <algorithm>
#include <array>
#include <vector>

#include "pavel/vdb/recovery_function.h"

namespace pavel {

/// Along one axis: how the k-th of the fine blocks in a coarse one lies among the coarse nodes.
struct FineSpan {
    static constexpr int kMostNodes = 7;
    int first = 0, nodes = 0;          ///< the node at or before its first voxel; nodes from the one before that on
    int before[8];                     ///< of a voxel's four nodes the first, from the first of all
    std::array<float, 4> weights[8];   ///< Catmull-Rom
    float spread[kMostNodes][8] = {};  ///< the same by nodes, zero for those that a voxel does not see

    FineSpan(int k, int factor) : first(8 * k / factor) {
        for (int i = 0; i < 8; ++i) {
            before[i] = (8 * k + i) / factor - first;
            const float t = float((8 * k + i) % factor) / float(factor), t2 = t * t, t3 = t2 * t;
            weights[i] = {0.5f * (-t3 + 2 * t2 - t), 0.5f * (3 * t3 - 5 * t2 + 2), 0.5f * (-3 * t3 + 4 * t2 + t),
                          0.5f * (t3 - t2)};
            for (int m = 0; m < 4; ++m) spread[before[i] + m][i] = weights[i][size_t(m)];
        }
        nodes = before[7] + 4;
    }
};

/// A front's nodes in one of its blocks and around it: one layer before the block, two beyond it.
struct FrontNodes {
    static constexpr int kBefore = 1, kSide = 11, kRow = 16, kSlab = kSide * kRow, kCount = kSide * kSlab;
    static constexpr int index(int x, int y, int z) { return x * kSlab + y * kRow + z; }

    float phi[kCount], way[kCount], scale[kCount];
    uint8_t flags[kCount];

    /// The nodes around a fine block, from the one before its first.
    struct Window {
        const float *phi, *way, *scale;  ///< steps kSlab, kRow, 1
        const FineSpan *x, *y, *z;
        // Of the nodes that the block's voxels lie between:
        uint8_t flags = 0;    ///< of any of them
        float least = kBand;  ///< of the front's own values, in coarse voxels
    };
    Window window(const FineSpan& sx, const FineSpan& sy, const FineSpan& sz) const;
};

namespace {

constexpr uint8_t kTimed = 1, kNearRim = 2;

constexpr float kReach =
    3;                     ///< fine voxels: farther off, a front is not seen in a region, nor after its last small move
constexpr float kFar = 3;  ///< coarse voxels: what comes later than that would only make an interpolation swing

/// What a front holds in one of its blocks.
struct FrontBlock {
    float phi[512], way[512], scale[512];
    float speed[512];    ///< -1 where it is not known
    uint8_t flags[512];  ///< kTimed, kNearRim

    FrontBlock(const Front& front, const GrowthBlock& block) {
        if (block.placed)
            std::copy(block.placed, block.placed + 512, phi);
        else
            std::fill(phi, phi + 512, block.placedTile);
        std::copy(phi, phi + 512, way);
        std::fill(scale, scale + 512, 0.f);
        std::fill(speed, speed + 512, -1.f);
        std::fill(flags, flags + 512, uint8_t(0));
        Front::CellField read;
        for (int c = 0; c < 8; ++c) {
            if (!block.cells[c]) continue;
            const GrowthCell& cell = *block.cells[c];
            front.read(block, c, read);
            for (int i = 0; i < GrowthCell::kCount; ++i) {
                const bool timed = cell.time[i] < GrowthBlock::kNever,
                           asked = (cell.contact[i] >= 0) & (cell.state[i] != kInner);
                const int v = GrowthBlock::voxelOf(c, i);
                way[v] = timed ? std::min(kFar, read.way[i]) : read.phi[i];
                scale[v] = timed ? read.scale[i] : 0;
                speed[v] = timed | !asked ? -1 : read.scale[i];
                flags[v] = uint8_t((timed ? kTimed : 0) | (asked & (cell.contact[i] < 3) ? kNearRim : 0));
            }
        }
    }
};

/// A front's own nodes in and around one of its blocks: as FrontNodes, and two layers more on each side, so that the
/// times that go on beyond the front are known wherever the interpolation asks.
class Nodes {
  public:
    static constexpr int kBefore = 3, kSide = 15, kRow = 16, kSlab = kSide * kRow, kCount = kSide * kSlab;

    /// @param blocks of the front, by number
    Nodes(const Front& front, const std::vector<FrontBlock>& blocks, const Coord& block) {
        struct Source {
            const FrontBlock* front = nullptr;  // or else
            const float* phi = nullptr;         // or else
            float tile = 0;
        } sources[27];
        const WorkTree& placed = *front.element.placed;
        for (int part = 0; part < 27; ++part) {
            const Coord at = block.offsetBy(part / 9 * 8 - 8, part / 3 % 3 * 8 - 8, part % 3 * 8 - 8);
            if (const GrowthBlock* grown = front.probe(at))
                sources[part].front = &blocks[size_t(grown->number)];
            else if (const WorkLeaf* leaf = placed.probeConstLeaf(at))
                sources[part].phi = leaf->buffer().data();
            else
                sources[part].tile = placed.getValue(at);
        }
        forEachRowAround<kBefore, kSide - 8 - kBefore, kRow>([&](int part, int row, int at, auto n) {
            const auto& [grown, phi, tile] = sources[part];
            const auto copy = [&](const auto* from, auto* to) {
                for (int i = 0; i < n; ++i) to[at + i] = from[row + i];
            };
            const auto fill = [&](auto* to, auto value) {
                for (int i = 0; i < n; ++i) to[at + i] = value;
            };
            if (grown) {
                copy(grown->phi, phi_), copy(grown->way, way_), copy(grown->scale, scale_);
                copy(grown->speed, speed_), copy(grown->flags, flags_);
                return;
            }
            if (phi)
                copy(phi, phi_), copy(phi, way_);
            else
                fill(phi_, tile), fill(way_, tile);
            fill(scale_, 0.f), fill(speed_, -1.f), fill(flags_, uint8_t(0));
        });
        uint8_t all[kSide] = {};
        float least[kSide];
        std::fill(least, least + kSide, kBand);
        for (int x = 0; x < kSide; ++x)
            for (int y = 0; y < kSide; ++y)
                for (int z = 0, i = index(x, y, 0); z < kSide; ++z, ++i) {
                    all[z] = uint8_t(all[z] | flags_[i]);
                    least[z] = way_[i] < least[z] ? way_[i] : least[z];
                }
        any_ = std::any_of(all, all + kSide, [](uint8_t f) { return f & kTimed; });
        least_ = *std::min_element(least, least + kSide);
    }
    /// Is there anything of the front within the band, in coarse voxels?
    bool within(float band) const { return any_ && least_ <= band; }

    void continueTimes();
    std::unique_ptr<FrontNodes> inner() const {
        auto inner = std::make_unique<FrontNodes>();
        for (int x = 0; x < FrontNodes::kSide; ++x)
            for (int y = 0; y < FrontNodes::kSide; ++y) {
                constexpr int kMore = kBefore - FrontNodes::kBefore;
                const int from = index(x + kMore, y + kMore, kMore), to = FrontNodes::index(x, y, 0);
                const auto copy = [&](const auto* source, auto* row) {
                    std::copy(source + from, source + from + FrontNodes::kSide, row + to);
                };
                copy(phi_, inner->phi), copy(way_, inner->way), copy(scale_, inner->scale);
                copy(flags_, inner->flags);
            }
        return inner;
    }

  private:
    static constexpr int index(int x, int y, int z) { return x * kSlab + y * kRow + z; }

    float phi_[kCount], way_[kCount], scale_[kCount], speed_[kCount];
    uint8_t flags_[kCount];
    bool any_;
    float least_;
};

/// Gives the nodes beside those that the front reached times as if it had gone on, two layers of them: an interpolation
/// that took the placed surface's distance for them would put ripples into the front's. Its advance goes on as much as
/// the speed does: not at all where that is zero. The outermost layer only lends its values.
PAVEL_WIDE void continueTimes(const float* phi, const float* speed, float* way, float* scale) {
    constexpr int n = Nodes::kSide, kSlab = Nodes::kSlab, kRow = Nodes::kRow,
                  kSides[6] = {-kSlab, kSlab, -kRow, kRow, -1, 1};
    float ahead[Nodes::kCount], newWay[Nodes::kCount], newScale[Nodes::kCount];
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < Nodes::kCount; ++i) {
            const float lead = way[i] - phi[i];
            ahead[i] = scale[i] > 0 ? lead : 0;
        }
        for (int x = 1; x < n - 1; ++x)
            for (int y = 1; y < n - 1; ++y) {
                const int row = x * kSlab + y * kRow;
                for (int i = row + 1; i < row + n - 1; ++i) {
                    float lead = 0, beside = 0, known = 0;
                    for (const int side : kSides) {
                        lead += ahead[i + side];
                        beside += scale[i + side];
                        known += scale[i + side] > 0 ? 1.f : 0.f;
                    }
                    const float share = speed[i] * known / beside, slower = share < 1 ? share : 1,
                                goesOn = speed[i] < 0 ? 1 : slower;
                    const float farther = phi[i] + goesOn * lead / known, mean = goesOn * beside / known;
                    const bool open = (scale[i] <= 0) & (speed[i] != 0) & (known > 0);
                    newWay[i] = open ? farther : way[i];
                    newScale[i] = open ? mean : scale[i];
                }
            }
        for (int x = 1; x < n - 1; ++x)
            for (int y = 1; y < n - 1; ++y) {
                const int row = x * kSlab + y * kRow;
                std::copy(newWay + row + 1, newWay + row + n - 1, way + row + 1);
                std::copy(newScale + row + 1, newScale + row + n - 1, scale + row + 1);
            }
    }
}

void Nodes::continueTimes() {
    pavel::continueTimes(phi_, speed_, way_, scale_);
}

/// Values on the window's nodes to the block's 8^3 voxels.
PAVEL_WIDE void upsample(const float* nodes, const FrontNodes::Window& w, float* out) {
    constexpr int n = FineSpan::kMostNodes, kSlab = FrontNodes::kSlab;
    float alongX[n * 8], alongY[8 * n];
    for (int x = 0; x < 8; ++x) {
        const auto& cx = w.x->weights[x];
        const float* slab = nodes + w.x->before[x] * kSlab;
        for (int y = 0; y < w.y->nodes; ++y) {
            const float* f = slab + y * FrontNodes::kRow;
            PAVEL_ROLLED
            for (int z = 0; z < 8; ++z)
                alongX[y * 8 + z] =
                    cx[0] * f[z] + cx[1] * f[kSlab + z] + cx[2] * f[2 * kSlab + z] + cx[3] * f[3 * kSlab + z];
        }
        for (int y = 0; y < 8; ++y) {
            const auto& cy = w.y->weights[y];
            const float* f = alongX + w.y->before[y] * 8;
            PAVEL_ROLLED
            for (int z = 0; z < 8; ++z)
                alongY[z] = cy[0] * f[z] + cy[1] * f[8 + z] + cy[2] * f[16 + z] + cy[3] * f[24 + z];
            // As a matrix: the four nodes that a voxel asks for would have to be gathered.
            float* row = out + x * 64 + y * 8;
            PAVEL_ROLLED
            for (int z = 0; z < 8; ++z) {
                float sum = w.z->spread[0][z] * alongY[0];
                for (int m = 1; m < n; ++m) sum += w.z->spread[m][z] * alongY[m];
                row[z] = sum;
            }
        }
    }
}

/// Front::wedgeArrival, and the speed there, for many points at once.
struct Wedge {
    explicit Wedge(const Front& front)
        : weight(float(front.weight)),
          a(float(front.a * front.element.size)),
          b(float(front.b * front.element.size)),
          reach(float(front.wedgeReach())) {}
    float weight, a, b, reach;  ///< a and b in voxels of the front's grid

    [[gnu::always_inline]] float speed(float d) const { return weight * recoveryFunction(d, a, b); }
};

/// M. Abramowitz and I. Stegun, Handbook of Mathematical Functions, 4.4.46; for x in [0, 1].
[[gnu::always_inline]] inline float arcsine(float x) {
    const float p =
        1.5707963050f +
        x * (-0.2145988016f +
             x * (0.0889789874f +
                  x * (-0.0501743046f +
                       x * (0.0308918810f + x * (-0.0170881256f + x * (0.0066700901f - x * 0.0012624911f))))));
    return 1.57079633f - std::sqrt(1 - x) * p;
}

/// Points of a fine block near a rim, in coarse voxels.
struct NearRim : ContactDistance::Near::Queries {
    int voxel[kMost];
    float phi[kMost], distance[kMost], time[kMost], scale[kMost];
};

constexpr float kNever = 1e30f;

PAVEL_WIDE void wedgeTimes(const Wedge& wedge, float least, NearRim& q) {
    for (int i = 0; i < q.count; ++i) {
        const float d = std::sqrt(q.distance2[i]), share = q.phi[i] / d, speed = wedge.speed(d),
                    rise = arcsine(share < 1 ? share : 1),
                    angle = rise + Front::behind(q.away[i] / d) * (float(kPi) - 2 * rise), time = angle * d / speed;
        const bool swept = (d > 0) & (d <= wedge.reach) & (q.phi[i] <= 3) & (speed > 0);
        q.distance[i] = d;
        q.time[i] = swept ? time : kNever;
        q.scale[i] = wedge.speed(d < least ? least : d);
    }
}

/// Voxels outside the placed surface, nearer to it than a distance, where the front comes within the band.
PAVEL_WIDE void besideRim(const float* distance, const GrownBlock& grown, float near, BlockMask& out) {
    for (int row = 0; row < 64; ++row) {
        unsigned bits = 0;
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) {
            const int v = 8 * row + z;
            bits |= unsigned((distance[v] > 0) & (distance[v] < near) & (grown.scale[v] > 0) &
                             (std::abs(grown.way[v]) <= 2 * kBand))
                    << z;
        }
        out[size_t(row)] = uint8_t(bits);
    }
}

/// Interpolation knows nothing of a field that turns around the rim like the hand of a clock.
void mendNearRim(const Front& front, const Coord& origin, int factor, const float* distance, GrownBlock& out) {
    // Coarse voxels from the rim: nothing of the wedge; nothing but it.
    const float none = std::min(2.f, float(front.wedgeReach())), only = 0.5f * none;
    const float toCoarse = 1 / float(factor);
    const ContactDistance::Near rims =
        front.element.contact->near((centreOf(origin) + Vec3(3.5, 3.5, 3.5)) * double(toCoarse),
                                    3.5 * std::sqrt(3.0) * double(toCoarse), double(none));
    if (rims.empty()) return;
    NearRim q;
    BlockMask asked;
    besideRim(distance, out, none * float(factor), asked);
    for (int v = 0; v < 512; ++v) {
        if (!testMask(asked, v)) continue;
        const Coord c = origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v));
        const Vec3f p{float(c[0]) * toCoarse, float(c[1]) * toCoarse, float(c[2]) * toCoarse};
        if (rims.toBox2(p) >= none * none) continue;
        q.x[q.count] = p[0], q.y[q.count] = p[1], q.z[q.count] = p[2];
        q.voxel[q.count] = v, q.phi[q.count++] = distance[v] * toCoarse;
    }
    if (q.count == 0) return;
    rims.nearest(q);
    const double trusted = 2 * double(toCoarse);
    wedgeTimes(Wedge(front), float(std::min(2.0, front.a * front.element.size)), q);
    for (int i = 0; i < q.count; ++i) {
        const float d = q.distance[i];
        if (d >= none) continue;
        double time = double(q.time[i]);
        if (double(d) < trusted) {
            const Vec3f p{q.x[i], q.y[i], q.z[i]}, rim = rims.nearestOn(q.piece[i], p);
            time = front.wedgeArrival(Vec3(p[0], p[1], p[2]), double(q.phi[i]), double(d),
                                      {Vec3(rim[0], rim[1], rim[2]), double(q.away[i])}, trusted);
        }
        if (time >= double(kNever)) continue;
        const float scale = float(factor) * q.scale[i], wedge = float(double(scale) * (time - double(front.stopTime))),
                    share = std::clamp((none - d) / (none - only), 0.f, 1.f);
        const int v = q.voxel[i];
        out.way[v] = share * wedge + (1 - share) * out.way[v];
        out.scale[v] = share * scale + (1 - share) * out.scale[v];
    }
}

/// Values of one fine block from the coarse nodes around it. `distance`: to the placed surface, beyond its band, too.
PAVEL_WIDE void interpolate(const FrontNodes::Window& nodes, int factor, float slowest, const float* placed,
                            float* distance, GrownBlock& out) {
    const float k = float(factor);
    upsample(nodes.way, nodes, out.way);
    upsample(nodes.scale, nodes, out.scale);
    upsample(nodes.phi, nodes, distance);
    for (int v = 0; v < 512; ++v) {
        // Details of the placed surface that the coarse grid does not know ride along with the front.
        float share = 0.5f * (kBand - std::abs(placed[v]));
        share = share > 1 ? 1 : share;
        share = share < 0 ? 0 : share;
        const float detail = share * (placed[v] - k * distance[v]);
        distance[v] = k * distance[v] + detail;
        out.way[v] = k * out.way[v] + detail;
        out.scale[v] = out.scale[v] * k < slowest ? 0 : out.scale[v] * k;
    }
}

/// Does the front come within reach?
PAVEL_WIDE bool reaches(const GrownBlock& block) {
    int count = 0;
    for (int v = 0; v < 512; ++v) count += int(block.scale[v] > 0) & int(block.way[v] < kReach);
    return count > 0;
}

}  // namespace

FrontNodes::Window FrontNodes::window(const FineSpan& sx, const FineSpan& sy, const FineSpan& sz) const {
    const int from = index(sx.first, sy.first, sz.first);
    Window w{phi + from, way + from, scale + from, &sx, &sy, &sz};
    for (int x = 1; x < sx.nodes - 1; ++x)
        for (int y = 1; y < sy.nodes - 1; ++y)
            for (int i = from + index(x, y, 1), end = i + sz.nodes - 2; i < end; ++i) {
                w.flags |= flags[i];
                w.least = way[i] < w.least ? way[i] : w.least;
            }
    return w;
}

GrownField::GrownField(const Front& front, int factor) : front_(front), factor_(factor) {
    for (int k = 0; k < factor; ++k) spans_.emplace_back(k, factor);
    std::vector<FrontBlock> blocks;
    blocks.reserve(front.blocks.size());
    for (const GrowthBlock& grown : front.blocks) blocks.emplace_back(front, grown);
    for (const GrowthBlock& grown : front.blocks) {
        Nodes nodes(front, blocks, grown.origin);
        std::unique_ptr<FrontNodes>& kept = nodes_.emplace_back();
        if (!nodes.within(kReach / float(factor))) continue;
        nodes.continueTimes();
        kept = nodes.inner();
    }
}

GrownField::~GrownField() = default;

bool GrownField::read(const Coord& origin, const float* placed, GrownBlock& out) const {
    Coord corner;
    size_t at[3];  // of the fine block in the coarse one
    for (int k = 0; k < 3; ++k) {
        const int block = origin[k] >> 3, coarse = floorDivide(block, factor_);
        corner[k] = 8 * coarse;
        at[k] = size_t(block - coarse * factor_);
    }
    const GrowthBlock* grown = front_.probe(corner);
    const FrontNodes* nodes = grown ? nodes_[size_t(grown->number)].get() : nullptr;
    if (!nodes) return false;
    const FrontNodes::Window window = nodes->window(spans_[at[0]], spans_[at[1]], spans_[at[2]]);
    if (!(window.flags & kTimed) || window.least > kReach / float(factor_)) return false;
    float distance[512];
    interpolate(window, factor_, 1e-3f * float(front_.weight * factor_), placed, distance, out);
    if (window.flags & kNearRim) mendNearRim(front_, origin, factor_, distance, out);
    return reaches(out);
}

}  // namespace pavel
