#include "traceur/skill/skill_sequence.h"

#include <algorithm>
#include <cmath>

namespace traceur::skill {

using control::Expression;

SkillSequence::SkillSequence(const Skill& skill, Places& places)
    : skill_(&skill), places_(&places) {
  int phases = 0;
  int failures = 0;
  for (const Part& part : skill.parts) {
    Running r;
    r.skill = part.skill.get();
    r.places = std::make_unique<Places>(*part.skill);
    if (part.skill->parts.empty()) {
      r.controller = std::make_unique<SkillController>(part.skill, *r.places);
    } else {
      auto nested = std::make_unique<SkillSequence>(*part.skill, *r.places);
      r.nested = nested.get();
      r.controller = std::move(nested);
    }
    r.measures = std::make_unique<Measures>(*part.skill, *r.places, *r.controller);
    for (const std::string& text : part.parameters) {
      r.parameters.emplace_back(text, places.in(Scope::kSetup));
    }
    r.task = std::make_unique<Expression>(part.task, places.in(Scope::kSetup));
    r.until = maybeBound(part.until, places.in(Scope::kRunning));
    r.steps = static_cast<int>(std::lround(part.skill->horizon / skill.model->timeStep()));
    places.parts.push_back(r.places.get());
    first_phase_.push_back(phases);
    first_failure_.push_back(failures);
    phases += static_cast<int>(part.skill->phaseNames().size());
    failures += static_cast<int>(part.skill->failures.size());
    parts_.push_back(std::move(r));
  }
}

motion::Moment SkillSequence::since(const motion::Moment& m) const {
  const int step = m.step - begun_;
  return {m.s, step, step * skill_->model->timeStep(), m.decides};
}

void SkillSequence::begin(const motion::Moment& m, const control::JointTarget& held) {
  ended_.clear();
  stage_ = -1;
  places_->forget();
  for (Running& r : parts_) {  // also of those that are not reached
    for (size_t i = 0; i < r.parameters.size(); ++i) {
      const ParamSpec& p = r.skill->parameters[i];
      r.places->parameters[static_cast<Eigen::Index>(i)] =
          std::clamp(r.parameters[i].value(), p.min, p.max);
    }
    r.places->task = r.task->value();
    for (size_t i = 0; i < r.skill->conditions.size(); ++i) {  // the whole's of the same name
      const ParamSpec& c = r.skill->conditions[i];
      const double* whole = places_->find(Scope::kSetup, c.name);
      r.places->conditions[static_cast<Eigen::Index>(i)] =
          std::clamp(whole ? *whole : c.initial, c.min, c.max);
    }
    r.places->settle();
  }
  enter(0, m, held);
}

void SkillSequence::enter(size_t part, const motion::Moment& m, const control::JointTarget& held) {
  part_ = part;
  begun_ = m.step;
  held_ = held;
  Running& r = parts_[part];
  r.controller->begin(since(m), held);
  r.measures->begin(since(m));
}

/// Why the part ends now; empty: it goes on.
std::string_view SkillSequence::why(const motion::Moment& m) {
  Running& r = parts_[part_];
  const motion::Moment now = since(m);
  std::string_view word = now.step >= r.steps ? "horizon" : "";
  const std::string_view nested = r.nested ? r.nested->ends(now) : "";
  const std::string_view own = r.measures->ends(now);
  for (const std::string_view other : {nested, own}) {
    if (!other.empty() && (word.empty() || word == "horizon")) word = other;
  }
  if (word.empty() && r.until && r.until->holds()) word = "stop";
  return word;
}

/// The part has seen its last step.
void SkillSequence::over(const motion::Moment& m) {
  Running& r = parts_[part_];
  if (r.nested) r.nested->see(since(m), true);
  r.measures->see(since(m), true);
  r.places->cost = 0;
  for (const double term : r.measures->terms()) r.places->cost += term;
}

void SkillSequence::update(const motion::Moment& m) {
  places_->time = m.time;
  places_->look(m.s);
  std::fill(places_->ended_stage.begin(), places_->ended_stage.end(), 0.0);
  const auto parts_at = places_->ended_stage.size() - parts_.size();
  while (true) {
    parts_[part_].controller->update(since(m));
    showStage(m);
    const std::string_view word = why(m);
    if (word.empty()) break;
    const Running& r = running();
    const bool failed =
        std::find(r.places->failed.begin(), r.places->failed.end(), 1.0) != r.places->failed.end();
    if (failed) {
      ended_ = skill_->parts[part_].name + "." + std::string(word);
      break;
    }
    places_->ended_stage[parts_at + part_] = 1;
    if (part_ + 1 == parts_.size()) {
      ended_ = word;
      break;
    }
    over(m);
    enter(part_ + 1, m, held_);
  }
  for (size_t i = 0; i < running().places->failed.size(); ++i) {
    if (running().places->failed[i] != 0) places_->failed[first_failure_[part_] + i] = 1;
  }
}

/// Tells the whole's expressions which phase and part last.
void SkillSequence::showStage(const motion::Moment& m) {
  places_->phase_time = (m.step - entered_) * skill_->model->timeStep();
  const auto parts_at = places_->in_stage.size() - parts_.size();
  const Places& now = *running().places;
  const size_t phases = running().controller->phases().size();
  for (size_t i = 0; i < phases; ++i) {
    if (now.ended_stage[i] != 0) places_->ended_stage[first_phase_[part_] + i] = 1;
  }
  if (stage_ == phase()) return;
  stage_ = phase();
  entered_ = m.step;
  places_->phase_time = 0;
  const bool next_part = places_->in_stage[parts_at + part_] == 0;
  std::fill(places_->in_stage.begin(), places_->in_stage.end(), 0.0);
  places_->in_stage[stage_] = 1;
  places_->in_stage[parts_at + part_] = 1;
  ++places_->entered_stage[stage_];
  if (next_part) ++places_->entered_stage[parts_at + part_];
}

void SkillSequence::command(const motion::Moment& m, motion::Senses& senses, control::Command& c) {
  parts_[part_].controller->command(since(m), senses, c);
  held_ = c.target;
}

void SkillSequence::see(const motion::Moment& m, bool last) {
  if (last) {
    over(m);
    return;
  }
  Running& r = parts_[part_];
  if (r.nested) r.nested->see(since(m), false);
  r.measures->see(since(m), false);
}

}  // namespace traceur::skill
