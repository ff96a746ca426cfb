#include "traceur/skill/skill.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cstdlib>

#include "traceur/core/is_file.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/skill/skill_reader.h"

namespace traceur::skill {
namespace {

namespace fs = std::filesystem;

/// Where the installed program's data are; set by CMake.
#ifndef TRACEUR_INSTALLED_DATA
#define TRACEUR_INSTALLED_DATA ""
#endif
/// The same from where the program is, as the installation may have been moved; set by CMake.
#ifndef TRACEUR_DATA_FROM_PROGRAM
#define TRACEUR_DATA_FROM_PROGRAM ""
#endif

/// Where models/ and skills/ may lie.
std::vector<fs::path> dataFolders(const fs::path& beside) {
  std::vector<fs::path> folders;
  // "jump.toml" lies beside nothing: in the working folder.
  for (fs::path dir = fs::absolute(beside.empty() ? "." : beside).lexically_normal();
       dir.has_relative_path(); dir = dir.parent_path()) {
    folders.push_back(dir);
  }
  if (const char* data = std::getenv("TRACEUR_DATA")) folders.emplace_back(data);
  folders.push_back(fs::current_path());
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (const std::string_view way = TRACEUR_DATA_FROM_PROGRAM; !error && !way.empty()) {
    folders.push_back((program.parent_path() / way).lexically_normal());
  }
  folders.emplace_back(TRACEUR_INSTALLED_DATA);
  return folders;
}

std::vector<fs::path> modelFolders(const fs::path& beside) {
  std::vector<fs::path> folders = dataFolders(beside);
  for (fs::path& folder : folders) folder /= "models";
  return folders;
}

}  // namespace

VectorXd Skill::initialConditions() const {
  return initialOf(conditions);
}

VectorXd Skill::conditionsWith(
    const std::vector<std::pair<std::string_view, double>>& numbers) const {
  VectorXd x = initialConditions();
  for (const auto& [condition, value] : numbers) {
    const auto found = std::ranges::find(conditions, condition, &ParamSpec::name);
    assert(found != conditions.end());
    x[found - conditions.begin()] = value;
  }
  return x;
}

VectorXd Skill::initialParameters() const {
  VectorXd x(parameters.size());
  for (size_t i = 0; i < parameters.size(); ++i) {
    x[static_cast<Eigen::Index>(i)] = parameters[i].initial;
  }
  return x;
}

std::vector<std::string> Skill::phaseNames() const {
  std::vector<std::string> names;
  for (const Phase& p : phases) names.push_back(p.name);
  for (const Part& part : parts) {
    for (const std::string& phase : part.skill->phaseNames()) {
      names.push_back(part.name + "." + phase);
    }
  }
  return names;
}

std::vector<std::string> Skill::stageNames() const {
  std::vector<std::string> names = phaseNames();
  for (const Part& part : parts) names.push_back(part.name);
  return names;
}

std::shared_ptr<const Skill> Skill::fromFile(const fs::path& file) {
  return fromText(readFile(file), file);
}

std::shared_ptr<const Skill> Skill::fromText(const std::string& text, const fs::path& file,
                                             const Disturbance& disturbance) {
  return readSkill(text, file, disturbance);
}

fs::path findSkill(const std::string& robot, const std::string& name) {
  std::vector<std::string> looked;
  for (const fs::path& folder : dataFolders({})) {
    fs::path file = folder / "skills" / robot / (name + ".toml");
    if (isFile(file)) return file;
    looked.push_back(file.parent_path().string());
  }
  throw InputError(fmt::format("no skill \"{}\" of {}: looked in {}", name, robot, join(looked)));
}

fs::path findRobot(const std::string& name, const fs::path& beside) {
  for (const fs::path& path : {beside / name, fs::path(name)}) {
    if (isFile(path)) return path;
  }
  std::vector<std::string> names;
  for (const fs::path& folder : modelFolders(beside)) {
    if (isFile(folder / name / "robot.toml")) return folder / name / "robot.toml";
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
      if (isFile(entry.path() / "robot.toml")) {
        names.push_back(entry.path().filename().string());
      }
    }
  }
  if (names.empty()) {
    std::vector<std::string> folders;
    for (const fs::path& folder : modelFolders(beside)) folders.push_back(folder.string());
    throw InputError(fmt::format("no robot \"{}\": no such file, and found no models/ in: {}", name,
                                 join(folders)));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  throw InputError(fmt::format("no robot \"{}\": neither a file nor one of: {}.{}", name,
                               join(names), didYouMean(name, names)));
}

}  // namespace traceur::skill
