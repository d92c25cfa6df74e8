// SPDX-License-Identifier: MIT
// Sums over samples by the surfel that each belongs to, on all threads: a range of surfels looks through the samples of
// all, so that the sums of one run in the samples' order.
#pragma once

#include "bake/base/parallel.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace relume {

// Call visit(first, last) for ranges of [0, count), which may run at the same time.
template <class Visit>
void forEachSurfelRange(Context& context, std::size_t count, const Visit& visit) {
  constexpr std::size_t kRanges = 16;  // each reads which surfel every sample has
  const std::size_t grain = context.threads == 1 ? count : (count + kRanges - 1) / kRanges;
  parallelChunks(context, "", count, grain, visit);
}

// Call visit(sample) for the samples whose surfel is in [first, last), in their order.
template <class Visit>
void forEachSampleOf(std::span<const std::uint32_t> surfelOfSample, std::size_t first, std::size_t last,
                     const Visit& visit) {
  for (std::size_t i = 0; i < surfelOfSample.size(); ++i) {
    if (surfelOfSample[i] - first < last - first) visit(i);
  }
}

}  // namespace relume
