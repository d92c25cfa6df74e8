// SPDX-License-Identifier: MIT
// The grid's texture: where its cells are open receivers read nearly what the caches around give them, and nothing of
// the room next door; where none is open they read the caches.
#include "runtime/shared/grid_texture.h"
#include "bake/caches/caches.h"
#include "formats/sh.h"
#include "runtime/cpu/grid_vectors.h"
#include "runtime/shared/receivers.h"
#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"
#include "tests/caches/two_rooms.h"
#include "tests/packed.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <functional>
#include <memory_resource>
#include <random>

namespace relume {
namespace {

using test::kHalfWall;
using test::twoRooms;

std::pmr::memory_resource* memory() { return std::pmr::new_delete_resource(); }

Caches place(const Scene& scene, const glm::uvec3& resolution, float spacing) {
  CacheOptions options;
  options.lightmapCaches = 0;
  options.gridCaches = 0;
  options.gridResolution = resolution;
  options.gridSpacing = spacing;
  Context context;
  test::Placed placed{scene, {}, {}, {}};
  test::place(placed, options, test::walks(1u << 15), context);
  return std::move(placed.caches);
}

// Uniform light of radiance valueAt(its position) in every cache, one band of each channel.
std::vector<float> uniformLight(const Caches& caches, const std::function<float(const glm::vec3&)>& valueAt) {
  std::vector<float> coefficients;
  for (std::uint32_t c = 0; c < caches.count(); ++c) {
    const float y = valueAt(caches.positionWorld[c]) / 0.28209479f;
    coefficients.insert(coefficients.end(), {y, 0.1f * y, -0.05f * y});
  }
  return coefficients;
}

constexpr float kPi = std::numbers::pi_v<float>;
const CacheBands kOneBand{1, 1};

class TextureWall : public testing::TestWithParam<float> {};

void expectNoLeak(const Caches& caches, float wall) {
  const std::vector<float> coefficients =
      uniformLight(caches, [wall](const glm::vec3& x) { return x.x < wall ? 1.0f : 0.0f; });
  const CacheLight light{kOneBand, coefficients, true};
  cpu::GridVectors grid(makeGridTexture(test::packed(caches), {}, {}, memory()), memory());
  grid.fill(light, {});
  ASSERT_FALSE(grid.texture().empty());
  test::DarkReceivers receivers(wall);
  int byTexture = 0;
  for (const bool smooth : {false, true}) {
    float most = 0.0f;
    for (int i = 0; i < 20000; ++i) {
      const test::DarkReceiver r = receivers.next();
      const auto e = readGridTexture(grid.texture(), grid.texels(), r.position, r.normal, smooth);
      if (!e) continue;
      ++byTexture;
      most = std::max(most, e->y / kPi);
    }
    EXPECT_LT(most, 0.01f) << (smooth ? "smooth" : "trilinear");
  }
  EXPECT_GT(byTexture, 4000) << "of 40,000";
}

TEST_P(TextureWall, betweenALitAndADarkRoomLeaksNothingOnALattice) {
  const Caches caches = place(twoRooms(GetParam()), {8, 3, 6}, 0.0f);
  EXPECT_TRUE(caches.grid.brick.empty());
  expectNoLeak(caches, GetParam());
}

TEST_P(TextureWall, betweenALitAndADarkRoomLeaksNothingInBricks) {
  const Caches caches = place(twoRooms(GetParam()), {}, 1.0f);
  EXPECT_GT(caches.grid.brickCount(), 0u);
  expectNoLeak(caches, GetParam());
}

INSTANTIATE_TEST_SUITE_P(, TextureWall, testing::Values(-0.35f, -0.2f, -0.07f, 0.0f, 0.11f, 0.24f, 0.38f, 0.5f));

// A lattice of caches in the open, made by hand: their own number where light is asked for.
Caches lattice(const glm::uvec3& resolution, const glm::vec3& spacing = glm::vec3(1.0f)) {
  Caches caches;
  caches.grid.resolution = resolution;
  caches.grid.originWorld = glm::vec3(-1.0f, 2.0f, 0.5f);
  caches.grid.spacing = spacing;
  std::vector<std::uint32_t> cache;
  std::vector<glm::vec3> position;
  for (std::uint32_t z = 0; z < resolution.z; ++z) {
    for (std::uint32_t y = 0; y < resolution.y; ++y) {
      for (std::uint32_t x = 0; x < resolution.x; ++x) {
        cache.push_back(static_cast<std::uint32_t>(cache.size()));
        position.push_back(caches.grid.originWorld + glm::vec3(x, y, z) * spacing);
      }
    }
  }
  caches.normal = std::vector<glm::vec3>(position.size(), glm::vec3(0.0f));
  caches.positionWorld = position;
  caches.grid.cache = cache;
  return caches;
}

// A grid whose texels are set by hand: linear in the position.
TEST(GridTexture, linearFieldsAreReadExactly) {
  const Caches caches = lattice({5, 6, 7});
  GridTexture texture = makeGridTexture(test::packed(caches), {.trust = 1.0f, .bytes = 72 * 5 * 6 * 7}, {}, memory());
  ASSERT_EQ(texture.resolution, glm::uvec3(5, 6, 7)) << "four, three and two times as dense are beyond the limit";
  const auto field = [](const glm::vec3& p) { return 5.0f + 0.3f * p.x - 0.2f * p.y + 0.11f * p.z; };
  std::vector<float> texels(kTexelFloats * 6 * texture.points(), 0.0f);
  for (std::uint32_t i = 0; i < texture.points(); ++i) {
    const glm::vec3 at(i % 5, i / 5 % 6, i / 30);
    for (std::size_t half = 0; half < 6; ++half) {
      float* t = &texels[kTexelFloats * (6 * i + half)];
      t[half / 2] = (half % 2 == 0 ? kPi : -kPi) * field(texture.originWorld + at * texture.spacing);
      t[3] = 1.0f;
    }
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::normal_distribution<float> gauss;
  for (int i = 0; i < 2000; ++i) {
    const glm::vec3 u(uniform(random), uniform(random), uniform(random));
    const glm::vec3 n = glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random)));
    const glm::vec3 p = texture.originWorld + u * texture.spacing * glm::vec3(texture.resolution - 1u);
    const auto linear = readGridTexture(texture, texels, p, n, false);
    ASSERT_TRUE(linear);
    EXPECT_NEAR(linear->y, kPi * field(p), 1e-4f);
    // A spline needs a cell all around.
    const glm::vec3 inner = texture.originWorld + (1.0f + u * glm::vec3(2, 3, 4)) * texture.spacing;
    const auto smooth = readGridTexture(texture, texels, inner, n, true);
    ASSERT_TRUE(smooth);
    EXPECT_NEAR(smooth->y, kPi * field(inner), 1e-4f);
  }
}

