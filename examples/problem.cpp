// A function of one's own, minimised where it is allowed.
#include <cstdio>

#include "traceur/optim/all.h"
#include "traceur/optim/minimise.h"

using namespace traceur;
using Eigen::VectorXd;

/// The lowest point of a slope that lies in a disc: (-1, -1)/√2.
class Disc : public optim::Problem {
 public:
  VectorXd lower() const override { return VectorXd::Constant(2, -2); }
  VectorXd upper() const override { return VectorXd::Constant(2, 2); }
  std::vector<std::string> constraints() const override { return {"outside"}; }
  optim::Evaluation evaluate(const VectorXd& x) const override {
    optim::Evaluation e;
    e.cost = x.sum();
    e.violated = {x.norm() > 1};
    return e;
  }
};

int main() {
  const Disc disc;
  const auto cma_c = optim::findOptimizer("cma-c").make(disc, {.seed = 1});
  const optim::Summary found = optim::minimise(disc, *cma_c, {.budget = 600});
  const VectorXd& x = found.progress.best->x;
  std::printf("%.4f at (%.4f, %.4f) after %d trials\n", found.progress.best->evaluation.cost, x[0],
              x[1], found.progress.evaluations);
  return found.progress.best->evaluation.cost < -1.41 ? 0 : 1;
}
