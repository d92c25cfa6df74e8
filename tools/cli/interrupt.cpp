// SPDX-License-Identifier: MIT
// See interrupt.h. The handler only sets a flag and posts a semaphore, or ends the process, which are all it may do. A
// thread of the guard waits for the semaphore, so that no other thread has to respond for the process to end.
#include "tools/cli/interrupt.h"

#include "formats/file_io.h"
#include "tools/cli/commands.h"
#include "tools/cli/terminal.h"

#include <poll.h>
#include <semaphore.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <ctime>
#include <string>
#include <thread>

namespace relume {
namespace {

std::atomic<bool> guarded{false}, interrupted{false}, messageClaimed{false};

// Posted by the first signal and by a guard that is destroyed. A guard asks for it first, so that the handler finds it
// initialized.
sem_t* wake() {
  static sem_t semaphore;
  static const bool ready = ::sem_init(&semaphore, 0, 0) == 0;
  return ready ? &semaphore : nullptr;
}

void onSignal(int) {
  if (!guarded.load()) ::_exit(kCancelled);
  // Others that follow say the same: a terminal that is closed and `timeout` send two, the latter to the process and to
  // its group.
  if (!interrupted.exchange(true)) ::sem_post(wake());
}

// Unless whoever started the process had it ignored: nohup, a shell in the background.
void handle(int number) {
  struct sigaction action {
  }, old{};
  action.sa_handler = onSignal;
  sigemptyset(&action.sa_mask);
  if (::sigaction(number, nullptr, &old) == 0 && old.sa_handler != SIG_IGN) ::sigaction(number, &action, nullptr);
}

// Wait until the semaphore is posted, or for so many seconds (0 = for ever).
void waitForWake(double seconds) {
  timespec until{};
  ::clock_gettime(CLOCK_REALTIME, &until);
  until.tv_nsec += static_cast<long>(1e9 * seconds);
  until.tv_sec += until.tv_nsec / 1'000'000'000;
  until.tv_nsec %= 1'000'000'000;
  int result = 0;
  do {
    result = seconds > 0.0 ? ::sem_timedwait(wake(), &until) : ::sem_wait(wake());
  } while (result != 0 && errno == EINTR);
}

// Past the locks of stdio, which a thread that no longer responds may hold. A reader that has stopped reading does not
// keep the process alive: what does not fit is not written.
void writeToStderr(const std::string& text) {
  pollfd stream{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&stream, 1, 0) != 1) return;
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace

struct InterruptGuard::State {
  std::atomic<bool> stop{false};
  std::thread thread;
};

InterruptGuard::InterruptGuard(Context& context, bool hasBar) : state_(std::make_unique<State>()) {
  State& s = *state_;
  sem_t* const semaphore = wake();
  if (interrupted.load()) ::sem_post(semaphore);  // while an earlier guard lived
  s.thread = std::thread([&s, &context, hasBar] {
    waitForWake(0.0);
    if (s.stop.load()) return;
    context.cancel();
    waitForWake(kGrace);
    if (s.stop.load()) return;
    removeOpenTemporaries();
    if (claimLastMessage()) writeToStderr(std::string(hasBar ? "\r\033[K" : "") + lastMessage("cancelled"));
    ::_exit(kCancelled);
  });
  guarded = true;
  handle(SIGINT);
  handle(SIGHUP);
  handle(SIGTERM);
}

InterruptGuard::~InterruptGuard() {
  guarded = false;
  state_->stop = true;
  ::sem_post(wake());
  state_->thread.join();
  // Leave nothing for the next guard.
  while (::sem_trywait(wake()) == 0) {
  }
}

bool interruptedBySignal() { return interrupted.load(); }

bool claimLastMessage() { return !messageClaimed.exchange(true); }

}  // namespace relume
