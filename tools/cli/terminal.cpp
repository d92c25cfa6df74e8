// SPDX-License-Identifier: MIT
// See terminal.h.
#include "tools/cli/terminal.h"

#include "tools/base/number_check.h"
#include "tools/base/printable.h"
#include "tools/cli/interrupt.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

namespace relume {
namespace {

using Clock = std::chrono::steady_clock;

std::shared_ptr<spdlog::logger> logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    auto created = std::make_shared<spdlog::logger>("relume", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    created->set_pattern("relume: %l: %v");
    created->flush_on(spdlog::level::info);
    return created;
  }();
  return instance;
}

// Whether a line of stderr can be drawn again. A terminal that cannot clear one is called dumb.
bool canRedraw() {
  const char* const kind = std::getenv("TERM");
  return ::isatty(STDERR_FILENO) != 0 && kind != nullptr && *kind != 0 && std::string_view(kind) != "dumb";
}

// Of the terminal behind stderr; 80 where it does not say.
std::size_t columnsOfTerminal() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

spdlog::level::level_enum levelOf(Severity severity) {
  switch (severity) {
    case Severity::info:
      return spdlog::level::info;
    case Severity::warning:
      return spdlog::level::warn;
    case Severity::error:
      return spdlog::level::err;
  }
  return spdlog::level::err;
}

// One of the lines of --progress json.
std::string jsonMessage(Severity severity, std::string_view text) {
  const char* names[] = {"info", "warning", "error"};
  const nlohmann::json line = {{"event", "message"}, {"severity", names[static_cast<int>(severity)]}, {"text", text}};
  return jsonText(line, -1) + "\n";
}

std::atomic<bool> toldInJson{false};

}  // namespace

void tellInJson(bool json) { toldInJson = json; }

std::string lastMessage(const std::string& text) {
  return toldInJson ? jsonMessage(Severity::error, text) : "relume: error: " + printableLines(text) + "\n";
}

struct Terminal::State {
  Context context;
  ProgressStyle style = ProgressStyle::none;
  bool bar = false;  // a line that is redrawn
  std::mutex mutex;  // guards what follows, and stderr
  std::string stage;
  double fraction = -1.0;
  std::map<std::string, Clock::time_point, std::less<>> stageBegin;  // stages nest: the outer one comes back
  Clock::time_point lastDrawn{};
  bool stageTold = false;                         // a line of this stage was printed
  std::set<std::string, std::less<>> stagesDone;  // of which the last line was printed
  OverallProgress overall;
  Clock::time_point begin = Clock::now();
  bool lineOpen = false;
  std::atomic<bool> stop{false};
  std::thread watcher;                    // tells of silent stages, in plain lines
  std::unique_ptr<InterruptGuard> guard;  // last, so that it goes before what it cancels

  void closeLine() {
    if (lineOpen) std::fputs("\r\033[K", stderr);
    lineOpen = false;
  }

  // Of one stage, as it is to be told.
  struct Told {
    double seconds = 0.0, left = 0.0;                // [s]; left: 0 = not known
    double overall = 0.0, overallSecondsLeft = 0.0;  // of the whole work
    bool finished = false;
  };
  void report(std::string_view newStage, double newFraction);
  void tellOfSilentStage();
  Told tell(Clock::time_point now);
  bool isDue(const Told& told, double before, Clock::time_point now) const;
  void drawBar(const Told& told);
  void printLine(const Told& told);
};

// "links        [=========           ]  45 %  whole 72 %  12 s left", with a shorter bar where the terminal is narrow:
// what goes on in the next line could not be drawn again.
void Terminal::State::drawBar(const Told& told) {
  constexpr std::size_t kBar = 30, kName = 12;
  std::string line = printable(stage);
  line.resize(std::max(line.size(), kName), ' ');
  char text[64];
  std::snprintf(text, sizeof(text), "] %3.0f %%", 100.0 * fraction);
  std::string behind = text;
  if (overall.known()) {
    std::snprintf(text, sizeof(text), "  whole %.0f %%", 100.0 * told.overall);
    behind += text;
  }
  const double left = overall.known() ? told.overallSecondsLeft : told.left;
  if (left > 0.5) {
    std::snprintf(text, sizeof(text), "  %.0f s left", left);
    behind += text;
  }
  line += " [";
  const std::size_t room = columnsOfTerminal() - 1, besides = line.size() + behind.size();
  const std::size_t width = std::min(kBar, room - std::min(room, besides));
  const auto filled = static_cast<std::size_t>(fraction * static_cast<double>(width) + 0.5);
  line += std::string(filled, '=') + std::string(width - filled, ' ') + behind;
  std::fprintf(stderr, "\r\033[K%s", line.substr(0, room).c_str());
  std::fflush(stderr);
  lineOpen = true;
}

