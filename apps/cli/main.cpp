// The program `traceur`: one verb a job.
#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <sstream>
#include <string>
#include <vector>

#include "apps/cli/arguments.h"
#include "apps/cli/output.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/sim/model.h"

#ifdef __x86_64__
#include <unistd.h>

namespace {

/// The physics engine is built for AVX, and its first instructions of that kind run when it is
/// loaded: before main, after this.
void requireAvx() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx")) return;
  static constexpr char kWords[] =
      "traceur: this processor has no AVX instructions, which the physics engine needs: "
      "expected one of 2011 or later, or a virtual machine that passes them through\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, kWords, sizeof kWords - 1);
  _exit(1);
}

[[gnu::section(".preinit_array"), gnu::used]] void (*const kRequireAvx)() = requireAvx;

}  // namespace
#endif

namespace traceur::cli {
namespace {

int failWith(int code, const std::string& message) {
  complain(message);
  return code;
}

/// What CLI11 says of a wrong command line, with a suggestion for a mistyped option.
std::string explain(const CLI::App& program, const CLI::ParseError& error) {
  std::string message = error.what();
  const CLI::App* verb = &program;
  std::string path;
  while (!verb->get_subcommands().empty()) {  // "balance learn"
    verb = verb->get_subcommands().front();
    path += verb->get_name() + " ";
  }
  if (dynamic_cast<const CLI::ExtrasError*>(&error)) {
    std::vector<std::string> options;
    for (const CLI::Option* o : verb->get_options()) {
      for (const std::string& name : o->get_lnames()) options.push_back("--" + name);
    }
    for (const std::string& extra : verb->remaining(true)) message += didYouMean(extra, options);
  }
  if (dynamic_cast<const CLI::RequiredError*>(&error)) {
    std::vector<std::string> names;
    for (const CLI::App* v : verb->get_subcommands({})) names.push_back(v->get_name());
    std::string near;
    for (const std::string& extra : verb->remaining(true)) near += didYouMean(extra, names);
    if (!names.empty()) message += fmt::format(".{} There is: {}", near, join(names));
  }
  return fmt::format("{}\n       see: traceur {}--help", message, path);
}

int run(int argc, char** argv) {
  CLI::App program("Traceur teaches dynamic motor skills to virtual and real humanoids.",
                   "traceur");
  program.set_version_flag("--version",
                           fmt::format("traceur {} ({})", TRACEUR_VERSION, sim::engineVersion()));
  program.require_subcommand(1);
  program.get_formatter()->column_width(28);
  int exit_code = kDone;
  for (const AddVerb add : allVerbs()) add(program, exit_code);
  requirePlainNumbers(program);

  if (argc > 1 && argv[1][0] != '-') {
    std::vector<std::string> names;
    for (const CLI::App* v : program.get_subcommands({})) names.push_back(v->get_name());
    if (std::find(names.begin(), names.end(), argv[1]) == names.end()) {
      return failWith(kWrongUse, fmt::format("no verb \"{}\".{} Known: {}", argv[1],
                                             didYouMean(argv[1], names), join(names)));
    }
  }
  try {
    program.parse(argc, argv);
  } catch (const CLI::Success& e) {
    std::ostringstream asked;  // --help, --version
    const int code = program.exit(e, asked, asked);
    writeResult(asked.str());
    return code;
  } catch (const CLI::ParseError& e) {
    if (argc == 1) {
      writeResult(program.help());
      return kWrongUse;
    }
    return failWith(kWrongUse, explain(program, e));
  } catch (const OutputError&) {
    throw;
  } catch (const InputError& e) {
    return failWith(kWrongUse, e.what());
  } catch (const std::exception& e) {
    return failWith(kFailed, e.what());
  }
  return exit_code;
}

/// The same, and whether everything it printed has arrived.
int runAndFlush(int argc, char** argv) {
  openStandardDescriptors();
  try {
    const int code = run(argc, argv);
    flushResults();
    return code;
  } catch (const OutputError& e) {
    return failWith(kFailed, e.what());
  } catch (const BrokenPipe&) {
    endByBrokenPipe();
  }
}

}  // namespace
}  // namespace traceur::cli

int main(int argc, char** argv) {
  signal(SIGXFSZ, SIG_IGN);  // a file as large as it may be is an error like a full disk
  signal(SIGCHLD, SIG_DFL);  // were it ignored, no program would say how it ended
  return traceur::cli::runAndFlush(argc, argv);
}
