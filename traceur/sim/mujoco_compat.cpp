#include "traceur/sim/mujoco_compat.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <memory>
#include <mutex>

#include "traceur/core/error.h"
#include "traceur/core/guarded.h"
#include "traceur/core/toml.h"

namespace traceur::sim {
namespace {

constexpr const char* kName = "scene.xml";

// MuJoCo keeps the last parsed document in a global.
std::mutex& parserMutex() {
  static std::mutex mutex;
  return mutex;
}

// Whether this thread has the parser for itself.
thread_local bool alone = false;

// Structures of another version have other layouts.
void requireOurMujoco() {
  if (mj_version() == mjVERSION_HEADER) return;
  throw SystemError("MuJoCo " + std::string(mj_versionString()) + " is loaded, expected version " +
                    std::to_string(mjVERSION_HEADER) + ", with which Traceur was built");
}

/// One file in memory, for the engine to read.
class MemoryFile {
 public:
  MemoryFile(const char* name, std::string_view bytes) : vfs_(std::make_unique<mjVFS>()) {
    mj_defaultVFS(vfs_.get());
    const int size = static_cast<int>(bytes.size());
#if mjVERSION_HEADER < 300
    mj_makeEmptyFileVFS(vfs_.get(), name, size);
    std::memcpy(vfs_->filedata[mj_findFileVFS(vfs_.get(), name)], bytes.data(), bytes.size());
#else
    mj_addBufferVFS(vfs_.get(), name, bytes.data(), size);
#endif
  }
  ~MemoryFile() {
    mj_deleteVFS(vfs_.get());
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  const mjVFS* get() const {
    return vfs_.get();
  }

 private:
  std::unique_ptr<mjVFS> vfs_;
};

mjModel* load(const std::string& text, std::string& error) {
  requireOurMujoco();
  quietMujoco();
  const MemoryFile file(kName, text);
  char message[1024] = "";
  mjModel* model = mj_loadXML(kName, file.get(), message, sizeof message);
  error = message;
  return model;
}

std::unique_lock<std::mutex> parserLock() {
  return alone ? std::unique_lock<std::mutex>() : std::unique_lock(parserMutex());
}

}  // namespace

mjModel* loadXmlText(const std::string& text, std::string& error) {
  const auto lock = parserLock();
  return load(text, error);
}

std::string compiledApart(std::string_view what, const std::function<std::string()>& work) {
  const std::lock_guard lock(parserMutex());
  return guarded(what, [&] {
    struct Alone {
      Alone() { alone = true; }
      ~Alone() { alone = false; }
    } while_it_works;
    return work();
  });
}

std::string toBytes(const mjModel& model) {
  std::string bytes(mj_sizeModel(&model), '\0');
  mj_saveModel(&model, nullptr, bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

ModelPointer toModel(std::string_view bytes) {
  static constexpr const char* kBinary = "scene.mjb";
  requireOurMujoco();
  quietMujoco();
  const MemoryFile file(kBinary, bytes);
  return {mj_loadModel(kBinary, file.get()), mj_deleteModel};
}

std::string urdfToMjcf(const std::string& urdf, std::string& error) {
  const auto lock = parserLock();
  const ModelPointer model(load(urdf, error), mj_deleteModel);
  if (!model) return {};
  // MuJoCo writes to files only.
  const int memory = memfd_create("mjcf", MFD_CLOEXEC);
  const std::string path = "/proc/self/fd/" + std::to_string(memory);
  char message[1024] = "";
  std::string mjcf;
  if (mj_saveLastXML(path.c_str(), model.get(), message, sizeof message) != 0) {
    mjcf = readFile(path);
  } else {
    error = message;
  }
  close(memory);
  return mjcf;
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
    mju_user_error = failGuarded;
    return true;
  }();
  (void)kDone;
}

}  // namespace traceur::sim
