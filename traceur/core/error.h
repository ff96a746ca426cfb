// Three kinds of wrong, three answers: our own bug asserts; the caller's input throws InputError;
// a trial that fails is an ordinary value (optim::Evaluation, skill::Rollout).
#pragma once

#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace traceur {

/// A mistake and where it is.
struct Mistake {
  std::string file;  ///< as it is named to a person
  int line = 0;      ///< from 1; 0: the file as a whole
  int column = 0;    ///< from 1, in bytes; 0 likewise
  std::string text;  ///< what is wrong there
};

/// What the caller gave cannot be used. The message says what, expected, got and where, and is
/// complete as it stands: a program prints it and exits.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  InputError(const std::string& message, std::vector<Mistake> mistakes)
      : std::runtime_error(message),
        mistakes_(std::make_shared<const std::vector<Mistake>>(std::move(mistakes))) {}

  /// In a text that a person wrote: each by itself, as an editor marks it, in the order of the
  /// text. The message says them all. Empty for other errors.
  std::span<const Mistake> mistakes() const {
    return mistakes_ ? std::span<const Mistake>(*mistakes_) : std::span<const Mistake>();
  }

 private:
  std::shared_ptr<const std::vector<Mistake>>
      mistakes_;  // shared: an exception's copy may not throw
};

/// The machine refused: no space, no permission, a missing program, no off-screen context.
class SystemError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Collects every mistake of a text a person wrote, so that one reading reports all, up to 100.
class Diagnostics {
 public:
  explicit Diagnostics(std::string file) : files_{{std::move(file), 0}} {}

  /// Lines beyond this one are another file's, counted on; files in the order of their lines.
  void goesOn(std::string file, int after_line);
  /// The file that a line is of.
  const std::string& fileOf(int line) const { return placeOf(line).file; }

  /// Line and column count from 1; line 0 means the file as a whole. The same again is kept once.
  void add(int line, int column, std::string_view message);
  bool empty() const { return mistakes_.empty(); }

  /// Throws one InputError listing all mistakes in the order of the text, or returns if none.
  void throwIfAny() const;

 private:
  struct File {
    std::string file;
    int after_line = 0;
  };
  const File& placeOf(int line) const;

  std::vector<File> files_;
  std::vector<Mistake> mistakes_;
};

}  // namespace traceur