void Terminal::State::printLine(const Told& told) {
  std::string line = "relume: " + printable(stage) + ": ";
  char text[128];
  if (told.finished)
    std::snprintf(text, sizeof(text), "done in %.2f s", told.seconds);
  else
    std::snprintf(text, sizeof(text), "%.0f %%", 100.0 * fraction);
  line += text;
  if (overall.known() && told.overallSecondsLeft > 0.5) {
    std::snprintf(text, sizeof(text), ", whole %.0f %%, %.0f s left", 100.0 * told.overall, told.overallSecondsLeft);
    line += text;
  } else if (!overall.known() && told.left > 0.5) {
    std::snprintf(text, sizeof(text), ", %.0f s left", told.left);
    line += text;
  }
  std::fprintf(stderr, "%s\n", line.c_str());
}

// Stages that are over sooner get no line.
constexpr double kShortStage = 0.1;  // [s]

// The bar is drawn ten times a second; plain lines come at each fifth of a stage, otherwise one when it is done.
bool Terminal::State::isDue(const Told& told, double before, Clock::time_point now) const {
  const bool fifth = static_cast<int>(fraction * 5.0) > static_cast<int>(before * 5.0);
  if (bar) return told.finished || before < 0.0 || now - lastDrawn > std::chrono::milliseconds(100);
  if (style == ProgressStyle::json) return told.finished || before < 0.0 || fifth;
  if (told.seconds < kShortStage || stagesDone.contains(stage)) return false;
  return told.finished || (style == ProgressStyle::plain && (fifth || !stageTold));
}

Terminal::State::Told Terminal::State::tell(Clock::time_point now) {
  const auto since = [now](Clock::time_point then) { return std::chrono::duration<double>(now - then).count(); };
  Told told;
  told.finished = fraction >= 1.0;
  told.seconds = since(stageBegin.try_emplace(stage, now).first->second);
  told.left = fraction > 0.02 && !told.finished ? told.seconds * (1.0 - fraction) / fraction : 0.0;
  told.overall = overall.update(stage, fraction);
  told.overallSecondsLeft = overall.secondsLeft(since(begin));
  return told;
}

// Plain lines name a stage even when its first report takes long.
void Terminal::State::tellOfSilentStage() {
  const std::lock_guard lock(mutex);
  if (stage.empty() || stageTold || fraction < 0.0 || fraction >= 1.0 || stagesDone.contains(stage)) return;
  const Told told = tell(Clock::now());
  if (told.seconds < kShortStage) return;
  stageTold = true;
  printLine(told);
}

void Terminal::State::report(std::string_view newStage, double newFraction) {
  if (style == ProgressStyle::none) return;
  const std::lock_guard lock(mutex);
  const Clock::time_point now = Clock::now();
  if (newStage != stage) {
    stage = newStage;
    fraction = -1.0;
    stageTold = false;
  }
  // Chunks finish in any order: progress never steps back.
  if (newFraction <= fraction) return;
  const double before = fraction;
  fraction = newFraction;
  const Told told = tell(now);
  if (!isDue(told, before, now)) return;
  lastDrawn = now;
  stageTold = true;
  if (told.finished) stagesDone.insert(stage);
  if (bar) return drawBar(told);
  if (style != ProgressStyle::json) return printLine(told);
  nlohmann::json line = {{"event", "progress"},
                         {"stage", stage},
                         {"fraction", fraction},
                         {"seconds", told.seconds},
                         {"secondsLeft", told.left}};
  if (overall.known()) {
    line["overall"] = told.overall;
    line["overallSecondsLeft"] = told.overallSecondsLeft;
  }
  std::fprintf(stderr, "%s\n", jsonText(line, -1).c_str());
}

