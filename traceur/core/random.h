// Random numbers that depend only on (seed, stream, index): never on time, threads or a global.
#pragma once

#include <cstdint>

namespace traceur {

/// xoshiro256++ [Blackman2021] seeded through SplitMix64. Two generators built from equal triples
/// give equal numbers on every platform with IEEE doubles and a correctly rounded log; the standard
/// library's distributions do not, hence our own.
class Random {
 public:
  /// @param seed    the run's seed
  /// @param stream  for instance the generation
  /// @param index   for instance the sample's number in it
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0, std::uint64_t index = 0);

  std::uint64_t bits();
  /// Uniform in [0, 1), 53 bits.
  double uniform();
  double uniform(double min, double max) { return min + (max - min) * uniform(); }
  /// Standard normal, by Marsaglia's polar method.
  double normal();
  /// Uniform in {0, …, n-1}, n > 0, without modulo bias.
  std::uint64_t below(std::uint64_t n);

 private:
  std::uint64_t s_[4];
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace traceur
