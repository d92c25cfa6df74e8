// SPDX-License-Identifier: MIT
// See pull_weights.h.
#include "bake/links/pull_weights.h"

#include <algorithm>

namespace relume {
namespace {

// The unit is 2^-40 of a cache's light: sums of 2^24 caches fit, and one ray of a million still counts 10^6 units.
std::uint64_t toFixed(float value) { return static_cast<std::uint64_t>(std::max(value, 0.0f) * 0x1p40f); }

float share(double first, double second, float otherwise) {
  return first + second > 0.0 ? static_cast<float>(first / (first + second)) : otherwise;
}

// Sum the values of leaves up to all their ancestors. A parent comes before its children.
template <class T>
void sumUp(const Hierarchy& hierarchy, std::vector<T>& value) {
  for (std::uint32_t node = hierarchy.nodeCount(); node-- > 0;) {
    if (!hierarchy.isLeaf(node)) value[node] = value[hierarchy.child[node]] + value[hierarchy.child[node] + 1];
  }
}

}  // namespace

PullSums::PullSums(const Hierarchy& hierarchy, LinkOptions::PullWeight kind) {
  if (kind == LinkOptions::PullWeight::area) return;
  all_.resize(hierarchy.nodeCount());
  cut_.resize(hierarchy.nodeCount());
}

void PullSums::add(const VisibleSubtree& tree, std::span<const CutLink> cut) {
  if (all_.empty()) return;
  for (const auto [slot, reads] : cut) {
    const VisibleNode& target = tree[reads];
    const float scale = slot == reads || target.received <= 0.0f ? 1.0f : tree[slot].received / target.received;
    for (const VisibleNode& leaf : tree.leaves().subspan(target.firstLeaf, target.endLeaf - target.firstLeaf)) {
      const std::uint64_t received = toFixed(leaf.received * scale);
      all_[leaf.node] += received;
      cut_[target.node] += received;
    }
  }
}

void PullSums::merge(const PullSums& other) {
  for (std::size_t i = 0; i < cut_.size(); ++i) cut_[i] += other.cut_[i];
  for (std::size_t i = 0; i < all_.size(); ++i) all_[i] += other.all_[i];
}

std::vector<float> PullSums::weights(const Hierarchy& hierarchy) const {
  if (all_.empty()) return hierarchy.firstWeight.toVector();
  std::vector<std::uint64_t> all = all_, cut = cut_;
  sumUp(hierarchy, all);
  // Count the links at or below each node: an inner node adds its own to its children's.
  for (std::uint32_t node = hierarchy.nodeCount(); node-- > 0;) {
    if (!hierarchy.isLeaf(node)) cut[node] += cut[hierarchy.child[node]] + cut[hierarchy.child[node] + 1];
  }
  std::vector<float> weight(hierarchy.nodeCount(), 0.0f);
  for (std::uint32_t node = 0; node < hierarchy.nodeCount(); ++node) {
    if (hierarchy.isLeaf(node)) continue;
    const std::uint32_t first = hierarchy.child[node], second = first + 1;
    const auto real = [](std::uint64_t v) { return static_cast<double>(v); };
    const float otherwise = share(real(all[first]), real(all[second]), hierarchy.firstWeight[node]);
    weight[node] = share(real(all[first] - cut[first]), real(all[second] - cut[second]), otherwise);
  }
  return weight;
}

}  // namespace relume
