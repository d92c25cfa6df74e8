// SPDX-License-Identifier: MIT
// See terminal.h.
#include "bake/tools/terminal.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>
#include <thread>

namespace relume {
namespace {

using Clock = std::chrono::steady_clock;

// All a signal handler may touch.
std::atomic<bool> interrupted{false};

void onSignal(int number) {
  if (interrupted.exchange(true)) {
    ::signal(number, SIG_DFL);
    ::raise(number);
  }
}

std::shared_ptr<spdlog::logger> logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    auto created = std::make_shared<spdlog::logger>("relume", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    created->set_pattern("relume: %l: %v");
    created->flush_on(spdlog::level::info);
    return created;
  }();
  return instance;
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

}  // namespace

struct Terminal::State {
  Context context;
  ProgressStyle style = ProgressStyle::none;
  bool bar = false;  // a line that is redrawn
  std::mutex mutex;  // guards what follows, and stderr
  std::string stage;
  double fraction = -1.0;
  std::map<std::string, Clock::time_point, std::less<>> stageBegin;  // stages nest: the outer one comes back
  Clock::time_point lastDrawn{};
  bool lineOpen = false;
  std::atomic<bool> stop{false};
  std::thread watcher;  // turns the signal into a cancelled context
  struct sigaction oldInt {
  }, oldTerm{};

  void closeLine() {
    if (lineOpen) std::fputs("\r\033[K", stderr);
    lineOpen = false;
  }

  void report(std::string_view newStage, double newFraction);
  void drawBar(double eta);
};

void Terminal::State::drawBar(double eta) {
  constexpr int kWidth = 30;
  char bars[kWidth + 1] = {};
  for (int i = 0; i < kWidth; ++i) bars[i] = i < static_cast<int>(fraction * kWidth + 0.5) ? '=' : ' ';
  std::fprintf(stderr, "\r\033[K%-12s [%s] %3.0f %%", stage.c_str(), bars, 100.0 * fraction);
  if (eta > 0.5) std::fprintf(stderr, "  %.0f s left", eta);
  std::fflush(stderr);
  lineOpen = true;
}

void Terminal::State::report(std::string_view newStage, double newFraction) {
  if (style == ProgressStyle::none) return;
  const std::lock_guard lock(mutex);
  const Clock::time_point now = Clock::now();
  const bool started = newStage != stage;
  if (started) {
    stage = newStage;
    fraction = -1.0;
  }
  const Clock::time_point begin = stageBegin.try_emplace(stage, now).first->second;
  // Chunks finish in any order: progress never steps back; draw ten times a second, print each fifth.
  if (newFraction <= fraction) return;
  const bool finished = newFraction >= 1.0;
  const double before = fraction;
  const bool due = bar ? now - lastDrawn > std::chrono::milliseconds(100)
                       : static_cast<int>(newFraction * 5.0) > static_cast<int>(before * 5.0);
  if (!started && !finished && !due) return;
  fraction = newFraction;
  lastDrawn = now;
  const double seconds = std::chrono::duration<double>(now - begin).count();
  const double eta = fraction > 0.02 && !finished ? seconds * (1.0 - fraction) / fraction : 0.0;
  if (bar) {
    drawBar(eta);
  } else if (style == ProgressStyle::json) {
    const nlohmann::json line = {
        {"event", "progress"}, {"stage", stage}, {"fraction", fraction}, {"seconds", seconds}, {"secondsLeft", eta}};
    std::fprintf(stderr, "%s\n", line.dump().c_str());
  } else if (finished) {
    std::fprintf(stderr, "relume: %s: done in %.2f s\n", stage.c_str(), seconds);
  } else if (eta > 0.5) {
    std::fprintf(stderr, "relume: %s: %.0f %%, %.0f s left\n", stage.c_str(), 100.0 * fraction, eta);
  } else {
    std::fprintf(stderr, "relume: %s: %.0f %%\n", stage.c_str(), 100.0 * fraction);
  }
}

void addTerminalOptions(CLI::App& command, TerminalOptions& options) {
  static const std::map<std::string, ProgressStyle> kStyles = {{"auto", ProgressStyle::automatic},
                                                               {"plain", ProgressStyle::plain},
                                                               {"json", ProgressStyle::json},
                                                               {"none", ProgressStyle::none}};
  command.add_option("--threads", options.threads, "Threads; 0 = all cores; never changes the result [0..1024]")
      ->option_text("N [0]")
      ->check(CLI::Range(0, 1024));
  addMemoryOption(command, options.maxMemory);
  command
      .add_option("--progress", options.progress,
                  "Progress on stderr: a bar on a terminal and lines otherwise, lines, JSON lines, nothing "
                  "[auto|plain|json|none]")
      ->option_text("STYLE [auto]")
      ->transform(CLI::CheckedTransformer(kStyles).description(""));
}

void addMemoryOption(CLI::App& command, std::uint64_t& maxMemory) {
  command
      .add_option(
          "--max-memory", maxMemory,
          "Memory the process may hold: bytes, or with a unit (512M, 8G); what would need more is refused by name "
          "before it is allocated. Never changes the result [>= 1M]")
      ->option_text("SIZE [three quarters of the machine's]")
      ->transform(CLI::AsSizeValue(false))
      ->check([](const std::string& text) {
        constexpr std::uint64_t kLeast = 1u << 20;
        return std::strtoull(text.c_str(), nullptr, 10) >= kLeast ? std::string() : "at least 1M expected, " + text;
      });
}

void logMessage(Severity severity, const std::string& text) { logger()->log(levelOf(severity), text); }

Terminal::Terminal(const TerminalOptions& options) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.style = options.progress;
  s.bar = options.progress == ProgressStyle::automatic && ::isatty(STDERR_FILENO) != 0;
  s.context.threads = options.threads;
  s.context.maxMemory = options.maxMemory;
  s.context.onProgress = [&s](std::string_view stage, double fraction) {
    s.report(stage, fraction);
    return !interrupted.load();
  };
  s.context.onMessage = [&s](Severity severity, std::string_view message) {
    if (s.style == ProgressStyle::none && severity == Severity::info) return;
    const std::lock_guard lock(s.mutex);
    s.closeLine();
    if (s.style != ProgressStyle::json) return logMessage(severity, std::string(message));
    const char* names[] = {"info", "warning", "error"};
    const nlohmann::json line = {
        {"event", "message"}, {"severity", names[static_cast<int>(severity)]}, {"text", message}};
    std::fprintf(stderr, "%s\n", line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  };

  // Stages that report rarely still see the cancellation, within 50 ms.
  struct sigaction action {};
  action.sa_handler = onSignal;
  sigemptyset(&action.sa_mask);
  ::sigaction(SIGINT, &action, &s.oldInt);
  ::sigaction(SIGTERM, &action, &s.oldTerm);
  s.watcher = std::thread([&s] {
    while (!s.stop.load()) {
      if (interrupted.load()) s.context.cancel();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
}

Terminal::~Terminal() {
  finish();
  state_->stop = true;
  state_->watcher.join();
  ::sigaction(SIGINT, &state_->oldInt, nullptr);
  ::sigaction(SIGTERM, &state_->oldTerm, nullptr);
}

Context& Terminal::context() { return state_->context; }

void Terminal::finish() {
  const std::lock_guard lock(state_->mutex);
  state_->closeLine();
}

}  // namespace relume
