#include "traceur/sim/mujoco_compat.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <random>
#include <sstream>

#include "traceur/core/error.h"

namespace traceur::sim {
namespace {

constexpr const char* kName = "scene.xml";

// MuJoCo keeps the last parsed document in a global.
std::mutex& parserMutex() {
  static std::mutex mutex;
  return mutex;
}

// Structures of another version have other layouts.
void requireOurMujoco() {
  if (mj_version() == mjVERSION_HEADER) return;
  throw SystemError("MuJoCo " + std::string(mj_versionString()) + " is loaded, expected version " +
                    std::to_string(mjVERSION_HEADER) + ", with which Traceur was built");
}

mjModel* load(const std::string& text, std::string& error) {
  requireOurMujoco();
  quietMujoco();
  auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
#if mjVERSION_HEADER < 300
  mj_makeEmptyFileVFS(vfs.get(), kName, static_cast<int>(text.size()));
  // NOLINTNEXTLINE(bugprone-not-null-terminated-result): a file of that size
  std::memcpy(vfs->filedata[mj_findFileVFS(vfs.get(), kName)], text.data(), text.size());
#else
  mj_addBufferVFS(vfs.get(), kName, text.data(), static_cast<int>(text.size()));
#endif
  char message[1024] = "";
  mjModel* model = mj_loadXML(kName, vfs.get(), message, sizeof message);
  mj_deleteVFS(vfs.get());
  error = message;
  return model;
}

}  // namespace

mjModel* loadXmlText(const std::string& text, std::string& error) {
  const std::lock_guard lock(parserMutex());
  return load(text, error);
}

std::string urdfToMjcf(const std::string& urdf, std::string& error) {
  const std::lock_guard lock(parserMutex());
  mjModel* model = load(urdf, error);
  if (!model) return {};
  // MuJoCo writes to files only.
  const auto path = std::filesystem::temp_directory_path() /
                    ("traceur-" + std::to_string(std::random_device{}()) + ".xml");
  char message[1024] = "";
  const int saved = mj_saveLastXML(path.c_str(), model, message, sizeof message);
  mj_deleteModel(model);
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  if (!saved) error = message;
  return saved ? std::move(text).str() : std::string();
}

std::string sizeAttributes([[maybe_unused]] int contacts, [[maybe_unused]] int rows) {
#if mjVERSION_HEADER < 300
  // 2.2 sizes its constraint arrays ahead and clears them each step: 1000 rows would cost a third
  // of the step, and a humanoid lying on the ground needs fewer than 200.
  return "njmax=\"" + std::to_string(400 + contacts * rows) + "\" nconmax=\"" +
         std::to_string(100 + contacts) + '"';
#else
  return "";
#endif
}

void quietMujoco() {
  static const bool kDone = [] {
    mju_user_warning = [](const char*) {};
    return true;
  }();
  (void)kDone;
}

}  // namespace traceur::sim
