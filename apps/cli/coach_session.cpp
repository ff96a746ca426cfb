#include "apps/cli/coach_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <istream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/cli/output.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/printable.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHelp =
    "  PHASE: INSTRUCTION   as \"landing: bend your knees a bit more\"; the phase is kept\n"
    "  undo, redo           the last instruction\n"
    "  branch NAME          keeps what there is now under a name\n"
    "  switch NAME          goes back to it; undo comes back\n"
    "  compare NAME NAME    two of them, phase by phase and in one picture; \"now\" is this one\n"
    "  why                  why a phase was not learned; tries what may help, and tells what does\n"
    "  show                 the script\n"
    "  save FILE            the script, elsewhere\n"
    "  quit\n";

class Session {
 public:
  Session(const coach::Script& script, fs::path folder, const SessionHooks& hooks)
      : hooks_(hooks), folder_(std::move(folder)), file_(script.file), texts_{script.text} {}

  int run(std::istream& in) {
    practise(read());
    prompt();
    for (std::string line; std::getline(in, line); prompt()) {
      if (line == "quit" || line == "exit") break;
      try {
        obey(line);
      } catch (const InputError& e) {
        note("{}\n", e.what());  // and nothing has changed
      }
      if (lesson_.interrupted) return kInterrupted;
    }
    print("\n");
    return lesson_.whole.empty() || lesson_.failed ? kNotReached : kDone;
  }

 private:
  static void prompt() {
    print("> ");
    flushResults();
  }
  coach::Script read() const { return coach::Script::fromText(texts_[at_], file_); }

