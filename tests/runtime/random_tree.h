// SPDX-License-Identifier: MIT
// Hierarchies of random shape and weights, laid out as include/relume/hierarchy.h wants them.
#pragma once

#include "relume/hierarchy.h"

#include <algorithm>
#include <random>
#include <vector>

namespace relume::test {

// [evenness 0..0.5] least share of its leaves that a node's smaller child has: 0 gives long chains.
inline Hierarchy makeRandomTree(std::uint32_t leaves, float evenness, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::vector<std::uint32_t> size{leaves}, child, levelBegin{0}, leafNode(leaves);
  std::vector<float> weight;
  std::uint32_t sender = 0;
  for (std::uint32_t i = 0, levelEnd = 1; i < size.size(); ++i) {
    if (i == levelEnd) {
      levelBegin.push_back(levelEnd);
      levelEnd = static_cast<std::uint32_t>(size.size());
    }
    if (size[i] == 1) {
      leafNode[sender] = i;
      child.push_back(kLeafBit | sender++);
      weight.push_back(0.0f);
      continue;
    }
    const auto min = std::max(static_cast<std::uint32_t>(evenness * static_cast<float>(size[i])), 1u);
    child.push_back(static_cast<std::uint32_t>(size.size()));
    // Some children count for nothing.
    weight.push_back(i % 17 == 0 ? 0.0f : uniform(random));
    size.push_back(min);
    size.push_back(size[i] - min);
  }
  levelBegin.push_back(static_cast<std::uint32_t>(size.size()));
  Hierarchy tree;
  tree.child = std::move(child);
  tree.firstWeight = std::move(weight);
  tree.levelBegin = std::move(levelBegin);
  tree.leafNode = std::move(leafNode);
  tree.groupRoot = std::vector<std::uint32_t>{0};
  return tree;
}

}  // namespace relume::test
