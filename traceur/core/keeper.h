// The process between us and a program that we start: it ends the program when we end.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace traceur {

/// What a program is started with.
struct Launch {
  std::vector<std::string> argv;  ///< argv[0] is looked up on PATH
  int input = -1;                 ///< becomes its standard input
  int output = -1;                ///< likewise; -1: /dev/null
  int error = -1;                 ///< likewise; -1: ours
  /// Environment variables whose names begin so are kept from it; "": none.
  std::string_view hidden = {};
};

/// A keeper is a child that waits for the end of its program or of us, whichever is first, and then
/// kills all that came of the program: its process group, and, as their adopter
/// (PR_SET_CHILD_SUBREAPER), those that left it. It ends as the program ended: with the same exit
/// code, or by the same signal. No signal but SIGKILL reaches it, and no file of ours stays open in
/// it. The program starts with no signal blocked.
struct Keeper {
  pid_t pid = -1;
  int life = -1;  ///< closing it, as our end does, makes the keeper end; its end can be polled for
  int error = 0;  ///< why the program could not be started (errno); 0: it was, the rest is valid
};

Keeper startKept(const Launch& launch);

}  // namespace traceur
