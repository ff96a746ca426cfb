// States of optimisers as someone who means harm would write them: the fingerprint is right.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

#include "traceur/core/hash.h"
#include "traceur/optim/optimizer.h"

namespace traceur::optim {

/// Gives a state (traceur/optim/state.h) the fingerprint of what it now holds, and before that the
/// states of other optimisers inside it theirs. Other bytes stay as they are.
inline void fingerprintAnew(std::string& bytes, size_t begin, size_t end) {
  static constexpr std::string_view kMagic = "TRCROPT\n";
  static constexpr size_t kWord = sizeof(std::uint64_t);
  if (end - begin < kMagic.size() + kWord) return;
  if (std::string_view(bytes).substr(begin, kMagic.size()) != kMagic) return;
  for (size_t at = bytes.find(kMagic, begin + 1); at < end; at = bytes.find(kMagic, at + 1)) {
    std::uint64_t size = 0;  // of the inner state stands before it
    if (at >= begin + kMagic.size() + kWord) std::memcpy(&size, bytes.data() + at - kWord, kWord);
    if (at + kWord <= end && size <= end - kWord - at) fingerprintAnew(bytes, at, at + size);
  }
  Hash hash;
  hash.add(std::string_view(bytes).substr(begin, end - kWord - begin));
  const std::uint64_t value = hash.value();
  std::memcpy(bytes.data() + end - kWord, &value, kWord);
}

inline void fingerprintAnew(std::string& bytes) {
  fingerprintAnew(bytes, 0, bytes.size());
}

/// What a word of a state is replaced by: numbers at which loops, sums and casts go wrong.
inline const std::uint64_t kBadWords[] = {
    0,
    1,
    3,
    std::uint64_t{1} << 31,
    std::uint64_t{1} << 32,
    std::uint64_t{1} << 62,
    std::uint64_t{1} << 63,
    UINT64_MAX,
    0x7ff8000000000000,  // NaN
    0x7ff0000000000000,  // ∞
    0xfff0000000000000,  // -∞
    0xbff0000000000000,  // -1.0
    0x7fefffffffffffff,  // the largest double
    0x0000000000000001,  // the smallest, 1 as an integer
};

/// A state whose eight bytes from `at` read otherwise. Texts of any length in it mean that words
/// need not lie at multiples of eight.
inline std::string withWord(std::string state, size_t at, std::uint64_t word) {
  std::memcpy(state.data() + at, &word, sizeof word);
  fingerprintAnew(state);
  return state;
}

/// Asks for and tells some generations, as a search does that goes on from such a state.
inline void tryGenerations(Optimizer& optimizer, const Problem& problem, int generations) {
  static constexpr size_t kEnough = 2000;  // candidates, of a population someone made huge
  for (int g = 0; g < generations; ++g) {
    const std::vector<Candidate> candidates = optimizer.ask();
    if (candidates.size() > kEnough) return;
    for (const Candidate& c : candidates) optimizer.tell(c.id, problem.evaluate(c.x));
    static_cast<void>(optimizer.stopped());
    static_cast<void>(optimizer.achieved());
  }
  static_cast<void>(optimizer.save());
}

}  // namespace traceur::optim
