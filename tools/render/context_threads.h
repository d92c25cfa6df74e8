// SPDX-License-Identifier: MIT
// The runtime's loops on the threads of a bake's context.
#pragma once

#include "bake/base/parallel.h"
#include "relume/bake/context.h"
#include "relume/relighter.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

namespace relume {

// The context must outlive what is returned, and has its final number of threads. One loop at a time: a frame has many,
// too short to make threads ready for each.
inline ParallelFor contextParallelFor(Context& context) {
  return [threads = std::make_shared<KeptThreads>(context)](std::uint32_t tasks,
                                                            const std::function<void(std::uint32_t)>& body) {
    threads->parallelChunks(tasks, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(static_cast<std::uint32_t>(i));
    });
  };
}

}  // namespace relume
