#include "traceur/optim/part.h"

#include <cassert>
#include <utility>

#include "traceur/core/error.h"

namespace traceur::optim {
namespace {

/// Which variables move, and where all stand.
struct Split {
  VectorXd at;             // (n)
  std::vector<int> moves;  // of the n

  VectorXd whole(const VectorXd& part) const {
    VectorXd x = at;
    x(moves) = part;
    return x;
  }
};

/// What an optimiser sees of the problem.
class PartProblem : public Problem {
 public:
  PartProblem(const Problem& problem, const Split& split) : problem_(problem), split_(split) {}
  VectorXd lower() const override { return problem_.lower()(split_.moves); }
  VectorXd upper() const override { return problem_.upper()(split_.moves); }
  std::vector<std::string> constraints() const override { return problem_.constraints(); }
  Evaluation evaluate(const VectorXd& x) const override {
    return problem_.evaluate(split_.whole(x));
  }

 private:
  const Problem& problem_;
  const Split& split_;
};

class InPart : public Optimizer {
 public:
  InPart(Split split, std::unique_ptr<Optimizer> inner)
      : split_(std::move(split)), inner_(std::move(inner)) {}

  std::vector<Candidate> ask() override {
    std::vector<Candidate> candidates = inner_->ask();
    for (Candidate& c : candidates) c.x = split_.whole(c.x);
    return candidates;
  }
  void tell(std::uint64_t id, const Evaluation& evaluation) override {
    inner_->tell(id, evaluation);
  }
  std::optional<Stop> stopped() const override { return inner_->stopped(); }
  std::optional<double> achieved() const override { return inner_->achieved(); }
  std::optional<VectorXd> favourite() const override {
    const std::optional<VectorXd> part = inner_->favourite();
    return part ? std::optional(split_.whole(*part)) : part;
  }
  std::string save() const override { return inner_->save(); }
  void restore(std::string_view state) override { inner_->restore(state); }

 private:
  Split split_;
  std::unique_ptr<Optimizer> inner_;
};

}  // namespace

std::unique_ptr<Optimizer> inPart(const Problem& problem, const CommonOptions& options,
                                  const std::vector<int>& moves,
                                  const decltype(OptimizerEntry::make)& make) {
  assert(!moves.empty() && options.x0.size() == problem.dimension() && options.experience.empty());
  if (static_cast<int>(moves.size()) == problem.dimension()) return make(problem, options);
  if (problem.tasks().size() > 0) {
    throw InputError("a family is learned in all parameters: expected none left out");
  }
  Split split{options.x0, moves};
  CommonOptions part = options;
  part.x0 = options.x0(moves);
  std::unique_ptr<Optimizer> inner = make(PartProblem(problem, split), part);
  return std::make_unique<InPart>(std::move(split), std::move(inner));
}

}  // namespace traceur::optim
