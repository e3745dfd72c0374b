#pragma once
// The growing front of one element: sub-voxel fast marching on blocks that are made when the front reaches them
// (paper, Fast marching approach; J. A. Sethian 1996).
#include <algorithm>
#include <boost/heap/d_ary_heap.hpp>
#include <deque>
#include <memory>
#include <unordered_map>

#include "pavel/vdb/contact_distance.h"
#include "pavel/vdb/growth_block.h"
#include "pavel/vdb/resting_cells.h"

namespace pavel {

class Front {
  public:
    /// @param weight relative speed, v_i / V_i over the largest of all
    Front(const WorkElement& element, ClaimMap& claims, double a, double b, double weight);

    /// Enters the first layer: free voxels beside the body, at their sub-voxel distance.
    void start();
    /// Accepts all voxels that arrive before `until`. stopTimes[id]: when others stopped (infinity while they grow).
    void march(double until, const std::vector<float>& stopTimes, bool claiming);
    /// Goes on past the end of a front that has stopped, so that times are known on both sides of it: accepts what
    /// arrives before `horizon`, and then, layer by layer, `layers` of voxels around that and one around the body,
    /// whenever they arrive.
    void marchBeyond(double horizon, int layers, const std::vector<float>& stopTimes);
    /// Keeps what it knows in a quarter of the memory, until it is to march again: look, but do not ask blocks.
    void rest();
    /// Did the last march go so far that a rest costs little beside it?
    bool mayRest() const { return accepted_ > 0 && 4 * accepted_ >= acceptedBefore_; }
    /// Frees all that it knows of voxels, for good.
    void forget();
    /// For a time without the shared clock: its claims, and none. Of a front that rests.
    void leaveClaims();
    void returnToClaims();
    /// Enters the claims of the last march into the shared clock.
    void commit();
    /// Counts the claims that won; the others become ghosts. Sets stopTime when the volume is back.
    void settle();
    /// Gives back claims later than the stop time.
    void release();
    /// The next arrival that waits, or infinity.
    double nextArrival() const;
    /// Largest speed on the waiting front, or where it was left waiting.
    double frontSpeed();
    static constexpr double kWidest = 2;  ///< b, in the element's sizes
    /// Gives everything back, to start() anew with b a step wider: pieces of time marched at several speeds would leave
    /// a craggy surface. Where it comes earlier than another then, the other loses ground. False when the limit is
    /// reached.
    bool widen();
    /// Does any free voxel wait for a wider b?
    bool couldWiden() const { return dormant_ || nextArrival() < std::numeric_limits<double>::infinity(); }

    /// Runs the front backwards into two layers of the body, so that times and scales are smooth across the body's
    /// surface. To be called when marching has ended.
    void finish();
    /// Gives the body's voxels that have times their own speed. Where it nearly ends, finds the contact distance in two
    /// layers of voxels around: their own speed tells how much of the front's advance goes on there.
    void lookBeyond();
    /// Arrival near the rim at a point in index space: see the definition. Never, away from the rim. `trusted`: how
    /// near to the rim phi still tells the angle.
    double wedgeArrival(const Vec3& p, double phi, double contact, const ContactDistance::Foot& foot,
                        double trusted) const;
    /// Is a point on the side of the shared surface, where a front gets only by turning through more than a right
    /// angle? `away`: as in ContactDistance::Foot, over the distance. 0 or 1, and a little way between them.
    template <class Real>
    [[gnu::always_inline]] static Real behind(Real away) {
        const Real share = -4 * away, least = share > 0 ? share : 0;
        return least < 1 ? least : 1;
    }
    /// How far from the rim that holds.
    double wedgeReach() const { return std::min(4.0, 0.8 * a * element.size); }
    /// Turns times into distances: the speed at the voxel (not taken nearer to the contact than two voxels), or beyond
    /// the rim the mean speed on the way from the placed surface, where that is larger: distances then go over into the
    /// placed ones where the speed ends. 0 where the front does not go.
    float scaleAt(const GrowthBlock& block, const GrowthCell& cell, int v, int i) const;
    /// The voxels of a cell, in its order. `way`: scale * (arrival - stop time), phi where the front has no time.
    struct CellField {
        float phi[GrowthCell::kCount], way[GrowthCell::kCount], scale[GrowthCell::kCount];
    };
    /// scaleAt for a whole cell of a block, and what goes with it. `placed`: the block's 512 values.
    void read(const GrowthCell& cell, int number, const float* placed, CellField& out) const;
    GrowthBlock* probe(const Coord& origin) const;
    /// A cell of a block, null where the front touched nothing, whether it rests or not. `spread`: room for it.
    const GrowthCell* look(const GrowthBlock& block, int cell, GrowthCell& spread) const {
        if (!(resting_.cells(block.number) >> cell & 1)) return block.cells[cell];
        resting_.read(block.number, cell, spread);
        return &spread;
    }
    /// Did it touch anything in the block?
    bool touched(const GrowthBlock& block) const {
        return resting_.cells(block.number) ||
               std::any_of(block.cells, block.cells + 8, [](const GrowthCell* c) { return c; });
    }

