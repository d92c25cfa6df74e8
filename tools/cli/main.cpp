// SPDX-License-Identifier: MIT
// `relume`: one binary, one subcommand a file (commands.h).
#include "bake/base/printed.h"
#include "formats/chunks.h"
#include "relume/bake/provenance.h"
#include "tools/base/option_rules.h"
#include "tools/base/usage_message.h"
#include "tools/cli/commands.h"
#include "tools/cli/interrupt.h"
#include "tools/cli/terminal.h"

#include <CLI/CLI.hpp>

#include <fcntl.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

int fail(const Error& error) {
  std::fflush(stdout);
  if (interruptedBySignal() && !claimLastMessage()) return exitCode(error.code);
  std::fputs(lastMessage(error.message).c_str(), stderr);
  return exitCode(error.code);
}

namespace {

// What an exception means to who called the program. Exceptions of several types say that a thread cannot be started,
// all in the system's words.
std::string reasonOf(const std::exception& e) {
  if (std::string_view(e.what()).ends_with(std::strerror(EAGAIN)))
    return "a thread cannot be started: the system's limit is reached (ulimit -u), or there is no memory for it; give "
           "fewer with --threads, or raise the limit";
  return dynamic_cast<const std::bad_alloc*>(&e) != nullptr ? "out of memory" : e.what();
}

// Packages may throw where nobody can catch it: oneTBB does when the system has no memory for its threads.
[[noreturn]] void endAfterUncaught() {
  std::string reason = "unknown failure";
  try {
    if (const std::exception_ptr current = std::current_exception()) std::rethrow_exception(current);
  } catch (const std::exception& e) {
    reason = reasonOf(e);
  } catch (...) {
  }
  std::fputs(lastMessage(reason).c_str(), stderr);
  std::_Exit(exitCode(ErrorCode::failed));
}

// A stream that the caller has closed must not become the first file that is opened, which messages would then be
// written into. Standard output gets a descriptor that refuses writing, so that nothing is lost in silence.
bool holdStandardStreams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) != -1 || errno != EBADF) continue;
    if (::open("/dev/null", fd == STDERR_FILENO ? O_WRONLY : O_RDONLY) != fd) return false;
  }
  return true;
}

// What was printed must have arrived: a command whose result is lost has not done its work.
int withOutputFlushed(int status) {
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  const int reason = errno;
  if (flushed && std::ferror(stdout) == 0) return status;
  return fail({ErrorCode::io, std::string("standard output cannot be written") +
                                  (reason != 0 ? std::string(": ") + std::strerror(reason) : "")});
}

std::string versionText() {
  return std::string("relume " RELUME_VERSION "\nbake format ") + std::to_string(kBakeFormatVersion) + ", packed " +
         std::to_string(kPackedFormatVersion) + ", algorithm version " + std::to_string(kAlgorithmVersion) +
         "\ncommit " + (*RELUME_COMMIT != 0 ? RELUME_COMMIT : "unknown: not built from a git checkout");
}

// Whether a command was asked for JSON lines on stderr, --progress json: its last message is one as well.
bool wantsJsonLines(const CLI::App& app, const GivenTexts& given) {
  for (const CLI::App* command : app.get_subcommands()) {
    const CLI::Option* const option = command->get_option_no_throw("--progress");
    if (option == nullptr || option->count() == 0) continue;
    // Parsing may have ended before it came to this option.
    const auto checked = given.find(option);
    if ((checked != given.end() ? checked->second : option->results()).back() == "json") return true;
  }
  return false;
}

bool isCommand(const CLI::App& app, std::string_view word) {
  return !app.get_subcommands([&](const CLI::App* command) { return command->get_name() == word; }).empty();
}

// The words of a command line, where `help COMMAND` is `COMMAND --help`. A word that is no command is left alone, so
// that it is the error: CLI11 answers --help before it tells of words that it does not know.
std::vector<const char*> withHelpAsOption(const CLI::App& app, int argc, char** argv) {
  std::vector<const char*> words(argv, argv + argc);
  if (argc < 2 || std::string_view(argv[1]) != "help") return words;
  words.erase(words.begin() + 1);
  if (argc == 2 || std::string_view(argv[2]) == "help" || isCommand(app, argv[2]))
    words.push_back("--help");
  else
    words.resize(2);
  return words;
}

int run(int argc, char** argv) {
  CLI::App app{"Relume bakes how light travels through a level, so that a game can relight it every frame.", "relume"};
  app.set_version_flag("--version", versionText);
  app.require_subcommand(0, 1);
  app.footer(
      "Exit status: 0 ok, 1 usage, 2 input/output, 3 invalid file, 4 failed, 5 unsupported, 7 difference found, "
      "130 cancelled.");
  Action action;
  addBakeCommand(app, action);
  addMergeCommand(app, action);
  addStoreCommand(app, action);
  addBenchCommand(app, action);
  addInfoCommand(app, action);
  addValidateCommand(app, action);
  addCompareCommand(app, action);
  addStatusCommand(app, action);
  addExportCommand(app, action);
  addPackCommand(app, action);
  addRenderCommand(app, action);
  addPreviewCommand(app, action);
  addReferenceCommand(app, action);
  addDiffCommand(app, action);
  addCompletionCommand(app, action);
  addPagesCommand(app, action);

  const std::vector<const char*> words = withHelpAsOption(app, argc, argv);
  GivenTexts given;
  applyOptionRules(app, given);
  try {
    app.parse(static_cast<int>(words.size()), words.data());
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(e);  // --help, --version
    tellInJson(wantsJsonLines(app, given));
    return fail({ErrorCode::usage, usageMessage(app, e, given)});
  }
  tellInJson(wantsJsonLines(app, given));

  if (!action) {
    std::string names;
    for (const CLI::App* command : app.get_subcommands({})) {
      const bool hidden = command->get_group().empty();
      if (!hidden) names += (names.empty() ? "" : ", ") + command->get_name();
    }
    return fail({ErrorCode::usage, "a command is required: " + names + " (see relume --help)"});
  }

  // The last line of defence: room doors return errors, so only exhausted memory should arrive here.
  try {
    const int status = action();
    return status == exitCode(ErrorCode::failed) && interruptedBySignal() ? kCancelled : status;
  } catch (const std::exception& e) {
    return fail({ErrorCode::failed, reasonOf(e)});
  }
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
#ifdef __GLIBC__
  // Arrays of 4 MiB and more go back to the system when they are freed. By itself, glibc comes to keep up to 64 MiB of
  // them, which a bake of many instances would hold for nothing.
  ::mallopt(M_MMAP_THRESHOLD, 4 << 20);
#endif
  std::set_terminate(relume::endAfterUncaught);
  relume::useClassicLocale();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of the write, not the end of the program
  if (!relume::holdStandardStreams()) return relume::exitCode(relume::ErrorCode::io);
  return relume::withOutputFlushed(relume::run(argc, argv));
}
