// From a skill file's text to a Skill.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "traceur/skill/skill.h"

namespace traceur::skill {

/// @param file  named in messages; says where the robot and other skills are looked for
/// @throws InputError listing every mistake with line and column
std::shared_ptr<const Skill> readSkill(const std::string& text, const std::filesystem::path& file,
                                       const Disturbance& disturbance);

}  // namespace traceur::skill
