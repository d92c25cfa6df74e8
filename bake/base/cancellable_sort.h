// SPDX-License-Identifier: MIT
// std::sort of many items that hears a cancel: runs are sorted, then merged, and the context is asked in between. Where
// no two items are equal, the order is that of std::sort.
#pragma once

#include "relume/bake/context.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace relume {

// False when cancelled: `items` are then all there, in any order.
template <class T, class Less>
bool sortUnlessCancelled(std::vector<T>& items, const Less& less, const Context& context) {
  constexpr std::size_t kRun = std::size_t{1} << 17;
  const auto at = [&](std::size_t i) { return items.begin() + static_cast<std::ptrdiff_t>(std::min(i, items.size())); };
  for (std::size_t i = 0; i < items.size(); i += kRun) {
    if (context.cancelled()) return false;
    std::sort(at(i), at(i + kRun), less);
  }
  for (std::size_t run = kRun; run < items.size(); run *= 2) {
    for (std::size_t i = 0; i + run < items.size(); i += 2 * run) {
      if (context.cancelled()) return false;
      std::inplace_merge(at(i), at(i + run), at(i + 2 * run), less);
    }
  }
  return true;
}

}  // namespace relume
