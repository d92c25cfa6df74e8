// SPDX-License-Identifier: MIT
// See chunks.h.
#include "runtime/shared/chunks.h"

#include <atomic>
#include <exception>

namespace relume {

void runTasks(const ParallelFor& parallelFor, std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
  std::atomic_flag threw;
  std::exception_ptr first;
  const auto task = [&](std::uint32_t i) {
    try {
      body(i);
    } catch (...) {
      if (!threw.test_and_set()) first = std::current_exception();
    }
  };
  parallelFor(tasks, std::cref(task));
  if (first) std::rethrow_exception(first);
}

}  // namespace relume
