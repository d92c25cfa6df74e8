// SPDX-License-Identifier: MIT
// Moving parts before a bake's links: form factors of a ball, what changes nothing to the bit, errors, memory, threads.
#include "formats/sh.h"
#include "relume/relighter.h"
#include "runtime/shared/look_turns.h"
#include "tests/on_threads.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/ball.h"
#include "tests/runtime/make_relighter.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <memory_resource>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
const glm::vec3 kMiddle(6.0f, 2.0f, 3.0f);  // of the synthetic room, 12 x 4 x 6 m

Bake room(LinkKind kind, std::uint32_t skyPatches = 0) {
  return test::makeSyntheticBake(
      {.surfels = 8192, .skyPatches = skyPatches, .lightmapCaches = 300, .linksPerCache = 200, .kind = kind});
}

MovingShapes shapesOf(const test::Ball& ball, const glm::vec3& albedo, const glm::vec3& emission = glm::vec3(0.0f)) {
  const MovingMesh mesh{ball.position, ball.triangle, {&albedo, 1}, {&emission, 1}};
  Result<MovingShapes> made = MovingShapes::create({&mesh, 1});
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

MovingPart at(const glm::vec3& place) {
  MovingPart part;
  part.toWorld[3] = place;
  return part;
}

RelightOptions withParts(std::uint32_t most = 4) {
  RelightOptions options;
  options.movingParts = most;
  return options;
}

// Light of a room whose surfaces all send out 1 W/m²/sr, after one frame without bounces.
std::vector<float> furnace(Relighter& relighter, const Bake& bake, const MovingShapes& shapes,
                           std::span<const MovingPart> parts) {
  const std::vector<glm::vec3> emission(bake.surfels.count(), glm::vec3(1.0f));
  LightSetup setup;
  setup.surfelEmission = emission;
  setup.skyRadiance = glm::vec3(1.0f);
  setup.bounceScale = 0.0f;
  setup.movingShapes = &shapes;
  setup.movingParts = parts;
  EXPECT_TRUE(relighter.relight(setup));
  return relighter.cacheCoefficients();
}
std::vector<float> furnace(const Bake& bake, const MovingShapes& shapes, std::span<const MovingPart> parts) {
  Relighter relighter = test::makeRelighter(bake, withParts());
  return furnace(relighter, bake, shapes, parts);
}

// Irradiance of luma at a cache of the light map for its own normal.
float irradianceOf(const Bake& bake, std::span<const float> all, std::uint32_t cache) {
  const std::size_t stride = all.size() / bake.caches.count();
  const std::span<const float> c = all.subspan(stride * cache, stride);
  if (bake.links.kind == LinkKind::irradiance) return 2.0f * kPi * 0.282094792f * c[0];
  return irradianceLinear(c, bake.caches.normal[cache]);
}

// A black ball takes its form factor, (r / d)² cos, of what a cache receives, whatever way links are stored: near and
// far from the cache, with many rays or few.
TEST(MovingParts, blackBallTakesItsFormFactor) {
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    const Bake bake = room(kind);
    for (const float radius : {0.5f, 1.2f}) {
      const test::Ball ball(radius, 48);
      const MovingShapes shapes = shapesOf(ball, glm::vec3(0.0f));
      const MovingPart part = at(kMiddle);
      const std::vector<float> open = furnace(bake, shapes, {}), shaded = furnace(bake, shapes, {&part, 1});
      double expected = 0.0, found = 0.0, error = 0.0;
      int counted = 0;
      for (std::uint32_t c = bake.caches.firstMapCache(); c < bake.caches.count(); ++c) {
        const glm::vec3 offset = kMiddle - bake.caches.positionWorld[c];
        const float d = glm::length(offset), along = glm::dot(offset, bake.caches.normal[c]);
        if (along < radius || radius * radius < 0.01f * d * d) continue;
        const double factor = radius * radius * along / (d * d * d);
        const double drop = 1.0 - irradianceOf(bake, shaded, c) / irradianceOf(bake, open, c);
        expected += factor;
        found += drop;
        error += (drop - factor) * (drop - factor);
        ++counted;
      }
      ASSERT_GT(counted, 20);
      // Half a voxel of 32 more all around is 6 % more of the disc.
      EXPECT_NEAR(found / expected, 1.03, 0.1) << "radius " << radius;
      EXPECT_LT(std::sqrt(error / counted), 0.12 * expected / counted) << "radius " << radius;
    }
  }
}

