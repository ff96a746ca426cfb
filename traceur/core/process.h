// Another program, run without a shell, fed through its standard input and, if wanted, heard.
#pragma once

#include <chrono>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "traceur/core/error.h"

namespace traceur {

/// Life of a process:
///   1. The constructor starts argv[0], looked up on PATH, in a process group of its own.
///   2. write() as often as needed; it waits while the program is busy. Of one that talks, also
///      readLine().
///   3. finish() closes the input and waits for the end. Without it the destructor kills.
/// The program never outlives us, however we end, kill -9 included, nor do the programs that it
/// started, whatever group or session they moved to: between us and it stands a small process, the
/// keeper, which ends them all when the program or we end.
/// All throw SystemError with the program's name and its own words (its standard error).
class Process {
 public:
  enum class Output {
    kDropped,  ///< nobody reads its standard output; its standard error becomes part of messages
    kTalk      ///< readLine() reads its standard output; its standard error is ours
  };
  /// It ended, or closed its input or output, where it was still needed.
  class Ended : public SystemError {
   public:
    using SystemError::SystemError;
  };
  /// A wait was given up, see heed(). Of the program nothing is known any more.
  class GivenUp : public SystemError {
   public:
    using SystemError::SystemError;
  };

  /// The longest line of an answer [bytes, ours].
  static constexpr size_t kMostLine = size_t{1} << 20;

  /// @param hidden  environment variables whose names begin so are kept from it; "": none
  explicit Process(const std::vector<std::string>& argv, Output output = Output::kDropped,
                   std::string_view hidden = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// From now on every wait for the program ends with GivenUp so many seconds after the request.
  void heed(std::stop_token stop, double grace);

  /// @throws Ended when the program reads no more
  void write(std::string_view bytes);
  /// Whether it has said more than was read: an answer nobody asked for.
  bool hasMore();
  /// Waits for the next line of a program that talks, without its end; "\r\n" ends one, too.
  /// @throws Ended when the program ends first; SystemError for a line longer than kMostLine
  std::string readLine();
  /// Whether a line, or the program's end, comes within so many seconds.
  /// @throws SystemError for a line longer than kMostLine
  bool answersWithin(double seconds);
  /// @return what the program said on standard error though it succeeded
  /// @throws Ended when it failed
  std::string finish();

 private:
  using Clock = std::chrono::steady_clock;

  bool ready(int fd, short events, Clock::time_point until);
  bool hear(Clock::time_point until);
  [[noreturn]] void missing(const std::string& why);
  void closeInput();
  int wait();
  std::string words() const;

  std::string name_;
  pid_t keeper_ = -1;
  std::string heard_;    // of its standard output, not handed out yet
  bool silent_ = false;  // its standard output is closed
  int input_ = -1;       // our end of a socket pair: send() can be told not to raise SIGPIPE
  int words_ = -1;       // an unnamed file in memory, so that a talkative program never blocks
  int life_ = -1;        // our end of the keeper's socket pair: each sees when the other ends
  std::stop_token stop_;
  Clock::duration grace_{};
  std::optional<Clock::time_point> patience_;  // until then, once asked to stop
};

}  // namespace traceur
