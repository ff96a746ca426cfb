// A robot with one leg joint that balances on a board that rolls on a wheel [Ha2015, §8.5.1].
#pragma once

#include <Eigen/Core>

#include "traceur/core/gravity.h"
#include "traceur/core/plant.h"

namespace traceur::bias {

using Eigen::VectorXd;

/// The published robot: two parallel legs hinged to the board, joined on top by a pelvis bar that
/// stays parallel to the board, so that one angle moves both. The paper prints no numbers; these
/// are the ones its experiments ran with.
struct BongoParameters {
  double gravity = kGravity;   ///< [m/s²]
  double wheel_radius = 0.05;  ///< [m]
  double wheel_density = 200;  ///< of the disc [kg/m²]
  double board_mass = 2;       ///< [kg]
  double board_length = 0.6;   ///< [m]
  double thickness = 0.01;     ///< of board, legs and pelvis [m]
  double leg_mass = 15;        ///< each [kg]
  double leg_length = 1;       ///< [m]
  double pelvis_mass = 15;     ///< each half [kg]
  double pelvis_length = 0.1;  ///< each half; also from the board's centre to a foot [m]
  double inertia_scale = 1;    ///< on every mass and moment of inertia
};

/// State x = (α_w, α_b, θ, and their rates) [rad, rad/s]: the wheel's angle, the board's relative
/// to the wheel, the legs' relative to the board's normal; counter-clockwise, seen with x to the
/// right and z up, so that a wheel that turns by α_w has rolled to -r α_w. 0 is upright. Input: the
/// torque between board and legs [N·m].
///
/// Euler-Lagrange in φ = α_w + α_b and ψ = φ + θ, the absolute angles of board and legs:
///
///     A(q) (α_w'', φ'', ψ'') = (0, -u, u) - h(q, q') - g(q)
///
/// integrated by the classical Runge-Kutta method with the input held for a step.
class BongoBoard : public Plant {
 public:
  static constexpr int kAngles = 3;
  using State = Eigen::Matrix<double, 6, 1>;

  explicit BongoBoard(const BongoParameters& parameters = {}, double time_step = 0.001);

  int states() const override { return 2 * kAngles; }
  int inputs() const override { return 1; }
  double timeStep() const override { return time_step_; }
  void reset(const VectorXd& x) override { x_ = x; }
  void step(const VectorXd& u) override { x_ = stepped(x_, u[0]); }
  const VectorXd& state() const override { return x_; }

  /// (α_w'', α_b'', θ'') [rad/s²].
  /// @param board_moment  on the board from outside the mechanism [N·m]
  Eigen::Vector3d acceleration(const State& x, double torque, double board_moment = 0) const;
  /// The state a time step later.
  State stepped(const State& x, double torque, double board_moment = 0) const;
  /// Kinetic and potential, 0 at rest at the top of the wheel [J].
  double energy(const State& x) const;

  const BongoParameters& parameters() const { return p_; }

 private:
  /// The entries of A, from α_b and the sines and cosines of φ, ψ and θ.
  struct Inertia {
    double a11, a12, a13, a22, a23, a33;
  };
  Inertia inertia(double ab, double sf, double cf, double cp, double st, double ct) const;

  BongoParameters p_;
  double time_step_;
  // Constants of A: see the .cpp.
  double k_, s_, S_, Jw_, Jf_, Jp_, mass_;
  VectorXd x_ = VectorXd::Zero(6);
};

/// Where things are, from a state of BongoBoard: the wheel rests on z = 0 and begins at x = 0.
struct BongoPose {
  Eigen::Vector2d wheel;                  ///< centre
  Eigen::Vector2d board;                  ///< centre
  Eigen::Vector2d left_foot, right_foot;  ///< hinges on the board
  Eigen::Vector2d left_hip, right_hip;    ///< upper ends of the legs
  Eigen::Vector2d pelvis;                 ///< its centre
};

BongoPose poseOf(const BongoParameters& parameters, const BongoBoard::State& x);

/// Of the board's lower end, the middle of its thickness [m].
double boardHeight(const BongoParameters& parameters, const BongoBoard::State& x);

/// The pelvis's horizontal speed [m/s].
double pelvisVelocity(const BongoParameters& parameters, const BongoBoard::State& x);

}  // namespace traceur::bias
