// SPDX-License-Identifier: MIT
// The fast alternative to agglomerative clustering (PIC 4.3 names it): a kd-tree over the surfels' positions by median
// splits along the longest axis. Ties go to the smaller index.
#include "bake/hierarchy/hierarchy.h"

#include <glm/common.hpp>

#include <algorithm>
#include <string>

namespace relume {
namespace {

struct Splitter {
  const Surfels& surfels;
  std::span<const std::uint32_t> members;
  ClusterTree tree;

  // Build the node over some of the members. The recursion is log2 of their number deep.
  std::uint32_t split(std::span<std::uint32_t> leaves) {
    if (leaves.size() == 1) return leaves[0];
    glm::vec3 low = position(leaves[0]), high = low;
    for (const std::uint32_t leaf : leaves) {
      low = glm::min(low, position(leaf));
      high = glm::max(high, position(leaf));
    }
    const glm::vec3 size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    const std::size_t middle = leaves.size() / 2;
    std::nth_element(leaves.begin(), leaves.begin() + static_cast<std::ptrdiff_t>(middle), leaves.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       const float x = position(a)[axis], y = position(b)[axis];
                       return x < y || (x == y && a < b);
                     });
    const std::uint32_t first = split(leaves.first(middle));
    const std::uint32_t second = split(leaves.subspan(middle));
    tree.first.push_back(first);
    tree.second.push_back(second);
    return tree.leafCount + static_cast<std::uint32_t>(tree.first.size()) - 1;
  }

  const glm::vec3& position(std::uint32_t leaf) const { return surfels.positionWorld[members[leaf]]; }
};

}  // namespace

Result<ClusterTree> splitMedian(const Surfels& surfels, std::span<const std::uint32_t> members, Context& context) {
  if (members.empty()) return Error{ErrorCode::failed, "clustering needs at least one surfel"};
  std::vector<std::uint32_t> leaves(members.size());
  for (std::uint32_t i = 0; i < leaves.size(); ++i) {
    if (members[i] >= surfels.count()) {
      return Error{ErrorCode::failed, "clustering: surfel " + std::to_string(members[i]) + " of " +
                                          std::to_string(surfels.count()) + " does not exist"};
    }
    leaves[i] = i;
  }
  if (!context.progress("clustering", 0.0)) return cancelledError();

  Splitter splitter{surfels, members, {}};
  splitter.tree.leafCount = static_cast<std::uint32_t>(members.size());
  splitter.tree.first.reserve(members.size() - 1);
  splitter.tree.second.reserve(members.size() - 1);
  splitter.split(leaves);
  return std::move(splitter.tree);
}

}  // namespace relume
