// SPDX-License-Identifier: MIT
// Light on a flat floor that is lit smoothly is smooth: neighbouring caches choose their links each on its own, and
// where they disagree the floor shows blotches that no error over a picture names (PIC Fig. 9b). What is measured is
// the error against path-traced irradiance without what a blur of half a metre keeps of it, and FLIP of the picture.
#include "bake/base/parallel.h"
#include "relume/bake/bake.h"
#include "relume/relighter.h"
#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"
#include "tests/long_tests.h"
#include "tests/measure/traced_light.h"
#include "tests/pipeline/read_at_hit.h"
#include "tools/images/perceptual.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::addBox;
using test::addInstance;

constexpr float kWidth = 24.0f, kHeight = 5.0f;
// The piece of floor that is looked at: between four columns.
constexpr std::size_t kSide = 41;
constexpr float kStep = 0.075f;  // [m]
const glm::vec3 kFirst(10.5f, 0.0f, 10.5f);
constexpr float kBlur = 0.5f;                                                 // [m] standard deviation
constexpr double kSeen = 0.01, kSeenOfSpot = 0.05, kFlip[2] = {0.085, 0.15};  // lamp, spot

// A hall with sixteen columns. A lamp between them, and a spot light that lights a patch of a wall three metres across:
// what some hundred surfels send, and the worst that a cut can be asked for.
Scene hall() {
  Scene scene;
  scene.name = "hall";
  scene.materials.emplace_back();
  scene.materials[0].albedo = glm::vec3(0.6f, 0.5f, 0.4f);
  Mesh room;
  addBox(room, {0, 0, 0}, {kWidth, kHeight, kWidth}, true);
  room.material = 0;
  addInstance(scene, std::move(room), "room");
  for (int x = 0; x < 4; ++x) {
    for (int z = 0; z < 4; ++z) {
      const glm::vec3 at(3.0f + 6.0f * static_cast<float>(x), 0.0f, 3.0f + 6.0f * static_cast<float>(z));
      Mesh column;
      addBox(column, at - glm::vec3(0.4f, 0, 0.4f), at + glm::vec3(0.4f, kHeight, 0.4f), false);
      column.material = 0;
      addInstance(scene, std::move(column), "column");
    }
  }
  scene.cameras = {test::cameraAt({12.0f, 1.6f, 12.0f})};
  SceneLight lamp;
  lamp.name = "lamp";
  lamp.intensity = glm::vec3(100.0f);
  lamp.positionWorld = {6.0f, 3.5f, 13.0f};
  SceneLight spot = lamp;
  spot.name = "spot";
  spot.kind = LightKind::spot;
  spot.positionWorld = {12.0f, 4.0f, 18.0f};
  spot.direction = glm::normalize(glm::vec3(0.1f, -0.2f, 1.0f));
  spot.innerConeRad = 0.15f;
  spot.outerConeRad = 0.25f;
  scene.lights = {lamp, spot};
  return scene;
}

using Picture = std::vector<glm::vec3>;  // irradiance, row by row [Size kSide²]

// A place that a path from the light has reached.
struct Sender {
  glm::vec3 position, normal, flux;  // flux [W] that leaves it
};

// Paths from the lamp or the spot light; each vertex is a sender (instant radiosity). Stratified by the first
// direction.
std::vector<Sender> senders(const test::TracedLevel& level, std::uint32_t paths, std::uint64_t seed) {
  const SceneLight& light = level.lights[0];
  const bool isSpot = light.kind == LightKind::spot;
  const float cosOuter = isSpot ? std::cos(light.outerConeRad) : -1.0f;
  const glm::vec3 axis = isSpot ? light.direction : glm::vec3(0, 1, 0),
                  side = glm::normalize(glm::cross(axis, glm::vec3(1, 0.1f, 0))), other = glm::cross(axis, side);
  std::vector<Sender> all;
  for (std::uint32_t k = 0; k < paths; ++k) {
    RandomStream random(seed, 0x73656E64, k);
    const float z = 1.0f - (1.0f - cosOuter) * (static_cast<float>(k) + random.uniform()) / static_cast<float>(paths);
    const float angle = 2.39996323f * static_cast<float>(k) + 6.28318531f * random.uniform() / 64.0f,
                r = std::sqrt(std::max(0.0f, 1.0f - z * z));
    glm::vec3 direction = z * axis + r * (std::cos(angle) * side + std::sin(angle) * other),
              origin = light.positionWorld;
    // The irradiance at a metre is the intensity.
    glm::vec3 toLight, flux;
    float distance = 0.0f;
    flux = lightIrradiance(light, origin + direction, -direction, toLight, distance) *
           (2.0f * test::kPathPi * (1.0f - cosOuter) / static_cast<float>(paths));
    for (int bounce = 0; bounce < 30; ++bounce) {
      const Hit hit = level.tracer.trace({origin, 0.0f, direction});
      if (!hit) break;
      const SurfacePoint point = hit.point();
      const glm::vec3 n = geometricNormal(level.scene, point);
      origin += hit.distance * direction;
      origin += n * level.tracer.epsilonAt(origin);
      flux *= albedoAt(level.scene, point);
      all.push_back({origin, n, flux});
      constexpr float kKeep = 0.5f;
      if (random.uniform() >= kKeep) break;
      flux /= kKeep;
      direction = test::cosineDirection(n, random.uniform2());
    }
  }
  return all;
}

