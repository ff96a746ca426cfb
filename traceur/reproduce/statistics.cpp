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
  return *middle;
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

}  // namespace traceur::reproduce
