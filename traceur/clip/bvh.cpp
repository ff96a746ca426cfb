#include "traceur/clip/bvh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <numbers>

#include "traceur/core/error.h"
#include "traceur/core/printable.h"

namespace traceur::clip {
namespace {

constexpr double kCentimetres = 100;  // of a metre
constexpr double kDegree = std::numbers::pi / 180;
// Of a stranger's file: above real ones, and what is read stays below half a gigabyte.
constexpr size_t kMostJoints = 2000;
constexpr size_t kMostPlaces =
    5'000'000;  // joints times frames: seven minutes of a hundred at 120 Hz

/// A file's axes from ours: x left, y up, z forward.
const Eigen::Matrix3d& axes() {
  static const Eigen::Matrix3d kAxes = (Eigen::Matrix3d() << 0, 1, 0, 0, 0, 1, 1, 0, 0).finished();
  return kAxes;
}

/// R = R_z R_x R_y [rad]: z, x, y.
Vector3d zxy(const Eigen::Matrix3d& R) {
  const double x = std::asin(std::clamp(R(2, 1), -1.0, 1.0));
  if (std::abs(R(2, 1)) > 1 - 1e-12) return {std::atan2(R(1, 0), R(0, 0)), x, 0};
  return {std::atan2(-R(0, 1), R(1, 1)), x, std::atan2(-R(2, 0), R(2, 2))};
}

constexpr double kShortest = 1e-4;  // between two frames [s]: no camera is as fast

class Writer {
 public:
  explicit Writer(const Clip& clip) : clip_(clip) {
    for (size_t j = 0; j < clip.joints.size(); ++j) {
      if (clip.joints[j].parent < 0) joint(j, 0);
    }
  }

  std::string text() {
    // Its joints are written depth first, and so are the numbers of each frame.
    out_ = "HIERARCHY\n" + out_;
    fmt::format_to(std::back_inserter(out_), "MOTION\nFrames: {}\nFrame Time: {:.9g}\n",
                   clip_.frames.size(), clip_.interval);
    for (const Frame& f : clip_.frames) {
      std::string row;
      for (const size_t j : order_) {
        if (clip_.joints[j].moves) add(row, axes() * f.position[j] * kCentimetres, 5);
        add(row, zxy(axes() * f.rotation[j].toRotationMatrix() * axes().transpose()) / kDegree, 7);
      }
      if (!row.empty()) row.back() = '\n';
      out_ += row;
    }
    return std::move(out_);
  }

 private:
  static void add(std::string& row, const Vector3d& v, int digits) {
    for (const double x : v) fmt::format_to(std::back_inserter(row), "{:.{}f} ", x, digits);
  }
  void line(int depth, std::string_view what) {
    out_.append(static_cast<size_t>(depth), '\t').append(what) += '\n';
  }
  void offset(int depth, const Vector3d& by) {
    const Vector3d v = axes() * by * kCentimetres;
    line(depth, fmt::format("OFFSET {:.5f} {:.5f} {:.5f}", v.x(), v.y(), v.z()));
  }
  void joint(size_t j, int depth) {
    const Joint& me = clip_.joints[j];
    order_.push_back(j);
    std::string name = me.name;
    std::ranges::replace_if(
        name, [](unsigned char c) { return std::isspace(c) != 0; }, '_');
    line(depth, (me.parent < 0 ? "ROOT " : "JOINT ") + name);
    line(depth, "{");
    // A root's place is in its channels: an offset would be added to them by some programs.
    offset(depth + 1, me.parent < 0 ? Vector3d(Vector3d::Zero()) : me.offset);
    const char* const turns = "Zrotation Xrotation Yrotation";
    line(depth + 1, me.moves ? fmt::format("CHANNELS 6 Xposition Yposition Zposition {}", turns)
                             : fmt::format("CHANNELS 3 {}", turns));
    bool leaf = true;
    for (size_t k = j + 1; k < clip_.joints.size(); ++k) {
      if (clip_.joints[k].parent != static_cast<int>(j)) continue;
      joint(k, depth + 1);
      leaf = false;
    }
    if (leaf) {
      line(depth + 1, "End Site");
      line(depth + 1, "{");
      offset(depth + 2, me.tip);
      line(depth + 1, "}");
    }
    line(depth, "}");
  }

  const Clip& clip_;
  std::string out_;
  std::vector<size_t> order_;
};

class Reader {
 public:
  Reader(std::string_view text, const std::string& name, double metre)
      : text_(text), name_(name), metre_(metre) {}

  Clip read() {
    expect("HIERARCHY");
    hierarchy();
    expect("Frames:");
    const auto frames = static_cast<size_t>(whole("a number of frames"));
    if (frames * clip_.joints.size() > kMostPlaces) {
      fail(fmt::format("at most {} frames of {} joints", kMostPlaces / clip_.joints.size(),
                       clip_.joints.size()));
    }
    expect("Frame");
    expect("Time:");
    clip_.interval = number("the time between two frames [s]");
    if (!(clip_.interval >= kShortest)) {
      fail(fmt::format("a time between two frames of at least {} s", kShortest));
    }
    for (size_t f = 0; f < frames; ++f) clip_.frames.push_back(frame());
    if (!word().empty()) fail("the end of the file");
    return std::move(clip_);
  }

 private:
  struct Channel {
    size_t joint;
    int axis;  // 0 to 2 position, 3 to 5 rotation, in the file's axes
  };

