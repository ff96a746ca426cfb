#include "traceur/reproduce/figure_28.h"

#include <fmt/format.h>

#include "traceur/core/error.h"
#include "traceur/optim/cma_c.h"
#include "traceur/reproduce/toy_constraints.h"

namespace traceur::reproduce {

using Eigen::VectorXd;

LearnedRegion learnRegion(std::string_view algorithm, std::uint64_t seed) {
  int row = 0;
  while (toyRows()[row].name != "Toy3") ++row;
  LearnedRegion region;
  const ToyProblem problem(toyRows()[row], seed);
  const auto run = [&](const optim::Candidate& c, const optim::Evaluation& e) {
    region.x.push_back(c.x[0]);
    region.y.push_back(c.x[1]);
    region.feasible.push_back(e.feasible());
  };
  int index = 0;
  for (const ToyAlgorithm& a : toyAlgorithms()) {
    if (a.name == algorithm) break;
    ++index;
  }
  if (index == static_cast<int>(toyAlgorithms().size())) {
    throw InputError(fmt::format("figure-28: no algorithm \"{}\"", algorithm));
  }
  const auto optimizer = runToy(row, index, seed, ToyStop::kCollapsed, run).second;
  const auto* cma_c = dynamic_cast<const optim::CmaC*>(optimizer.get());
  if (!cma_c) throw InputError(fmt::format("figure-28: {} learns no region", algorithm));

  int both = 0;
  int learned = 0;
  int truth = 0;
  static constexpr double kCell =
      (LearnedRegion::kHigh - LearnedRegion::kLow) / LearnedRegion::kCells;
  for (int j = 0; j < LearnedRegion::kCells; ++j) {
    for (int i = 0; i < LearnedRegion::kCells; ++i) {
      const VectorXd x{
          {LearnedRegion::kLow + (i + 0.5) * kCell, LearnedRegion::kLow + (j + 0.5) * kCell}};
      region.learned.push_back(cma_c->acceptance(x) >= 0.5);
      region.truth.push_back(problem.evaluate(x).feasible());
      both += region.learned.back() && region.truth.back();
      learned += region.learned.back();
      truth += region.truth.back();
    }
  }
  region.precision = learned > 0 ? static_cast<double>(both) / learned : 0;
  region.recall = static_cast<double>(both) / truth;
  return region;
}

}  // namespace traceur::reproduce
