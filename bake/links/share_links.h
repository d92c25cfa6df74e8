// SPDX-License-Identifier: MIT
// Shares a number of links between caches by their error: the keys of what all caches would refine are counted, and one
// threshold is chosen for all. Refining the largest keys of all caches together is what leaves the least error in sum.
#pragma once

#include "bake/links/visible_subtree.h"
#include "relume/bake/options.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// How many links there are to share.
struct LinkBudget {
  LinkBudget(const LinkOptions& options, std::size_t caches, std::size_t groups);

  double total;               // of all caches
  std::uint32_t maxPerCache;  // of one; at least `groups`: a cache links to each that it sees
  bool isShared;              // else every cache gets as many as it may have
};

// Counts of refinements by key, the same in any order of the caches. Not thread-safe: use one per thread, merged at the
// end.
class KeyCounts {
 public:
  // Count what one cache refines until it has maxNodes links.
  void add(const VisibleSubtree& tree, std::span<const float> keys, std::uint32_t maxNodes);
  void merge(const KeyCounts& other);

  std::uint64_t caches() const { return caches_; }
  // The key above which caches may refine so that these caches together have at most `links` links, for
  // CutLimit::minKey; -1 where all that is counted fits. It is one of 64 an octave, so that it stays as it is
  // where the caches change a little.
  float keyFor(double links) const;

 private:
  std::uint64_t caches_ = 0, roots_ = 0;
  std::vector<std::uint64_t> count_;  // [Size 0 or 16384] by the key's exponent and 6 bits of its mantissa
  std::vector<float> refined_;        // scratch
};

}  // namespace relume
