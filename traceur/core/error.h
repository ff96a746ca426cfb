// Three kinds of wrong, three answers: our own bug asserts; the caller's input throws InputError;
// a trial that fails is an ordinary value (optim::Evaluation, skill::Rollout).
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace traceur {

/// What the caller gave cannot be used. The message says what, expected, got and where, and is
/// complete as it stands: a program prints it and exits.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The machine refused: no space, no permission, a missing program, no off-screen context.
class SystemError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Collects every mistake of a text a person wrote, so that one reading reports all, up to 100.
class Diagnostics {
 public:
  explicit Diagnostics(std::string file) : file_(std::move(file)) {}

  /// Line and column count from 1; line 0 means the file as a whole. The same again is kept once.
  void add(int line, int column, std::string_view message);
  bool empty() const { return entries_.empty(); }

  /// Throws one InputError listing all mistakes in the order of the text, or returns if none.
  void throwIfAny() const;

 private:
  struct Entry {
    int line;
    int column;
    std::string message;
  };
  std::string file_;
  std::vector<Entry> entries_;
};

}  // namespace traceur
