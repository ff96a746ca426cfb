#include "traceur/coach/demonstration.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <cmath>
#include <iterator>
#include <numbers>

#include "traceur/core/error.h"
#include "traceur/core/gravity.h"
#include "traceur/core/text.h"
#include "traceur/sim/robot.h"
#include "traceur/sim/world.h"

namespace traceur::coach {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPerDegree = std::numbers::pi / 180;  // [rad]
constexpr double kSame = 5 * kPerDegree;   // between two sides: one pose for both [ours]
constexpr double kShown = 2 * kPerDegree;  // smaller angles are left out of a pose [ours]
constexpr double kShortest = 0.1;          // of a flight [s, ours]
constexpr double kTurns = 1;   // backward angular momentum that is meant [kg·m²/s, ours]
constexpr double kLow = 0.02;  // [m]: so little above the lowest it has not yet pushed [ours]
// A push-off's pose is a target: at it, motors no longer push [ours].
constexpr double kBeyond = 0.5;
// Half as deep as it sinks, the root as it stood: the rig of MOVE bends legs and root on, about the
// key pose. As deep and inclined as the clip, three of three thrusts spun; half as deep with the
// root inclined by 3, 6 and 9 degrees, 3, 2 and 1 of 3 landed [ours].
constexpr double kLess = 0.5;
constexpr double kPoint = 1e-6;  // a bone of no length [m]

/// What motion capture calls the bones, lower case without separators, and the robot's bodies that
/// may be meant, the first that it has.
struct Called {
  std::string_view clip;
  std::array<std::string_view, 2> body;
};
constexpr Called kCalled[] = {
    {"hips", {"pelvis", ""}},     {"hip", {"pelvis", "thigh"}},    {"spine", {"abdomen", "chest"}},
    {"spine1", {"chest", ""}},    {"spine2", {"chest", ""}},       {"chest", {"chest", ""}},
    {"chest2", {"chest", ""}},    {"head", {"head", ""}},          {"upleg", {"thigh", ""}},
    {"thigh", {"thigh", ""}},     {"leg", {"shank", ""}},          {"shin", {"shank", ""}},
    {"knee", {"shank", ""}},      {"foot", {"foot", ""}},          {"ankle", {"foot", ""}},
    {"toebase", {"toe", ""}},     {"arm", {"upper_arm", ""}},      {"shldr", {"upper_arm", ""}},
    {"uparm", {"upper_arm", ""}}, {"shoulder", {"upper_arm", ""}}, {"forearm", {"forearm", ""}},
    {"loarm", {"forearm", ""}},   {"elbow", {"forearm", ""}},      {"hand", {"hand", ""}},
    {"wrist", {"hand", ""}},
};

/// The robot's body that a bone is; empty: none.
/// @param by_joints  the clip calls a bone by the joint at its beginning: what it calls a shoulder
///                   is an upper arm, and no collarbone
std::string bodyOf(const std::string& bone, bool by_joints,
                   const std::vector<std::string>& bodies) {
  const auto has = [&](const std::string& name) {
    return std::ranges::find(bodies, name) != bodies.end();
  };
  if (has(bone)) return bone;
  std::string word;
  for (const char c : bone.substr(bone.rfind(':') + 1)) {  // "mixamorig:LeftUpLeg"
    if (std::isalnum(static_cast<unsigned char>(c))) {
      word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  std::string side;
  for (const auto& [prefix, of] : {std::pair("left", "l_"), {"right", "r_"}}) {
    if (word.starts_with(prefix)) side = of, word.erase(0, std::string_view(prefix).size());
  }
  for (const Called& c : kCalled) {
    // "lShldr", "rThigh": one letter for the side.
    const bool short_side = side.empty() && word.size() == c.clip.size() + 1 &&
                            word.ends_with(c.clip) && (word[0] == 'l' || word[0] == 'r');
    if (word != c.clip && !short_side) continue;
    if (c.clip == "shoulder" && !by_joints) continue;
    const std::string s = short_side ? std::string(1, word[0]) + "_" : side;
    for (const std::string_view body : c.body) {
      if (!body.empty() && has(s + std::string(body))) return s + std::string(body);
    }
  }
  return {};
}

/// Follows a clip with a robot.
class Follower {
 public:
  Follower(const clip::Clip& clip, const std::shared_ptr<const sim::Model>& shared)
      : clip_(clip), model_(*shared), world_(shared) {
    const sim::Model& model = *shared;
    assert(model.robot());
    if (model.rootDofs() == 0) throw InputError("a robot that is fixed follows no clip");
    if (!model.robot()->bodies.contains("feet")) {
      throw InputError(fmt::format("{} has no [bodies] called \"feet\"", model.robot()->name));
    }
    std::vector<std::string> names;
    for (int b = 0; b < model.bodies(); ++b) {
      if (model.isRobot({b})) names.push_back(model.bodyName({b}));
    }
    world_.place(model.initialState());
    const sim::Snapshot& s = world_.snapshot();
    const bool by_joints = std::ranges::any_of(clip.joints, [](const clip::Joint& j) {
      return j.name.ends_with("Elbow") || j.name.ends_with("elbow");
    });
    for (size_t j = 0; j < clip.joints.size(); ++j) {
      const std::string body = bodyOf(clip.joints[j].name, by_joints, names);
      if (body.empty()) continue;
      const sim::BodyId id = model.body(body);
      const auto taken = std::ranges::find(bones_, id, &Bone::body);
      if (taken == bones_.end()) {
        bones_.push_back({j, id, s.bodyRotation(id)});
      } else if (body == "chest") {
        taken->joint = j;  // of several the one that carries the arms: the last
      }
    }
    if (bones_.empty() || bones_[0].body != model.root()) {
      throw InputError(fmt::format(
          "no bone of the clip is {}'s root: expected bones named as the robot's bodies ({}) or as "
          "motion capture does (Hips, LeftUpLeg, ...)",
          model.bodyName(model.root()), join(names)));
    }
    align();
  }

  std::vector<sim::State> follow() {
    std::vector<sim::State> all;
    sim::State state = model_.initialState();
    for (size_t f = 0; f < clip_.frames.size(); ++f) {
      turn(clip_.places(f), state);
      state.time = static_cast<double>(f) * clip_.interval;
      all.push_back(state);
    }
    speeds(all);
    return all;
  }

 private:
  struct Bone {
    size_t joint;  // of the clip
    sim::BodyId body;
    Matrix3d at_rest;  // of the body; then what the clip's turn is followed by
  };

  /// Where a robot's bone points at rest, and the clip's.
  void align() {
    const sim::Snapshot& s = world_.snapshot();
    std::vector<Vector3d> at(clip_.joints.size());
    for (size_t j = 0; j < clip_.joints.size(); ++j) {
      const auto on = clip_.joints[j].parent;
      at[j] = clip_.joints[j].offset + (on < 0 ? Vector3d::Zero() : at[static_cast<size_t>(on)]);
    }
    std::vector<Eigen::Quaterniond> turns(bones_.size(), Eigen::Quaterniond::Identity());
    for (size_t i = 0; i < bones_.size(); ++i) {
      int child = -1;
      int children = 0;
      for (size_t k = 0; k < bones_.size(); ++k) {
        if (knownUnder(bones_[k]) != static_cast<int>(i)) continue;
        child = static_cast<int>(k);
        ++children;
      }
      // By the one known child; a bone without is turned as what carries it. Of others, as the
      // pelvis, the frames are equal.
      Eigen::Quaterniond& turn = turns[i];
      const int on = knownUnder(bones_[i]);
      if (children == 0 && on >= 0) turn = turns[static_cast<size_t>(on)];
      if (children == 1) {
        const Bone& next = bones_[static_cast<size_t>(child)];
        const Vector3d mine = anchor(s, next.body) - anchor(s, bones_[i].body);
        const Vector3d theirs = at[next.joint] - at[bones_[i].joint];
        if (mine.norm() > kPoint && theirs.norm() > kPoint) turn.setFromTwoVectors(mine, theirs);
      }
      bones_[i].at_rest = turn * bones_[i].at_rest;
    }
    scale(at);
  }
  /// Whoever shows it has other legs, and a file may be in any unit.
  void scale(const std::vector<Vector3d>& at) {
    const sim::Snapshot& s = world_.snapshot();
    double mine = 0;
    double theirs = 0;
    int legs = 0;
    const auto& feet = model_.robot()->bodies.at("feet");
    const auto is_foot = [&](const Bone& b) {
      return std::ranges::find(feet, model_.bodyName(b.body)) != feet.end();
    };
    for (const Bone& foot : bones_) {
      const int shank = knownUnder(foot);
      if (!is_foot(foot) || shank <= 0 || is_foot(bones_[static_cast<size_t>(shank)])) continue;
      const int thigh = knownUnder(bones_[static_cast<size_t>(shank)]);
      if (thigh <= 0) continue;
      ++legs;
      for (const auto& [above, below] :
           {std::pair(bones_[static_cast<size_t>(thigh)], bones_[static_cast<size_t>(shank)]),
            {bones_[static_cast<size_t>(shank)], foot}}) {
        mine += (anchor(s, above.body) - anchor(s, below.body)).norm();
        theirs += (at[above.joint] - at[below.joint]).norm();
      }
    }
    if (legs < 2 || !(theirs > 0)) {
      throw InputError(
          fmt::format("{} cannot follow the clip's legs: expected bones of two thighs, shanks and "
                      "feet that are "
                      "called as its bodies, or as motion capture does while it calls them "
                      "l_thigh, l_shank ...",
                      model_.robot()->name));
    }
    scale_ = mine / theirs;
  }

  /// The nearest known bone that carries this one; -1: none.
  int knownUnder(const Bone& bone) const {
    for (int on = clip_.joints[bone.joint].parent; on >= 0;
         on = clip_.joints[static_cast<size_t>(on)].parent) {
      const auto found = std::ranges::find(bones_, static_cast<size_t>(on), &Bone::joint);
      if (found != bones_.end()) return static_cast<int>(found - bones_.begin());
    }
    return -1;
  }
  Vector3d anchor(const sim::Snapshot& s, sim::BodyId body) const {
    for (const sim::Joint& j : model_.joints()) {
      if (j.body == body) return s.jointAnchor(j);
    }
    return s.bodyPosition(body);
  }

  /// Gauss-Newton on the angles between the robot's bones and where they are to be.
  void turn(const std::vector<clip::Place>& places, sim::State& state) {
    const auto wanted = [&](const Bone& b) -> Matrix3d { return places[b.joint].R * b.at_rest; };
    const auto root_q = model_.rootQ();
    const Eigen::Quaterniond root(wanted(bones_[0]));
    state.q.segment<3>(root_q) = scale_ * places[bones_[0].joint].p;
    state.q.segment<4>(root_q + 3) << root.w(), root.x(), root.y(), root.z();
    const auto n = static_cast<Eigen::Index>(model_.joints().size());
    static constexpr int kSteps = 30;
    static constexpr double kEnough = 1e-10;
    static constexpr double kDamping = 1e-6;  // hinges that nothing known hangs on stay
    for (int step = 0; step < kSteps; ++step) {
      world_.place(state);
      const sim::Snapshot& s = world_.snapshot();
      VectorXd error(3 * static_cast<Eigen::Index>(bones_.size()));
      Eigen::MatrixXd J(error.size(), n);
      for (size_t i = 0; i < bones_.size(); ++i) {
        const auto row = 3 * static_cast<Eigen::Index>(i);
        const Eigen::AngleAxisd left(
            Matrix3d(wanted(bones_[i]) * s.bodyRotation(bones_[i].body).transpose()));
        error.segment<3>(row) = left.angle() * left.axis();
        Matrix3Xd rows(3, model_.nv());
        s.rotationJacobian(bones_[i].body, rows);
        for (Eigen::Index j = 0; j < n; ++j) {
          J.block<3, 1>(row, j) = rows.col(model_.joints()[static_cast<size_t>(j)].v);
        }
      }
      Eigen::MatrixXd normal = J.transpose() * J;
      normal.diagonal().array() += kDamping;
      const VectorXd change = normal.ldlt().solve(J.transpose() * error);
      for (Eigen::Index j = 0; j < n; ++j) {
        const sim::Joint& joint = model_.joints()[static_cast<size_t>(j)];
        double& q = state.q[joint.q];
        q = std::clamp(q + change[j], joint.limit.min, joint.limit.max);
      }
      if (change.norm() < kEnough) break;
    }
  }

  /// From the frames before and after.
  void speeds(std::vector<sim::State>& all) const {
    const auto q = model_.rootQ();
    const auto v = model_.rootV();
    for (size_t i = 0; i < all.size(); ++i) {
      const sim::State& a = all[i > 0 ? i - 1 : i];
      const sim::State& b = all[std::min(i + 1, all.size() - 1)];
      const double time = std::max(b.time - a.time, clip_.interval);
      sim::State& s = all[i];
      s.v.setZero(model_.nv());
      s.v.segment<3>(v) = (b.q.segment<3>(q) - a.q.segment<3>(q)) / time;
      const auto turn = [&](const sim::State& x) {
        return Eigen::Quaterniond(x.q[q + 3], x.q[q + 4], x.q[q + 5], x.q[q + 6]);
      };
      const Eigen::AngleAxisd turned(turn(a).conjugate() * turn(b));
      s.v.segment<3>(v + 3) = turned.angle() * turned.axis() / time;
      for (const sim::Joint& j : model_.joints()) s.v[j.v] = (b.q[j.q] - a.q[j.q]) / time;
    }
  }

  const clip::Clip& clip_;
  const sim::Model& model_;
  sim::World world_;
  std::vector<Bone> bones_;
  double scale_ = 1;  // length of the robot's legs by the clip's
};

/// The mean of neighbours, so that a motion from cameras can be differentiated.
std::vector<Vector3d> smoothed(const std::vector<Vector3d>& x, int half) {
  std::vector<Vector3d> out;
  const auto n = static_cast<int>(x.size());
  for (int i = 0; i < n; ++i) {
    const int reach = std::min({half, i, n - 1 - i});
    Vector3d sum = Vector3d::Zero();
    for (int k = i - reach; k <= i + reach; ++k) sum += x[static_cast<size_t>(k)];
    out.emplace_back(sum / (2 * reach + 1));
  }
  return out;
}

class Describer {
 public:
  Describer(const clip::Clip& clip, const std::shared_ptr<const sim::Model>& model)
      : dt_(clip.interval),
        model_(*model),
        robot_(*model->robot()),
        states_(followed(clip, model)),
        world_(model) {
    sim::World& world = world_;
    for (const sim::State& s : states_) {
      world.place(s);
      com_.push_back(world.snapshot().com());
      Vector3d feet = Vector3d::Zero();
      const auto& of = robot_.bodies.at("feet");
      for (const std::string& b : of) {
        feet += world.snapshot().bodyPosition(model_.body(b)) / static_cast<double>(of.size());
      }
      feet_.push_back(feet);
      heading_.push_back(world.snapshot().heading());
    }
    flight();
  }

  std::string script(const std::string& what) {
    size_t low = 0;  // the last of its lowest, before it pushes
    for (size_t i = 0; i <= off_; ++i) low = com_[i].z() < com_[low].z() ? i : low;
    const double lowest = com_[low].z();
    for (size_t i = low; i < off_ && com_[i].z() < lowest + kLow; ++i) low = i;
    const size_t last = com_.size() - 1;
    std::string out = fmt::format(
        "# {}\n# Vectors: x forward, y up, z to the right; [0, 0, 0] is between the feet at the "
        "start.\nRobot: {}\nAxes: x forward, y up\nStart: stand\n",
        what, robot_.name);
    const auto line = [&]<typename... A>(fmt::format_string<A...> text, A&&... a) {
      fmt::format_to(std::back_inserter(out), "  ");
      fmt::format_to(std::back_inserter(out), text, std::forward<A>(a)...);
      out += '\n';
    };
    sim::State half = beyond(states_[0], states_[low], -kLess);
    const auto root = Eigen::seqN(model_.rootQ(), 7);
    half.q(root) = states_[0].q(root);
    out += "\nLeaning:\n";
    line("{}", pose(flatSoles(half)));
    line("UNTIL COM leads BY {:.2f} m", std::max(0.05, ahead(low)));
    line("MOVE downward BY {:.2f} m", std::max(kLow, com_[0].z() - lowest));
    out += "\nThrusting:\n";
    line("{}", pose(beyond(states_[low], states_[off_], kBeyond)));
    line("SPEED NEAR {}", vector(speed(off_)));
    // Asked for nothing, a push-off leans back as it extends.
    line("spin about z {}", pitch() > -kTurns ? "FORWARD" : "BACKWARD");
    out += "\nAirborne:\n";
    line("{}", pose(states_[on_]));
    line("PLACE feet NEAR {}", vector(turnedBack(feet_[on_] - feet_[0])));
    line("PLACE COM NEAR {}", vector(turnedBack(com_[on_] - start())));
    out += "\nLanding:\n";
    line("{}", pose(flatSoles(states_[last])));
    line("PLACE COM NEAR {}", vector(turnedBack(com_[last] - start())));
    line("BALANCE");
    return out;
  }

 private:
  /// Where the longest free fall of the COM begins and ends.
  void flight() {
    // Differences over a fiftieth of a second: less is noise, more blurs a take-off.
    static constexpr double kWindow = 0.02;
    const auto h = std::max<size_t>(1, static_cast<size_t>(std::lround(kWindow / dt_)));
    const auto smooth = smoothed(com_, static_cast<int>(h));
    const double step = static_cast<double>(h) * dt_;
    size_t best = 0;
    size_t begun = 0;
    for (size_t i = h; i + h < smooth.size(); ++i) {
      const double up = (smooth[i + h].z() - 2 * smooth[i].z() + smooth[i - h].z()) / (step * step);
      if (!(up < -0.7 * kGravity)) {  // noise is no flight [ours]
        begun = 0;
        continue;
      }
      if (begun == 0) begun = i;
      // A push-off ends softly, which the smoothing makes up for; a landing begins hard.
      if (i + h - begun > best) best = i + h - begun, off_ = begun, on_ = i + h;
    }
    if (static_cast<double>(best) * dt_ < kShortest) {
      throw InputError(fmt::format(
          "the clip shows no jump: expected the COM to fall freely for {} s, it does for {:.2f}",
          kShortest, static_cast<double>(best) * dt_));
    }
  }
  Vector3d speed(size_t at) const {
    // From the flight, a parabola: the ground's part has no constant acceleration.
    const double t = static_cast<double>(on_ - at) * dt_;
    Vector3d v = (com_[on_] - com_[at]) / t;
    v.z() += kGravity * t / 2;
    return turnedBack(v);
  }
  /// The angular momentum about what is left of it, in the middle of its flight [kg·m²/s].
  double pitch() {
    world_.reset(states_[(off_ + on_) / 2]);
    const Vector3d L = world_.snapshot().angularMomentum();
    return turnedBack(L).y();
  }
  double ahead(size_t at) const { return (com_[at] - feet_[at]).dot(heading_[0]); }
  Vector3d start() const { return {feet_[0].x(), feet_[0].y(), 0}; }
  /// As the robot sees it that stands as the clip begins: it begins with x forward.
  Vector3d turnedBack(const Vector3d& v) const {
    const Vector3d& f = heading_[0];
    return {v.dot(f), -v.x() * f.y() + v.y() * f.x(), v.z()};
  }
  static std::string vector(const Vector3d& v) {
    // No minus before a zero.
    const auto rounded = [](double x) { return std::round(100 * x) / 100 + 0.0; };
    return fmt::format("[{:.2f}, {:.2f}, {:.2f}]", rounded(v.x()), rounded(v.z()), rounded(-v.y()));
  }
  /// The joints' way from one to the other, and by a part of it further; the root as there.
  sim::State beyond(const sim::State& from, sim::State to, double part) const {
    for (const sim::Joint& j : model_.joints()) {
      double& q = to.q[j.q];
      q = std::clamp(q + part * (q - from.q[j.q]), j.limit.min, j.limit.max);
    }
    return to;
  }
  /// With the ankles turned so that the soles lie flat: a key pose on the ground says with them how
  /// the root is inclined, and a heel that is about to leave the ground would say otherwise.
  sim::State flatSoles(sim::State state) {
    world_.place(state);
    const sim::Snapshot& s = world_.snapshot();
    const auto& feet = robot_.bodies.at("feet");
    const auto is_foot = [&](sim::BodyId b) {
      return std::ranges::find(feet, model_.bodyName(b)) != feet.end();
    };
    for (const sim::Joint& j : model_.joints()) {
      const sim::BodyId body = model_.bodyOf(j);
      if (!is_foot(body)) continue;
      const Vector3d axis = s.bodyRotation(body).transpose() * s.jointAxis(j);
      if (std::abs(axis.y()) < 0.9) continue;  // it turns the foot in another way
      double& q = state.q[j.q];
      // Toes lie as the sole does.
      q = is_foot(model_.parent(body)) ? 0 : q - sim::rpyOf(s.bodyRotation(body)).y() / axis.y();
      q = std::clamp(q, j.limit.min, j.limit.max);
    }
    return state;
  }
  std::string pose(const sim::State& state) const {
    std::string out = "POSE zero";
    const auto angle = [&](const std::string& name) { return state.q[model_.joint(name).q]; };
    const auto add = [&](const std::string& name, double value) {
      if (std::abs(value) < kShown) return;
      fmt::format_to(std::back_inserter(out), ", {} {:.0f}deg", name, value / kPerDegree);
    };
    std::vector<std::string> told;
    for (const auto& [name, pair] : robot_.mirrored) {
      const double left = angle(pair.left);
      const double right = pair.sign * angle(pair.right);
      if (std::abs(left - right) < kSame) {
        add(name, (left + right) / 2);
      } else {
        add(pair.left, left);
        add(pair.right, angle(pair.right));
      }
      told.insert(told.end(), {pair.left, pair.right});
    }
    for (const sim::Joint& j : model_.joints()) {
      if (j.motor >= 0 && std::ranges::find(told, j.name) == told.end()) add(j.name, angle(j.name));
    }
    return out;
  }

  double dt_;
  const sim::Model& model_;
  const sim::Robot& robot_;
  std::vector<sim::State> states_;
  sim::World world_;
  std::vector<Vector3d> com_, feet_, heading_;
  size_t off_ = 0, on_ = 0;  // frames of take-off and touch-down
};

}  // namespace

std::vector<sim::State> followed(const clip::Clip& clip,
                                 const std::shared_ptr<const sim::Model>& model) {
  return Follower(clip, model).follow();
}

std::string scriptOf(const clip::Clip& clip, const std::shared_ptr<const sim::Model>& model,
                     const std::string& what) {
  return Describer(clip, model).script(what);
}

}  // namespace traceur::coach
