// SPDX-License-Identifier: MIT
// The layout of the hierarchy, its weights, and its groups.
#include "bake/hierarchy/hierarchy.h"
#include "tests/hierarchy/make_surfels.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relume {
namespace {

// Every third surfel of the last tenth glows.
Surfels makeSurfelsWithEmitters(std::uint32_t count, std::uint64_t seed) {
  Surfels surfels = makeSurfels(count, seed);
  std::vector<glm::vec3> emission = surfels.emission.toVector();
  for (std::uint32_t i = count - count / 10; i < count; i += 3) emission[i] = glm::vec3(0, 2, 0);
  surfels.emission = std::move(emission);
  return surfels;
}

void expectInvariants(const Hierarchy& h, std::uint32_t surfelCount) {
  const std::uint32_t nodes = h.nodeCount(), senders = h.senderCount();
  ASSERT_EQ(senders, surfelCount + h.skyDirection.size());
  ASSERT_EQ(nodes, 2 * senders - 1);
  ASSERT_EQ(h.firstWeight.size(), nodes);

  // Every sender is one leaf, every node but the root is one child; parents come before children.
  std::vector<int> isChild(nodes, 0), isSender(senders, 0);
  std::vector<std::uint32_t> depth(nodes, 0);
  for (std::uint32_t i = 0; i < nodes; ++i) {
    if (h.isLeaf(i)) {
      ASSERT_LT(h.sender(i), senders);
      ++isSender[h.sender(i)];
      EXPECT_EQ(h.leafNode[h.sender(i)], i);
      EXPECT_EQ(h.firstWeight[i], 0.0f);
      continue;
    }
    ASSERT_GT(h.child[i], i);
    ASSERT_LT(h.child[i] + 1, nodes);
    for (const std::uint32_t c : {h.child[i], h.child[i] + 1}) {
      ++isChild[c];
      depth[c] = depth[i] + 1;
    }
    EXPECT_GT(h.firstWeight[i], 0.0f);
    EXPECT_LT(h.firstWeight[i], 1.0f);
  }
  for (const int n : isSender) EXPECT_EQ(n, 1);
  for (std::uint32_t i = 1; i < nodes; ++i) EXPECT_EQ(isChild[i], 1);
  EXPECT_EQ(isChild[0], 0);

  // Levels are the nodes of one depth, in order.
  ASSERT_GE(h.levelBegin.size(), 2u);
  EXPECT_EQ(h.levelBegin.front(), 0u);
  EXPECT_EQ(h.levelBegin.back(), nodes);
  for (std::uint32_t level = 0; level < h.levelCount(); ++level) {
    EXPECT_LT(h.levelBegin[level], h.levelBegin[level + 1]);
    for (std::uint32_t i = h.levelBegin[level]; i < h.levelBegin[level + 1]; ++i) EXPECT_EQ(depth[i], level);
  }
}

// Senders under a node.
std::vector<std::uint32_t> sendersUnder(const Hierarchy& h, std::uint32_t node) {
  std::vector<std::uint32_t> senders, stack{node};
  while (!stack.empty()) {
    const std::uint32_t at = stack.back();
    stack.pop_back();
    if (h.isLeaf(at)) {
      senders.push_back(h.sender(at));
    } else {
      stack.push_back(h.child[at]);
      stack.push_back(h.child[at] + 1);
    }
  }
  return senders;
}

void expectGroupsAreUnmixed(const Hierarchy& h, const Surfels& surfels, std::size_t groups) {
  ASSERT_EQ(h.groupRoot.size(), groups);
  const auto kindOf = [&](std::uint32_t sender) {
    if (sender >= surfels.count()) return 2;
    return surfels.emission[sender] == glm::vec3(0.0f) ? 0 : 1;
  };
  std::size_t covered = 0;
  std::vector<int> kinds;
  for (std::size_t g = 0; g < groups; ++g) {
    if (g > 0) {
      EXPECT_GT(h.groupRoot[g], h.groupRoot[g - 1]);
    }
    const std::vector<std::uint32_t> senders = sendersUnder(h, h.groupRoot[g]);
    covered += senders.size();
    kinds.push_back(kindOf(senders[0]));
    for (const std::uint32_t sender : senders) EXPECT_EQ(kindOf(sender), kinds.back());
  }
  EXPECT_EQ(covered, h.senderCount());
  std::sort(kinds.begin(), kinds.end());
  EXPECT_EQ(std::unique(kinds.begin(), kinds.end()), kinds.end());
}

TEST(ClusterSurfels, keepsTheLayoutsInvariants) {
  Context context;
  for (const auto method : {ClusteringOptions::Method::approximate, ClusteringOptions::Method::exact}) {
    ClusteringOptions options;
    options.method = method;
    for (const std::uint32_t count : {1u, 2u, 3u, 50u, 2000u}) {
      for (const std::uint32_t sky : {0u, 1u, 2u, 64u}) {
        const Surfels surfels = makeSurfels(count, 1);
        const Result<Hierarchy> h = clusterSurfels(surfels, sky, options, context);
        ASSERT_TRUE(h);
        expectInvariants(*h, count);
        expectGroupsAreUnmixed(*h, surfels, sky == 0 ? 1 : 2);
      }
    }
  }
}

TEST(ClusterSurfels, neverMixesReflectorsEmittersAndSky) {
  Context context;
  const Surfels surfels = makeSurfelsWithEmitters(1000, 2);
  for (const std::uint32_t sky : {0u, 16u}) {
    const Result<Hierarchy> h = clusterSurfels(surfels, sky, {}, context);
    ASSERT_TRUE(h);
    expectInvariants(*h, 1000);
    expectGroupsAreUnmixed(*h, surfels, sky == 0 ? 2 : 3);
  }
}

TEST(ClusterSurfels, allEmittersAreOneGroup) {
  Context context;
  Surfels surfels = makeSurfels(40, 2);
  surfels.emission = std::vector<glm::vec3>(40, glm::vec3(1));
  const Result<Hierarchy> h = clusterSurfels(surfels, 0, {}, context);
  ASSERT_TRUE(h);
  expectInvariants(*h, 40);
  ASSERT_EQ(h->groupRoot.size(), 1u);
  EXPECT_EQ(h->groupRoot[0], 0u);
}

TEST(ClusterSurfels, pullWithTheWeightsGivesTheAreaMean) {
  Context context;
  const Surfels surfels = makeSurfelsWithEmitters(3000, 8);
  const Result<Hierarchy> h = clusterSurfels(surfels, 32, {}, context);
  ASSERT_TRUE(h);
  std::vector<double> radiosity(h->nodeCount());
  const auto leafRadiosity = [](std::uint32_t sender) { return 1.0 + (sender * 7919u % 1000u); };
  for (std::uint32_t i = h->nodeCount(); i-- > 0;) {
    if (h->isLeaf(i)) {
      radiosity[i] = leafRadiosity(h->sender(i));
    } else {
      const double w = h->firstWeight[i];
      radiosity[i] = w * radiosity[h->child[i]] + (1.0 - w) * radiosity[h->child[i] + 1];
    }
  }
  for (const std::uint32_t root : h->groupRoot) {
    double mean = 0.0;
    const std::vector<std::uint32_t> senders = sendersUnder(*h, root);
    for (const std::uint32_t sender : senders) mean += leafRadiosity(sender) / static_cast<double>(senders.size());
    EXPECT_NEAR(radiosity[root], mean, 1e-4 * mean);
  }
}

TEST(ClusterSurfels, staysShallow) {
  Context context;
  const Surfels surfels = makeSurfels(32768, 3);
  const Result<Hierarchy> h = clusterSurfels(surfels, 0, {}, context);
  ASSERT_TRUE(h);
  EXPECT_LE(h->levelCount(), 32u);
}

TEST(ClusterSurfels, skyDirectionsAreUnitAndOfEqualSolidAngles) {
  Context context;
  const Result<Hierarchy> h = clusterSurfels(makeSurfels(4, 1), 64, {}, context);
  ASSERT_TRUE(h);
  ASSERT_EQ(h->skyDirection.size(), 64u);
  for (const glm::vec3& d : h->skyDirection) EXPECT_NEAR(glm::length(d), 1.0f, 1e-6f);
  std::vector<int> hits(64, 0);
  const int samples = 200000;
  for (int i = 0; i < samples; ++i) {
    RandomStream random(1, 2, static_cast<std::uint64_t>(i));
    const float y = 2.0f * random.uniform() - 1.0f, azimuthRad = 6.2831853f * random.uniform();
    const float r = std::sqrt(1.0f - y * y);
    const glm::vec3 d(r * std::cos(azimuthRad), y, r * std::sin(azimuthRad));
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < 64; ++k) {
      if (glm::dot(h->skyDirection[k], d) > glm::dot(h->skyDirection[nearest], d)) nearest = k;
    }
    ++hits[nearest];
  }
  for (const int n : hits) EXPECT_NEAR(n, samples / 64.0, 0.15 * samples / 64.0);
}

