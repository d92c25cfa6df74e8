// SPDX-License-Identifier: MIT
// SIGINT, SIGTERM and SIGHUP, unless the process was started with them ignored. A command that is asked to stop cancels
// its Context and ends in its own way as soon as its stage notices. Some work cannot be asked: a package that decodes
// one image, parses one document or maps one chart, a frame that the driver draws. A command that is still there after
// kGrace is therefore ended where it stands.
#pragma once

#include "relume/bake/context.h"

#include <memory>

namespace relume {

inline constexpr double kGrace = 0.3;  // [s] from the signal until the process is ended

// For its lifetime, the first signal cancels `context`; if the guard still lives kGrace later, the temporaries of
// unfinished writes are removed, "cancelled" is printed, and the process ends with kCancelled. Signals that follow say
// the same: `timeout` sends two. Once the guard is gone, what is left is to end: a signal ends the process at once,
// with kCancelled. One guard at a time.
class InterruptGuard {
 public:
  // `hasBar`: stderr may show a progress bar, which is cleared before the message.
  InterruptGuard(Context& context, bool hasBar);
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Whether a signal has come while a guard lived.
bool interruptedBySignal();

// True for the first caller in the process. Both the command and the guard end with a message that the work was
// cancelled; only the one that gets true prints it.
bool claimLastMessage();

}  // namespace relume
