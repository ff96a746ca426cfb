#include "traceur/bias/policy_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/toml.h"

namespace traceur::bias {
namespace {

using Json = nlohmann::ordered_json;

struct Gain {
  const char* name;
  const char* unit;
};
constexpr std::array<Gain, BalancePolicy::kParameters> kGains = {{{"place", "N"},
                                                                  {"speed", "N·s"},
                                                                  {"leg", "N·m/rad"},
                                                                  {"leg_rate", "N·m·s/rad"},
                                                                  {"board_angle", "N·m/rad"}}};

}  // namespace

void writePolicy(const std::filesystem::path& file, const VectorXd& parameters) {
  const BalancePolicy policy = BalancePolicy::of(parameters);
  Json j{{"format", "traceur policy"}, {"version", 1}, {"plant", "bongo board"}};
  for (const double p : parameters) j["parameters"].push_back(p);
  for (size_t i = 0; i < kGains.size(); ++i) {
    j["gains"][kGains[i].name] = {{"value", policy.h[static_cast<Eigen::Index>(i)]},
                                  {"unit", kGains[i].unit}};
  }
  j["most_torque"] = {{"value", policy.most_torque}, {"unit", "N·m"}};
  j["torque"] =
      "sum of gain times: the pelvis's horizontal place from the wheel's centre [m], its speed "
      "[m/s], the legs' angle from the board's normal [rad], its rate [rad/s], the board's angle "
      "from the horizontal [rad]; angles counter-clockwise, x to the right; clipped to most_torque";
  PendingFile pending(file);
  pending.write(j.dump(2) + "\n");
  pending.commit();
}

VectorXd readPolicy(const std::filesystem::path& file) {
  const std::string text = readFile(file);
  const auto fail = [&](const std::string& why) {
    throw InputError(fmt::format("{}: {}", file.string(), why));
  };
  VectorXd parameters(BalancePolicy::kParameters);
  try {
    const auto j = nlohmann::json::parse(text);
    if (j.value("format", "") != "traceur policy") fail("not a policy: no \"traceur policy\"");
    if (j.value("version", 0) != 1) fail("\"version\": expected 1");
    if (j.value("plant", "") != "bongo board") fail("\"plant\": expected \"bongo board\"");
    const auto& values = j.at("parameters");
    if (values.size() != kGains.size()) {
      fail(
          fmt::format("\"parameters\": expected {} numbers, got {}", kGains.size(), values.size()));
    }
    for (size_t i = 0; i < kGains.size(); ++i) {
      const double p = values[i];
      if (!(std::abs(p) <= BalancePolicy::kBound)) {
        fail(fmt::format("\"parameters\": expected sizes up to {}, got {}", BalancePolicy::kBound,
                         p));
      }
      parameters[static_cast<Eigen::Index>(i)] = p;
    }
  } catch (const nlohmann::json::exception& e) {
    fail(fmt::format("not a policy: {}", e.what()));
  }
  return parameters;
}

std::string cHeader(const VectorXd& parameters, const BongoParameters& board) {
  const BalancePolicy policy = BalancePolicy::of(parameters);
  return fmt::format(R"(/* Balance on a bongo board: written by `traceur balance export`. */
#ifndef TRACEUR_BONGO_POLICY_H
#define TRACEUR_BONGO_POLICY_H
#include <math.h>

/* Torque between board and legs [N m], pushing the legs counter-clockwise (x to the right), to be
   asked for at every reading, once a millisecond. Angles [rad] counter-clockwise, rates [rad/s]:
   of the wheel, of the board relative to the wheel, of the legs relative to the board's normal. */
static inline float traceur_bongo_torque(float wheel, float board, float leg, float wheel_rate,
                                         float board_rate, float leg_rate) {{
  const float r = {:#.9g}f, l = {:#.9g}f; /* wheel's radius, legs' length [m] */
  const float f = wheel + board, vf = wheel_rate + board_rate;
  const float p = f + leg, vp = vf + leg_rate;
  const float place = -r * sinf(f) + r * board * cosf(f) - l * sinf(p);
  const float speed =
      (-r * vf + r * board_rate) * cosf(f) - r * board * sinf(f) * vf - l * cosf(p) * vp;
  const float u = {:#.9g}f * place + {:#.9g}f * speed + {:#.9g}f * leg + {:#.9g}f * leg_rate +
                  {:#.9g}f * f;
  if (u != u) return 0; /* a reading that is no number */
  return fminf({:#.9g}f, fmaxf(-{:#.9g}f, u));
}}
#endif
)",
                     board.wheel_radius, board.leg_length, policy.h[0], policy.h[1], policy.h[2],
                     policy.h[3], policy.h[4], policy.most_torque, policy.most_torque);
}

}  // namespace traceur::bias
