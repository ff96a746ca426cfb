// Files that tests write, the robots in them, and what is said of them.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "traceur/core/test_folder.h"
#include "traceur/sim/robot.h"

namespace traceur::sim {

/// Writes a file among those of this process's tests.
/// @return its path
inline std::string file(const std::string& name, const std::string& bytes) {
  static const TestFolder kFolder;
  std::filesystem::create_directories((kFolder / name).parent_path());
  std::ofstream(kFolder / name, std::ios::binary) << bytes;
  return kFolder / name;
}

inline std::shared_ptr<const Robot> robotOf(const std::string& path) {
  return std::make_shared<const Robot>(Robot::fromFile(path));
}

inline void expectIn(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text << "\nlacks " << part;
}

}  // namespace traceur::sim
