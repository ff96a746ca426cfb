// Ctrl-C as a request, not an end.
#pragma once

#include <atomic>
#include <stop_token>
#include <thread>

namespace traceur::cli {

/// While one lives, a first SIGINT, SIGTERM or SIGHUP asks the token to stop, and a second ends the
/// program at once. So does the first while nobody heeds it: before the token was handed out, as
/// while files are read, and after release(). Make it before any other thread: they inherit the
/// blocked signals. A SIGHUP that was ignored when we began, as under nohup, stays ignored.
class Interrupt {
 public:
  Interrupt();
  /// Whoever takes it looks at it often, and from then on is given the time to end by himself.
  std::stop_token token() {
    heeded_ = true;
    return source_.get_token();
  }
  bool asked() const { return source_.stop_requested(); }
  /// What follows looks at no token.
  void release() { heeded_ = false; }

 private:
  std::stop_source source_;
  std::atomic<bool> heeded_ = false;
  std::jthread waiter_;
};

}  // namespace traceur::cli
