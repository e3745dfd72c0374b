// What a front that has ended tells: how far its times are from the stop, as distances.
#include <algorithm>

#include "pavel/vdb/front.h"
#include "pavel/vdb/recovery_function.h"

namespace pavel {
namespace {

constexpr float kNever = GrowthBlock::kNever;
constexpr float kNearRim = 3;  // voxels from it: no mean speed there

/// What Front::scaleAt needs to know of a front; in voxels.
struct Speed {
    explicit Speed(const Front& f)
        : weight(float(f.weight)),
          a(float(f.a * f.element.size)),
          b(float(f.b * f.element.size)),
          least(std::min(2.f, a)) {}
    float weight, a, b, least;

    /// Not taken nearer to the contact than two voxels. There it falls so fast within a voxel that the zero set of a
    /// product with it would be pitted.
    [[gnu::always_inline]] float at(float contact) const {
        return weight * recoveryFunction(contact > least ? contact : least, a, b);
    }
    [[gnu::always_inline]] float scale(bool inner, float contact, float time, float phi) const {
        const float speed = at(contact);
        const float near = 2.5f - phi, most = near < 1 ? near : 1, share = most > 0 ? most : 0;  // placed ones end at 3
        const float faster = phi / time - speed, mean = speed + share * (faster > 0 ? faster : 0);
        const float own = (time < kNever) & (phi > 0) & (contact >= kNearRim) ? mean : speed,
                    known = contact < 0 ? 0 : own;
        return inner ? contact : known;
    }
};

/// Front::read, with phi there already.
PAVEL_WIDE void readCell(const GrowthCell& cell, const Speed& speed, float stopTime, Front::CellField& out) {
    const Speed s = speed;
    for (int i = 0; i < GrowthCell::kCount; ++i) {
        const float time = cell.time[i], phi = out.phi[i],
                    scale = s.scale(cell.state[i] == kInner, cell.contact[i], time, phi),
                    way = scale * (time - stopTime);
        out.scale[i] = scale;
        out.way[i] = time < kNever ? way : phi;
    }
}

}  // namespace

void Front::read(const GrowthCell& cell, int number, const float* placed, CellField& out) const {
    for (int i = 0; i < GrowthCell::kCount; i += 4)
        std::copy_n(placed + GrowthBlock::voxelOf(number, i), 4, out.phi + i);
    readCell(cell, Speed(*this), stopTime, out);
}

float Front::scaleAt(const GrowthBlock& block, const GrowthCell& cell, int v, int i) const {
    return Speed(*this).scale(cell.state[i] == kInner, cell.contact[i], cell.time[i], block.placedAt(v));
}

/// Mean scale of the neighbours that have times, for a body voxel beside them; 0 where there are none.
double Front::innerScale(GrowthBlock& block, int v) const {
    double sum = 0;
    int count = 0;
    for (int side = 0; side < 6; ++side) {
        int n;
        const GrowthBlock* other = step(&block, v, side, n);
        if (!other || !other->hasTime(n)) continue;
        sum += scaleAt(*other, *other->cellAt(n), n, inCell(n));
        ++count;
    }
    return count ? sum / count : 0;
}

void Front::finish() {
    if (!changed_) return;
    wake();
    changed_ = false;
    std::vector<VoxelMask> timed(blocks.size());
    for (GrowthBlock& block : blocks)
        block.forEachVoxel([&](int v, GrowthCell& cell, int i) {
            if (!(cell.time[i] < kNever)) return;
            if (cell.state[i] == kInner)
                cell.state[i] = kBody, cell.time[i] = kNever, cell.contact[i] = -1;
            else
                timed[size_t(block.number)].setOn(openvdb::Index(v));
        });
    // Layer by layer: the voxels of the body beside those that have times.
    for (int layer = 0; layer < 2; ++layer) {
        struct Inner {
            GrowthBlock* block;
            int v;
            float scale;
        };
        std::vector<Inner> inner;
        for (GrowthBlock& block : blocks) {
            const VoxelMask* sides[6];
            for (int side = 0; side < 6; ++side)
                sides[side] = block.next[side] ? &timed[size_t(block.next[side]->number)] : nullptr;
            VoxelMask beside = besideMask(timed[size_t(block.number)], sides);
            beside &= *block.body;
            beside -= timed[size_t(block.number)];
            for (auto at = beside.beginOn(); at; ++at)
                inner.push_back({&block, int(at.pos()), float(innerScale(block, int(at.pos())))});
        }
        for (const Inner& at : inner) {
            GrowthCell& cell = touch(*at.block, at.v);
            const int i = inCell(at.v);
            cell.state[i] = kInner;
            cell.contact[i] = at.scale;
            cell.time[i] = std::min(-1e-6f, at.block->placedAt(at.v) / at.scale);
            timed[size_t(at.block->number)].setOn(openvdb::Index(at.v));
        }
    }
}

void Front::lookBeyond() {
    wake();
    std::vector<std::pair<GrowthBlock*, int>> layer, next;
    const auto contactAt = [&](const GrowthBlock& block, int v) {
        return float((*element.contact)(centreOf(block.origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)))));
    };
    const auto askBeside = [&](GrowthBlock* block, int v) {
        for (int side = 0; side < 6; ++side) {
            int n;
            GrowthBlock* other = stepOrMake(block, v, side, n);
            GrowthCell& cell = touch(*other, n);
            const int i = inCell(n);
            if (cell.contact[i] >= 0 && cell.state[i] != kInner) continue;
            if (cell.state[i] != kInner) cell.contact[i] = contactAt(*other, n);
            next.emplace_back(other, n);
        }
    };
    const Speed speed(*this);
    // Elsewhere the speed changes little within two voxels.
    const float slow = float(weight * recoveryFunction(b - 3 / element.size, a, b));
    const size_t made = blocks.size();
    for (size_t k = 0; k < made; ++k) {
        GrowthBlock& block = blocks[k];
        block.forEachVoxel([&](int v, GrowthCell& cell, int i) {
            if (!(cell.time[i] < kNever)) return;
            if (scaleAt(block, cell, v, i) <= slow) askBeside(&block, v);
            if (cell.state[i] != kInner) return;
            // Its neighbours' mean will do for marching, but would leave warts where the speed changes much in a voxel.
            cell.contact[i] = contactAt(block, v);
            cell.state[i] = kBody;
            const float scale = speed.at(cell.contact[i]);
            cell.time[i] = scale > 0 ? std::min(-1e-6f, block.placedAt(v) / scale) : kNever;
        });
    }
    layer.swap(next);
    for (const auto& [block, v] : layer) askBeside(block, v);
}

}  // namespace pavel