// Light that is the same everywhere is read as such, whatever the shares, at the border too.
TEST(GridTexture, uniformLightIsPiEverywhere) {
  for (const glm::uvec3& resolution : {glm::uvec3(4, 3, 5), glm::uvec3(3, 1, 2), glm::uvec3(1, 1, 1)}) {
    const Caches caches = lattice(resolution);
    const std::vector<float> coefficients = uniformLight(caches, [](const glm::vec3&) { return 1.0f; });
    cpu::GridVectors grid(makeGridTexture(test::packed(caches), {.trust = 1.0f}, {}, memory()), memory());
    grid.fill({kOneBand, coefficients, true}, {});
    ASSERT_FALSE(grid.texture().empty());
    std::mt19937 random(4);
    std::uniform_real_distribution<float> uniform(-0.1f, 1.1f);
    std::normal_distribution<float> gauss;
    for (int i = 0; i < 1000; ++i) {
      const glm::vec3 u(uniform(random), uniform(random), uniform(random));
      const glm::vec3 n = glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random)));
      const glm::vec3 p = caches.grid.originWorld + glm::clamp(u * glm::vec3(resolution - 1u), glm::vec3(-0.05f),
                                                               glm::vec3(resolution - 1u) + 0.05f);
      for (const bool smooth : {false, true}) {
        const auto e = readGridTexture(grid.texture(), grid.texels(), p, n, smooth);
        ASSERT_TRUE(e);
        EXPECT_NEAR(e->y, kPi * 0.95f, 0.01f) << "green = Y + Cg";
      }
    }
  }
}

