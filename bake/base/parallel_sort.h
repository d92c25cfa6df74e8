// SPDX-License-Identifier: MIT
// std::sort of many items on all threads: runs of one length are sorted, then merged two by two, a merge in pieces that
// begin where a search says. Where no two items are equal, the order is that of std::sort.
#pragma once

#include "bake/base/parallel.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::size_t kSortedRun = std::size_t{1} << 13;  // [items] of a run, and of a piece of a merge

// How many of the first `count` items of two merged sorted runs are of run a.
template <class T, class Less>
std::size_t takenOfFirst(std::span<const T> a, std::span<const T> b, std::size_t count, const Less& less) {
  std::size_t low = count - std::min(count, b.size()), high = std::min(count, a.size());
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (less(a[middle], b[count - middle - 1])) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

// Holds as much memory again while it runs, where items are many. Ask the context for a cancel before the items are
// used: they may be any then.
template <class T, class Less>
void sortByThreads(Context& context, std::vector<T>& items, const Less& less) {
  const std::size_t count = items.size();
  if (context.threads == 1 || count <= 2 * kSortedRun) return std::sort(items.begin(), items.end(), less);
  parallelChunks(context, "", count, kSortedRun, [&](std::size_t begin, std::size_t end) {
    std::sort(items.begin() + static_cast<std::ptrdiff_t>(begin), items.begin() + static_cast<std::ptrdiff_t>(end),
              less);
  });
  std::vector<T> merged(count);
  for (std::size_t run = kSortedRun; run < count; run *= 2) {
    parallelChunks(context, "", count, kSortedRun, [&](std::size_t begin, std::size_t end) {
      const std::size_t first = begin / (2 * run) * (2 * run), second = std::min(count, first + run),
                        last = std::min(count, first + 2 * run);
      const std::span<const T> a(items.data() + first, second - first), b(items.data() + second, last - second);
      const std::size_t a0 = takenOfFirst(a, b, begin - first, less), a1 = takenOfFirst(a, b, end - first, less);
      const std::size_t b0 = begin - first - a0, b1 = end - first - a1;
      const auto partOf = [](const std::span<const T>& s, std::size_t from, std::size_t to) {
        return s.subspan(from, to - from);
      };
      const std::span<const T> fromA = partOf(a, a0, a1), fromB = partOf(b, b0, b1);
      std::merge(fromA.begin(), fromA.end(), fromB.begin(), fromB.end(),
                 merged.begin() + static_cast<std::ptrdiff_t>(begin), less);
    });
    items.swap(merged);
  }
}

}  // namespace relume
