#include "traceur/bias/policy_search.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <stdexcept>
#include <vector>

#include "traceur/core/error.h"
#include "traceur/core/infinity.h"
#include "traceur/optim/cma_es.h"
#include "traceur/optim/minimise.h"

namespace traceur::bias {
namespace {

/// From a round's seed to the next one's: far from the seeds of other searches.
constexpr std::uint64_t kRoundSeeds = 1'000'003;

/// Counts, remembers the best, and stands for what is no number.
class Trials {
 public:
  Trials(const std::function<double(const VectorXd&)>& cost, FoundPolicy& found)
      : cost_(cost), found_(found) {}

  double operator()(const VectorXd& x) {
    ++found_.trials;
    const double c = cost_(x);
    if (!(c > -kInfinity)) return kInfinity;  // NaN too
    if (c < found_.cost || found_.parameters.size() == 0) {
      found_.cost = c;
      found_.parameters = x;
    }
    return c;
  }

 private:
  const std::function<double(const VectorXd&)>& cost_;
  FoundPolicy& found_;
};

class PolishProblem : public optim::Problem {
 public:
  PolishProblem(Trials& trials, VectorXd lower, VectorXd upper)
      : trials_(trials), lower_(std::move(lower)), upper_(std::move(upper)) {}
  VectorXd lower() const override { return lower_; }
  VectorXd upper() const override { return upper_; }
  optim::Evaluation evaluate(const VectorXd& x) const override { return {.cost = trials_(x)}; }

 private:
  Trials& trials_;
  VectorXd lower_, upper_;
};

}  // namespace

FoundPolicy searchPolicy(const std::function<double(const VectorXd&)>& cost, const VectorXd& lower,
                         const VectorXd& upper, const PolicySearchOptions& o) {
  const Eigen::Index n = lower.size();
  if (n == 0 || upper.size() != n || !lower.allFinite() || !upper.allFinite() ||
      !(lower.array() < upper.array()).all()) {
    throw InputError("policy search: expected finite bounds, lower < upper");
  }
  if (o.warm && o.warm->size() != n) {
    throw InputError(fmt::format("policy search: a warm start of {} parameters, expected {}",
                                 o.warm->size(), n));
  }
  FoundPolicy found;
  Trials trials(cost, found);
  if (o.warm) trials(o.warm->cwiseMax(lower).cwiseMin(upper));
  if (o.direct > 0 && !(found.cost <= o.good)) {
    struct Direct {
      Trials& trials;
      const std::stop_token& stop;
      std::exception_ptr failure;  // of a trial: NLopt would forget what it was
    } data{trials, o.stop, nullptr};
    nlopt::opt direct(nlopt::GN_ORIG_DIRECT, static_cast<unsigned>(n));
    direct.set_lower_bounds(std::vector<double>(lower.begin(), lower.end()));
    direct.set_upper_bounds(std::vector<double>(upper.begin(), upper.end()));
    direct.set_maxeval(o.direct);
    direct.set_stopval(o.good);
    direct.set_min_objective(
        [](const std::vector<double>& x, std::vector<double>&, void* of) {
          // DIRECT compares sums with costs: an infinite one would spoil them.
          static constexpr double kWorst = 1e300;
          Direct& d = *static_cast<Direct*>(of);
          // NLopt's own stop crashes in the first trials; trials that are not run cost no time.
          if (d.failure || d.stop.stop_requested()) return kWorst;
          try {
            return std::min(kWorst, d.trials(Eigen::Map<const VectorXd>(
                                        x.data(), static_cast<Eigen::Index>(x.size()))));
          } catch (...) {
            d.failure = std::current_exception();
            return kWorst;
          }
        },
        &data);
    std::vector<double> x(lower.begin(), lower.end());  // DIRECT begins in the middle all the same
    double value = 0;
    try {
      direct.optimize(x, value);
    } catch (const std::runtime_error&) {
      // On a plain, such as trials that are not run make, it divides many boxes at once and runs
      // out of room for them: what it found until then stands.
    }
    if (data.failure) std::rethrow_exception(data.failure);
  }
  if (o.stop.stop_requested()) return found;
  const PolishProblem problem(trials, lower, upper);
  for (int round = 0; o.polish > 0 && round < o.rounds; ++round) {
    optim::CmaEsOptions cma;
    cma.x0 = found.parameters.size() > 0 ? found.parameters : VectorXd(0.5 * (lower + upper));
    cma.sigma = o.polish_step;
    cma.scale = upper - lower;
    cma.lower = lower;
    cma.upper = upper;
    cma.seed = o.seed + kRoundSeeds * static_cast<std::uint64_t>(round);
    optim::CmaEs polish(cma);
    optim::minimise(problem, polish, {.threads = 1, .budget = o.polish, .stop = o.stop});
    if (found.cost < o.success || o.stop.stop_requested()) break;
  }
  return found;
}

}  // namespace traceur::bias
