#include "traceur/fall/ways.h"

#include <fmt/format.h>

#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/fall/planned_fall.h"

namespace traceur::fall {
namespace {

using Eigen::VectorXd;

/// One pose, with one factor on the gains.
class Keep : public motion::Controller {
 public:
  Keep(std::string name, control::JointTarget target, double stiffness, double damping)
      : name_(std::move(name)),
        target_(std::move(target)),
        stiffness_(VectorXd::Constant(target_.q.size(), stiffness)),
        damping_(VectorXd::Constant(target_.q.size(), damping)) {}

  void begin(const motion::Moment& /*m*/, const control::JointTarget& /*held*/) override {}
  void command(const motion::Moment& /*m*/, motion::Senses& /*senses*/,
               control::Command& c) override {
    c.target = target_;
    c.stiffness = stiffness_;
    c.damping = damping_;
  }
  std::vector<std::string> phases() const override { return {name_}; }

 private:
  std::string name_;
  control::JointTarget target_;
  VectorXd stiffness_, damping_;
};

std::unique_ptr<motion::Controller> keepStance(const FallContext& context, const char* name,
                                               double stiffness, double damping) {
  return std::make_unique<Keep>(name, control::targetOf(*context.body.model(), context.stance),
                                stiffness, damping);
}

std::unique_ptr<motion::Controller> tuck(const FallContext& context) {
  const sim::Model& model = *context.body.model();
  const sim::Pose& pose = context.falls.robot->poses.at(context.falls.tuck);
  return std::make_unique<Keep>("tuck", control::targetOf(model, model.stateOf(pose)), 1, 1);
}

}  // namespace

const std::vector<WayToFall>& allWays() {
  static const std::vector<WayToFall> kWays = {
      {"hold", "keeps the pose of the stance: \"unplanned\" [Ha2015, §4.4]",
       [](const FallContext& c) { return keepStance(c, "hold", 1, 1); }},
      {"planned", "the poses of a plan, one contact after another",
       [](const FallContext& c) { return std::make_unique<PlannedFall>(c); }},
      {"limp", "motors off", [](const FallContext& c) { return keepStance(c, "limp", 0, 0); }},
      {"damp", "motors only resist motion",
       [](const FallContext& c) { return keepStance(c, "damp", 0, 1); }},
      {"tuck", "curls up", tuck}};
  return kWays;
}

const WayToFall& wayNamed(std::string_view name) {
  std::vector<std::string> names;
  for (const WayToFall& w : allWays()) {
    if (w.name == name) return w;
    names.emplace_back(w.name);
  }
  throw InputError(fmt::format("no way to fall named \"{}\": there is {}", name, join(names)));
}

}  // namespace traceur::fall
