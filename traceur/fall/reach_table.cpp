#include "traceur/fall/reach_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "traceur/core/random.h"

namespace traceur::fall {

ReachTable::ReachTable(double cell, double longest)
    : cell_(cell),
      cells_(static_cast<int>(std::ceil(longest / cell)) + 2),
      marked_(static_cast<size_t>(cells_) * cells_ * kAngles) {}

int ReachTable::angleOf(double theta2) {
  const double turn = theta2 / (2 * std::numbers::pi);
  const int angle = static_cast<int>(std::floor((turn - std::floor(turn)) * kAngles));
  return std::min(angle, kAngles - 1);
}

void ReachTable::mark(double r1, double r2, double theta2) {
  const int i1 = static_cast<int>(r1 / cell_);
  const int i2 = static_cast<int>(r2 / cell_);
  const int a = angleOf(theta2);
  for (int i = std::max(0, i1 - 1); i <= std::min(cells_ - 1, i1 + 1); ++i) {
    for (int j = std::max(0, i2 - 1); j <= std::min(cells_ - 1, i2 + 1); ++j) {
      for (int k = a - 1; k <= a + 1; ++k) marked_[index(i, j, (k + kAngles) % kAngles)] = 1;
    }
  }
}

bool ReachTable::reachable(double r1, double r2, double theta2) const {
  const double i1 = r1 / cell_;
  const double i2 = r2 / cell_;
  if (!(i1 >= 0 && i1 < cells_ && i2 >= 0 && i2 < cells_)) return false;
  return marked_[index(static_cast<int>(i1), static_cast<int>(i2), angleOf(theta2))] != 0;
}

double ReachTable::filled() const {
  return static_cast<double>(std::count(marked_.begin(), marked_.end(), 1)) /
         static_cast<double>(marked_.size());
}

ReachTables sampleReach(const SagittalBody& body, const FallRobot& falls,
                        const ReachOptions& options,
                        std::vector<std::pair<double, double>>* lengths) {
  if (lengths) lengths->assign(body.setup().graph.nodes.size(), {1e9, 0});
  const sim::Model& model = *body.model();
  const ContactGraph& graph = body.setup().graph;
  const std::vector<MovedJoint> joints = movedJoints(body, falls);
  const sim::State stance = model.stateOf(falls.robot->poses.at(body.setup().stance));
  struct Sample {
    double r1, r2, theta2;
  };
  std::vector<std::vector<std::vector<Sample>>> samples(graph.nodes.size());
  for (size_t i = 0; i < samples.size(); ++i) samples[i].resize(graph.edges[i].size());
  sim::World world(body.model());
  double longest = 0;
  for (int k = 0; k < options.poses; ++k) {
    Random random(options.seed, 0, k);
    sim::State pose = stance;
    for (const MovedJoint& j : joints) {
      const double angle = random.uniform(j.min, j.max);
      pose.q[model.joint(j.name).q] = angle;
      if (!j.other.empty()) pose.q[model.joint(j.other).q] = j.sign * angle;
    }
    world.place(pose);
    const sim::Snapshot& s = world.snapshot();
    const Vector2d com = body.com(s);
    for (size_t i = 0; i < graph.nodes.size(); ++i) {
      const double r1 = (com - body.node(s, static_cast<int>(i))).norm();
      if (lengths) {
        auto& [least, most] = (*lengths)[i];
        least = std::min(least, r1);
        most = std::max(most, r1);
      }
      for (size_t e = 0; e < graph.edges[i].size(); ++e) {
        const int to = graph.edges[i][e];
        const double r2 = (body.node(s, to) - com).norm();
        samples[i][e].push_back({r1, r2, body.stopperAngle(s, static_cast<int>(i), to)});
        longest = std::max({longest, r1, r2});
      }
    }
  }
  ReachTables tables(graph.nodes.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    for (const std::vector<Sample>& edge : samples[i]) {
      ReachTable table(options.cell, longest);
      for (const Sample& s : edge) table.mark(s.r1, s.r2, s.theta2);
      tables[i].push_back(std::move(table));
    }
  }
  return tables;
}

}  // namespace traceur::fall
