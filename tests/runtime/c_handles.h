// SPDX-License-Identifier: MIT
// A context of relume.h and what was made with it, for tests.
#pragma once

#include "relume/relume.h"

#include <atomic>
#include <thread>

namespace relume::test {

// A host's job system of two threads, as relume_parallel_for.
inline void runInTwo(void*, unsigned int tasks, relume_task task, void* data) {
  std::atomic<unsigned int> next{0};
  const auto work = [&] {
    for (unsigned int i = next++; i < tasks; i = next++) task(data, i);
  };
  std::thread helper(work);
  work();
  helper.join();
}

// Handles may be destroyed in any order; here the context goes first.
struct Handles {
  relume_context* context = nullptr;
  relume_bake* bake = nullptr;
  relume_relighter* relighter = nullptr;

  Handles() = default;
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;
  ~Handles() {
    relume_context_destroy(context);
    relume_bake_destroy(bake);
    relume_relighter_destroy(relighter);
  }
};

}  // namespace relume::test