void addTerminalOptions(CLI::App& command, TerminalOptions& options) {
  command.add_option("--threads", options.threads, "Threads; 0 = all cores; never changes the result [0..1024]")
      ->option_text("N [0]")
      ->check(CLI::Range(0, 1024));
  addMemoryOption(command, options.maxMemory);
  addProgressOption(command, options.progress);
}

void addProgressOption(CLI::App& command, ProgressStyle& progress) {
  static const std::map<std::string, ProgressStyle> kStyles = {{"auto", ProgressStyle::automatic},
                                                               {"plain", ProgressStyle::plain},
                                                               {"json", ProgressStyle::json},
                                                               {"none", ProgressStyle::none}};
  command
      .add_option(
          "--progress", progress,
          "Progress on stderr: a bar on a terminal and a line for each stage otherwise, lines at each fifth of a "
          "stage, JSON lines, nothing "
          "[auto|plain|json|none]")
      ->option_text("STYLE [auto]")
      ->transform(CLI::CheckedTransformer(kStyles).description(""));
}

void addMemoryOption(CLI::App& command, std::uint64_t& maxMemory) {
  takeBytes(
      command
          .add_option(
              "--max-memory", maxMemory,
              "Memory the process may hold: bytes, or with a unit (512M, 8G); what would need more is refused by name "
              "before it is allocated. Never changes the result [1M..17179869183G]")
          ->option_text("SIZE [three quarters of the machine's]"))
      ->check([](const std::string& text) {
        constexpr std::uint64_t kMin = 1u << 20;
        return std::strtoull(text.c_str(), nullptr, 10) >= kMin ? std::string() : "at least 1M expected, " + text;
      });
}

void logMessage(Severity severity, const std::string& text) {
  if (toldInJson) {
    std::fputs(jsonMessage(severity, text).c_str(), stderr);
    return;
  }
  constexpr std::string_view kNextLine = "\n  ";
  std::string shown;
  std::string_view rest = text;
  for (std::size_t end = 0; (end = rest.find(kNextLine)) != std::string_view::npos;) {
    shown += printable(rest.substr(0, end)) + std::string(kNextLine);
    rest.remove_prefix(end + kNextLine.size());
  }
  logger()->log(levelOf(severity), shown + printable(rest));
}

Terminal::Terminal(const TerminalOptions& options, ProgressPlan plan) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.overall = OverallProgress(std::move(plan));
  s.style = options.progress;
  s.bar = options.progress == ProgressStyle::automatic && canRedraw();
  s.context.threads = options.threads;
  s.context.maxMemory = options.maxMemory;
  s.context.onProgress = [&s](std::string_view stage, double fraction) {
    s.report(stage, fraction);
    return !interruptedBySignal();
  };
  s.context.onMessage = [&s](Severity severity, std::string_view message) {
    if (s.style == ProgressStyle::none && severity == Severity::info) return;
    const std::lock_guard lock(s.mutex);
    s.closeLine();
    logMessage(severity, std::string(message));
  };

  s.guard = std::make_unique<InterruptGuard>(s.context, s.bar);
  if (s.style != ProgressStyle::plain) return;
  s.watcher = std::thread([&s] {
    while (!s.stop.load()) {
      s.tellOfSilentStage();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
}

Terminal::~Terminal() {
  finish();
  state_->stop = true;
  if (state_->watcher.joinable()) state_->watcher.join();
}

void Terminal::startOver() {
  const std::lock_guard lock(state_->mutex);
  state_->stage.clear();
  state_->fraction = -1.0;
  state_->stageBegin.clear();
  state_->stagesDone.clear();
}

Context& Terminal::context() { return state_->context; }

Terminal::Terminal(std::uint64_t maxMemory) : Terminal({0, ProgressStyle::none, maxMemory}) {}

void Terminal::finish() {
  const std::lock_guard lock(state_->mutex);
  state_->closeLine();
}

}  // namespace relume
