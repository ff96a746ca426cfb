// What a sample of runs says, and how sure it is.
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace traceur::reproduce {

using Sample = std::vector<double>;

double mean(std::span<const double> values);
/// Of an even number the mean of the two in the middle.
double median(std::span<const double> values);
/// The mean without the lowest and the highest ⌊n·share⌋ values.
double trimmedMean(std::span<const double> values, double share);
/// exp of the mean logarithm; values > 0.
double geometricMean(std::span<const double> values);

struct Interval {  ///< NaN: there is none
  double low = std::numeric_limits<double>::quiet_NaN();
  double high = std::numeric_limits<double>::quiet_NaN();
};

/// The 95 % percentile bootstrap interval of a statistic of independent samples
/// [Efron1993, §13.3]: each sample is drawn anew from itself, with replacement, `resamples` times.
/// Equal samples give equal bits.
/// @param samples    none of them empty
/// @param statistic  of one resample of each, in the same order
Interval bootstrap(std::span<const Sample> samples,
                   const std::function<double(std::span<const Sample>)>& statistic,
                   int resamples = 4000);

/// What pairs of runs, alike but for one thing, say of it.
struct PairedDifference {
  int pairs = 0;
  double mean = 0;    ///< of the differences
  Interval interval;  ///< of the mean, bootstrap over the pairs
  /// Of a mean as far from 0, were each difference as likely of the other sign: the exact sign-flip
  /// test, two-sided, over all 2ⁿ signs; of more than 16 pairs over 65536 random ones.
  double p = 1;
};

/// @param differences  of each pair, at least one
PairedDifference pairedDifference(const Sample& differences);

}  // namespace traceur::reproduce