// A ball as bright as the room is not seen in it: what it takes it gives.
TEST(MovingParts, brightBallGivesWhatItTakes) {
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    const Bake bake = room(kind, 16);
    const test::Ball ball(0.8f, 32);
    const MovingShapes shapes = shapesOf(ball, glm::vec3(0.0f), glm::vec3(1.0f));
    const MovingPart part = at(kMiddle);
    const std::vector<float> open = furnace(bake, shapes, {}), lit = furnace(bake, shapes, {&part, 1});
    for (std::uint32_t c = bake.caches.firstMapCache(); c < bake.caches.count(); ++c)
      EXPECT_NEAR(irradianceOf(bake, lit, c), irradianceOf(bake, open, c), 0.01 * irradianceOf(bake, open, c));
  }
}

// It sends on the light that falls on it, in its own colour.
TEST(MovingParts, reflectsLampsInItsOwnColour) {
  const Bake bake = room(LinkKind::oct6);
  const test::Ball ball(0.6f, 32);
  Light lamp{.intensity = glm::vec3(50.0f), .positionWorld = {6.0f, 3.9f, 3.0f}};
  std::vector<glm::vec3> darkness(bake.surfels.count(), glm::vec3(0.0f));
  const auto green = [&](const glm::vec3& albedo, bool isShadowed) {
    const MovingShapes shapes = shapesOf(ball, albedo);
    const MovingPart part = at(kMiddle);
    Relighter relighter = test::makeRelighter(bake, withParts());
    LightSetup setup;
    setup.lights = {&lamp, 1};
    setup.surfelIrradiance = setup.surfelEmission = darkness;  // surfaces send nothing
    setup.bounceScale = 0.0f;
    setup.movingShapes = &shapes;
    setup.movingParts = {&part, 1};
    if (isShadowed) setup.visibility = [](std::uint32_t, const glm::vec3&, const glm::vec3&) { return 0.0f; };
    EXPECT_TRUE(relighter.relight(setup));
    return relighter.irradianceInGrid({6.0f, 3.7f, 3.0f}, {0.0f, -1.0f, 0.0f});
  };
  const glm::vec3 white = green(glm::vec3(1.0f), false), leaf = green({0.0f, 0.5f, 0.0f}, false);
  EXPECT_GT(white.g, 0.05f);
  EXPECT_NEAR(white.r, white.g, 0.02f * white.g);
  EXPECT_NEAR(leaf.g, 0.5f * white.g, 0.05f * white.g);
  EXPECT_LT(leaf.r, 0.15f * leaf.g);
  EXPECT_EQ(green(glm::vec3(1.0f), true), glm::vec3(0.0f));
}

// A small lamp in a dark room gives what faces it its form factor, (r / d)² cos, though it is too small there to hide
// anything that is seen; from 71 to 100 radii that fades.
TEST(MovingParts, lampsAreSeenFromFarOff) {
  constexpr float kRadius = 0.05f;
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    const Bake bake = room(kind);
    const MovingShapes shapes = shapesOf(test::Ball(kRadius, 32), glm::vec3(0.0f), glm::vec3(1.0f / kPi));
    const std::vector<glm::vec3> darkness(bake.surfels.count(), glm::vec3(0.0f));
    const MovingPart part = at(kMiddle);
    LightSetup setup;
    setup.surfelEmission = darkness;
    setup.bounceScale = 0.0f;
    setup.movingShapes = &shapes;
    setup.movingParts = {&part, 1};
    Relighter relighter = test::makeRelighter(bake, withParts());
    ASSERT_TRUE(relighter.relight(setup));
    const std::vector<float> lit = relighter.cacheCoefficients();
    double expected = 0.0, found = 0.0, error = 0.0;
    int counted = 0;
    for (std::uint32_t c = bake.caches.firstMapCache(); c < bake.caches.count(); ++c) {
      const glm::vec3 offset = kMiddle - bake.caches.positionWorld[c];
      const float d = glm::length(offset), along = glm::dot(offset, bake.caches.normal[c]);
      const double e = irradianceOf(bake, lit, c);
      if (d > 100.0f * kRadius) {
        EXPECT_EQ(e, 0.0);
      } else if (along > 0.3f * d && d > 13.0f * kRadius && d < 70.0f * kRadius) {
        const double factor = kRadius * kRadius * along / (d * d * d);
        expected += factor;
        found += e;
        error += (e - factor) * (e - factor);
        ++counted;
      }
    }
    ASSERT_GT(counted, 20);
    EXPECT_NEAR(found / expected, 1.0, 0.01);
    EXPECT_LT(std::sqrt(error / counted), 0.02 * expected / counted);
  }
}

