// A recording's bytes: what is accepted says the same once written, and can be looked at.
#include "traceur/sim/recording.h"

#include <cstdlib>

#include "tests/fuzz/fuzz.h"
#include "traceur/render/motion.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace traceur;
  static const auto model = sim::Model::fromMjcf(
      "<mujoco><worldbody><body><freejoint/><geom size='.1'/><body><joint/><geom size='.1'/>"
      "</body></body></worldbody></mujoco>");
  const std::string_view bytes = fuzz::textOf(data, size);
  fuzz::maybeRefused([&] {
    const sim::Recording r = sim::Recording::decode(bytes);
    if (sim::Recording::decode(r.encode()).encode() != r.encode()) std::abort();
    render::checkRecording(*model, r);
    render::phaseStarts(r);
    for (const double t : render::tellingTimes(*model, r, 5)) render::frameAt(*model, r, t);
  });
  return 0;
}