  void obey(const std::string& line) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) return;
    if (line == "help" || line == "?") return print("{}", kHelp);
    if (line == "why") return why();
    if (line == "show") return writeResult(printableLines(texts_[at_]));
    if (line == "undo" || line == "redo") return step(line == "undo" ? -1 : 1);
    if (line.starts_with("save ")) return save(line.substr(5));
    const std::vector<std::string> words = wordsOf(line);
    if (words[0] == "branch" && words.size() == 2) return branch(words[1]);
    if (words[0] == "switch" && words.size() == 2) return goTo(words[1]);
    if (words[0] == "compare" && words.size() == 3) {
      const std::pair one{words[1], kept(words[1])};
      const std::pair other{words[2], kept(words[2])};
      fs::create_directories(branches());  // where their picture goes
      return hooks_.compare(one, other);
    }
    for (const char* command : {"branch NAME", "switch NAME", "compare NAME NAME", "save FILE"}) {
      if (std::string_view(command).starts_with(line + " ")) {
        throw InputError(fmt::format("\"{}\": expected \"{}\"", line, command));
      }
    }
    instruct(line);
  }
  void why() {
    const auto& phases = lesson_.phases;
    if (phases.empty() || !phases.back().failed) return print("nothing failed\n");
    const coach::Why w = coach::why(read(), lesson_);
    print("{}\n{}\n", printable(w.what), w.often);
    if (!w.because.empty()) print("{}\n", printable(w.because));
    flushResults();
    hooks_.help(read(), w);
  }
  void step(int by) {
    if ((by < 0 && at_ == 0) || (by > 0 && at_ + 1 >= texts_.size())) {
      return print("there is nothing to {}\n", by < 0 ? "undo" : "redo");
    }
    at_ = by < 0 ? at_ - 1 : at_ + 1;
    restore();
    practise(read(), false);  // all of it is there, and so is its film strip
  }
  /// What the folder held after the instruction that is the last one now.
  fs::path history() const { return folder_ / "history" / std::to_string(at_); }
  static void copyFiles(const fs::path& from, const fs::path& to) {
    fs::create_directories(to);
    for (const auto& entry : fs::directory_iterator(to)) {
      if (entry.is_regular_file()) fs::remove(entry.path());
    }
    for (const auto& entry : fs::directory_iterator(from)) {
      if (entry.is_regular_file()) fs::copy_file(entry.path(), to / entry.path().filename());
    }
  }
  void restore() { copyFiles(history(), folder_); }

  static std::vector<std::string> wordsOf(const std::string& line) {
    std::vector<std::string> words;
    for (std::string& word : split(line, ' ')) {
      if (!word.empty()) words.push_back(std::move(word));
    }
    return words;
  }
  fs::path branches() const { return folder_ / "branches"; }
  /// Where a branch is kept.
  fs::path kept(const std::string& name) const {
    if (name == "now") return folder_;
    std::vector<std::string> names{"now"};
    if (fs::exists(branches())) {
      for (const auto& entry : fs::directory_iterator(branches())) {
        if (entry.is_directory()) names.push_back(entry.path().filename().string());
      }
    }
    std::ranges::sort(names);
    if (std::ranges::find(names, name) != names.end()) return branches() / name;
    throw InputError(fmt::format("no branch \"{}\": expected one of {}.{}", name, join(names),
                                 didYouMean(name, names)));
  }
  void branch(const std::string& name) {
    if (name == "now" || fileNamePart(name) != name || name.starts_with('.')) {
      throw InputError(fmt::format(
          "\"{}\" is no name of a branch: expected letters, digits, '-' and '_', and not \"now\"",
          name));
    }
    if (fs::exists(branches() / name)) {
      throw InputError(fmt::format("there is a branch \"{}\" already", name));
    }
    copyFiles(folder_, branches() / name);
    print("kept as {}\n", name);
  }
  void goTo(const std::string& name) {
    const fs::path from = kept(name);
    if (name == "now") return;
    texts_.resize(at_ + 1);
    texts_.push_back(readFile(from / "script.coach"));
    ++at_;
    copyFiles(from, folder_);
    practise(read(), false);  // all of it is there
  }
  /// The script for a terminal, line by line.
  static std::string printableLines(const std::string& text) {
    std::string out;
    for (const std::string& line : split(text, '\n')) out += printable(line) + "\n";
    return out;
  }
  void save(const std::string& to) {
    PendingFile out(to);
    out.write(texts_[at_]);
    out.commit();
    print("saved in {}\n", to);
  }
  void instruct(const std::string& line) {
    std::string said = line;
    if (const size_t colon = line.find(':'); colon != std::string::npos) {
      phase_ = line.substr(0, colon);
      said = line.substr(colon + 1);
    }
    const size_t first = said.find_first_not_of(" \t");
    if (first != std::string::npos)
      said = said.substr(first, said.find_last_not_of(" \t\r") - first + 1);
    if (phase_.empty()) {
      throw InputError("in which phase? As \"landing: bend your knees a bit more\"");
    }
    const std::string text = coach::withLine(texts_[at_], phase_, said);
    const coach::Script script = coach::Script::fromText(text, file_);  // or it is no instruction
    for (const coach::Phase& p : script.phases) {
      if (p.name != lowered(phase_)) continue;
      const auto asked = std::ranges::find(p.instructions, said, &coach::Instruction::said);
      if (asked != p.instructions.end()) print("understood: {}\n", asked->means);
    }
    texts_.resize(at_ + 1);
    texts_.push_back(text);
    ++at_;
    practise(script);
  }
  static std::string lowered(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
  }
  void practise(const coach::Script& script, bool draws = true) {
    lesson_ = hooks_.practise(script);
    PendingFile out(folder_ / "script.coach");
    out.write(script.text);
    out.commit();
    hooks_.report(lesson_, script);
    if (draws && !lesson_.whole.empty()) hooks_.draw(lesson_);
    copyFiles(folder_, history());
  }

  const SessionHooks& hooks_;
  fs::path folder_, file_;
  std::vector<std::string> texts_;  // the script after each instruction
  size_t at_ = 0;
  std::string phase_;
  coach::Lesson lesson_;
};

}  // namespace

int runSession(const coach::Script& script, const fs::path& folder, std::istream& in,
               const SessionHooks& hooks) {
  return Session(script, folder, hooks).run(in);
}

}  // namespace traceur::cli
