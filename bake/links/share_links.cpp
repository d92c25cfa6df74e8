// SPDX-License-Identifier: MIT
// See share_links.h.
#include "bake/links/share_links.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>

namespace relume {
namespace {

constexpr std::uint32_t kShift = 17;  // bits of a positive float below its bin: 64 bins an octave
constexpr std::size_t kBins = std::size_t{1} << (31 - kShift);

constexpr double kMaxOfMean = 8.0;  // most links of a cache, in multiples of the mean, if the options do not say
constexpr double kMaxLinks = 65535.0;

std::size_t binOf(float key) { return key > 0.0f ? std::bit_cast<std::uint32_t>(key) >> kShift : 0; }

}  // namespace

LinkBudget::LinkBudget(const LinkOptions& options, std::size_t caches, std::size_t groups)
    : total(options.linksTotal > 0 ? options.linksTotal
                                   : static_cast<double>(options.linksPerCache) * static_cast<double>(caches)) {
  const double mean = caches > 0 ? total / static_cast<double>(caches) : 0.0;
  const double max = options.maxLinksPerCache > 0 ? options.maxLinksPerCache : std::ceil(kMaxOfMean * mean);
  maxPerCache = static_cast<std::uint32_t>(std::clamp(max, static_cast<double>(groups), kMaxLinks));
  isShared = caches > 0 && maxPerCache > mean;
}

void KeyCounts::add(const VisibleSubtree& tree, std::span<const float> keys, std::uint32_t maxNodes) {
  if (count_.empty()) count_.assign(kBins, 0);
  caches_ += 1;
  roots_ += tree.roots().size();

  // A node is refined only after all nodes above it: it counts with the smallest key on the way down to it. Parents
  // come last.
  refined_.assign(keys.begin(), keys.end());
  for (std::size_t slot = refined_.size(); slot-- > tree.leaves().size();) {
    for (const std::uint32_t child : tree[static_cast<std::uint32_t>(slot)].child) {
      refined_[child] = std::min(refined_[child], refined_[slot]);
    }
  }
  // Leaves are not refined. Each refinement adds a link, so that maxNodes limits their number.
  const auto begin = refined_.begin() + static_cast<std::ptrdiff_t>(tree.leaves().size());
  const auto inner = static_cast<std::size_t>(refined_.end() - begin);
  const std::size_t allowed = maxNodes > tree.roots().size() ? maxNodes - tree.roots().size() : 0;
  auto end = refined_.end();
  if (allowed < inner) {
    end = begin + static_cast<std::ptrdiff_t>(allowed);
    std::nth_element(begin, end, refined_.end(), std::greater<>());
  }
  for (auto key = begin; key != end; ++key) count_[binOf(*key)] += 1;
}

void KeyCounts::merge(const KeyCounts& other) {
  caches_ += other.caches_;
  roots_ += other.roots_;
  if (count_.empty()) count_.assign(kBins, 0);
  for (std::size_t i = 0; i < other.count_.size(); ++i) count_[i] += other.count_[i];
}

float KeyCounts::keyFor(double links) const {
  double used = static_cast<double>(roots_);
  for (std::size_t bin = count_.size(); bin-- > 0;) {
    used += static_cast<double>(count_[bin]);
    if (count_[bin] == 0 || used <= links) continue;
    // This bin no longer fits: refine what is above it.
    const float next = std::bit_cast<float>(static_cast<std::uint32_t>((bin + 1) << kShift));
    return std::nextafter(next, 0.0f);
  }
  return -1.0f;
}

}  // namespace relume
