// The forces that a fall is judged by.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "traceur/fall/sagittal_body.h"
#include "traceur/motion/controller.h"

namespace traceur::fall {

/// How falls are simulated and measured; all comparisons share one.
struct FallProtocol {
  double time_step = 0.0005;  ///< [s] [Ha2015, §4.4]
  double window = 0.01;  ///< impulses are sums over so long [s]: what the paper's plots rest at
  double settle = 2.5;   ///< how long after the fall is noticed the trial goes on [s]
  double patience = 2;   ///< how long after the push a fall may take to show [s]
  sim::Material ground = {};  ///< its softness decides raw forces, the window most of the rest
};

struct GroundContact {
  std::string part;    ///< the nearest contact point of the body's, or the body
  double time = 0;     ///< of the first touch [s]
  double impulse = 0;  ///< largest windowed one of all contacts until the next part touches [N·s]
};

/// What the ground did to a robot.
struct Impacts {
  /// The largest over time of Σ h f_y over the window, f_y the vertical force on what is not the
  /// stance's own contact, which counts once it has been off the ground for the window [N·s].
  double impulse = 0;
  double raw_impulse = 0;  ///< the largest of a single step [N·s]
  double peak_force = 0;   ///< of the same force [N]
  double peak_torque = 0;  ///< as a share of a joint's limit
  double peak_head = 0;    ///< acceleration of the head's point, mean over the window [m/s²]
  bool head_hit = false;   ///< the head touched the ground
  std::vector<GroundContact> contacts;              ///< in order of first touch
  std::vector<std::pair<double, double>> windowed;  ///< time [s], windowed impulse [N·s], every ms
};

class ImpulseMeter : public motion::Observer {
 public:
  /// @param head  the contact point that stands for the head
  ImpulseMeter(const SagittalBody& body, const FallProtocol& protocol, std::string head);

  void begin(const motion::Moment& m) override;
  void see(const motion::Moment& m, bool last) override;
  void commanded(const motion::Moment& m, const control::Command& c,
                 const sim::Torque& torque) override;

  const Impacts& impacts() const { return impacts_; }

 private:
  void note(const std::string& part, double time);

  const SagittalBody* body_;
  std::shared_ptr<const sim::Model> model_;
  int window_;
  std::string head_;
  Impacts impacts_;
  std::vector<int> off_;  // steps each body has been off the ground
  std::vector<bool> standing_;
  std::deque<double> forces_;
  double sum_ = 0;
  std::deque<sim::Vector3d> head_velocities_;
};

}  // namespace traceur::fall