// Irradiance by two sets of senders. All receivers read the same ones, so that what noise there is blurs away.
std::array<Picture, 2> trace(const test::TracedLevel& level, std::span<const glm::vec3> at) {
  constexpr std::uint32_t kPaths = 4096;
  std::array<Picture, 2> halves{Picture(at.size()), Picture(at.size())};
  Context context;
  for (std::size_t half = 0; half < 2; ++half) {
    const std::vector<Sender> all = senders(level, kPaths, half + 1);
    parallelChunks(context, "", at.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        for (const Sender& sender : all) {
          const glm::vec3 toward = sender.position - at[i];
          const float d2 = glm::dot(toward, toward), cosines = -toward.y * glm::dot(toward, sender.normal) / d2;
          if (!(toward.y > 0.0f && cosines > 0.0f)) continue;
          const float d = std::sqrt(d2);
          if (level.tracer.occluded({at[i], 0.0f, toward / d, 0.9999f * d})) continue;
          halves[half][i] += sender.flux * (cosines / (test::kPathPi * d2));
        }
      }
    });
  }
  return halves;
}

// A picture less its blur by a Gaussian, which is cut at two deviations and at the picture's border.
Picture fine(const Picture& picture) {
  constexpr int kReach = static_cast<int>(2.0f * kBlur / kStep), kLast = static_cast<int>(kSide) - 1;
  const auto along = [&](const Picture& from, std::size_t stepOf, std::size_t stepAcross) {
    Picture to(from.size());
    for (std::size_t across = 0; across < kSide; ++across) {
      for (int i = 0; i <= kLast; ++i) {
        glm::vec3 sum(0.0f);
        float total = 0.0f;
        for (int k = std::max(0, i - kReach); k <= std::min(kLast, i + kReach); ++k) {
          const float d = static_cast<float>(k - i) * kStep / kBlur, w = std::exp(-0.5f * d * d);
          sum += w * from[across * stepAcross + static_cast<std::size_t>(k) * stepOf];
          total += w;
        }
        to[across * stepAcross + static_cast<std::size_t>(i) * stepOf] = sum / total;
      }
    }
    return to;
  };
  Picture blurred = along(along(picture, 1, kSide), kSide, 1);
  for (std::size_t i = 0; i < picture.size(); ++i) blurred[i] = picture[i] - blurred[i];
  return blurred;
}

Picture less(const Picture& a, const Picture& b) {
  Picture d(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) d[i] = a[i] - b[i];
  return d;
}

struct Blotches {
  double fine = 0.0;  // root mean square of the fine error over the mean of the truth
  double energy = 0.0;
  double flip = 0.0;  // mean, of the pictures that such a floor makes at a middling exposure
};

// The noise of the two halves is not the same, so that it is not in the mean of the product of the two errors.
Blotches measure(const Picture& found, const std::array<Picture, 2>& truth) {
  const Picture a = fine(less(found, truth[0])), b = fine(less(found, truth[1]));
  Picture shown(found.size()), wanted(found.size());
  double square = 0.0, mean = 0.0, light = 0.0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    square += static_cast<double>(glm::dot(a[i], b[i])) / 3.0;
    wanted[i] = 0.5f * (truth[0][i] + truth[1][i]);
    mean += static_cast<double>(wanted[i].x + wanted[i].y + wanted[i].z) / 3.0;
    light += static_cast<double>(found[i].x + found[i].y + found[i].z) / 3.0;
  }
  const auto n = static_cast<double>(found.size());
  const auto exposure = static_cast<float>(0.4 * n / mean);
  Blotches blotches{std::sqrt(std::max(0.0, square / n)) / (mean / n), light / mean, 0.0};
  for (const float e : flip(kSide, kSide, found, wanted, exposure)) blotches.flip += static_cast<double>(e) / n;
  return blotches;
}

