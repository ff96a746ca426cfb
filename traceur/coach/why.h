// Why a script was not learned, and what to say instead.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/coach/lesson.h"

namespace traceur::coach {

/// What is wrong with a script, as a coach would call it.
enum class Fault {
  kUnknown,
  kTooWeak,        ///< what is asked for is reached, and does not do
  kTooStrong,      ///< likewise
  kTooLate,        ///< a phase ends, or comes to its pose, too late
  kTooEarly,       ///< likewise
  kSlips,          ///< what bears the body slides
  kOutOfReach,     ///< the body cannot do what is asked for
  kContradiction,  ///< two instructions oppose each other
};
std::string_view nameOf(Fault fault);  ///< "too weak"

/// Other words for a part of a script, or words more.
struct Remedy {
  Fault against = Fault::kUnknown;
  std::string phase;  ///< that it is said in; "scene" for what is around
  Said instead_of;    ///< line 0: it is said besides
  std::string say;    ///< empty: it is left out
  size_t from = 0;    ///< the first phase that it changes, from 0
  double rank = 0;    ///< the lower the likelier
};

struct Why {
  std::string what;   ///< "hands touch 0.03 s into landing, the trunk leaning 85 deg forward"
  std::string often;  ///< "152 of 192 trials failed: 120 touches, 32 hops"
  Fault seen = Fault::kUnknown;  ///< what the trials show, or the script
  std::string because;           ///< "the feet slid 0.31 m in thrusting"; empty: nothing is seen
  size_t failed = 0;             ///< the phase, from 0
  std::vector<Remedy> remedies;  ///< the likeliest first; none has been tried
};

/// From the best trial of the phase that failed, from how its trials failed, from what the phases
/// before it came to, and from the script.
/// @param lesson  whose last phase failed
Why why(const Script& script, const Lesson& lesson);

/// "try: "SPEED NEAR [1.2, 2.4, 0]" in thrusting, instead of "SPEED NEAR [0.6, 1.2, 0]""
std::string told(const Remedy& remedy);

/// The script with it.
/// @throws InputError where it cannot be said
Script withRemedy(const Script& script, const Remedy& remedy);

/// A remedy that has been tried.
struct Helps {
  Remedy remedy;
  size_t learned = 0;  ///< phases, of the script with it
  bool all = false;    ///< of them, and then all of it succeeds
};

/// The first of the remedies, in their order, with which practice learns the script and all of it
/// succeeds, practised as before with the same seed; else the first of those that get furthest, if
/// beyond the phase that failed; nothing: none does.
/// @param folder   of the lesson; it is left as it was
/// @param why      of the lesson
/// @param most     so many are tried at most
/// @param on_try   before each
/// Equal lessons give equal answers, for any number of threads.
std::optional<Helps> whatHelps(const Script& script, const std::filesystem::path& folder,
                               const Why& why, const LessonOptions& options, int most,
                               const std::function<void(const Remedy&)>& on_try = {});

}  // namespace traceur::coach
