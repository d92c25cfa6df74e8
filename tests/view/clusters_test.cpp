// SPDX-License-Identifier: MIT
// What the overlays draw of a bake is what the bake has.
#include "tools/view/clusters.h"

#include "tests/runtime/synthetic_bake.h"
#include "tools/view/spheres.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <set>

namespace relume {
namespace {

Bake box(LinkKind kind = LinkKind::cone) {
  return test::makeSyntheticBake({.surfels = 300, .skyPatches = 8, .linksPerCache = 24, .kind = kind});
}

// Whether `node` is `below` or one of its ancestors.
bool isAbove(const Hierarchy& tree, std::uint32_t node, std::uint32_t below) {
  if (node == below) return true;
  if (tree.isLeaf(node)) return false;
  return isAbove(tree, tree.child[node], below) || isAbove(tree, tree.child[node] + 1, below);
}

TEST(Clusters, levelsCutTheTreeAboveEverySurfel) {
  const Bake bake = box();
  const Hierarchy& tree = bake.hierarchy;
  std::size_t last = 0;
  for (std::uint32_t level = 0; level < tree.levelCount() + 2; ++level) {
    const std::vector<std::uint32_t> clusters = clustersAtLevel(bake, level);
    ASSERT_EQ(clusters.size(), bake.surfels.count());
    const std::uint32_t end = level + 1 < tree.levelCount() ? tree.levelBegin[level + 1] : tree.nodeCount();
    for (std::uint32_t s = 0; s < clusters.size(); ++s) {
      ASSERT_TRUE(isAbove(tree, clusters[s], tree.leafNode[s]));
      ASSERT_LT(clusters[s], end);
      // A node above the level is there only as a leaf.
      if (level < tree.levelCount() && clusters[s] < tree.levelBegin[level]) {
        ASSERT_TRUE(tree.isLeaf(clusters[s]));
      }
    }
    const std::size_t count = std::set(clusters.begin(), clusters.end()).size();
    EXPECT_GE(count, last);
    last = count;
  }
  const std::vector<std::uint32_t> root = clustersAtLevel(bake, 0);
  EXPECT_EQ(std::count(root.begin(), root.end(), 0u), static_cast<std::ptrdiff_t>(root.size()));
  EXPECT_EQ(last, bake.surfels.count());
}

TEST(Clusters, linksAreThoseOfTheCache) {
  for (const LinkKind kind : kLinkKinds) {
    const Bake bake = box(kind);
    const ClusterLinks links(bake);
    bool anySky = false;
    for (const std::uint32_t cache : {0u, bake.caches.count() - 1}) {
      const std::vector<DrawnLink> drawn = links.linksOf(cache);
      ASSERT_EQ(drawn.size(), bake.links.rowBegin[cache + 1] - bake.links.rowBegin[cache]);
      float sum = 0.0f;
      for (std::size_t i = 0; i < drawn.size(); ++i) {
        EXPECT_EQ(drawn[i].node, bake.links.node(bake.links.rowBegin[cache] + static_cast<std::uint32_t>(i)));
        EXPECT_GE(drawn[i].transfer, 0.0f);
        sum += drawn[i].transfer;
        anySky = anySky || drawn[i].isSky;
        if (drawn[i].isSky) {
          EXPECT_NEAR(glm::length(drawn[i].centre), 1.0f, 1e-4f);
        } else if (bake.hierarchy.isLeaf(drawn[i].node)) {
          EXPECT_EQ(drawn[i].centre, bake.surfels.positionWorld[bake.hierarchy.sender(drawn[i].node)]);
        }
      }
      // 2 y_0 of a hemisphere, twice that of the sphere
      EXPECT_NEAR(sum, cache == 0 ? 4.0f * 0.2821f : 2.0f * 0.2821f, 0.03f);
      const std::vector<std::uint32_t> clusters = links.clustersOf(drawn);
      for (std::uint32_t s = 0; s < clusters.size(); ++s) {
        const auto above = std::find_if(drawn.begin(), drawn.end(), [&](const DrawnLink& l) {
          return isAbove(bake.hierarchy, l.node, bake.hierarchy.leafNode[s]);
        });
        EXPECT_EQ(clusters[s], above == drawn.end() ? ClusterLinks::kNoNode : above->node);
      }
    }
    EXPECT_TRUE(anySky);
  }
}

TEST(Clusters, aPickedPointFindsTheCacheItReads) {
  const Bake bake = box();
  const ClusterLinks links(bake);
  for (std::uint32_t cache = bake.caches.firstMapCache(); cache < bake.caches.count(); cache += 37) {
    const glm::vec3 position = bake.caches.positionWorld[cache], normal = bake.caches.normal[cache];
    const auto found = links.cacheAt(position, position + normal);
    ASSERT_TRUE(found);
    EXPECT_EQ(bake.caches.positionWorld[*found], position);
    // From behind, a wall's caches are not what is seen.
    const auto behind = links.cacheAt(position, position - normal);
    EXPECT_TRUE(!behind || glm::dot(bake.caches.normal[*behind], normal) <= 0.0f);
  }
}

TEST(CacheSpheres, tellValidMovedAndOffApart) {
  Bake bake = test::makeBakeWithBricks({4, 3, 4}, true, false);
  const std::uint32_t caches = bake.caches.count();
  std::set<std::uint32_t> inGrid;
  for (const std::uint32_t c : bake.caches.grid.cache) inGrid.insert(c);
  const std::uint32_t some = *inGrid.begin();
  ASSERT_LT(some, caches);
  std::vector<glm::vec3> positions = bake.caches.positionWorld.toVector();
  // A bake of this test has its bricks' caches anywhere; put one cache of the lattice onto its point, and one beside.
  const CacheGrid& grid = bake.caches.grid;
  const auto first =
      static_cast<std::uint32_t>(std::find(grid.cache.begin(), grid.cache.end(), some) - grid.cache.begin());
  const glm::vec3 point = grid.originWorld + grid.spacing * glm::vec3(first % 4, first / 4 % 3, first / 12);
  for (const float away : {0.0f, 0.2f}) {
    Bake changed = bake;
    positions[some] = point + glm::vec3(away * grid.spacing.x, 0.0f, 0.0f);
    changed.caches.positionWorld = positions;
    // Only the lattice's points, so that no brick names the cache too
    changed.caches.grid.brick = changed.caches.grid.fine = std::vector<std::uint32_t>();
    std::vector<std::uint32_t> lattice = grid.cache.toVector();
    for (std::uint32_t i = 0; i < lattice.size(); ++i) {
      if (i != first) lattice[i] = kNoCache;
    }
    changed.caches.grid.cache = lattice;
    const std::vector<CacheSphere> spheres = cacheSpheres(changed);
    ASSERT_EQ(spheres.size(), caches + lattice.size() - 1) << "all caches, then points without";
    EXPECT_EQ(spheres[some].state, away > 0.0f ? CacheState::moved : CacheState::valid);
    for (std::size_t i = caches; i < spheres.size(); ++i) EXPECT_EQ(spheres[i].state, CacheState::off);
    for (const CacheSphere& s : spheres) EXPECT_GT(s.radius, 0.0f);
  }
}

}  // namespace
}  // namespace relume