// What it emits goes up and down with what emits in the bake, and out.
TEST(MovingParts, shineByTheEmissionScale) {
  const Bake bake = room(LinkKind::oct6);
  const MovingShapes shapes = shapesOf(test::Ball(0.6f, 32), glm::vec3(0.5f), glm::vec3(3.0f));
  const std::vector<glm::vec3> darkness(bake.surfels.count(), glm::vec3(0.0f));
  const MovingPart part = at(kMiddle);
  const auto seen = [&](const glm::vec3& scale) {
    Relighter relighter = test::makeRelighter(bake, withParts());
    LightSetup setup;
    setup.surfelEmission = darkness;
    setup.emissionScale = scale;
    setup.bounceScale = 0.0f;
    setup.movingShapes = &shapes;
    setup.movingParts = {&part, 1};
    EXPECT_TRUE(relighter.relight(setup));
    return relighter.irradianceInGrid({6.0f, 3.7f, 3.0f}, {0.0f, -1.0f, 0.0f});
  };
  const glm::vec3 all = seen(glm::vec3(1.0f)), some = seen({2.0f, 0.5f, 0.0f});
  EXPECT_GT(all.r, 0.05f);
  EXPECT_NEAR(some.r, 2.0f * all.r, 0.05f * all.r);
  EXPECT_NEAR(some.g, 0.5f * all.g, 0.05f * all.g);
  EXPECT_NEAR(some.b, 0.0f, 0.05f * all.b);
  EXPECT_EQ(seen(glm::vec3(0.0f)), glm::vec3(0.0f));
}

// Nothing near, nothing before a sender, or nothing at all: not a bit changes.
TEST(MovingParts, whatHidesNothingChangesNothing) {
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    const Bake bake = room(kind, 16);
    const test::Ball ball(0.3f, 24);
    const MovingShapes shapes = shapesOf(ball, glm::vec3(0.5f));
    Relighter plain = test::makeRelighter(bake), moving = test::makeRelighter(bake, withParts());
    const std::vector<Light> lights = test::someLights();
    LightSetup setup;
    setup.lights = lights;
    MovingPart far = at({60.0f, 2.0f, 3.0f});
    MovingPart flat = at(kMiddle);
    flat.toWorld[1] = glm::vec3(0.0f);
    const std::vector<std::vector<MovingPart>> frames{{}, {far}, {flat}, {far, flat}};
    for (const std::vector<MovingPart>& parts : frames) {
      ASSERT_TRUE(plain.relight(setup));
      LightSetup with = setup;
      with.movingShapes = &shapes;
      with.movingParts = parts;
      ASSERT_TRUE(moving.relight(with));
      EXPECT_EQ(plain.cacheCoefficients(), moving.cacheCoefficients());
    }
  }
}

// Under the floor, all senders come before it: where links are looked at one by one nothing changes, and where far
// parts are weighed by cones that are wider than their senders, next to nothing.
TEST(MovingParts, standingGeometryHidesParts) {
  const Bake bake = room(LinkKind::oct6);
  const test::Ball ball(0.6f, 32);
  const MovingShapes shapes = shapesOf(ball, glm::vec3(0.0f));
  const MovingPart under = at({6.0f, -0.7f, 3.0f}), above = at({6.0f, 0.7f, 3.0f});
  const std::vector<float> open = furnace(bake, shapes, {}), hidden = furnace(bake, shapes, {&under, 1}),
                           seen = furnace(bake, shapes, {&above, 1});
  double changedHidden = 0.0, changedSeen = 0.0;
  for (std::uint32_t c = bake.caches.firstMapCache(); c < bake.caches.count(); ++c) {
    const float e = irradianceOf(bake, open, c);
    EXPECT_NEAR(irradianceOf(bake, hidden, c), e, 0.01f * e);
    changedHidden += std::abs(irradianceOf(bake, hidden, c) - e);
    changedSeen += std::abs(irradianceOf(bake, seen, c) - e);
  }
  EXPECT_LT(changedHidden, 0.05 * changedSeen);
}

// Where a part has left, light is what it would be without.
TEST(MovingParts, leavesNoTraces) {
  const Bake bake = room(LinkKind::oct6);
  const test::Ball ball(0.8f, 24);
  const MovingShapes shapes = shapesOf(ball, glm::vec3(0.5f));
  const MovingPart part = at(kMiddle);
  Relighter relighter = test::makeRelighter(bake, withParts());
  const std::vector<float> open = furnace(bake, shapes, {});
  EXPECT_NE(furnace(relighter, bake, shapes, {&part, 1}), open);
  EXPECT_EQ(furnace(relighter, bake, shapes, {}), open);
}

