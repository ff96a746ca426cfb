#include "traceur/bias/bongo_board.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

namespace traceur::bias {
namespace {

using State = BongoBoard::State;
using Eigen::Vector3d;

State stateOf(std::initializer_list<double> x) {
  State s;
  std::copy(x.begin(), x.end(), s.data());
  return s;
}

TEST(BongoBoard, AcceleratesAsABruteForceLagrangianDoes) {
  const BongoBoard board;
  const Vector3d rest = board.acceleration(stateOf({.01, .02, .03, 0, 0, 0}), 0);
  EXPECT_LT((rest - Vector3d(-17.0923, 15.5277, 4.14699)).cwiseAbs().maxCoeff(), 1e-4);
  const State x = stateOf({.3 * std::sin(2), .25 * std::cos(2), .2 * std::sin(3.5),
                           1.5 * std::cos(1.3), -2 * std::sin(1.7), 1.1 * std::cos(2.3)});
  const Vector3d moving = board.acceleration(x, 12);
  EXPECT_LT((moving - Vector3d(-6.7762, -19.2095, 28.1206)).cwiseAbs().maxCoeff(), 5e-4);
}

/// The same model derived by differences of its energy alone: d/dt ∂L/∂v - ∂L/∂q = Q, where the
/// kinetic energy is what energy() adds for velocities.
TEST(BongoBoard, ObeysEulerAndLagrangeForItsOwnEnergy) {
  const BongoBoard board;
  const double h = 1e-4;
  for (int trial = 0; trial < 20; ++trial) {
    const double t = 0.7 * trial;
    State x = stateOf({.3 * std::sin(t), .25 * std::cos(2 * t), .2 * std::sin(3 * t + 1),
                       1.5 * std::cos(t), -2 * std::sin(1.7 * t), 1.1 * std::cos(2.3 * t)});
    const double u = 20 * std::sin(5 * t);
    const Vector3d a = board.acceleration(x, u);
    const auto kinetic = [&](const State& s) {
      State still = s;
      still.tail<3>().setZero();
      return board.energy(s) - board.energy(still);
    };
    const auto lagrangian = [&](const State& s) {
      State still = s;
      still.tail<3>().setZero();
      return kinetic(s) - board.energy(still);
    };
    const auto shifted = [&](const State& s, int i, double by) {
      State moved = s;
      moved[i] += by;
      return moved;
    };
    const auto momentum = [&](const State& s, int i) {
      return (lagrangian(shifted(s, 3 + i, h)) - lagrangian(shifted(s, 3 + i, -h))) / (2 * h);
    };
    State rate;
    rate << x.tail<3>(), a;
    for (int i = 0; i < 3; ++i) {
      const double change = (momentum(x + h * rate, i) - momentum(x - h * rate, i)) / (2 * h);
      const double force = (lagrangian(shifted(x, i, h)) - lagrangian(shifted(x, i, -h))) / (2 * h);
      EXPECT_NEAR(change - force, i == 2 ? u : 0, 1e-3) << "coordinate " << i;
    }
  }
}

/// The sum over rigid bodies, placed by poseOf: independent of how the mechanism's inertia is put.
TEST(BongoBoard, HasTheEnergyOfItsBodies) {
  BongoParameters p;
  p.thickness = 0.08;  // so that it counts
  p.wheel_density = 3000;
  p.inertia_scale = 1.5;
  const BongoBoard board(p);
  EXPECT_EQ(board.energy(State::Zero()), 0);
  const auto rod = [&](double mass, double length) {
    return mass * (length * length + p.thickness * p.thickness) / 12;
  };
  const double wheel_mass = M_PI * p.wheel_radius * p.wheel_radius * p.wheel_density;
  for (int trial = 0; trial < 10; ++trial) {
    const double t = trial;
    const State x = stateOf({std::sin(t), .25 * std::cos(2 * t), .4 * std::sin(3 * t + 1),
                             1.5 * std::cos(t), -2 * std::sin(1.7 * t), 1.1 * std::cos(2.3 * t)});
    const double h = 1e-6;
    State later = x, earlier = x;
    later.head<3>() += h * x.tail<3>();
    earlier.head<3>() -= h * x.tail<3>();
    const auto energy = [&](double mass, double inertia, double rate, const auto& centre) {
      const Eigen::Vector2d v = (centre(poseOf(p, later)) - centre(poseOf(p, earlier))) / (2 * h);
      const double rise = centre(poseOf(p, x)).y() - centre(poseOf(p, State::Zero())).y();
      return 0.5 * mass * v.squaredNorm() + 0.5 * inertia * rate * rate + mass * p.gravity * rise;
    };
    using Point = Eigen::Vector2d;
    const double vf = x[3] + x[4];
    const double vp = vf + x[5];
    const double sum =
        energy(wheel_mass, 0.5 * wheel_mass * p.wheel_radius * p.wheel_radius, x[3],
               [](const BongoPose& q) -> Point { return q.wheel; }) +
        energy(p.board_mass, rod(p.board_mass, p.board_length), vf,
               [](const BongoPose& q) -> Point { return q.board; }) +
        energy(p.leg_mass, rod(p.leg_mass, p.leg_length), vp,
               [](const BongoPose& q) -> Point { return (q.left_foot + q.left_hip) / 2; }) +
        energy(p.leg_mass, rod(p.leg_mass, p.leg_length), vp,
               [](const BongoPose& q) -> Point { return (q.right_foot + q.right_hip) / 2; }) +
        energy(2 * p.pelvis_mass, 2 * rod(p.pelvis_mass, p.pelvis_length), vf,
               [](const BongoPose& q) -> Point { return q.pelvis; });
    EXPECT_NEAR(board.energy(x), 1.5 * sum, 1e-6) << trial;
  }
}

TEST(BongoBoard, IsIntegratedToTheFourthOrder) {
  const State x = stateOf({.2, -.1, .15, 1, -2, .5});
  const auto after = [&](int steps) {  // of 0.04 s
    const BongoBoard board({}, 0.04 / steps);
    State at = x;
    for (int i = 0; i < steps; ++i) at = board.stepped(at, 20, -3);
    return at;
  };
  const State exact = after(256);
  const double coarse = (after(4) - exact).norm();
  const double fine = (after(8) - exact).norm();
  EXPECT_NEAR(std::log2(coarse / fine), 4, 0.3);
  EXPECT_LT(fine, 1e-5);
}

TEST(BongoBoard, IsTwiceUnstable) {
  const BongoBoard board;
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  const double h = 1e-6;
  A.topRightCorner<3, 3>().setIdentity();
  for (int i = 0; i < 6; ++i) {
    State x = State::Zero();
    x[i] = h;
    A.block<3, 1>(3, i) = (board.acceleration(x, 0) - board.acceleration(-x, 0)) / (2 * h);
  }
  const Vector3d B = board.acceleration(State::Zero(), 1);
  EXPECT_LT((B - Vector3d(-.94029, -1.65532, 2.72639)).norm(), 1e-4);
  std::vector<double> real, imaginary;
  const auto values = A.eigenvalues().eval();
  for (const std::complex<double>& e : values) {
    real.push_back(e.real());
    imaginary.push_back(e.imag());
  }
  std::sort(real.begin(), real.end());
  std::sort(imaginary.begin(), imaginary.end());
  EXPECT_NEAR(real[5], 11.900, 1e-3);
  EXPECT_NEAR(real[4], 3.016, 1e-3);
  EXPECT_NEAR(real[0], -11.900, 1e-3);
  EXPECT_NEAR(imaginary[5], 13.11, 1e-2);
}

TEST(BongoBoard, KeepsItsEnergyAndGainsTheWorkDone) {
  BongoBoard board;
  State x = stateOf({.05, -.02, .1, 0, 0, 0});
  const double before = board.energy(x);
  for (int i = 0; i < 500; ++i) x = board.stepped(x, 0);
  EXPECT_GT(x.norm(), 1);  // it fell
  EXPECT_NEAR(board.energy(x), before, 1e-6 * std::max(1.0, std::abs(before)));

  x = stateOf({.01, 0, 0, 0, 0, 0});
  double work = 0;
  const double start = board.energy(x);
  for (int i = 0; i < 300; ++i) {
    const double u = 30 * std::sin(0.02 * i);
    const State next = board.stepped(x, u);
    work += u * (next[2] - x[2]);
    x = next;
  }
  EXPECT_NEAR(board.energy(x) - start, work, 1e-6 * std::max(1.0, std::abs(work)));
}

TEST(BongoBoard, PosesAgreeWithSpeeds) {
  const BongoParameters p;
  const State x = stateOf({.2, -.1, .15, 1, -2, .5});
  const double h = 1e-6;
  State later = x, earlier = x;
  later.head<3>() += h * x.tail<3>();
  earlier.head<3>() -= h * x.tail<3>();
  EXPECT_NEAR((poseOf(p, later).pelvis.x() - poseOf(p, earlier).pelvis.x()) / (2 * h),
              pelvisVelocity(p, x), 1e-8);
  const BongoPose pose = poseOf(p, x);
  EXPECT_NEAR((pose.left_hip - pose.left_foot).norm(), p.leg_length, 1e-12);
  EXPECT_NEAR((pose.right_hip - pose.left_hip).norm(), 2 * p.pelvis_length, 1e-12);
  // The board touches the wheel: its centre line is one radius from the wheel's centre.
  const double f = x[0] + x[1];
  EXPECT_NEAR((pose.board - pose.wheel).dot(Eigen::Vector2d(-std::sin(f), std::cos(f))),
              p.wheel_radius, 1e-12);
}

TEST(BongoBoard, IsAPlant) {
  BongoBoard board;
  board.reset(stateOf({.01, .02, .03, 0, 0, 0}));
  board.step(VectorXd::Constant(1, 3));
  EXPECT_EQ(State(board.state()), board.stepped(stateOf({.01, .02, .03, 0, 0, 0}), 3));
  // Scaling every mass scales what a torque does, and nothing else.
  BongoParameters heavy;
  heavy.inertia_scale = 1.2;
  const State x = stateOf({.1, -.1, .05, .3, .2, -.4});
  EXPECT_LT((BongoBoard(heavy).acceleration(x, 12) - BongoBoard().acceleration(x, 10)).norm(),
            1e-10);
}

TEST(BongoBoard, StandsWhereItsAnglesSay) {
  const BongoParameters p;
  const auto near = [](const Eigen::Vector2d& at, double x, double y) {
    EXPECT_LT((at - Eigen::Vector2d(x, y)).norm(), 1e-12) << at.transpose();
  };
  const BongoPose rest = poseOf(p, State::Zero());
  near(rest.wheel, 0, 0.05);
  near(rest.board, 0, 0.1);
  near(rest.left_foot, -0.1, 0.1);
  near(rest.right_foot, 0.1, 0.1);
  near(rest.left_hip, -0.1, 1.1);
  near(rest.right_hip, 0.1, 1.1);
  near(rest.pelvis, 0, 1.1);
  for (const State& x : {stateOf({.7, -.4, .2, 1, -2, .5}), stateOf({-1.2, 1.4, -.3, .3, 1, -2})}) {
    const BongoPose q = poseOf(p, x);
    const double f = x[0] + x[1];
    const Eigen::Vector2d along(std::cos(f), std::sin(f));
    near(q.wheel, -0.05 * x[0], 0.05);
    // As far from the board's middle as the wheel has rolled along it.
    EXPECT_NEAR((q.board - q.wheel).dot(along), 0.05 * x[1], 1e-12);
    EXPECT_LT((q.right_foot - q.board - 0.1 * along).norm(), 1e-12);
    EXPECT_LT((q.board - q.left_foot - 0.1 * along).norm(), 1e-12);
    const double p_abs = f + x[2];
    const Eigen::Vector2d leg(-std::sin(p_abs), std::cos(p_abs));
    EXPECT_LT((q.left_hip - q.left_foot - leg).norm(), 1e-12);
    EXPECT_LT((q.right_hip - q.right_foot - leg).norm(), 1e-12);
    EXPECT_LT((q.pelvis - (q.left_hip + q.right_hip) / 2).norm(), 1e-12);
    EXPECT_NEAR(boardHeight(p, x),
                std::min((q.board - 0.3 * along).y(), (q.board + 0.3 * along).y()), 1e-12);
    State later = x;
    later.head<3>() += 1e-7 * x.tail<3>();
    EXPECT_NEAR((poseOf(p, later).pelvis.x() - q.pelvis.x()) / 1e-7, pelvisVelocity(p, x), 1e-5);
  }
}

}  // namespace
}  // namespace traceur::bias
