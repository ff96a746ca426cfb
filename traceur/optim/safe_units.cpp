#include "traceur/optim/safe_units.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace traceur::optim {
namespace {

constexpr double kMax = std::numeric_limits<double>::max();

/// The units of a problem's variables.
class Units {
 public:
  explicit Units(const Problem& problem) : lower_(problem.lower()), upper_(problem.upper()) {
    checkBounds("optimiser", lower_, upper_, static_cast<int>(lower_.size()));
    for (Eigen::Index i = 0; i < lower_.size(); ++i) {
      exponents_.push_back(unitExponent(lower_[i], upper_[i]));
      ordinary_ = ordinary_ && exponents_.back() == 0;
    }
  }

  bool ordinary() const { return ordinary_; }
  const VectorXd& lower() const { return lower_; }
  const VectorXd& upper() const { return upper_; }

  /// From the problem's unit into ours. Of another size: unchanged, for the optimiser to refuse.
  VectorXd inward(VectorXd x) const {
    if (x.size() != lower_.size()) return x;
    for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = std::ldexp(x[i], -exponents_[i]);
    return x;
  }
  /// And back, as near as there is a number.
  VectorXd outward(VectorXd x) const {
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      x[i] = std::clamp(std::ldexp(x[i], exponents_[i]), -kMax, kMax);
    }
    return x;
  }
  VectorXd intoBox(const VectorXd& x) const { return x.cwiseMax(lower_).cwiseMin(upper_); }

 private:
  VectorXd lower_, upper_;
  std::vector<int> exponents_;
  bool ordinary_ = true;
};

/// What an optimiser sees of the problem.
class Inside : public Problem {
 public:
  Inside(const Problem& problem, const Units& units) : problem_(problem), units_(units) {}
  VectorXd lower() const override { return units_.inward(units_.lower()); }
  VectorXd upper() const override { return units_.inward(units_.upper()); }
  std::vector<std::string> constraints() const override { return problem_.constraints(); }
  VectorXd tasks() const override { return problem_.tasks(); }
  Evaluation evaluate(const VectorXd& x) const override {
    return problem_.evaluate(units_.intoBox(units_.outward(x)));
  }

 private:
  const Problem& problem_;
  const Units& units_;
};

class InUnits : public Optimizer {
 public:
  InUnits(Units units, std::unique_ptr<Optimizer> inner)
      : units_(std::move(units)), inner_(std::move(inner)) {}

  std::vector<Candidate> ask() override {
    std::vector<Candidate> candidates = inner_->ask();
    for (Candidate& c : candidates) c.x = units_.intoBox(units_.outward(std::move(c.x)));
    return candidates;
  }
  void tell(std::uint64_t id, const Evaluation& evaluation) override {
    inner_->tell(id, evaluation);
  }
  std::optional<Stop> stopped() const override { return inner_->stopped(); }
  std::optional<double> achieved() const override { return inner_->achieved(); }
  std::optional<VectorXd> favourite() const override {
    std::optional<VectorXd> x = inner_->favourite();
    if (x) x = units_.intoBox(units_.outward(*x));
    return x;
  }
  std::optional<Family> family() const override {
    std::optional<Family> family = inner_->family();
    if (!family) return family;
    for (auto point : family->curve.points.colwise()) point = units_.outward(point);
    if (family->curve.bounds.any()) {
      VectorXd margins(units_.lower().size());
      for (int i = 0; i < margins.size(); ++i) margins[i] = family->curve.bounds.margin(i);
      family->curve.bounds = BoundFold(units_.lower(), units_.upper(), units_.outward(margins));
    }
    return family;
  }
  std::string save() const override { return inner_->save(); }
  void restore(std::string_view state) override { inner_->restore(state); }

 private:
  Units units_;
  std::unique_ptr<Optimizer> inner_;
};

}  // namespace

std::unique_ptr<Optimizer> inSafeUnits(const Problem& problem, const CommonOptions& options,
                                       const decltype(OptimizerEntry::make)& make) {
  Units units(problem);
  if (units.ordinary()) return make(problem, options);
  CommonOptions inside = options;
  inside.x0 = units.inward(inside.x0);
  for (Trial& trial : inside.experience) trial.x = units.inward(trial.x);
  std::unique_ptr<Optimizer> inner = make(Inside(problem, units), inside);
  return std::make_unique<InUnits>(std::move(units), std::move(inner));
}

}  // namespace traceur::optim
