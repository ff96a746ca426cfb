// What a landing came to: whether it rolled and stands, what the head and the joints bore.
#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "traceur/motion/controller.h"

namespace traceur::landing {

using Eigen::VectorXd;

/// A fall as it is counted.
///
/// It touches down on what is fixed to the world. It has rolled when within kRollingTime after that
/// the trunk's somersault, counted on from the nearest upright, has passed kRolled, with shoulders
/// or back, but for the pelvis, on the ground between: who turns over later is getting up. It
/// stands once, after that, it has been on its feet alone with the COM above kStanding for
/// kStandingTime. It is safe when besides the head's contact force stayed below kHeadForce.
struct Verdict {
  std::optional<double> touch_down = {};  ///< when [s]
  std::optional<double> rolled = {};      ///< when [s]
  std::optional<double> stood = {};       ///< when it had stood for so long [s]
  bool stands_later = false;              ///< and still did kLater after that
  double head_force = 0;                  ///< largest on the head [N]
  double touch_down_speed = 0;            ///< of the COM, downwards, as it touched [m/s]
  double touch_down_somersault = 0;       ///< of the root then, in [-1.5, 2π - 1.5) [rad]
  double touch_down_tilt = 0;             ///< of the root [rad]
  double touch_down_forward = 0;          ///< velocity of the COM then, where it is headed [m/s]
  double touch_down_spin = 0;             ///< of the body about its left [rad/s]
  /// By body: the largest force that its joint with its parent bore since touch-down, as a mean
  /// over kStressWindow [Ha2015, §3.6.1] [N]
  VectorXd stress = {};

  bool stands() const { return rolled && stood; }
  bool safe() const;

  static constexpr double kRolled = 4.5;  ///< [rad]
  static constexpr double kRollingTime =
      2;  ///< [s] [ours: of 88 rolls from m2 the longest took 1.1]
  static constexpr double kStanding = 0.6;        ///< [m], of a person of 1.64 m
  static constexpr double kStandingTime = 1;      ///< [s]
  static constexpr double kLater = 5;             ///< [s]
  static constexpr double kHeadForce = 1000;      ///< [N]
  static constexpr double kStressWindow = 0.002;  ///< [s]
};

/// Watches a trial of a robot whose file has the groups "head", "feet", "shoulders" and "trunk";
/// ends it when nothing more can be learned from it.
class Judge : public motion::Observer {
 public:
  /// @throws InputError for a robot without those groups
  explicit Judge(std::shared_ptr<const sim::Model> model);

  void begin(const motion::Moment& m) override;
  std::string_view ends(const motion::Moment& m) override;

  const Verdict& verdict() const { return verdict_; }

  /// From touch-down, until it has stood, a fall is given so long [s] [ours: enough for getting up
  /// twice].
  static constexpr double kPatience = 12;

 private:
  std::vector<bool> group(const char* name) const;
  void look(const motion::Moment& m);
  void addStress(const motion::Moment& m);

  std::shared_ptr<const sim::Model> model_;
  std::vector<bool> head_, feet_, back_;  // by body
  Verdict verdict_;
  double somersault_ = 0;  // of the trunk, counted on
  bool on_back_ = false;   // since touch-down
  std::optional<double> up_since_;
  std::vector<VectorXd> window_;  // of joint forces, a ring
  VectorXd sum_;
  int steps_ = 0;  // since touch-down
};

}  // namespace traceur::landing