// A floor under one light.
struct Floor {
  std::vector<SceneLight> lights;
  std::array<Picture, 2> truth;
};

class SmoothLight : public testing::Test {
 protected:
  void SetUp() override {
    scene_ = hall();
    auto tracer = RayTracer::create(scene_, "avx2", context_);
    ASSERT_TRUE(tracer) << tracer.error().message;
    tracer_.emplace(std::move(*tracer));
    for (std::size_t i = 0; i < kSide * kSide; ++i)
      at_.push_back(kFirst + kStep * glm::vec3(static_cast<float>(i % kSide), 0, static_cast<float>(i / kSide)));
    std::vector<glm::vec3> above;
    for (const glm::vec3& p : at_) above.push_back(p + glm::vec3(0, tracer_->epsilonAt(p), 0));
    for (const SceneLight& light : scene_.lights) {
      Floor floor{{light}, {}};
      floor.truth = trace({scene_, *tracer_, floor.lights, false}, above);
      floors_.push_back(std::move(floor));
    }
  }

  // Under each of the lights.
  std::vector<Blotches> blotchesOf(const BakeOptions& options) {
    std::vector<Blotches> all;
    auto baked = bake(scene_, options, context_);
    if (!baked) {
      ADD_FAILURE() << baked.error().message;
      return all;
    }
    auto relighter = Relighter::create(*baked, {});
    if (!relighter) {
      ADD_FAILURE() << relighter.error().message;
      return all;
    }
    for (const Floor& floor : floors_) {
      const std::vector<glm::vec3> direct =
          test::shadowedLight({scene_, *tracer_, floor.lights, false}, baked->surfels);
      LightSetup setup;
      setup.surfelIrradiance = direct;
      relighter->reset();
      EXPECT_TRUE(relightUntilConverged(*relighter, setup));
      Picture found;
      for (const glm::vec3& p : at_) {
        const Hit hit = tracer_->trace({p + glm::vec3(0, 1, 0), 0.0f, {0, -1, 0}});
        EXPECT_TRUE(hit);
        found.push_back(test::readAtHit(*baked, *relighter, hit, p, {0, 1, 0}, {0, 1, 0}));
      }
      all.push_back(measure(found, floor.truth));
    }
    return all;
  }

  Scene scene_;
  Context context_;
  std::optional<RayTracer> tracer_;
  std::vector<glm::vec3> at_;
  std::vector<Floor> floors_;
};

// Figures at hand, lamp and spot: medium 0.46 % and 2.8 %, FLIP 0.046 and 0.098; high 0.93 % and 3.7 %, 0.054 and
// 0.135. A contrast of a hundredth is about what can be seen.
TEST_F(SmoothLight, floorsOfThePresetsAreSmooth) {
  for (const Preset preset : {Preset::medium, Preset::high}) {
    const std::vector<Blotches> found = blotchesOf(presetOptions(preset));
    ASSERT_EQ(found.size(), 2u);
    EXPECT_LT(found[0].fine, kSeen);
    EXPECT_LT(found[0].flip, kFlip[0]);
    EXPECT_LT(found[1].fine, kSeenOfSpot);
    EXPECT_LT(found[1].flip, kFlip[1]);
    for (const Blotches& each : found) EXPECT_NEAR(each.energy, 1.0, 0.1);
  }
}

// The bounds can tell: with a twelfth of the links neighbours disagree. At hand 2.5 % and 6.8 %, FLIP 0.21 and 0.32;
// by four other seeds 2.0 to 5.4 % and 9.6 to 24 %, 0.15 to 0.23 and 0.27 to 0.46.
TEST_F(SmoothLight, floorsBlotchWithFewLinks) {
  if (!test::longTests()) GTEST_SKIP() << "a long test: set RELUME_LONG_TESTS=1";
  BakeOptions few = presetOptions(Preset::high);
  few.links.linksPerCache = 11;
  const std::vector<Blotches> found = blotchesOf(few);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_GT(found[0].fine, 1.5 * kSeen);
  EXPECT_GT(found[0].flip, kFlip[0]);
  EXPECT_GT(found[1].fine, kSeenOfSpot);
  EXPECT_GT(found[1].flip, kFlip[1]);
}

}  // namespace
}  // namespace relume
