#include "apps/cli/interrupt.h"

#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <ctime>

#include "apps/cli/output.h"
#include "apps/cli/verbs.h"

namespace traceur::cli {

Interrupt::Interrupt() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  struct sigaction hang_up = {};
  // A signal that is waited for comes even when it is ignored.
  if (sigaction(SIGHUP, nullptr, &hang_up) == 0 && hang_up.sa_handler != SIG_IGN) {
    sigaddset(&signals, SIGHUP);
  }
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  waiter_ = std::jthread([this, signals](const std::stop_token& done) {
    const timespec pause{0, 100'000'000};
    while (!done.stop_requested()) {
      if (sigtimedwait(&signals, nullptr, &pause) < 0) continue;
      if (!heeded_ || source_.stop_requested()) _exit(kInterrupted);
      source_.request_stop();
      note("\nstopping after what is under way …\n");
    }
  });
}

}  // namespace traceur::cli