RelightOptions withLag(std::uint32_t lag) {
  RelightOptions options = withParts();
  options.movingLag = lag;
  return options;
}

// Sum of squared differences.
double squared(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (double{a[i]} - b[i]) * (double{a[i]} - b[i]);
  return sum;
}

// Caches have their turns: not all see a step at once, but all do within movingLag frames, to the bit.
TEST(MovingParts, takeTurnsAndMissNone) {
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    const Bake bake = room(kind, 16);
    const test::Ball ball(0.5f, 24);
    const MovingShapes shapes = shapesOf(ball, {0.8f, 0.3f, 0.1f});
    const MovingPart before = at(kMiddle), after = at(kMiddle + glm::vec3(0.25f, 0.1f, 0.0f));
    constexpr std::uint32_t kLag = 16;
    Relighter turns = test::makeRelighter(bake, withLag(kLag)), all = test::makeRelighter(bake, withLag(1));
    const std::vector<float> old = furnace(turns, bake, shapes, {&before, 1});
    EXPECT_EQ(old, furnace(all, bake, shapes, {&before, 1}));
    const std::vector<float> wanted = furnace(all, bake, shapes, {&after, 1});
    std::vector<float> found;
    for (std::uint32_t frame = 0; frame < kLag; ++frame) {
      found = furnace(turns, bake, shapes, {&after, 1});
      if (frame < kLag / 2) {
        EXPECT_GT(squared(found, wanted), 0.0);
      }
      EXPECT_LE(squared(found, wanted), squared(old, wanted));
    }
    EXPECT_EQ(found, wanted);
    // After a frame without parts all are looked at, and after reset().
    for (const bool isReset : {false, true}) {
      if (isReset) {
        turns.reset();
      } else {
        furnace(turns, bake, shapes, {});
      }
      EXPECT_EQ(furnace(turns, bake, shapes, {&before, 1}), old);
      furnace(turns, bake, shapes, {&after, 1});
    }
  }
}

// What is kept of a change goes with the light: of a quarter of it a quarter, of darkness nothing.
TEST(MovingParts, keptChangesFollowTheLight) {
  const Bake bake = room(LinkKind::oct6);
  const test::Ball ball(0.5f, 24);
  const MovingShapes shapes = shapesOf(ball, glm::vec3(0.0f));
  const MovingPart part = at(kMiddle);
  Relighter turns = test::makeRelighter(bake, withLag(kMaxMovingLag)), all = test::makeRelighter(bake, withLag(1));
  for (const float light : {1.0f, 0.25f, 0.0f}) {
    const std::vector<glm::vec3> emission(bake.surfels.count(), glm::vec3(light));
    LightSetup setup;
    setup.surfelEmission = emission;
    setup.bounceScale = 0.0f;
    setup.movingShapes = &shapes;
    setup.movingParts = {&part, 1};
    ASSERT_TRUE(turns.relight(setup));
    ASSERT_TRUE(all.relight(setup));
    const std::vector<float> found = turns.cacheCoefficients(), wanted = all.cacheCoefficients();
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], wanted[i], 1e-3f * light) << light;
  }
}

TEST(MovingParts, refusesLagsThatAreNone) {
  const Bake bake = room(LinkKind::oct6);
  for (const std::uint32_t lag : {0u, 3u, 128u}) {
    const Result<Relighter> made = Relighter::create(bake, withLag(lag));
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::usage);
    EXPECT_NE(made.error().message.find("movingLag is " + std::to_string(lag)), std::string::npos);
  }
}

TEST(MovingParts, doesNotDependOnThreadsAndTakesNoMemoryInAFrame) {
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    const Bake bake = room(kind, 16);
    const test::Ball ball(0.5f, 32);
    const MovingShapes shapes = shapesOf(ball, {0.8f, 0.3f, 0.1f});
    const std::vector<Light> lights = test::someLights();
    std::optional<std::vector<float>> expected;
    for (const std::uint32_t threads : {1u, 2u, 3u}) {
      RelightOptions options = withParts();
      if (threads > 1)
        options.parallelFor = [threads](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
          test::onThreads(threads, tasks, body);
        };
      Relighter relighter = test::makeRelighter(bake, options);
      LightSetup setup;
      setup.lights = lights;
      setup.movingShapes = &shapes;
      std::size_t before = 0;
      for (int frame = 0; frame < 5; ++frame) {
        if (frame == 1) before = test::allocations();
        MovingPart parts[2] = {at(kMiddle + 0.2f * static_cast<float>(frame)), at({2.0f, 1.0f, 1.5f})};
        parts[1].toWorld[0] *= -1.5f;  // mirrored and wider
        setup.movingParts = parts;
        ASSERT_TRUE(relighter.relight(setup));
      }
      if (threads == 1) {
        EXPECT_EQ(test::allocations(), before);
      }
      const std::vector<float> found = relighter.cacheCoefficients();
      for (const float v : found) ASSERT_TRUE(std::isfinite(v));
      if (!expected) expected = found;
      EXPECT_EQ(found, *expected);
    }
  }
}

