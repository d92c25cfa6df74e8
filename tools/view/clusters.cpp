// SPDX-License-Identifier: MIT
// See clusters.h. Parents stand before their children, so that one pass forward hands down and one backward sums up.
#include "tools/view/clusters.h"

#include "formats/compact_links.h"
#include "formats/pack.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <utility>

namespace relume {
namespace {

// What each node has of its nearest marked ancestor, itself among them; `none` without one.
std::vector<std::uint32_t> handDown(const Hierarchy& tree, std::vector<std::uint32_t> mark, std::uint32_t none) {
  for (std::uint32_t node = 0; node < tree.nodeCount(); ++node) {
    if (tree.isLeaf(node)) continue;
    for (const std::uint32_t child : {tree.child[node], tree.child[node] + 1}) {
      if (mark[node] != none) mark[child] = mark[node];
    }
  }
  return mark;
}

std::vector<std::uint32_t> ofSurfels(const Bake& bake, const std::vector<std::uint32_t>& ofNodes) {
  std::vector<std::uint32_t> nodes(bake.surfels.count());
  for (std::size_t s = 0; s < nodes.size(); ++s) nodes[s] = ofNodes[bake.hierarchy.leafNode[s]];
  return nodes;
}

float transferOf(const Links& links, std::uint32_t link) {
  switch (links.kind) {
    case LinkKind::sh:
      return unpackHalf(links.shCoefficients[std::size_t{link} * links.bands * links.bands]);
    case LinkKind::cone:
      return unpackHalf(links.cone[link].transfer);
    case LinkKind::oct6:
    case LinkKind::irradiance:
      return unpackTransfer(links.head[link] >> 20);
  }
  return 0.0f;
}

}  // namespace

std::vector<std::uint32_t> clustersAtLevel(const Bake& bake, std::uint32_t level) {
  const Hierarchy& tree = bake.hierarchy;
  // Above the level every node stands for itself, and so do the leaves there; from it on, nodes stand for what is
  // below.
  std::vector<std::uint32_t> mark(tree.nodeCount());
  for (std::uint32_t node = 0; node < mark.size(); ++node) mark[node] = node;
  const std::uint32_t first = level < tree.levelCount() ? tree.levelBegin[level] : tree.nodeCount();
  for (std::uint32_t node = first; node < mark.size(); ++node) {
    if (tree.isLeaf(node)) continue;
    mark[tree.child[node]] = mark[tree.child[node] + 1] = mark[node];
  }
  return ofSurfels(bake, mark);
}

glm::vec3 clusterColor(std::uint32_t node) {
  // Hues by the golden ratio, which are apart for neighbours, in two rings of brightness.
  const float hue = 6.0f * std::fmod(0.61803399f * static_cast<float>(node % 4096u), 1.0f);
  const glm::vec3 pure = glm::clamp(
      glm::vec3(std::abs(hue - 3.0f) - 1.0f, 2.0f - std::abs(hue - 2.0f), 2.0f - std::abs(hue - 4.0f)), 0.0f, 1.0f);
  return (node % 2u == 0u ? 1.0f : 0.4f) * (0.015f + 0.985f * pure);
}

ClusterLinks::ClusterLinks(const Bake& bake)
    : bake_(&bake), centre_(bake.hierarchy.nodeCount(), glm::vec3(0.0f)), surfels_(bake.hierarchy.nodeCount(), 0) {
  const Hierarchy& tree = bake.hierarchy;
  std::vector<glm::dvec3> sum(tree.nodeCount(), glm::dvec3(0.0)), sky = sum;
  for (std::uint32_t node = tree.nodeCount(); node-- > 0;) {
    if (tree.isLeaf(node)) {
      const std::uint32_t sender = tree.sender(node);
      if (sender < bake.surfels.count()) {
        sum[node] = glm::dvec3(bake.surfels.positionWorld[sender]);
        surfels_[node] = 1;
      } else {
        sky[node] = glm::dvec3(tree.skyDirection[sender - bake.surfels.count()]);
      }
    } else {
      for (const std::uint32_t child : {tree.child[node], tree.child[node] + 1}) {
        sum[node] += sum[child];
        sky[node] += sky[child];
        surfels_[node] += surfels_[child];
      }
    }
    if (surfels_[node] > 0) {
      centre_[node] = glm::vec3(sum[node] / static_cast<double>(surfels_[node]));
    } else if (glm::length(sky[node]) > 0.0) {
      centre_[node] = glm::vec3(glm::normalize(sky[node]));
    }
  }
}

std::optional<std::uint32_t> ClusterLinks::cacheAt(const glm::vec3& positionWorld, const glm::vec3& eye) const {
  const Caches& caches = bake_->caches;
  std::optional<std::uint32_t> nearest;
  float best = std::numeric_limits<float>::infinity();
  for (std::uint32_t i = 0; i < caches.count(); ++i) {
    const bool onSurface = glm::dot(caches.normal[i], caches.normal[i]) > 0.0f;
    if (onSurface && glm::dot(caches.normal[i], eye - positionWorld) <= 0.0f) continue;
    // Surfaces that are on the light map do not read the air.
    const float distance = (onSurface ? 1.0f : 2.0f) * glm::distance(caches.positionWorld[i], positionWorld);
    if (!(distance < best)) continue;
    best = distance;
    nearest = i;
  }
  return nearest;
}

std::vector<DrawnLink> ClusterLinks::linksOf(std::uint32_t cache) const {
  std::vector<DrawnLink> drawn;
  const Links& links = bake_->links;
  for (std::uint32_t i = links.rowBegin[cache]; i < links.rowBegin[cache + 1]; ++i) {
    const std::uint32_t node = links.node(i);
    drawn.push_back({node, transferOf(links, i), surfels_[node] == 0, centre_[node]});
  }
  return drawn;
}

std::vector<std::uint32_t> ClusterLinks::clustersOf(std::span<const DrawnLink> links) const {
  std::vector<std::uint32_t> mark(bake_->hierarchy.nodeCount(), kNoNode);
  for (const DrawnLink& link : links) mark[link.node] = link.node;
  return ofSurfels(*bake_, handDown(bake_->hierarchy, std::move(mark), kNoNode));
}

}  // namespace relume
