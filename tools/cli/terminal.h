// SPDX-License-Identifier: MIT
// What every long command shares: progress on the terminal, messages through spdlog, and Ctrl-C. Progress and messages
// go to stderr; stdout is for results.
#pragma once

#include "relume/bake/context.h"
#include "relume/result.h"
#include "tools/base/overall_progress.h"

#include <cstdint>
#include <memory>
#include <string>

namespace CLI {
class App;
}

namespace relume {

// automatic: a bar on a terminal; elsewhere a line for each stage that took a tenth of a second.
enum class ProgressStyle { automatic, plain, json, none };

// The options of a long command: --threads, --max-memory and --progress.
struct TerminalOptions {
  int threads = 0;  // [0..1024] 0 = all cores
  ProgressStyle progress = ProgressStyle::automatic;
  std::uint64_t maxMemory = 0;  // [byte] 0 = three quarters of the machine's
};
void addTerminalOptions(CLI::App& command, TerminalOptions& options);
// --max-memory alone, for commands that are quick; --progress alone, for those that work on one thread.
void addMemoryOption(CLI::App& command, std::uint64_t& maxMemory);
void addProgressOption(CLI::App& command, ProgressStyle& progress);

// Connects a Context to the terminal for its lifetime: progress as a bar, as lines, or as one JSON object a line, or
// warnings and errors only; Ctrl-C (SIGINT, SIGTERM, SIGHUP) cancels the context (interrupt.h). One at a time.
class Terminal {
 public:
  // With a plan, progress is told of the whole work as well.
  explicit Terminal(const TerminalOptions& options, ProgressPlan plan = {});
  // Of a command that is quick: no progress, no information; a signal ends it as it ends the others.
  explicit Terminal(std::uint64_t maxMemory);
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  Context& context();
  // What follows has the same stages as what is done, and they are new.
  void startOver();
  // Clear the bar's line before results are printed.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A message outside of a context, on stderr: "relume: warning: text", or JSON. Lines that it goes on in are indented by
// two spaces; every other line end is one of a name and is shown as \n.
void logMessage(Severity severity, const std::string& text);

// Whether the process writes its messages in JSON, as --progress json has them; false until called.
void tellInJson(bool json);

// The line, or lines, that a command which failed ends with, with their line ends: "relume: error: text", or JSON.
std::string lastMessage(const std::string& text);

}  // namespace relume
