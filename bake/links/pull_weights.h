// SPDX-License-Identifier: MIT
// The weights with which children make up their parent's radiosity (Hierarchy::firstWeight).
//
// Deviation from PIC 4.1, whose clusters average by area. Most of a cluster's surfels are hidden from a cache that
// links to it, and hidden ones are darker than visible ones, so equal areas lose energy: 13 to 15 % in Sponza.
//
// `importance` is the adjoint of the cut. Let R(s) be the caches whose cut holds s or an ancestor of s: those that read
// the average at s. With
//   firstWeight[s] = sum_{c in R(s)} F_{c,first} / sum_{c in R(s)} F_{c,s},   F_{c,s} = light c receives from s,
// the light all caches receive together is exact under any lighting: by induction from the cut down, the leaves under
// s are read with the total weight sum_{c in R(s)} F_{c,s}, and each level splits that total as the caches themselves
// see it. It depends on geometry alone.
//
// A link that picks a node t below its own s reads t with all of F_{c,s}: it counts as one at t whose leaves send
// F_{c,s} / F_{c,t} of what they do. So what is exact is the light of all caches together as they read it.
//
// read[s] = sum_{c in R(s)} F_{c,s} is what all caches receive from s less what those receive whose cut lies at or
// below s. So a cache adds F to its leaves and subtracts it at the nodes of its cut; summing up the tree once gives
// read[s].
#pragma once

#include "bake/links/select_cut.h"
#include "relume/bake/options.h"
#include "relume/hierarchy.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Sums over caches, in fixed point: whole numbers add up to the same in any order. One a thread, merged at the end.
class PullSums {
 public:
  PullSums(const Hierarchy& hierarchy, LinkOptions::PullWeight kind);

  // Add what one cache sees and how its cut reads it.
  void add(const VisibleSubtree& tree, std::span<const CutLink> cut);
  void merge(const PullSums& other);
  // The sums themselves, by node: to be kept, and merged elsewhere. Empty for equal areas.
  std::span<const std::uint64_t> all() const { return all_; }
  std::span<const std::uint64_t> cut() const { return cut_; }
  // node: of the hierarchy; not for equal areas.
  void addAll(std::uint32_t node, std::uint64_t sum) { all_[node] += sum; }
  void addCut(std::uint32_t node, std::uint64_t sum) { cut_[node] += sum; }

  // firstWeight of every node. Nodes no cut averages fall back on what all caches receive, then on equal areas.
  std::vector<float> weights(const Hierarchy& hierarchy) const;

 private:
  // Both [Size nodes] for importance, empty for equal areas.
  std::vector<std::uint64_t> all_;  // received by all caches; leaves only
  std::vector<std::uint64_t> cut_;  // received through links to a node
};

}  // namespace relume
