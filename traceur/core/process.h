// Another program, run without a shell, fed through its standard input and, if wanted, heard.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace traceur {

/// Life of a process:
///   1. The constructor starts argv[0], looked up on PATH.
///   2. write() as often as needed; it waits while the program is busy. Of one that talks, also
///      readLine().
///   3. finish() closes the input and waits for the end. Without it the destructor kills.
/// All throw SystemError with the program's name and its own words (its standard error).
class Process {
 public:
  enum class Output {
    kDropped,  ///< nobody reads its standard output; its standard error becomes part of messages
    kTalk      ///< readLine() reads its standard output; its standard error is ours
  };

  /// @param hidden  environment variables whose names begin so are kept from it; "": none
  explicit Process(const std::vector<std::string>& argv, Output output = Output::kDropped,
                   std::string_view hidden = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void write(std::string_view bytes);
  /// Whether it has said more than was read: an answer nobody asked for.
  bool hasMore();
  /// Waits for the next line of a program that talks, without its end; "\r\n" ends one, too.
  /// @throws SystemError when the program ends first
  std::string readLine();
  /// Whether a line, or the program's end, comes within so many seconds.
  bool answersWithin(double seconds);
  /// @return what the program said on standard error though it succeeded
  std::string finish();

 private:
  void closeInput();
  int wait();
  std::string words() const;

  std::string name_;
  pid_t pid_ = -1;
  Output output_;
  std::string heard_;  // of its standard output, not handed out yet
  int input_ = -1;     // our end of a socket pair: send() can be told not to raise SIGPIPE
  int words_ = -1;     // an unnamed file in memory, so that a talkative program never blocks
};

}  // namespace traceur
