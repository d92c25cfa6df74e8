// SPDX-License-Identifier: MIT
// Sums by surfel run in the samples' order, each once, whatever the number of surfels and threads.
#include "bake/surfels/by_surfel.h"

#include "bake/base/random.h"

#include <gtest/gtest.h>

#include <vector>

namespace relume {
namespace {

constexpr std::uint32_t kNoSurfel = 0xFFFFFFFFu;

TEST(BySurfel, everySampleIsVisitedOnceInOrder) {
  for (const std::size_t surfels :
       {std::size_t{0}, std::size_t{1}, std::size_t{5}, std::size_t{16}, std::size_t{1000}}) {
    std::vector<std::uint32_t> of(surfels == 1 ? 0 : 4096);  // a surfel without samples as well
    for (std::size_t i = 0; i < of.size(); ++i) {
      const std::uint64_t any = mix64(i);
      of[i] = surfels == 0 || any % 7 == 0 ? kNoSurfel : static_cast<std::uint32_t>(any % surfels);
    }
    std::vector<std::vector<std::size_t>> expected(surfels);
    for (std::size_t i = 0; i < of.size(); ++i) {
      if (of[i] != kNoSurfel) expected[of[i]].push_back(i);
    }
    for (const int threads : {1, 2, 7, 32}) {
      Context context;
      context.threads = threads;
      std::vector<std::vector<std::size_t>> found(surfels);
      forEachSurfelRange(context, surfels, [&](std::size_t first, std::size_t last) {
        forEachSampleOf(of, first, last, [&](std::size_t i) { found[of[i]].push_back(i); });
      });
      EXPECT_TRUE(found == expected) << surfels << " surfels, " << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace relume
