// The inner loop: the policy that costs least on a model [Ha2015, Fig. 37].
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <stop_token>

namespace traceur::bias {

using Eigen::VectorXd;

struct PolicySearchOptions {
  /// Trials for DIRECT, the original one (NLopt's GN_ORIG_DIRECT: its scaled variants stop early on
  /// the plains where every policy fails alike). [Ha2015, Tab. 12]
  int direct = 1000;
  /// A cost at which DIRECT may stop.
  double good = -std::numeric_limits<double>::infinity();
  /// Trials of a round of CMA-ES from the best found, 0 for none; the paper has none.
  int polish = 0;
  double polish_step = 0.02;  ///< its first standard deviation, as a fraction of each range [ours]
  /// A round that ends with no cost below this is followed by another, anew from the best.
  double success = std::numeric_limits<double>::infinity();
  int rounds = 5;          ///< at most [ours]
  std::uint64_t seed = 1;  ///< of CMA-ES; DIRECT draws nothing
  /// Where an earlier search ended: where it costs at most `good`, DIRECT is left out.
  std::optional<VectorXd> warm = {};
  std::stop_token stop = {};  ///< asked to end, it ends after the trial under way
};

struct FoundPolicy {
  VectorXd parameters;
  double cost = std::numeric_limits<double>::infinity();
  int trials = 0;
};

/// @param cost          of parameters; pure, the same whenever it is asked; NaN counts as infinite
/// @param lower, upper  finite bounds, which nothing leaves
/// @throws InputError for bounds that are none or of another size than a warm start
FoundPolicy searchPolicy(const std::function<double(const VectorXd&)>& cost, const VectorXd& lower,
                         const VectorXd& upper, const PolicySearchOptions& options);

}  // namespace traceur::bias
