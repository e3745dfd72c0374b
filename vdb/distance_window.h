#pragma once
// Nearest points of a surface, handed on from voxel to voxel through its band. Internal to re-distancing.
#include <algorithm>
#include <array>
#include <vector>

#include "pavel/vdb/foot_block.h"
#include "pavel/vdb/foot_points.h"
#include "pavel/vdb/pieces.h"

namespace pavel {

/// A box of blocks. Only those in the band hold voxels: a slot each.
class DistanceWindow {
  public:
    /// values(origin) -> BlockValues. False where no surface passes.
    /// @param outside, inside how far the band reaches on the two sides
    template <class Values>
    bool load(const Coord& origin, const std::array<int, 3>& blocks, float outside, float inside, Values&& values) {
        band_ = std::max(outside, inside);
        limit_[0] = (outside + 0.25f) * (outside + 0.25f), limit_[1] = (inside + 0.25f) * (inside + 0.25f);
        for (int k = 0; k < 3; ++k) count_[k] = blocks[size_t(k)] + 2;  // one more layer, whose values alone are used
        step_[0] = count_[1] * count_[2], step_[1] = count_[2], step_[2] = 1;
        const size_t count = size_t(count_[0]) * size_t(step_[0]);
        source_.resize(count);
        sign_.resize(count);
        slot_.assign(count, kNone);
        slots_ = 0;
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

    void solve();
    /// The clean distances of a block, one of the window's own or its halo, and which are in the band; false where none
    /// is.
    bool read(int bx, int by, int bz, float* out, BlockMask& near) const;

  private:
    static constexpr int kNone = -1, kClosed = -2;

    int block(int x, int y, int z) const { return x * step_[0] + y * step_[1] + z; }

    /// -1 inside, 1 outside, 0 mixed.
    static signed char signOf(const BlockValues& f);

    /// Does a block hold voxels beside the surface? One of a single sign may by its face neighbours only.
    bool crosses(int b) const;

    /// The block's slot, made where it has none yet; negative outside the window.
    int slotAt(int b);

    /// Feet of the block's voxels beside the surface.
    void findFeet(int bx, int by, int bz);

    /// Lets feet spread through all blocks, up and down. sweep: true where that changed anything.
    void sweepOnce();
    bool sweep();
    bool spreadLayer(int x, bool up, int twosAlong);
    /// The same in one block, and makes slots for those beside it that its feet reach. `twosAlong`: as FootBlock's.
    bool spread(int block, int twosAlong);

    float band_ = kResultBand, limit_[2] = {};  // up to where blocks get slots, squared; outside, inside
    int count_[3] = {}, step_[3] = {};
    std::vector<BlockValues> source_;
    std::vector<signed char> sign_;
    std::vector<int> slot_;  // of each block
    int slots_ = 0;
    std::vector<FootBlock> voxels_;  // of all slots, and of more that windows before this one had
    std::vector<Foot> feet_;
    Patch patch_;
};

}  // namespace pavel
