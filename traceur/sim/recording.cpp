#include "traceur/sim/recording.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "traceur/core/error.h"

namespace traceur::sim {
namespace {

static_assert(std::endian::native == std::endian::little, "recordings are little-endian");

constexpr std::string_view kMagic = "traceur-recording";
constexpr std::uint32_t kVersion = 2;  // 1 has no joint forces

// The fewest bytes that each takes, all its vectors but those of three numbers being empty.
constexpr size_t kVector3 = 4 + 3 * 8;
constexpr size_t kLeastFrame = 3 * 4 + 2 * 8 + 2 * kVector3 + 4;
constexpr size_t kLeastContact = 2 * 8 + 3 * kVector3;

class Writer {
 public:
  void number(double x) { raw(&x, sizeof x); }
  void count(size_t n) {
    const auto small = static_cast<std::uint32_t>(n);
    raw(&small, sizeof small);
  }
  void text(std::string_view s) {
    count(s.size());
    bytes_.append(s);
  }
  template <class Vector>
  void vector(const Vector& x) {
    count(x.size());
    for (int i = 0; i < x.size(); ++i) number(x[i]);
  }
  std::string take() { return std::move(bytes_); }

 private:
  void raw(const void* p, size_t n) { bytes_.append(static_cast<const char*>(p), n); }
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  double number() {
    double x = 0;
    std::memcpy(&x, raw(sizeof x).data(), sizeof x);
    return x;
  }
  /// A whole number that is kept as a double: of a phase or a body.
  int integer() {
    const double x = number();
    if (!(x >= -1 && x <= std::numeric_limits<int>::max() && x == std::floor(x))) fail();
    return static_cast<int>(x);
  }
  /// A number of things of at least `each` bytes still to come.
  std::uint32_t count(size_t each) {
    std::uint32_t n = 0;
    std::memcpy(&n, raw(sizeof n).data(), sizeof n);
    if (n > (bytes_.size() - at_) / each) fail();
    return n;
  }
  std::uint32_t version() {
    std::uint32_t n = 0;
    std::memcpy(&n, raw(sizeof n).data(), sizeof n);
    return n;
  }
  std::string text() { return std::string(raw(count(1))); }
  VectorXd vector() {
    VectorXd x(count(sizeof(double)));
    for (double& e : x) e = number();
    return x;
  }
  Vector3d vector3() {
    const VectorXd x = vector();
    if (x.size() != 3) fail();
    return x;
  }
  std::string_view raw(size_t n) {
    if (n > bytes_.size() - at_) fail();
    at_ += n;
    return bytes_.substr(at_ - n, n);
  }
  [[noreturn]] static void fail() {
    throw InputError("recording: the bytes end early or hold impossible sizes");
  }

 private:
  std::string_view bytes_;
  size_t at_ = 0;
};

}  // namespace

std::string Recording::encode() const {
  Writer out;
  out.text(kMagic);
  out.count(kVersion);
  out.text(mjcf);
  out.count(phases.size());
  for (const std::string& p : phases) out.text(p);
  out.count(frames.size());
  for (const Frame& f : frames) {
    out.number(f.state.time);
    out.vector(f.state.q);
    out.vector(f.state.v);
    out.vector(f.com);
    out.vector(f.com_velocity);
    out.number(f.phase);
    out.vector(f.torque);
    out.count(f.contacts.size());
    for (const Contact& c : f.contacts) {
      out.number(c.body_a.value);
      out.number(c.body_b.value);
      out.vector(c.p_WC);
      out.vector(c.normal);
      out.vector(c.f_WC);
    }
    out.vector(f.joint_forces);
  }
  return out.take();
}

Recording Recording::decode(std::string_view bytes) {
  Reader in(bytes);
  if (bytes.size() < 4 + kMagic.size() || in.text() != kMagic) {
    throw InputError("recording: these bytes are not a Traceur recording");
  }
  const std::uint32_t version = in.version();
  if (version < 1 || version > kVersion) {
    throw InputError("recording: version " + std::to_string(version) +
                     ", this program reads 1 to " + std::to_string(kVersion));
  }
  Recording r;
  r.mjcf = in.text();
  r.phases.resize(in.count(4));
  for (std::string& p : r.phases) p = in.text();
  r.frames.resize(in.count(kLeastFrame));
  for (Frame& f : r.frames) {
    f.state.time = in.number();
    f.state.q = in.vector();
    f.state.v = in.vector();
    f.com = in.vector3();
    f.com_velocity = in.vector3();
    f.phase = in.integer();
    f.torque = in.vector();
    f.contacts.resize(in.count(kLeastContact));
    for (Contact& c : f.contacts) {
      c.body_a.value = in.integer();
      c.body_b.value = in.integer();
      c.p_WC = in.vector3();
      c.normal = in.vector3();
      c.f_WC = in.vector3();
    }
    if (version > 1) f.joint_forces = in.vector();
  }
  return r;
}

Frame frameOf(const Snapshot& s, int phase, const VectorXd& torque) {
  return {{s.time(), s.q(), s.v()}, s.com(), s.comVelocity(), phase, torque, s.contacts(), {}};
}

}  // namespace traceur::sim
