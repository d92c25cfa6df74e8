// SPDX-License-Identifier: MIT
// simplifyForWeb(): what is rounded stays within the bounds that simplify.h gives, and what is left out is gone.
#include "relume/bake/simplify.h"

#include "formats/compact_links.h"
#include "formats/validate.h"
#include "relume/bake_file.h"
#include "tests/formats/small_bake.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

namespace relume {
namespace {

// A bake whose numbers need all their bits.
Bake makeUnevenBake(LinkKind kind) {
  Bake bake = makeSmallBake(kind);
  bake.surfels.areaEach = 0.37f;
  std::vector<glm::vec3> positions, normals, albedos, emissions;
  for (std::uint32_t i = 0; i < bake.surfels.count(); ++i) {
    const float t = static_cast<float>(i) + 0.123456f;
    positions.push_back(bake.surfels.positionWorld[i] +
                        0.01f * glm::vec3(std::sin(t), std::cos(t), std::sin(2.0f * t)));
    normals.push_back(glm::normalize(bake.surfels.normal[i] + 0.3f * glm::vec3(std::cos(t), 0.0f, std::sin(t))));
    albedos.push_back(glm::vec3(0.013f, 0.5f, 0.97f) * (0.9f + 0.01f * t));
    emissions.push_back(bake.surfels.emission[i] * (1.0f + 0.0123f * t));
  }
  bake.surfels.positionWorld = positions;
  bake.surfels.normal = normals;
  bake.surfels.albedo = albedos;
  bake.surfels.emission = emissions;
  std::vector<float> weights = bake.hierarchy.firstWeight.toVector();
  for (std::size_t i = 0; i < 7; ++i) weights[i] = 0.1f + 0.111f * static_cast<float>(i);
  bake.hierarchy.firstWeight = weights;
  bake.provenance.optionsJson = "{\"links\":{\"pull\":\"importance\"}}";
  return bake;
}

TEST(Simplify, staysValidOfAllLinkKinds) {
  for (const LinkKind kind : kLinkKinds) {
    const Bake bake = makeUnevenBake(kind);
    ASSERT_TRUE(validateBake(bake).empty()) << toString(validateBake(bake).front());
    for (const bool keep : {false, true}) {
      const Bake simple = simplifyForWeb(bake, {keep});
      for (const Finding& finding : validateBake(simple))
        ADD_FAILURE() << linkKindName(kind) << ": " << toString(finding);
      const Bake twice = simplifyForWeb(simple, {keep});
      for (const auto& [once, again] : {std::pair{simple.surfels.positionWorld, twice.surfels.positionWorld},
                                        std::pair{simple.surfels.normal, twice.surfels.normal},
                                        std::pair{simple.surfels.albedo, twice.surfels.albedo}})
        EXPECT_EQ(once.toVector(), again.toVector());
    }
  }
}

TEST(Simplify, keepsWeightsByArea) {
  const Bake bake = makeSmallBake();
  ASSERT_NE(bake.provenance.optionsJson.find("\"pull\":\"area\""), std::string::npos);
  Bake uneven = bake;
  uneven.hierarchy.firstWeight = withElement(bake.hierarchy.firstWeight, 3, 0.3001f);
  EXPECT_EQ(simplifyForWeb(uneven).hierarchy.firstWeight[3], 0.3001f);
}

TEST(Simplify, roundsWithinItsBounds) {
  const Bake bake = makeUnevenBake(LinkKind::oct6), simple = simplifyForWeb(bake);
  const Surfels &then = bake.surfels, &now = simple.surfels;
  const float radius = std::sqrt(then.areaEach * std::numbers::inv_pi_v<float>);
  bool moved = false;
  for (std::uint32_t i = 0; i < then.count(); ++i) {
    const glm::vec3 step = now.positionWorld[i] - then.positionWorld[i];
    moved |= step != glm::vec3(0.0f);
    EXPECT_GE(glm::dot(step, then.normal[i]), 0.0f) << "behind its surface";
    EXPECT_LE(glm::length(step), std::sqrt(3.0f) * radius / 64.0f);
    EXPECT_LT(glm::length(now.normal[i] - then.normal[i]), 0.87f / 1024.0f);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(now.albedo[i][k], then.albedo[i][k], then.albedo[i][k] / 128.0f);
      EXPECT_NEAR(now.emission[i][k], then.emission[i][k], then.emission[i][k] / 128.0f);
      EXPECT_EQ(std::bit_cast<std::uint32_t>(now.albedo[i][k]) & 0x1FFFFu, 0u) << "seven significant bits";
    }
  }
  EXPECT_TRUE(moved);
  for (std::size_t i = 0; i < bake.hierarchy.firstWeight.size(); ++i)
    EXPECT_NEAR(simple.hierarchy.firstWeight[i], bake.hierarchy.firstWeight[i], 0.5f / 512.0f);
}

// A row of links gives as much light as before: what one loses the next gains.
TEST(Simplify, rowsKeepTheirSums) {
  Bake bake = makeSmallBake(LinkKind::irradiance);
  std::mt19937 random(5);
  std::vector<std::uint32_t> head = bake.links.head.toVector();
  for (std::uint32_t& word : head)
    word = (word & 0xFFFFFu) | packTransfer(0.001f + 0.0001f * static_cast<float>(random() % 1000)) << 20;
  bake.links.head = head;
  const Bake simple = simplifyForWeb(bake);
  const auto transfer = [](const Bake& b, std::uint32_t i) { return unpackTransfer(b.links.head[i] >> 20); };
  for (std::uint32_t cache = 0; cache < bake.links.cacheCount(); ++cache) {
    float sum = 0.0f, largest = 0.0f, lost = 0.0f;
    for (std::uint32_t i = bake.links.rowBegin[cache]; i < bake.links.rowBegin[cache + 1]; ++i) {
      EXPECT_EQ(simple.links.head[i] & 0xFFFFFu, bake.links.head[i] & 0xFFFFFu);
      EXPECT_EQ(simple.links.head[i] >> 20 & 3u, 0u);
      sum += transfer(bake, i);
      lost += transfer(bake, i) - transfer(simple, i);
      largest = std::max(largest, transfer(bake, i));
    }
    EXPECT_LE(std::abs(lost), largest / 64.0f) << "of " << sum;
  }
  for (std::size_t i = 0; i < bake.links.shape.size(); ++i) {
    const LinkDirection then = unpackShape8(bake.links.shape[i]), now = unpackShape8(simple.links.shape[i]);
    EXPECT_GT(glm::dot(then.direction, now.direction), std::cos(0.04f));
    EXPECT_NEAR(now.cosAlpha, then.cosAlpha, 0.06f);
  }
}

TEST(Simplify, leavesOutWhatOnlyToolsRead) {
  const Bake bake = makeSmallBake(), without = simplifyForWeb(bake), with = simplifyForWeb(bake, {true});
  EXPECT_TRUE(without.caches.lightmap.cornerUv.empty() && without.caches.lightmap.backCornerUv.empty());
  EXPECT_EQ(without.caches.lightmap.parts.size(), bake.caches.lightmap.parts.size());
  for (const LightmapPart& part : without.caches.lightmap.parts) EXPECT_EQ(part.triangleCount, 0u);
  EXPECT_TRUE(without.shapes.empty());
  EXPECT_EQ(without.instances[1].node, "lamp");
  EXPECT_EQ(with.caches.lightmap.cornerUv.toVector(), bake.caches.lightmap.cornerUv.toVector());
  EXPECT_EQ(with.caches.lightmap.parts[1].triangleCount, 1u);
}

}  // namespace
}  // namespace relume
