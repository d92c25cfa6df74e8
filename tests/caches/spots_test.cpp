// SPDX-License-Identifier: MIT
// Which spot of its texel a cache stands at: outside of solids, in gaps that are seen, off what stands beside it.
#include "tests/caches/reads.h"
#include "tests/caches/room.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::addBox;
using test::addInstance;
using test::addQuad;
using test::fewCaches;
using test::place;
using test::Placed;
using test::readLightmap;
using test::roomScene;

TEST(CacheSpots, NoCacheLiesInsideASolid) {
  Placed p{roomScene(), {}, {}, {}};
  Mesh pillar;
  // Sunk into the floor and through the ceiling.
  addBox(pillar, {-0.7f, -0.5f, -0.7f}, {0.7f, 3.5f, 0.7f}, false);
  addInstance(p.scene, std::move(pillar), "pillar");
  CacheOptions options = fewCaches(2000);
  options.gridResolution = {13, 10, 20};
  place(p, options);
  int inside = 0, grid = 0;
  for (std::uint32_t c = 0; c < p.caches.count(); ++c) {
    const glm::vec3 x = p.caches.positionWorld[c];
    inside += std::max(std::abs(x.x), std::abs(x.z)) < 0.699f;
    EXPECT_GT(x.y, 0.0f);
    EXPECT_LT(x.y, 3.0f);
    grid += p.caches.normal[c] == glm::vec3(0.0f);
  }
  EXPECT_EQ(inside, 0);
  const CacheGrid& lattice = p.caches.grid;
  EXPECT_LT(grid, static_cast<int>(lattice.cache.size())) << "points inside the pillar are gone";
  EXPECT_GT(grid, static_cast<int>(lattice.cache.size()) * 7 / 10);

  // The floor under the pillar reads caches beside it.
  for (float s = 0.01f; s < 1.0f; s += 0.02f) {
    for (std::uint32_t t = 0; t < 12; ++t) {
      const auto read = readLightmap(p.caches, 0, t, {0.5f * s, 0.5f * (1.0f - s)}, false);
      ASSERT_FALSE(read.gridLit);
      EXPECT_EQ(read.unfilled, 0.0f);
    }
  }
}

// The gap over a one-sided lamp is in sight and dark: what lies in it reads caches in it, not the bright ceiling beside
// it.
TEST(CacheSpots, GapBehindAOneSidedLampHasCachesOfItsOwn) {
  Placed p{roomScene(), {}, {}, {}};
  constexpr float kHalf = 0.8f, kGap = 0.1f;
  Mesh lamp;
  addQuad(lamp, {-kHalf, 3.0f - kGap, -kHalf}, {kHalf, 3.0f - kGap, -kHalf}, {kHalf, 3.0f - kGap, kHalf},
          {-kHalf, 3.0f - kGap, kHalf});
  addInstance(p.scene, std::move(lamp), "lamp");
  ASSERT_LT(geometricNormal(p.scene, {1, 0, {0.3f, 0.3f}}).y, -0.99f);
  place(p, fewCaches(6000));
  int inGap = 0;
  for (std::uint32_t t = 0; t < 12; ++t) {
    const auto c = p.scene.corners(p.scene.instances[0], t);
    for (float a = 0.005f; a < 1.0f; a += 0.01f) {
      for (float b = 0.005f; a + b < 1.0f; b += 0.01f) {
        const glm::vec3 x = c[0] + (c[1] - c[0]) * a + (c[2] - c[0]) * b;
        if (x.y < 2.999f || std::abs(x.x) > 0.5f || std::abs(x.z - (kHalf - 0.15f)) > 0.02f) continue;
        const auto read = readLightmap(p.caches, 0, t, {a, b}, false);
        ASSERT_FALSE(read.gridLit);
        EXPECT_LT(p.caches.positionWorld[read.nearest].z, kHalf);
        ++inGap;
      }
    }
  }
  EXPECT_GT(inGap, 20);
}