TEST(ClusterSurfels, refusesBadInput) {
  Context context;
  EXPECT_EQ(clusterSurfels(Surfels{}, 0, {}, context).error().code, ErrorCode::failed);
  EXPECT_EQ(clusterSurfels(makeSurfels(4, 1), 4097, {}, context).error().code, ErrorCode::usage);
}

TEST(NodeGeometry, isTheMeanOfTheLeaves) {
  Context context;
  const Surfels surfels = makeSurfelsWithEmitters(700, 5);
  const Result<Hierarchy> h = clusterSurfels(surfels, 8, {}, context);
  ASSERT_TRUE(h);
  const NodeGeometry geometry = nodeGeometry(*h, surfels);
  for (std::uint32_t node = 0; node < h->nodeCount(); ++node) {
    const std::vector<std::uint32_t> senders = sendersUnder(*h, node);
    glm::dvec3 center(0.0), normal(0.0);
    std::size_t sky = 0;
    const auto placeOf = [&](std::uint32_t s) {
      return glm::dvec3(s < 700 ? surfels.positionWorld[s] : h->skyDirection[s - 700]);
    };
    for (const std::uint32_t s : senders) {
      center += placeOf(s) / static_cast<double>(senders.size());
      if (s < 700) normal += surfels.normal[s];
      if (s >= 700) ++sky;
    }
    double moment = 0.0;
    for (const std::uint32_t s : senders) moment += glm::dot(placeOf(s) - center, placeOf(s) - center);
    EXPECT_NEAR(geometry.area[node], 0.25 * static_cast<double>(senders.size() - sky), 1e-3);
    if (sky > 0 && sky < senders.size()) {
      EXPECT_TRUE(std::isinf(geometry.radius[node]));
      continue;
    }
    EXPECT_LT(glm::length(glm::dvec3(geometry.center[node]) - center), 1e-4);
    EXPECT_NEAR(geometry.radius[node], std::sqrt(moment / static_cast<double>(senders.size())), 1e-4);
    if (glm::length(normal) > 1e-6) {
      EXPECT_LT(glm::length(glm::dvec3(geometry.normal[node]) - glm::normalize(normal)), 1e-5);
    } else {
      EXPECT_EQ(geometry.normal[node], glm::vec3(0.0f));
    }
  }
}

}  // namespace
}  // namespace relume
