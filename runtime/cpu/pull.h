// SPDX-License-Identifier: MIT
// Step 3 on the CPU: radiosity averaged up the hierarchy (PIC 4.1, 4.3).
//
// Breadth first, the children of the inner nodes lie in a row behind the root: the k-th inner node's are 1 + 2 k and
// 2 + 2 k. So the whole tree is one bit per node and a weight of 16 bits per inner node.
#pragma once

#include "relume/hierarchy.h"
#include "relume/relighter.h"
#include "runtime/cpu/light_surfels_job.h"
#include "runtime/cpu/node_set.h"

#include <memory_resource>
#include <span>
#include <vector>

namespace relume::cpu {

class PullTree {
 public:
  // The hierarchy must pass checkBake(). memory: keeps the tree.
  PullTree(const Hierarchy& hierarchy, std::pmr::memory_resource* memory);
  // Fills the inner nodes from the leaves (runtime/shared/pack_color.h), deepest level first. [Size node = nodeCount()]
  void pull(const LightSurfelsKernel& kernel, std::span<std::uint32_t> node, const ParallelFor& parallelFor) const;
  std::size_t bytes() const;

 private:
  void cutUp(const Hierarchy& hierarchy, std::span<const std::uint32_t> innerBefore);
  // Inner nodes [begin, end), all of one level.
  void pullNodes(const LightSurfelsKernel& kernel, std::span<std::uint32_t> node, std::uint32_t begin,
                 std::uint32_t end) const;

  NodeSet inner_;
  std::pmr::vector<std::uint16_t> weight_;      // [Size inner nodes] of the first child, over 65534
  std::pmr::vector<std::uint32_t> innerBegin_;  // [Size levels + 1] inner nodes above each level
  std::uint32_t cut_ = 0, parts_ = 0;           // the level at which the tree is cut, and into how many
  std::pmr::vector<std::uint32_t>
      bound_;  // [Size (parts + 1) * levels from the cut on] first inner node of a part's level
};

}  // namespace relume::cpu
