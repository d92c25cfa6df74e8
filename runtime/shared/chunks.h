// SPDX-License-Identifier: MIT
// Runs work on the host's ParallelFor, cut into chunks.
#pragma once

#include "relume/relighter.h"

#include <algorithm>
#include <functional>

namespace relume {

// Run body(0) .. body(tasks - 1) by `parallelFor`, which is not empty. What a body throws would end the threads of most
// job systems, and the program with them: the first exception is thrown here, when all tasks have ended.
void runTasks(const ParallelFor& parallelFor, std::uint32_t tasks, const std::function<void(std::uint32_t)>& body);

// Run body(begin, end) over [0, count) in chunks of `grain`; on the calling thread when there is one chunk or no
// ParallelFor.
template <class Body>
void forChunks(const ParallelFor& parallelFor, std::uint32_t count, std::uint32_t grain, const Body& body) {
  const std::uint32_t chunks = (count + grain - 1) / grain;
  const auto chunk = [&](std::uint32_t i) { body(i * grain, std::min(count, (i + 1) * grain)); };
  if (parallelFor && chunks > 1) {
    runTasks(parallelFor, chunks, std::cref(chunk));  // by reference: std::function allocates nothing
  } else {
    for (std::uint32_t i = 0; i < chunks; ++i) chunk(i);
  }
}

}  // namespace relume
