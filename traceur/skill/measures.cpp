#include "traceur/skill/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "traceur/motion/session.h"

namespace traceur::skill {

using control::Expression;

double Measures::Verdict::value() const {
  const bool unknown =
      std::any_of(measures.begin(), measures.end(), [](const double* m) { return std::isnan(*m); });
  return unknown ? std::numeric_limits<double>::quiet_NaN() : of.value();
}

Measures::Measures(const Skill& skill, Places& places, const motion::Controller& controller)
    : skill_(&skill),
      places_(&places),
      controller_(&controller),
      steps_(static_cast<int>(std::lround(skill.horizon / skill.model->timeStep()))),
      interval_(skill.model->timeStep() *
                motion::Session::stepsOf(skill.decision_interval, skill.model->timeStep())) {
  const Expression::Lookup running = places.in(Scope::kRunning);
  for (const Measure& m : skill.measures) {
    measures_.push_back({Expression(m.of, running), maybeBound(m.when, running)});
  }
  // What fails in a part is not for this one to see.
  for (const Failure& f : skill.failures) {
    failures_.emplace_back(f.when.empty() ? "0" : f.when, running);
  }
  stop_ = maybeBound(skill.stop, running);
  for (const Term& t : skill.terms) terms_.push_back(verdict(t.cost, true));
  if (!skill.task.achieved.empty()) achieved_ = verdict(skill.task.achieved, false);
}

Measures::Verdict Measures::verdict(const std::string& text, bool cost) {
  std::vector<const double*> named;
  Expression of(text, [&](const std::string& name) {
    if (cost) task_costs_ = task_costs_ || name == "task";
    const double* place = places_->find(Scope::kVerdict, name);
    if (places_->isMeasure(place)) named.push_back(place);
    return place;
  });
  return {std::move(of), std::move(named)};
}

void Measures::begin(const motion::Moment& /*m*/) {
  std::fill(places_->failed.begin(), places_->failed.end(), 0.0);
  for (size_t i = 0; i < measures_.size(); ++i) {
    places_->measures[i] = skill_->measures[i].otherwise;
    measures_[i].seen = 0;
  }
}

std::string_view Measures::ends(const motion::Moment& m) {
  if (!m.decides) return {};  // signals are those of then
  const int phase = controller_->phase();
  std::string_view why;
  for (size_t i = 0; i < failures_.size(); ++i) {
    if (!skill_->failures[i].during[phase] || !failures_[i].holds()) continue;
    places_->failed[i] = 1;
    if (why.empty()) why = skill_->failures[i].name;
  }
  if (why.empty() && m.step < steps_ && stop_ && stop_->holds()) why = "stop";
  return why;
}

void Measures::see(const motion::Moment& moment, bool last) {
  if (!moment.decides) return;
  const int phase = controller_->phase();
  for (size_t i = 0; i < measures_.size(); ++i) {
    const Measure& m = skill_->measures[i];
    if (!m.during[phase]) continue;
    Taken& taken = measures_[i];
    if (m.take == Measure::Take::kFirst && taken.seen > 0) continue;
    if (taken.when && !taken.when->holds()) continue;
    const double x = taken.of.value();
    if (std::isnan(x)) continue;  // a signal that has no value now, such as cop in flight
    const bool first = taken.seen++ == 0;
    double& value = places_->measures[i];
    switch (m.take) {
      case Measure::Take::kFirst:
      case Measure::Take::kLast:
        value = x;
        break;
      case Measure::Take::kMin:
        value = first ? x : std::min(value, x);
        break;
      case Measure::Take::kMax:
        value = first ? x : std::max(value, x);
        break;
      case Measure::Take::kMean:
        value = first ? x : value + (x - value) / taken.seen;
        break;
      case Measure::Take::kIntegral:
        value = (first ? 0 : value) + (last ? 0 : x * interval_);
        break;
    }
  }
}

std::vector<double> Measures::terms() const {
  std::vector<double> values;
  for (const Verdict& t : terms_) values.push_back(t.value());
  return values;
}

double Measures::achieved() const {
  return achieved_ ? achieved_->value() : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace traceur::skill
