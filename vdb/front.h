#pragma once
// The growing front of one element: sub-voxel fast marching on blocks that are made when the front reaches them
// (paper, Fast marching approach; J. A. Sethian 1996).
#include <deque>
#include <unordered_map>

#include "pavel/vdb/claims.h"
#include "pavel/vdb/contact.h"

namespace pavel {

/// State of a voxel for one front. Ghosts are voxels that another front or body holds: the front marches two layers
/// into them, so that the face between the two is known at sub-voxel precision, but grows no further from there.
enum VoxelState : uint8_t { kFar, kTrial, kReal, kGhost, kDeepGhost, kBody };

struct GrowthBlock {
    Coord origin;
    ClaimBlock* claims = nullptr;
    const float* placed = nullptr;  ///< the placed shape's values here, or null where placedTile stands for all
    float placedTile = 0;
    float placedAt(int v) const { return placed ? placed[v] : placedTile; }
    GrowthBlock* next[6] = {};  ///< -x +x -y +y -z +z, null until made
    int number = 0;
    float time[512];     ///< arrival time; in body voxels, once extended: the front's way run backwards, negative
    float contact[512];  ///< distance to the contact rims, -1 where not asked for yet
    float scale[512];    ///< turns times into distances: Front::scaleFor; 0 where the front does not go
    uint8_t state[512];
    bool hasTime(int v) const { return scale[v] > 0 && time[v] < std::numeric_limits<float>::max(); }
};

class Front {
  public:
    /// @param weight relative speed, v_i / V_i over the largest of all
    Front(const WorkElement& element, ClaimMap& claims, double a, double b, double weight);

    /// Enters the first layer: free voxels beside the body, at their sub-voxel distance.
    void start();
    /// Accepts all voxels that arrive before `until`. stopTimes[id]: when others stopped (infinity while they grow).
    void march(double until, const std::vector<float>& stopTimes, bool claiming);
    /// Enters the claims of the last march into the shared clock.
    void commit();
    /// Counts the claims that won; the others become ghosts. Sets stopTime when the volume is back.
    void settle();
    /// Gives back claims later than the stop time.
    void release();
    /// Frees the queue: no more marching after this.
    void dropQueue() { std::vector<Arrival>().swap(heap_), std::vector<Arrival>().swap(claimed_); }
    /// The next arrival that waits, or infinity.
    double nextArrival() const;
    /// Largest speed on the waiting front.
    double frontSpeed();
    /// Starts anew with b a step wider: pieces of time marched at several speeds would leave a craggy surface. Where it
    /// comes earlier than another now, the other loses ground. False when the limit is reached.
    bool widen();
    /// Does any free voxel wait for a wider b?
    bool couldWiden() const { return dormant_ || !heap_.empty(); }

    /// Runs the front backwards into two layers of the body, so that times and scales are smooth across the body's
    /// surface. To be called when marching has ended.
    void finish();
    /// Where the speed nearly ends, finds the contact distance in two layers of voxels around: their own speed tells
    /// how much of the front's advance goes on there.
    void lookBeyond();
    /// Arrival near the rim at a point in index space whose nearest rim point is `rim`: see the definition. Never,
    /// away from the rim. `trusted`: how near to the rim phi still tells the angle.
    double wedgeArrival(const Vec3& p, double phi, double contact, const Vec3& rim, double trusted) const;
    double speedAt(const GrowthBlock& block, int v) const;
    /// The speed, but not taken nearer to the contact than two voxels. There it falls so fast within a voxel that the
    /// zero set of a product with it would be pitted.
    double scaleFor(double contact) const;
    GrowthBlock* probe(const Coord& origin) const;
    /// Neighbouring voxel: its block (null where there is none) and index.
    static GrowthBlock* step(GrowthBlock* block, int v, int side, int& n);

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
    struct Arrival {
        float time;
        uint32_t voxel;  // block number * 512 + index
        bool operator<(const Arrival& o) const { return time != o.time ? time > o.time : voxel > o.voxel; }
    };
    GrowthBlock* make(const Coord& origin);
    GrowthBlock* stepOrMake(GrowthBlock* block, int v, int side, int& n);
    double arrival(GrowthBlock* block, int v, double speed, bool withGhosts) const;
    double speedOf(GrowthBlock* block, int v);
    double wedgeArrival(const GrowthBlock& block, int v) const;
    double wedgeReach() const { return std::min(4.0, 0.7 * a * element.size); }
    double innerScale(GrowthBlock& block, int v) const;
    bool heldByOther(const GrowthBlock* block, int v, float time, const std::vector<float>& stopTimes) const;
    void accept(GrowthBlock* block, int v, const std::vector<float>& stopTimes, bool claiming);
    void push(GrowthBlock* block, int v, double time);

    ClaimMap& claims_;
    std::unordered_map<Coord, GrowthBlock*, CoordHash> map_;
    std::vector<Arrival> heap_;
    double speed_ = 0;  // of the waiting front, where it is known
    bool speedKnown_ = false;
    bool changed_ = false;          // since it was finished
    bool dormant_ = false;          // touched free voxels where the speed is zero
    std::vector<Arrival> claimed_;  // in the last round
};

}  // namespace pavel
