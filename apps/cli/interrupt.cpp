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
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  waiter_ = std::jthread([this, signals](const std::stop_token& done) {
    const timespec pause{0, 100'000'000};
    while (!done.stop_requested()) {
      if (sigtimedwait(&signals, nullptr, &pause) < 0) continue;
      if (source_.stop_requested()) _exit(kInterrupted);
      note("\nstopping after what is under way …\n");
      source_.request_stop();
    }
  });
}

}  // namespace traceur::cli