  // Words ---------------------------------------------------------------------------------------
  std::string_view word() {
    const auto space = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
    while (at_ < text_.size() && space(text_[at_])) line_ += text_[at_++] == '\n';
    const size_t begin = at_;
    while (at_ < text_.size() && !space(text_[at_])) ++at_;
    return last_ = text_.substr(begin, at_ - begin);
  }
  [[noreturn]] void fail(const std::string& expected) const {
    static constexpr size_t kShown = 40;
    throw InputError(fmt::format(
        "{}:{}: expected {}, got {}", name_, line_, expected,
        last_.empty() ? "the end" : "\"" + printable(std::string(last_.substr(0, kShown))) + "\""));
  }
  void expect(std::string_view what) {
    if (word() != what) fail(fmt::format("\"{}\"", what));
  }
  double number(const std::string& what) {
    const std::string_view w = word();
    double x = 0;
    const auto [end, error] = std::from_chars(w.data(), w.data() + w.size(), x);
    if (error != std::errc() || end != w.data() + w.size() || !std::isfinite(x)) fail(what);
    return x;
  }
  int whole(const std::string& what) {
    static constexpr double kMost = 1e9;
    const double x = number(what);
    if (x < 0 || x > kMost || x != std::floor(x)) fail(what);
    return static_cast<int>(x);
  }
  Vector3d lengths() {
    Vector3d v;
    for (double& x : v) x = number("a length");
    return axes().transpose() * v / metre_;
  }

  // The skeleton ----------------------------------------------------------------------------------
  void hierarchy() {
    std::vector<int> open;  // the joints whose braces are open; -2: an end site
    for (;;) {
      const std::string_view w = word();
      if (w == "MOTION" && open.empty() && !clip_.joints.empty()) return;
      if (w == "ROOT" || w == "JOINT") {
        if ((w == "ROOT") != open.empty() || (!open.empty() && open.back() < 0)) {
          fail(open.empty() ? "\"ROOT\"" : "\"JOINT\" or \"End Site\" in a joint");
        }
        if (clip_.joints.size() == kMostJoints) fail(fmt::format("at most {} joints", kMostJoints));
        Joint joint{std::string(word()), open.empty() ? -1 : open.back(), Vector3d::Zero()};
        joint.moves = joint.parent < 0;
        if (joint.name.empty() || joint.name == "{") fail("a name");
        clip_.joints.push_back(std::move(joint));
        open.push_back(static_cast<int>(clip_.joints.size()) - 1);
        expect("{");
      } else if (w == "End" && !open.empty() && open.back() >= 0) {
        expect("Site");
        expect("{");
        open.push_back(-2);
      } else if (w == "OFFSET" && !open.empty()) {
        const Vector3d v = lengths();
        if (open.back() >= 0) {
          clip_.joints[static_cast<size_t>(open.back())].offset = v;
        } else {
          clip_.joints[static_cast<size_t>(open[open.size() - 2])].tip = v;
        }
      } else if (w == "CHANNELS" && !open.empty() && open.back() >= 0) {
        channels(static_cast<size_t>(open.back()));
      } else if (w == "}" && !open.empty()) {
        open.pop_back();
      } else {
        fail(open.empty() ? (clip_.joints.empty() ? "\"ROOT\"" : "\"MOTION\"")
                          : "\"OFFSET\", \"CHANNELS\", \"JOINT\", \"End Site\" or \"}\"");
      }
    }
  }
  void channels(size_t joint) {
    static constexpr std::array<std::string_view, 6> kNames = {
        "Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation"};
    const int count = whole("a number of channels");
    if (count > 6) fail("at most 6 channels");
    for (int c = 0; c < count; ++c) {
      const auto found = std::ranges::find(kNames, word());
      if (found == kNames.end()) fail("a channel, as Xrotation or Yposition");
      const auto axis = static_cast<int>(found - kNames.begin());
      if (axis < 3) clip_.joints[joint].moves = true;
      channels_.push_back({joint, axis});
    }
  }

  Frame frame() {
    Frame f;
    f.rotation.assign(clip_.joints.size(), Quaterniond::Identity());
    for (const Joint& j : clip_.joints) f.position.push_back(j.offset);
    std::vector<bool> placed(clip_.joints.size());
    for (const Channel& c : channels_) {
      const double x = number("a number of motion");
      const Vector3d axis = axes().transpose().col(c.axis % 3);
      if (c.axis < 3) {
        // What a joint's position channels say is its place on its parent, not from its offset.
        Vector3d& p = f.position[c.joint];
        if (!placed[c.joint] && clip_.joints[c.joint].parent >= 0) p.setZero();
        placed[c.joint] = true;
        p += axis * x / metre_;
      } else {
        f.rotation[c.joint] = f.rotation[c.joint] * Eigen::AngleAxisd(x * kDegree, axis);
      }
    }
    return f;
  }

  std::string_view text_;
  std::string name_;
  double metre_;
  size_t at_ = 0;
  int line_ = 1;
  std::string_view last_;
  Clip clip_;
  std::vector<Channel> channels_;
};

}  // namespace

std::string toBvh(const Clip& clip) {
  return Writer(clip).text();
}

Clip fromBvh(std::string_view text, const std::string& name, double metre) {
  return Reader(text, name, metre).read();
}

}  // namespace traceur::clip
