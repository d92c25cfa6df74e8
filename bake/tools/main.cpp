// SPDX-License-Identifier: MIT
// `relume`: one binary, one subcommand a file (commands.h).
#include "bake/printed.h"
#include "bake/tools/commands.h"

#include <CLI/CLI.hpp>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>

namespace relume {

int fail(const Error& error) {
  std::fflush(stdout);
  std::fprintf(stderr, "relume: error: %s\n", error.message.c_str());
  return exitCode(error.code);
}

namespace {

// Packages may throw where nobody can catch it: oneTBB does when the system has no memory for its threads.
[[noreturn]] void endAfterUncaught() {
  const char* what = "unknown failure";
  std::string text;
  try {
    if (const std::exception_ptr current = std::current_exception()) std::rethrow_exception(current);
  } catch (const std::exception& e) {
    text = e.what();
    what = text.c_str();
  } catch (...) {
  }
  std::fprintf(stderr, "relume: error: %s\n", what);
  std::_Exit(exitCode(ErrorCode::failed));
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  using namespace relume;
  std::set_terminate(endAfterUncaught);
  useClassicLocale();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of the write, not the end of the program
  CLI::App app{"Relume bakes how light travels through a level, so that a game can relight it every frame.", "relume"};
  app.set_version_flag("--version", RELUME_VERSION);
  app.require_subcommand(0, 1);
  app.footer(
      "Exit status: 0 ok, 1 usage, 2 input/output, 3 invalid file, 4 failed, 5 unsupported, 7 difference found.");
  Action action;
  addBakeCommand(app, action);
  addBenchCommand(app, action);
  addInfoCommand(app, action);
  addValidateCommand(app, action);
  addCompareCommand(app, action);
  addStatusCommand(app, action);
  addRenderCommand(app, action);
  addReferenceCommand(app, action);
  addDiffCommand(app, action);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(e);  // --help, --version
    return fail({ErrorCode::usage, std::string(e.what()) + " (see relume --help)"});
  }

  if (!action) {
    std::string names;
    for (const CLI::App* command : app.get_subcommands({})) names += (names.empty() ? "" : ", ") + command->get_name();
    return fail({ErrorCode::usage, "a command is required: " + names + " (see relume --help)"});
  }

  // The last line of defence: room doors return errors, so only exhausted memory should arrive here.
  try {
    return action();
  } catch (const std::bad_alloc&) {
    return fail({ErrorCode::failed, "out of memory"});
  } catch (const std::exception& e) {
    return fail({ErrorCode::failed, e.what()});
  }
}
