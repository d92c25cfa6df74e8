// SPDX-License-Identifier: MIT
// The 3xx and 5xx checks: weights and groups of the hierarchy, links as cuts. The bake is safe to index (1xx found
// nothing). Whether the numbers of links are any is checkNumbers()'s.
#include "formats/compact_links.h"
#include "formats/decimal.h"
#include "formats/findings.h"
#include "formats/pack.h"
#include "formats/validate.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

namespace relume {
namespace {

// Leaves below each node as a range of the leaves in depth-first order: one node lies below another exactly when its
// range lies within the other's.
struct LeafRanges {
  std::vector<std::uint32_t> begin, count;  // [Size nodes]
  std::uint32_t end(std::uint32_t node) const { return begin[node] + count[node]; }
  bool within(std::uint32_t node, std::uint32_t ancestor) const {
    return begin[node] >= begin[ancestor] && end(node) <= end(ancestor);
  }
};

// Parents come before their children: one pass up for the counts, one down for the ranges.
LeafRanges leafRanges(const Hierarchy& h) {
  LeafRanges r;
  r.begin.assign(h.nodeCount(), 0);
  r.count.assign(h.nodeCount(), 1);
  for (std::uint32_t node = h.nodeCount(); node-- > 0;) {
    if (!h.isLeaf(node)) r.count[node] = r.count[h.child[node]] + r.count[h.child[node] + 1];
  }
  for (std::uint32_t node = 0; node < h.nodeCount(); ++node) {
    if (h.isLeaf(node)) continue;
    const std::uint32_t child = h.child[node];
    r.begin[child] = r.begin[node];
    r.begin[child + 1] = r.begin[node] + r.count[child];
  }
  return r;
}

bool inGroup(const Hierarchy& h, const LeafRanges& ranges, std::uint32_t node) {
  return std::any_of(h.groupRoot.begin(), h.groupRoot.end(),
                     [&](std::uint32_t root) { return ranges.within(node, root); });
}

void checkWeights(const Bake& bake, const LeafRanges& ranges, Findings& findings) {
  const Hierarchy& h = bake.hierarchy;
  const bool equalAreas = pullsByArea(bake.provenance);
  for (std::uint32_t node = 0; node < h.nodeCount(); ++node) {
    const float weight = h.firstWeight[node];
    if (!(weight >= 0.0f && weight <= 1.0f)) continue;  // checkNumbers()
    if (h.isLeaf(node)) {
      if (weight != 0.0f) findings.add(Check::firstWeightLeaf, At{"node.weight", node}, 0, weight);
      continue;
    }
    const float area = static_cast<float>(ranges.count[h.child[node]]) / static_cast<float>(ranges.count[node]);
    if (equalAreas && inGroup(h, ranges, node) && std::abs(weight - area) > 1e-5f)
      findings.add(Check::firstWeightArea, At{"node.weight", node}, area, weight);
  }
}

// Surfels of materials that are marked as drivable: emitters, also where they are dark.
std::vector<bool> markedSurfels(const Bake& bake) {
  std::vector<bool> marked(bake.surfels.count(), false);
  for (const DrivableMaterial& material : bake.emitters.materials) {
    for (std::uint32_t i = 0; i < material.entryCount && material.marked; ++i)
      marked[bake.emitters.surfel[material.firstEntry + i]] = true;
  }
  return marked;
}

const char* kindOf(const Bake& bake, const std::vector<bool>& marked, std::uint32_t sender) {
  if (sender >= bake.surfels.count()) return "sky";
  const glm::vec3& e = bake.surfels.emission[sender];
  return e.x > 0.0f || e.y > 0.0f || e.z > 0.0f || marked[sender] ? "emitter" : "reflector";
}

void checkGroups(const Bake& bake, const LeafRanges& ranges, Findings& findings) {
  const Hierarchy& h = bake.hierarchy;
  // Groups are disjoint and hold all senders.
  for (std::size_t i = 0; i < h.groupRoot.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (ranges.within(h.groupRoot[i], h.groupRoot[j]))
        findings.add(Check::groupsOverlap, At{"node.group", i}, "no node below another group", h.groupRoot[i]);
    }
  }
  const std::vector<bool> marked = markedSurfels(bake);
  std::vector<const char*> kind(h.groupRoot.size(), nullptr);
  for (std::uint32_t sender = 0; sender < h.senderCount(); ++sender) {
    std::size_t group = 0;
    while (group < kind.size() && !ranges.within(h.leafNode[sender], h.groupRoot[group])) ++group;
    if (group == kind.size()) {
      findings.add(Check::groupsIncomplete, "sender " + std::to_string(sender), "below a group's root", "none");
      continue;
    }
    const char* mine = kindOf(bake, marked, sender);
    if (kind[group] == nullptr) kind[group] = mine;
    if (std::string_view(kind[group]) != mine)
      findings.add(Check::groupMixed, "sender " + std::to_string(sender), kind[group], mine);
  }
}

// A cut holds no node and its ancestor, and nothing above the groups.
void checkCut(const Bake& bake, const LeafRanges& ranges, std::span<const std::uint32_t> nodes, std::uint32_t cache,
              std::vector<std::uint32_t>& byLeaf, Findings& findings) {
  byLeaf.assign(nodes.begin(), nodes.end());
  std::sort(byLeaf.begin(), byLeaf.end(), [&](std::uint32_t a, std::uint32_t b) {
    return ranges.begin[a] != ranges.begin[b] ? ranges.begin[a] < ranges.begin[b] : a < b;
  });
  for (std::size_t i = 1; i < byLeaf.size(); ++i) {
    if (ranges.begin[byLeaf[i]] < ranges.end(byLeaf[i - 1]))
      findings.add(Check::linkAncestor, "row of cache " + std::to_string(cache), "disjoint nodes",
                   std::to_string(byLeaf[i - 1]) + " and " + std::to_string(byLeaf[i]));
  }
  for (const std::uint32_t node : nodes) {
    if (!inGroup(bake.hierarchy, ranges, node))
      findings.add(Check::linkAboveGroups, "row of cache " + std::to_string(cache), "a node of a group", node);
  }
}

// Check the direction of one cone link; returns its transfer f.
float checkCone(const ConeLink& link, std::uint64_t index, Findings& findings) {
  const float transfer = unpackHalf(link.transfer), cosAlpha = unpackHalf(link.cosAlpha);
  // Only light from all around has no mean direction.
  if (link.direction == kNoDirection && transfer > 0.0f && cosAlpha > -0.9f)
    findings.add(Check::linkDirection, At{"link.cone", index}, "a direction", "none");
  return transfer;
}

// Transfer f of a link of any kind; of cones the direction is checked as well.
float transferOf(const Links& l, std::uint32_t index, Findings& findings) {
  switch (l.kind) {
    case LinkKind::sh:
      return unpackHalf(l.shCoefficients[std::size_t{l.bands} * l.bands * index]);
    case LinkKind::cone:
      return checkCone(l.cone[index], index, findings);
    default:
      return unpackTransfer(l.head[index] >> 20);
  }
}

// f = y_0 * solid angle / pi (include/relume/links.h): a full sphere sums to 4 y_0, a hemisphere to half of it. Solid
// angles estimated by few rays, and halves, stay within 5 %.
void checkEnergy(const Caches& caches, std::uint32_t cache, double transfer, Findings& findings) {
  constexpr double kSphere = 4.0 * 0.28209479177387814, kTolerance = 1.05;
  const glm::vec3 n = caches.normal[cache];
  const bool surface = n.x != 0.0f || n.y != 0.0f || n.z != 0.0f;
  if (transfer > kSphere * kTolerance)
    findings.add(Check::linkEnergySphere, "cache " + std::to_string(cache), "at most " + decimalGeneral(kSphere, 6),
                 transfer);
  else if (surface && transfer > 0.5 * kSphere * kTolerance)
    findings.add(Check::linkEnergyHemisphere, "cache " + std::to_string(cache),
                 "at most " + decimalGeneral(0.5 * kSphere, 6), transfer);
}

}  // namespace

void checkHierarchy(const Bake& bake, Findings& findings) {
  const LeafRanges ranges = leafRanges(bake.hierarchy);
  checkWeights(bake, ranges, findings);
  checkGroups(bake, ranges, findings);
}

void checkLinks(const Bake& bake, Findings& findings) {
  const Links& l = bake.links;
  const LeafRanges ranges = leafRanges(bake.hierarchy);
  std::vector<std::uint32_t> nodes, byLeaf;
  for (std::uint32_t cache = 0; cache < l.cacheCount(); ++cache) {
    nodes.clear();
    double transfer = 0.0;
    for (std::uint32_t i = l.rowBegin[cache]; i < l.rowBegin[cache + 1]; ++i) {
      nodes.push_back(l.node(i));
      transfer += transferOf(l, i, findings);
    }
    if (nodes.empty()) findings.add(Check::cacheWithoutLinks, "cache " + std::to_string(cache), "at least 1", 0);
    checkCut(bake, ranges, nodes, cache, byLeaf, findings);
    checkEnergy(bake.caches, cache, transfer, findings);
  }
}

}  // namespace relume
