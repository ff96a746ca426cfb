// What tests of skill files begin with.
#pragma once

#include <memory>
#include <string>

#include "traceur/core/error.h"
#include "traceur/skill/skill.h"

namespace traceur::skill {

/// A skill beside those of the BioloidGP.
inline std::shared_ptr<const Skill> fromText(const std::string& text) {
  return Skill::fromText(text, "skills/bioloid-gp/test.toml");
}

/// What reading a text says of it, or "accepted".
inline std::string mistakes(const std::string& text) {
  try {
    fromText(text);
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

}  // namespace traceur::skill
