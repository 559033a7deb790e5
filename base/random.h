#pragma once
#include <cstdint>

namespace scanview {

/// Random numbers from a counter: the n-th number of the stream named by (seed, item, iteration) is a pure function of
/// these, so results depend neither on threads nor on order. SplitMix64's finaliser (Steele, Lea, Flood 2014) over a
/// Weyl sequence whose start mixes the three keys.
class CounterRandom {
 public:
  CounterRandom(std::uint64_t seed, std::uint64_t item, std::uint64_t iteration = 0);
  std::uint64_t bits();
  double uniform();                          ///< in [0, 1)
  double normal();                           ///< mean 0, standard deviation 1 (Box-Muller)
  std::uint32_t below(std::uint32_t bound);  ///< in [0, bound), bound > 0

 private:
  std::uint64_t state_;
};

}  // namespace scanview
