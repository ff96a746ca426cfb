// What a person lets happen to a falling body: another ground, a box in its way, a push, a cannon.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "traceur/skill/rollout.h"

namespace traceur::cli {

/// Where a fall begins, as far as it decides where a box stands.
struct Starting {
  double height = 0;           ///< of the COM [m]
  double forward = 0, up = 0;  ///< velocity [m/s]
  std::uint64_t seed = 1;      ///< of noise
};

class Mishaps {
 public:
  /// The name of the box's body.
  static constexpr const char* kBox = "box";

  /// The options of a verb that say them.
  void addTo(CLI::App& verb);

  /// The box that it comes down on before the ground.
  struct Box {
    double height = 0;  ///< of its top [m]
    double length = 0, width = 0;
    double aim = 0;    ///< where the feet should come down on it, forward from the start
    double front = 0;  ///< its front edge's distance from there [m]
  };
  /// @throws InputError for what is not NAME=VALUE, here and below
  std::optional<Box> box(const Starting& start) const;
  skill::Disturbance changes(const Starting& start) const;
  /// @param model  of a skill with those changes
  skill::Meddling meddling(const sim::Model& model) const;

 private:
  std::optional<double> time_step_, compliance_, friction_;
  std::string surface_;
  std::vector<std::string> push_, cannon_, drag_, onto_, perturb_;  // NAME=VALUE each
};

}  // namespace traceur::cli
