#include "traceur/reproduce/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "traceur/core/random.h"

namespace traceur::reproduce {

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double median(std::span<const double> values) {
  assert(!values.empty());
  std::vector<double> sorted(values.begin(), values.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  if (sorted.size() % 2 == 1) return *middle;
  return (*std::max_element(sorted.begin(), middle) + *middle) / 2;
}

double trimmedMean(std::span<const double> values, double share) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const auto cut = static_cast<size_t>(static_cast<double>(sorted.size()) * share + 1e-9);
  assert(2 * cut < sorted.size());
  return mean(std::span(sorted).subspan(cut, sorted.size() - 2 * cut));
}

double geometricMean(std::span<const double> values) {
  double sum = 0;
  for (const double v : values) sum += std::log(v);
  return std::exp(sum / static_cast<double>(values.size()));
}

Interval bootstrap(std::span<const Sample> samples,
                   const std::function<double(std::span<const Sample>)>& statistic, int resamples) {
  std::vector<Sample> drawn(samples.begin(), samples.end());
  std::vector<double> values(resamples);
  for (int r = 0; r < resamples; ++r) {
    for (size_t s = 0; s < samples.size(); ++s) {
      assert(!samples[s].empty());
      Random random(1, r, s);
      for (double& v : drawn[s]) v = samples[s][random.below(samples[s].size())];
    }
    values[r] = statistic(drawn);
  }
  std::sort(values.begin(), values.end());
  const auto at = [&](double q) {
    return values[static_cast<size_t>(std::lround(q * (resamples - 1)))];
  };
  return {at(0.025), at(0.975)};
}

PairedDifference pairedDifference(const Sample& differences) {
  assert(!differences.empty());
  PairedDifference d;
  d.pairs = static_cast<int>(differences.size());
  d.mean = mean(differences);
  d.interval =
      bootstrap({&differences, 1}, [](std::span<const Sample> drawn) { return mean(drawn[0]); });
  static constexpr int kExact = 16;
  static constexpr std::uint64_t kDraws = 1U << kExact;
  const bool exact = d.pairs <= kExact;
  const std::uint64_t all = exact ? std::uint64_t{1} << d.pairs : kDraws;
  // Sums that differ by rounding are equal.
  const double limit = std::abs(d.mean) * d.pairs * (1 - 1e-9) - 1e-12;
  Random random(1);
  std::uint64_t as_far = 0;
  for (std::uint64_t i = 0; i < all; ++i) {
    double sum = 0;
    std::uint64_t signs = i;
    for (int k = 0; k < d.pairs; ++k, signs >>= 1) {
      if (!exact && k % 64 == 0) signs = random.bits();
      sum += (signs & 1) ? -differences[k] : differences[k];
    }
    as_far += std::abs(sum) >= limit;
  }
  // What was seen is one of the random draws, too.
  d.p = exact ? static_cast<double>(as_far) / static_cast<double>(all)
              : static_cast<double>(as_far + 1) / static_cast<double>(all + 1);
  return d;
}

}  // namespace traceur::reproduce
