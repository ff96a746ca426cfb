// A plan followed, contact by contact.
#pragma once

#include <string>
#include <vector>

#include "traceur/fall/ways.h"
#include "traceur/motion/joint_path.h"

namespace traceur::fall {

/// Follows a plan's stages, and asks for another plan where it does not go as planned. What bears
/// the COM from the part it turns about is the rod's force of Eq. 12, a virtual force between the
/// COM and that part.
class PlannedFall : public motion::Controller {
 public:
  explicit PlannedFall(const FallContext& context);

  void begin(const motion::Moment& m, const control::JointTarget& held) override;
  void update(const motion::Moment& m) override;
  void command(const motion::Moment& m, motion::Senses& senses, control::Command& c) override;
  int phase() const override { return made_; }
  std::vector<std::string> phases() const override;

 private:
  bool ask(const sim::Snapshot& s);
  void enter(double time);
  bool falling(const sim::Snapshot& s) const;
  bool touches(const sim::Snapshot& s, const FallMotion::Stage& stage) const;
  void addSupport(const sim::Snapshot& s, std::vector<control::VirtualForce>& forces) const;
  /// There has been no plan yet: the pose is kept.
  bool waiting() const { return motion_.stages.empty() && motion_.rest.q.size() == 0; }
  /// All contacts of the plan have been made.
  bool resting() const { return stage_ >= motion_.stages.size(); }

  FallContext context_;
  const SagittalBody* body_;
  std::shared_ptr<const sim::Model> model_;
  const FallTracking* tracking_;
  FallMotion motion_;
  size_t stage_ = 0;
  int made_ = 0;  // stages ended
  int node_ = 0;  // the last that touched
  std::vector<int> made_nodes_;
  double noticed_ = 0;  // [s]
  double begun_ = 0;    // the stage, or the way to rest [s]
  double asked_ = 0;    // [s]
  control::JointTarget target_;
  motion::JointPath way_;
};

}  // namespace traceur::fall
