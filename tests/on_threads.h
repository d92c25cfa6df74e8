// SPDX-License-Identifier: MIT
// A host's job system for tests: RelightOptions::parallelFor and its like.
#pragma once

#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace relume::test {

// Run task i on thread i modulo `threads`, in an order of their own; the calling thread takes task 0.
inline void onThreads(std::uint32_t threads, std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
  const auto run = [&](std::uint32_t first) {
    for (std::uint32_t i = first; i < tasks; i += threads) body(i);
  };
  std::vector<std::thread> others;
  for (std::uint32_t t = 1; t < threads; ++t) others.emplace_back(run, t);
  run(0);
  for (std::thread& other : others) other.join();
}

inline void onTwoThreads(std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
  onThreads(2, tasks, body);
}

}  // namespace relume::test
