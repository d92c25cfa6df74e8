// SPDX-License-Identifier: MIT
// Sorting by threads gives the order of std::sort, whatever the number of items and threads; so do the buckets of
// points.
#include "bake/base/parallel_sort.h"

#include "bake/base/point_grid.h"
#include "bake/base/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

namespace relume {
namespace {

// Keys of which many are equal, told apart by their index.
std::vector<std::pair<std::uint32_t, std::uint32_t>> mixedKeys(std::size_t count) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> items(count);
  for (std::uint32_t i = 0; i < count; ++i) items[i] = {static_cast<std::uint32_t>(mix64(i) % (count / 3 + 1)), i};
  return items;
}

TEST(ParallelSort, isThatOfOneThread) {
  const std::less<> less;
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{5}, 2 * kSortedRun,
                                  2 * kSortedRun + 1, 3 * kSortedRun, 5 * kSortedRun - 1, 8 * kSortedRun + 3}) {
    auto expected = mixedKeys(count);
    std::sort(expected.begin(), expected.end());
    for (const int threads : {1, 2, 7, 16}) {
      Context context;
      context.threads = threads;
      auto items = mixedKeys(count), sorted = expected, reversed = expected;
      std::reverse(reversed.begin(), reversed.end());
      for (auto* each : {&items, &sorted, &reversed}) {
        sortByThreads(context, *each, less);
        EXPECT_TRUE(*each == expected) << count << " items, " << threads << " threads";
      }
    }
  }
}

TEST(ParallelSort, cancelledContextEndsIt) {
  Context context;
  context.threads = 2;
  context.cancel();
  auto items = mixedKeys(4 * kSortedRun);
  sortByThreads(context, items, std::less<>());
  EXPECT_EQ(items.size(), 4 * kSortedRun);
}

// All points by bucket, then index, of few points and of more than one thread sorts at a time.
TEST(PointGrid, orderIsByBucketThenIndexAtAnyNumberOfThreads) {
  for (const std::size_t count : {0u, 1u, 3u, 100000u}) {
    std::vector<glm::vec3> points(count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t bits = mix64(i);
      points[i] = glm::vec3(bits & 1023, bits >> 10 & 1023, bits >> 20 & 1023) / 16.0f;
    }
    std::vector<std::uint32_t> expected(count);
    std::iota(expected.begin(), expected.end(), 0u);
    for (const int threads : {1, 2, 7}) {
      Context context;
      context.threads = threads;
      const PointGrid grid(points, 1.0f, context);
      if (threads == 1) {
        std::stable_sort(expected.begin(), expected.end(), [&](std::uint32_t a, std::uint32_t b) {
          const PointGrid::Bucket p = grid.bucketOf(points[a]), q = grid.bucketOf(points[b]);
          return std::tie(p.z, p.y, p.x) < std::tie(q.z, q.y, q.x);
        });
      }
      ASSERT_EQ(grid.order().size(), count);
      EXPECT_TRUE(std::equal(expected.begin(), expected.end(), grid.order().begin())) << count << ", " << threads;
    }
  }
}

}  // namespace
}  // namespace relume