TEST(GridTexture, sharesAddUpAndAreOfTheEightLargest) {
  const Caches caches = place(twoRooms(0.11f), {}, 0.8f);
  const GridTexture texture = makeGridTexture(test::packed(caches), {.trust = 1.0f}, {}, memory());
  ASSERT_EQ(texture.begin.size(), std::size_t{6} * texture.points() + 1);
  std::uint32_t known = 0, none = 0;
  for (std::size_t texel = 0; texel + 1 < texture.begin.size(); ++texel) {
    ASSERT_LE(texture.begin[texel + 1] - texture.begin[texel], kMaxTexelCaches);
    std::uint32_t sum = 0;
    for (std::uint32_t k = texture.begin[texel]; k < texture.begin[texel + 1]; ++k) {
      ASSERT_LT(texture.shares[k] & ((1u << kCacheBits) - 1), texture.cacheCount);
      sum += texture.shares[k] >> kCacheBits;
    }
    // An eighth for each position that sees a cache.
    const float eighths = 8.0f * static_cast<float>(sum) / static_cast<float>(kMaxShare);
    ASSERT_NEAR(eighths, std::round(eighths), 0.02f);
    (sum > 0 ? known : none) += 1;
  }
  EXPECT_GT(known, none);
}

TEST(GridTexture, isThatOfOneThreadOnTwo) {
  const Caches caches = place(twoRooms(0.0f), {}, 1.0f);
  const ParallelFor backwards = [](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
    for (std::uint32_t i = tasks; i > 0; --i) body(i - 1);
  };
  const GridTexture a = makeGridTexture(test::packed(caches), {}, {}, memory()),
                    b = makeGridTexture(test::packed(caches), {}, backwards, memory());
  EXPECT_EQ(a.begin, b.begin);
  EXPECT_EQ(a.shares, b.shares);
  EXPECT_EQ(a.open, b.open);
}

TEST(GridTexture, limitsAndNoGridLeaveNone) {
  const Caches caches = lattice({4, 4, 4});
  const auto sideOf = [&](const GridTextureLimits& limits) {
    return makeGridTexture(test::packed(caches), limits, {}, memory()).resolution.x;
  };
  EXPECT_EQ(sideOf({}), 13u);
  EXPECT_EQ(sideOf({.bytes = 72 * 10 * 10 * 10}), 10u);
  EXPECT_EQ(sideOf({.bytes = 72 * 10 * 10 * 10 - 1}), 7u);
  EXPECT_EQ(sideOf({.bytes = 72 * 64}), 4u);
  EXPECT_EQ(sideOf({.bytes = 72 * 64 - 1}), 0u);
  EXPECT_EQ(sideOf({.bytes = 0}), 0u);
  // Six slabs of 13 points and five between.
  EXPECT_EQ(sideOf({.maxSide = 6 * 14 - 1}), 13u);
  EXPECT_EQ(sideOf({.maxSide = 6 * 14 - 2}), 10u);
  EXPECT_EQ(sideOf({.maxSide = 28}), 0u);
  EXPECT_TRUE(makeGridTexture(test::packed(Caches()), {}, {}, memory()).empty());
  EXPECT_EQ(makeGridTexture(test::packed(caches), {.trust = 0.0f}, {}, memory()).openCells(), 0u);
}

// Receivers that are nowhere, and those far outside.
TEST(GridTexture, answersForReceiversWithinItAlone) {
  const Caches caches = lattice({4, 4, 4});
  const std::vector<float> coefficients = uniformLight(caches, [](const glm::vec3&) { return 1.0f; });
  cpu::GridVectors grid(makeGridTexture(test::packed(caches), {.trust = 1.0f}, {}, memory()), memory());
  grid.fill({kOneBand, coefficients, true}, {});
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  const glm::vec3 middle = caches.grid.originWorld + 1.5f, up(0, 1, 0);
  const auto reads = [&](const glm::vec3& p, const glm::vec3& n) {
    return readGridTexture(grid.texture(), grid.texels(), p, n, false).has_value();
  };
  EXPECT_TRUE(reads(middle, up));
  EXPECT_TRUE(reads(middle, 0.5f * up)) << "what interpolation leaves of a normal";
  EXPECT_FALSE(reads(middle, glm::vec3(0.0f)));
  EXPECT_FALSE(reads(middle, {kNan, 0, 1}));
  EXPECT_FALSE(reads(middle, {3, 0, 0}));
  EXPECT_FALSE(reads({kNan, 0, 0}, up));
  EXPECT_FALSE(reads({kInfinity, 0, 0}, up));
  EXPECT_FALSE(reads(middle + glm::vec3(1e30f, 0, 0), up));
  EXPECT_FALSE(reads(middle + glm::vec3(2, 0, 0), up)) << "half a metre out";
  const auto half = readGridTexture(grid.texture(), grid.texels(), middle, 0.5f * up, false),
             whole = readGridTexture(grid.texture(), grid.texels(), middle, up, false);
  EXPECT_NEAR(half->x, whole->x, 1e-5f);
}

