#include "traceur/sim/engine.h"

#include <csetjmp>
#include <mutex>

#include "traceur/core/error.h"
#include "traceur/core/guarded.h"

namespace traceur::sim {
namespace {

// The engine's parser changes and restores the process's locale.
std::mutex& parserMutex() {
  static std::mutex mutex;
  return mutex;
}

// Whether this thread has the parser for itself.
thread_local bool alone = false;

std::unique_lock<std::mutex> parserLock() {
  return alone ? std::unique_lock<std::mutex>() : std::unique_lock(parserMutex());
}

// Where an error of the engine leads on this thread; null: out of the program or guarded work.
thread_local std::jmp_buf* on_error = nullptr;

void leave(const char* words) {
  if (on_error) std::longjmp(*on_error, 1);
  failGuarded(words);
}

void requireEngine() {
  // Structures of another version have other layouts.
  if (mj_version() != mjVERSION_HEADER) {
    throw SystemError("MuJoCo " + std::string(mj_versionString()) +
                      " is loaded, expected version " + std::to_string(mjVERSION_HEADER) +
                      ", with which Traceur was built");
  }
  quietMujoco();
}

SpecPointer parsed(const std::function<mjSpec*(char*, int)>& parse, std::string& error) {
  requireEngine();
  const auto lock = parserLock();
  char message[1024] = "";
  SpecPointer spec(parse(message, sizeof message), mj_deleteSpec);
  error = message;
  return spec;
}

}  // namespace

SpecPointer parseFile(const std::filesystem::path& file, std::string& error) {
  return parsed(
      [&](char* message, int size) { return mj_parseXML(file.c_str(), nullptr, message, size); },
      error);
}

SpecPointer parseText(const std::string& text, std::string& error) {
  return parsed([&](char* message,
                    int size) { return mj_parseXMLString(text.c_str(), nullptr, message, size); },
                error);
}

ModelPointer compile(mjSpec& spec, std::string& error) {
  const auto lock = parserLock();
  ModelPointer model(mj_compile(&spec, nullptr), mj_deleteModel);
  if (!model) error = mjs_getError(&spec);
  return model;
}

ModelPointer compileText(const std::string& text, std::string& error) {
  const SpecPointer spec = parseText(text, error);
  return spec ? compile(*spec, error) : ModelPointer(nullptr, mj_deleteModel);
}

std::string toXml(const mjSpec& spec, std::string& error) {
  const auto lock = parserLock();
  char message[1024] = "";
  std::string text(1 << 16, '\0');
  int needed =
      mj_saveXMLString(&spec, text.data(), static_cast<int>(text.size()), message, sizeof message);
  if (needed > 0) {
    text.resize(needed + 1);
    needed = mj_saveXMLString(&spec, text.data(), static_cast<int>(text.size()), message,
                              sizeof message);
  }
  if (needed != 0) {
    error = message;
    return {};
  }
  text.resize(text.find('\0'));
  return text;
}

std::string compiledApart(std::string_view what, const std::function<std::string()>& work,
                          const GuardLimits& limits) {
  requireEngine();  // what it makes ready once, no copy of the process should be amid of
  const std::lock_guard lock(parserMutex());
  const auto while_alone = [&] {
    struct Alone {
      Alone() { alone = true; }
      ~Alone() { alone = false; }
    } while_it_works;
    return work();
  };
  return guarded(what, while_alone, limits);
}

std::string toBytes(const mjModel& model) {
  std::string bytes(mj_sizeModel(&model), '\0');
  mj_saveModel(&model, nullptr, bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

ModelPointer toModel(std::string_view bytes) {
  static constexpr const char* kName = "scene.mjb";
  requireEngine();
  const auto lock = parserLock();
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_addBufferVFS(files.get(), kName, bytes.data(), static_cast<int>(bytes.size()));
  ModelPointer model(mj_loadModel(kName, files.get()), mj_deleteModel);
  mj_deleteVFS(files.get());
  return model;
}

bool completes(void (*calls)(const mjModel*, mjData*), const mjModel* model, mjData* data) {
  std::jmp_buf here;
  if (setjmp(here) != 0) {  // NOLINT(cert-err52-cpp): C functions, through which nothing is thrown
    on_error = nullptr;
    return false;
  }
  on_error = &here;
  calls(model, data);
  on_error = nullptr;
  return true;
}

void quietMujoco() {
  static const bool kDone = [] {
    mju_user_warning = [](const char*) {};
    mju_user_error = leave;
    return true;
  }();
  (void)kDone;
}

}  // namespace traceur::sim
