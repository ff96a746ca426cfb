// A stranger's skeleton and motion: read, and where its joints are.
#include "traceur/clip/bvh.h"

#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace traceur;
  fuzz::maybeRefused([&] {
    const clip::Clip clip = clip::fromBvh(fuzz::textOf(data, size), "fuzzed.bvh");
    if (!clip.frames.empty()) clip.places(clip.frames.size() - 1);
    clip::toBvh(clip);
  });
  return 0;
}
