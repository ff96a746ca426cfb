#include "traceur/sim/surface.h"

#include <fmt/format.h>

#include "traceur/core/error.h"
#include "traceur/core/text.h"

namespace traceur::sim {

// A mass m on a spring of compliance T and damping ratio d swings with 1 / (T d) [rad/s]: who comes
// down with v sinks v T d deep [m], but for damping.
const std::vector<Surface>& surfaces() {
  static const std::vector<Surface> kSurfaces = {
      {"floor", "hard and dry", {.friction = 1, .compliance = 0.006}},
      // Of rubber on ice, .05 to .1 [ours].
      {"ice", "hard and slippery", {.friction = 0.06, .compliance = 0.006}},
      // At 7 m/s it gives 0.1 m: a mat of foam [ours].
      {"gym", "a soft mat", {.friction = 1, .compliance = 0.02}},
      // At 6 m/s it gives 0.6 m, and throws back two thirds of that speed [ours].
      {"trampoline",
       "gives far and throws back",
       {.friction = 0.9, .compliance = 1.1, .damping_ratio = 0.1}}};
  return kSurfaces;
}

const Surface& findSurface(const std::string& name) {
  std::vector<std::string> names;
  for (const Surface& s : surfaces()) {
    if (s.name == name) return s;
    names.push_back(s.name);
  }
  throw InputError(fmt::format("no surface named \"{}\".{} Known: {}", name,
                               didYouMean(name, names), join(names)));
}

}  // namespace traceur::sim