// Plates that stand on the floor right beside the middles of texels. A cache there would see little but its plate, and
// all of its texel would be lit by that.
TEST(CacheSpots, KeepOffWhatStandsBesideThem) {
  Placed bare{roomScene(), {}, {}, {}};
  place(bare, fewCaches(600));
  const auto onFloor = [](const Caches& caches, std::uint32_t c) {
    const glm::vec3& p = caches.positionWorld[c];
    return caches.normal[c].y > 0.99f && p.y < 0.1f && std::abs(p.x) < 1.6f && std::abs(p.z) < 2.6f;
  };
  Placed p{roomScene(), {}, {}, {}};
  std::vector<glm::vec3> beside;
  Mesh plates;
  for (std::uint32_t c = 0; c < bare.caches.count(); ++c) {
    if (!onFloor(bare.caches, c) || beside.size() == 40) continue;
    const glm::vec3 at = bare.caches.positionWorld[c];
    addBox(plates, at + glm::vec3(0.01f, -0.01f, -0.05f), at + glm::vec3(0.02f, 0.2f, 0.05f), false);
    beside.push_back(at);
  }
  ASSERT_EQ(beside.size(), 40u);
  addInstance(p.scene, std::move(plates), "plates");
  p.scene.instances.back().mode = BakeMode::gridLit;
  place(p, fewCaches(600));
  int close = 0;
  for (std::uint32_t c = 0; c < p.caches.count(); ++c) {
    if (!onFloor(p.caches, c)) continue;
    for (const glm::vec3& at : beside) close += glm::distance(at, p.caches.positionWorld[c]) < 0.03f;
  }
  EXPECT_LE(close, 2);
}

// Lids that lie on the floor over the middles of texels, open below and two-sided: no back face tells that a cache is
// under one. But nobody sees what is there.
TEST(CacheSpots, KeepOutFromUnderLids) {
  constexpr float kHalf = 0.14f, kTop = 0.1f;
  const auto floorCaches = [](const Caches& caches) {
    std::vector<glm::vec3> found;
    for (std::uint32_t c = 0; c < caches.count(); ++c) {
      const glm::vec3& p = caches.positionWorld[c];
      if (caches.normal[c].y > 0.99f && p.y < 0.02f && std::abs(p.x) < 1.6f && std::abs(p.z) < 2.6f) found.push_back(p);
    }
    return found;
  };
  Placed bare{roomScene(), {}, {}, {}};
  place(bare, fewCaches(600));
  const std::vector<glm::vec3> middles = floorCaches(bare.caches);
  ASSERT_GE(middles.size(), 40u);

  Placed p{roomScene(), {}, {}, {}};
  Mesh lids;
  for (const glm::vec3& at : middles) {
    const float x[] = {at.x - kHalf, at.x + kHalf}, z[] = {at.z - kHalf, at.z + kHalf};
    addQuad(lids, {x[0], kTop, z[0]}, {x[0], kTop, z[1]}, {x[1], kTop, z[1]}, {x[1], kTop, z[0]});
    addQuad(lids, {x[0], 0, z[0]}, {x[0], 0, z[1]}, {x[0], kTop, z[1]}, {x[0], kTop, z[0]});
    addQuad(lids, {x[1], 0, z[0]}, {x[1], kTop, z[0]}, {x[1], kTop, z[1]}, {x[1], 0, z[1]});
    addQuad(lids, {x[0], 0, z[0]}, {x[0], kTop, z[0]}, {x[1], kTop, z[0]}, {x[1], 0, z[0]});
    addQuad(lids, {x[0], 0, z[1]}, {x[1], 0, z[1]}, {x[1], kTop, z[1]}, {x[0], kTop, z[1]});
  }
  p.scene.materials.emplace_back().doubleSided = true;
  lids.material = 0;
  addInstance(p.scene, std::move(lids), "lids");
  p.scene.instances.back().mode = BakeMode::gridLit;
  place(p, fewCaches(600));
  const std::vector<glm::vec3> caches = floorCaches(p.caches);
  ASSERT_GT(caches.size(), middles.size() / 2);
  std::size_t under = 0;
  for (const glm::vec3& cache : caches) {
    under += std::any_of(middles.begin(), middles.end(), [&](const glm::vec3& at) {
      return std::max(std::abs(at.x - cache.x), std::abs(at.z - cache.z)) < kHalf;
    });
  }
  EXPECT_LE(under, caches.size() / 20) << "of " << caches.size();
}

}  // namespace
}  // namespace relume