TEST(MovingParts, refusesPartsThatItCannotPlace) {
  const Bake bake = room(LinkKind::oct6);
  const test::Ball ball(0.5f, 16);
  const MovingShapes shapes = shapesOf(ball, glm::vec3(0.5f));
  const std::vector<Light> lights = test::someLights();
  Relighter relighter = test::makeRelighter(bake, withParts(2));
  LightSetup setup;
  setup.lights = lights;
  setup.movingShapes = &shapes;
  std::vector<MovingPart> parts{at(kMiddle), at(kMiddle)};
  setup.movingParts = parts;
  ASSERT_TRUE(relighter.relight(setup));
  const std::vector<float> before = relighter.cacheCoefficients();
  const auto refuses = [&](const std::string& word) {
    const Status status = relighter.relight(setup);
    ASSERT_FALSE(status) << word;
    EXPECT_EQ(status.error().code, ErrorCode::usage);
    EXPECT_NE(status.error().message.find(word), std::string::npos) << status.error().message;
    EXPECT_EQ(relighter.cacheCoefficients(), before);
  };
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 2e8f}) {
    for (int column = 0; column < 4; ++column) {
      parts[1] = at(kMiddle);
      parts[1].toWorld[column].y = bad;
      refuses("movingParts[1].toWorld");
    }
  }
  parts[1] = at(kMiddle);
  parts[1].shape = 1;
  refuses("movingParts[1].shape");
  parts[1].shape = 0;
  parts.push_back(at(kMiddle));
  setup.movingParts = parts;
  refuses("expected at most 2");
  setup.movingParts = {parts.data(), 1};
  setup.movingShapes = nullptr;
  refuses("without movingShapes");
  EXPECT_FALSE(Relighter::create(bake, withParts(257)));
}

// A part's light is not packed, so that a lamp as bright as they may be, close to it, goes on into the caches.
TEST(MovingParts, theBrightestLampStaysFinite) {
  const Bake bake = room(LinkKind::oct6, 16);
  const test::Ball ball(0.5f, 16);
  const MovingShapes shapes = shapesOf(ball, glm::vec3(1.0f, 0.5f, 0.0f));
  const std::vector<MovingPart> parts{at(kMiddle), at(kMiddle + glm::vec3(2, 0, 0))};
  std::vector<Light> lamps;
  for (int k = 0; k < 8; ++k)
    lamps.push_back(
        {.intensity = glm::vec3(1e20f), .positionWorld = kMiddle + glm::vec3(0.0f, 0.5f + 0.05f * k, 0.0f)});
  for (const int chroma : {1, 2, 3, 4}) {
    for (const int luma : {2, 4}) {
      if (chroma > luma) continue;
      RelightOptions options = withParts();
      options.lumaBands = luma;
      options.chromaBands = chroma;
      options.gridTexture = true;
      options.gridTrust = 1.0f;
      Relighter relighter = test::makeRelighter(bake, options);
      LightSetup setup;
      setup.lights = lamps;
      setup.movingShapes = &shapes;
      setup.movingParts = parts;
      for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(relighter.relight(setup));
      for (const float c : relighter.cacheCoefficients()) ASSERT_TRUE(std::isfinite(c));
      for (const GridLookup lookup : {GridLookup::stencil, GridLookup::texture, GridLookup::smooth}) {
        for (float x = 0.3f; x < 12.0f; x += 0.7f) {
          for (const glm::vec3& normal : {glm::vec3(0, 1, 0), glm::vec3(0.6f, 0, -0.8f)}) {
            const glm::vec3 e = relighter.irradianceInGrid({x, 2.0f, 3.0f}, normal, lookup);
            ASSERT_TRUE(std::isfinite(e.x) && std::isfinite(e.y) && std::isfinite(e.z)) << luma << " " << chroma;
            ASSERT_TRUE(e.x >= 0.0f && e.y >= 0.0f && e.z >= 0.0f);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace relume