    const WorkElement& element;
    std::deque<GrowthBlock> blocks;
    double a, b, weight;
    double grown = 0;  ///< voxels won so far
    float stopTime = std::numeric_limits<float>::infinity();
    float lastArrival = 0;   ///< of what was marched so far
    bool stopped = false;    ///< has its volume back, or
    bool exhausted = false;  ///< has no room left
    double firstB = 0;       ///< b before it was widened
    size_t won = 0;          ///< in the last round

  private:
    /// Orders by time, then by voxel (block number * 512 + index): positive floats order like their bits.
    struct Arrival {
        uint64_t key;
        Arrival(float time, uint32_t voxel) : key(makeClaim(time, int(voxel))) {}
        float time() const { return claimTime(key); }
        uint32_t voxel() const { return uint32_t(key); }
        bool operator<(const Arrival& o) const { return key > o.key; }  // the earliest on top of a heap
    };
    using Queue = boost::heap::d_ary_heap<Arrival, boost::heap::arity<4>>;
    static uint32_t keyOf(const GrowthBlock& block, int v) { return uint32_t(block.number) * 512 + uint32_t(v); }
    GrowthBlock* make(const Coord& origin);
    /// Neighbouring voxel: its block (null where there is none) and index.
    static GrowthBlock* step(GrowthBlock* block, int v, int side, int& n) {
        const int at = kLeafTables.beside[side][v];
        n = at & (LeafTables::kNext - 1);
        return at & LeafTables::kNext ? block->next[side] : block;
    }
    GrowthBlock* stepOrMake(GrowthBlock* block, int v, int side, int& n);
    /// The earliest times beside a voxel along each axis, of what the front holds, and of ghosts, too.
    struct Upwind {
        float held[3], any[3];
    };
    static Upwind upwind(GrowthBlock* block, int v);
    double speedAt(double contact) const;
    double speedOf(GrowthBlock* block, int v);
    double wedgeArrival(const GrowthBlock& block, int v) const;
    double innerScale(GrowthBlock& block, int v) const;
    void wake();
    void findQueues();
    GrowthCell& touch(GrowthBlock& block, int v);
    GrowthCell& add(GrowthBlock& block, int cell);
    bool heldByOther(const GrowthBlock* block, int v, float time, const std::vector<float>& stopTimes) const;
    /// Does the front go on from there?
    bool accept(GrowthBlock* block, int v, const std::vector<float>& stopTimes, bool claiming);
    double arrivalAt(GrowthBlock* block, int v, double speed, const std::vector<float>& stopTimes) const;
    void pushBeside(GrowthBlock* block, int v, const std::vector<float>& stopTimes);
    std::vector<VoxelMask> around(double horizon, int layers);
    std::vector<Arrival> layerBeside(std::vector<Arrival> layer, const std::vector<VoxelMask>& limits,
                                     const std::vector<float>& stopTimes);
    void push(GrowthBlock* block, int v, double time);
    void enter(GrowthBlock& block, int v);

    ClaimMap& claims_;
    std::unordered_map<Coord, GrowthBlock*, CoordHash> map_;
    static constexpr int kChunk = 8;
    std::vector<std::unique_ptr<GrowthCell[]>> cells_;  // a deque would ask for memory for each
    int usedOfLast_ = kChunk;
    RestingCells resting_;                 // in the place of cells_
    int nearestRim_ = -1;                  // of the voxel whose contact distance was asked for last
    uint32_t rimAskedFor_ = uint32_t(-1);  // that voxel
    Queue heap_;
    bool queuesGone_ = false;                   // since it rested
    float waits_ = 0;                           // the next arrival then
    bool pastEnd_ = false;                      // marched beyond
    size_t accepted_ = 0, acceptedBefore_ = 0;  // voxels of the last march, and of those before
    double speed_ = 0;                          // of the waiting front, where it is known
    bool speedKnown_ = false;
    bool changed_ = false;           // since it was finished
    bool dormant_ = false;           // touched free voxels where the speed is zero
    std::vector<Arrival> claimed_;   // in the last round
    std::vector<uint32_t> leftOut_;  // accepted voxels beside which the limits left some out
};

}  // namespace pavel
