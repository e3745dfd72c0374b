#pragma once
#include <cstdint>

namespace pavel {

/// Small counter-based generator (SplitMix64, G. Steele et al. 2014): equal on every platform, one stream per purpose,
/// so that a new random choice in one place does not change the others.
class Rng {
  public:
    Rng(uint64_t seed, uint64_t stream) : state_(mix(seed + 0x9E3779B97F4A7C15ull * (stream + 1))) {}
    uint64_t next() { return mix(state_ += 0x9E3779B97F4A7C15ull); }
    /// Uniform in [0, 1).
    double uniform() { return double(next() >> 11) * 0x1.0p-53; }
    double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }

  private:
    static uint64_t mix(uint64_t z) {
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
        return z ^ (z >> 31);
    }
    uint64_t state_;
};

}  // namespace pavel