// Vectors of a cache by bands of luma and chroma, against those of formats/ with the bands that are guessed spelled
// out.
TEST(GridTexture, vectorsOfACacheAreThoseOfItsCoefficients) {
  std::mt19937 random(5);
  std::normal_distribution<float> gauss;
  for (int luma = 1; luma <= kMaxBands; ++luma) {
    for (int chroma = 1; chroma <= luma; ++chroma) {
      const CacheBands bands{luma, chroma};
      std::vector<float> c(bands.stride());
      for (float& v : c) v = 0.2f * gauss(random);
      c[0] = 1.0f;
      cpu::CacheVectors found;
      cpu::makeCacheVectors(bands, c, found);
      // Luma: at the axes the clamped cosine, with the guessed band.
      const std::span<const float> y = std::span(c).first(bands.lumaCount());
      for (std::size_t half = 0; half < 6; ++half) {
        glm::vec3 n(0.0f);
        n[static_cast<int>(half / 2)] = half % 2 == 0 ? 1.0f : -1.0f;
        const float* v = &found[cpu::kVectorFloats * half];
        const float guessed = luma == 2 ? zonalIrradiance(y[0], {y[3], y[1], y[2]}, n) : 0.0f;
        EXPECT_NEAR(glm::dot(n, glm::vec3(v[0], v[1], v[2])), irradianceClamped(luma, y, n) + guessed, 2e-5f);
        if (chroma < 3) continue;
        for (std::size_t k = 1; k < 3; ++k) {
          const std::span<const float> x =
              std::span(c).subspan(bands.lumaCount() + (k - 1) * bands.chromaCount(), bands.chromaCount());
          EXPECT_NEAR(glm::dot(n, glm::vec3(v[3 * k], v[3 * k + 1], v[3 * k + 2])), irradianceClamped(chroma, x, n),
                      2e-5f);
        }
      }
      if (luma != 2) {
        const SixVectors expected = vectorsFromSh(luma, y);
        for (std::size_t half = 0; half < 6; ++half) {
          const float* v = &found[cpu::kVectorFloats * half];
          EXPECT_LT(glm::length(expected[half] - glm::vec3(v[0], v[1], v[2])), 2e-5f);
        }
      }
    }
  }
}

// A colour is that of the receiver by the caches around.
TEST(GridTexture, chromaFollowsLumaAsReceiversHaveIt) {
  const Caches caches = lattice({2, 2, 2});
  for (const CacheBands bands :
       {CacheBands{3, 1}, CacheBands{3, 2}, CacheBands{2, 2}, CacheBands{2, 1}, CacheBands{4, 3}}) {
    // Warm light from one side, in all caches alike.
    const glm::vec3 d = glm::normalize(glm::vec3(0.6f, 0.7f, -0.3f));
    std::array<float, kMaxCoefficients> y;
    evaluateSh(kMaxBands, d, y);
    std::vector<float> one;
    const auto add = [&](int l, float scale) {
      for (int i = 0; i < l * l; ++i) one.push_back(scale * (y[static_cast<std::size_t>(i)] + (i == 0 ? 0.2f : 0.0f)));
    };
    add(bands.lumaBands, 1.0f), add(bands.chromaBands, 0.4f), add(bands.chromaBands, -0.1f);
    std::vector<float> coefficients;
    for (std::uint32_t i = 0; i < caches.count(); ++i) coefficients.insert(coefficients.end(), one.begin(), one.end());
    const CacheLight light{bands, coefficients, true};
    cpu::GridVectors grid(makeGridTexture(test::packed(caches), {.trust = 1.0f}, {}, memory()), memory());
    grid.fill(light, {});
    const glm::vec3 p = caches.grid.originWorld + 0.4f;
    for (int half = 0; half < 6; ++half) {
      glm::vec3 n(0.0f);
      n[half / 2] = half % 2 == 0 ? 1.0f : -1.0f;
      const auto e = readGridTexture(grid.texture(), grid.texels(), p, n, false);
      ASSERT_TRUE(e);
      const glm::vec3 expected = irradianceInGrid(test::packed(caches), light, p, n);
      EXPECT_LT(glm::length(*e - expected), 2e-3f * glm::length(expected) + 2e-3f)
          << bands.lumaBands << " " << bands.chromaBands << " half " << half;
    }
  }
}

}  // namespace
}  // namespace relume
