// Ctrl-C as a request, not an end.
#pragma once

#include <stop_token>
#include <thread>

namespace traceur::cli {

/// While one lives, the first SIGINT or SIGTERM asks the token to stop and a second ends the
/// program at once. Make it before any other thread: they inherit the blocked signals.
class Interrupt {
 public:
  Interrupt();
  std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::jthread waiter_;
};

}  // namespace traceur::cli
