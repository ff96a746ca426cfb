// Balancing on the bongo board: the policy, what an episode of it costs, and when it has failed
// [Ha2015, §8.4, §8.5.1].
#pragma once

#include <string>

#include "traceur/bias/bongo_board.h"
#include "traceur/bias/dynamics_bias.h"

namespace traceur::bias {

/// Output feedback u = H z, clipped, z = (x_p, x_p', θ, θ', φ): the pelvis's horizontal place and
/// speed, the legs' angle and rate, the board's absolute angle [Ha2015, Eq. 57].
///
/// x_p counts from the wheel's centre [Ha2015, Fig. 38b]. Then nothing tells the policy where the
/// wheel has rolled to, which balances all the same: moved aside, board and robot stand as before.
/// Gains of about a thousand do; with x_p in the world they must be ten times as large, and the
/// least of the published noises is enough to make such a policy fall.
struct BalancePolicy {
  static constexpr int kParameters = 5;
  static constexpr double kBound = 10;  ///< |ĥ_i| at most [Ha2015, Tab. 12]

  VectorXd h = VectorXd::Zero(kParameters);  ///< H [N, N·s, N·m, N·m·s, N·m]
  double most_torque = 100;                  ///< [N·m] [Ha2015, Tab. 12]
  bool from_wheel = true;                    ///< false: x_p in the world, from where it began

  /// h_i = sign(ĥ_i) (exp |ĥ_i| - 1) [Ha2015, Eq. 58].
  static BalancePolicy of(const VectorXd& parameters);

  double torque(const BongoParameters& board, const BongoBoard::State& x) const;
};

/// When an episode has failed: criteria 1 to 6 of [Ha2015, §8.3.3] by their numbers there. That the
/// wheel leaves the paper's ground, 0.15 m from where it began, cannot come before criterion 3,
/// which ends at 0.12 m. The paper prints no thresholds; but for the first these are the ones its
/// experiments ran with. Criterion 2, board and wheel have parted, is not judged: a state does not
/// tell it.
struct BalanceLimits {
  double board_height = 0.005;  ///< 1, "board on the ground": its lower end [m] [ours]
  double distance = 4.5;        ///< 3, "distance": |α_w| + |α_b| + |θ| [rad]
  double body_angle = 0.5;      ///< 4, "body angle": of the legs from the vertical [rad]
  double board_angle = 0.3;     ///< 5, "board angle": of the board from the horizontal [rad]; with
                                ///< its middle on the wheel it touches the ground at 0.34
  double rate = 6.2;            ///< 6, "rate": of wheel, board and both together [rad/s]

  /// The name of what has failed, as above, or "" while all is well.
  std::string failure(const BongoParameters& board, const BongoBoard::State& x) const;
};

/// Weights of the cost [Ha2015, Tab. 12]:
///
///     Z = c (T - t_fail) + max_t xᵀ R x + Σ_t Q u²                     [Ha2015, Eq. 56]
struct BalanceCost {
  int steps = 5000;      ///< T
  double failure = 200;  ///< c, and Z_max: an episode that does not fail costs less
  double angle = 10;     ///< R, of each angle
  double rate = 0.1;     ///< R, of each rate
  double torque = 1e-6;  ///< Q

  /// xᵀ R x.
  double of(const BongoBoard::State& x) const {
    return angle * x.head<3>().squaredNorm() + rate * x.tail<3>().squaredNorm();
  }
};

struct Episode {
  double cost = 0;
  int steps = 0;        ///< until the failure, or all
  std::string failure;  ///< "" for none
  bool failed() const { return !failure.empty(); }
};

/// Runs a policy on a plant.
/// @param x0   (6)
/// @param log  when given: what was read and asked for, to the end or the failure
Episode balance(Plant& plant, const BongoParameters& board, const BalancePolicy& policy,
                const VectorXd& x0, const BalanceCost& cost = {}, const BalanceLimits& limits = {},
                RunLog* log = nullptr);

}  // namespace traceur::bias
