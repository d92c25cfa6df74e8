// SPDX-License-Identifier: MIT
// Light without a bake under what hosts get wrong and levels have at worst: nothing is read that is not there, no
// number of the light is other than finite, and what was refused changes nothing.
#include "relume/live_light.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>
#include <glm/ext/matrix_transform.hpp>
#include <glm/mat4x4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinite = std::numeric_limits<float>::infinity();

LiveLight hostileLight(VoxelLevel& level, std::uint32_t cascades, bool follows, std::uint32_t budget = 0) {
  LiveLightOptions options;
  options.cells = 8;
  options.cascades = cascades;
  options.boxFollowsEye = follows;
  options.raysPerCell = 8;
  options.surfaceBudget = budget;
  auto light = LiveLight::create(level.geometry(), options);
  EXPECT_TRUE(light) << light.error().message;
  return std::move(*light);
}

void expectFinite(const LiveLight& light) {
  for (int i = 0; i < 40; ++i) {
    const float x = -3.0f + 0.35f * static_cast<float>(i);
    const glm::vec3 e = light.irradiance({x, 0.3f * x, 1.0f}, {0, 1, 0});
    ASSERT_TRUE(e.x >= 0.0f && e.y >= 0.0f && e.z >= 0.0f && e.x < 1e12f && e.y < 1e12f && e.z < 1e12f) << i;
  }
}

// Levels of nothing, of a point, a line, of triangles without area, with volumes of one cell.
TEST(HostileLive, levelsOfNextToNothingAreDark) {
  std::vector<VoxelLevel> levels(7);
  levels[1].meshes.push_back({});
  levels[1].parts.push_back({0, glm::mat4x3(1.0f), true});
  levels[2].addQuad({1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1});
  levels[3].addQuad({-1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {-1, 0, 0});
  levels[4].addBox({0, 0, 0}, {1, 1, 1}, true);
  levels[4].parts[0].toWorld = glm::mat4x3(0.0f);
  levels[5].addBox({0, 0, 0}, {1e-30f, 1e-30f, 1e-30f}, true);
  levels[6].addBox({0, 0, 0}, {1e-44f, 1e-44f, 0}, true);
  for (std::size_t i = 0; i < levels.size(); ++i) {
    for (const std::uint32_t cascades : {1u, 4u}) {
      LiveLight light = hostileLight(levels[i], cascades, i % 2 == 1);
      const std::vector<glm::mat4x3> moves(i == 1 ? 1 : 0, glm::mat4x3(1.0f));
      ASSERT_TRUE(light.move(moves)) << i;
      for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(light.update({}, {})) << i;
      ASSERT_TRUE(light.centre({1e6f, -1e6f, 0.0f})) << i;
      ASSERT_TRUE(light.update({}, {})) << i;
      expectFinite(light);
    }
  }
}

// A run of edits, moves, looks and frames, many of which are refused.
TEST(HostileLive, aRunOfBadCallsLeavesALightLikeANewOne) {
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> place(-3.0f, 3.0f), share(0.0f, 1.0f);
    VoxelLevel level;
    level.surfaces = {{glm::vec3(1.0f)}, {glm::vec3(0.5f), glm::vec3(1e3f, 0.0f, 1.0f), 0.5f, true}};
    level.addBox({-4, -4, -4}, {4, 4, 4}, true);
    for (int i = 0; i < 6; ++i) {
      const glm::vec3 low(place(random), place(random), place(random));
      level.addBox(low, low + 0.05f + share(random), false, i % 2);
      level.parts.back().moves = i > 3;
    }
    const std::uint32_t cascades = 1 + seed % 3, budget = seed % 4 == 3 ? 200 : 0;
    LiveLight light = hostileLight(level, cascades, seed % 2 == 1, budget);
    std::vector<PartEdit> stands(5);
    std::vector<glm::mat4x3> moves(2, glm::mat4x3(1.0f));
    for (std::uint32_t p = 0; p < 5; ++p) stands[p] = {p, glm::mat4x3(1.0f), true};
    const auto transform = [&] {
      glm::mat4 to = glm::translate(glm::mat4(1.0f), glm::vec3(place(random), place(random), place(random)));
      to = glm::rotate(to, 6.0f * share(random), unit(random));
      const float size = share(random) < 0.1f ? 0.0f : share(random) < 0.1f ? 1e4f : 0.2f + share(random);
      to = glm::scale(to, glm::vec3(size, share(random) < 0.3f ? -size : size, size));
      if (share(random) < 0.1f) to[static_cast<int>(3.0f * share(random))][0] = kNan;
      if (share(random) < 0.1f) to[3][1] = share(random) < 0.5f ? kInfinite : 9e7f;
      return glm::mat4x3(to);
    };
    const auto isGood = [](const glm::mat4x3& m) {
      bool good = true;
      for (int c = 0; c < 4; ++c) {
        for (int r = 0; r < 3; ++r) good = good && std::abs(m[c][r]) <= 1e8f;
      }
      return good;
    };
    glm::vec3 eye(0.0f);
    for (int step = 0; step < 60; ++step) {
      switch (random() % 5) {
        case 0: {  // edits, some parts twice, some that are not there or move
          std::vector<PartEdit> edits(random() % 4);
          bool isOk = true;
          for (PartEdit& e : edits) {
            e = {static_cast<std::uint32_t>(random() % (share(random) < 0.1f ? 9 : 5)), transform(),
                 share(random) < 0.7f};
            isOk = isOk && e.part < 5 && isGood(e.toWorld);
          }
          ASSERT_EQ(static_cast<bool>(light.edit(edits)), isOk) << seed << ' ' << step;
          for (const PartEdit& e : edits) {
            if (isOk) stands[e.part] = e;
          }
          break;
        }
        case 1: {
          std::vector<glm::mat4x3> to(share(random) < 0.1f ? 3 : 2);
          std::generate(to.begin(), to.end(), transform);
          const bool isOk = to.size() == 2 && std::all_of(to.begin(), to.end(), isGood);
          ASSERT_EQ(static_cast<bool>(light.move(to)), isOk) << seed << ' ' << step;
          if (isOk) moves = to;
          break;
        }
        case 2: {
          const glm::vec3 to =
              share(random) < 0.2f ? glm::vec3(kNan, 0, 0) : (share(random) < 0.2f ? 1e8f : 2.0f) * unit(random);
          const bool isOk = !std::isnan(to.x);
          ASSERT_EQ(static_cast<bool>(light.centre(to)), isOk);
          if (isOk) eye = to;
          break;
        }
        default: {
          LiveFrame frame;
          frame.raySet = static_cast<std::uint32_t>(random());
          frame.keep = share(random) < 0.1f ? kNan : 0.5f;
          std::array<Light, 2> lights;
          lights[0].kind = LightKind::point;
          lights[0].intensity = glm::vec3(share(random) < 0.1f ? kInfinite : 1e10f * share(random));
          lights[0].positionWorld = {place(random), place(random), place(random)};
          lights[1].kind = LightKind::directional;
          lights[1].direction = share(random) < 0.1f ? glm::vec3(0.0f) : unit(random);
          LightSetup setup;
          setup.lights = lights;
          setup.visibility = [&](std::uint32_t, const glm::vec3&, const glm::vec3&) {
            return share(random) < 0.1f ? kNan : 2.0f * share(random) - 0.5f;
          };
          static_cast<void>(light.update(setup, frame));
          break;
        }
      }
    }
    ASSERT_TRUE(light.update({}, {}));
    expectFinite(light);

    // A level made where all is by now has the same voxels.
    for (const PartEdit& e : stands) level.parts[e.part].toWorld = e.toWorld;
    LiveLightOptions options;
    options.cells = 8;
    options.cascades = cascades;
    options.boxFollowsEye = seed % 2 == 1;
    options.boxMin = glm::vec3(-4.0f);
    options.boxMax = glm::vec3(4.0f);
    options.eyeWorld = eye;
    options.raysPerCell = 8;
    options.surfaceBudget = budget;
    auto fresh = LiveLight::create(level.geometry(), options);
    ASSERT_TRUE(fresh);
    ASSERT_TRUE(fresh->edit(stands));
    ASSERT_TRUE(fresh->move(moves));
    static_cast<void>(fresh->centre(eye));
    static_cast<void>(light.centre(eye));
    ASSERT_TRUE(fresh->update({}, {}));
    ASSERT_TRUE(light.update({}, {}));
    // Those that follow the eye may be half a cell from where new ones would be
    if (cascades == 1 && seed % 2 == 0) {
      EXPECT_EQ(light.voxels().occupied, fresh->voxels().occupied) << seed;
      EXPECT_EQ(light.caches(), fresh->caches()) << seed;
    }
  }
}

// Frame after frame of what moves and is edited take no more than the first did.
TEST(HostileLive, memoryStaysThroughManyFrames) {
  VoxelLevel level;
  level.surfaces[0].emission = glm::vec3(1.0f);
  level.addBox({-4, -4, -4}, {4, 4, 4}, true);
  level.addBox({-1, -1, -1}, {0, 0, 0}, false);
  level.addBox({1, 1, 1}, {2, 2, 2}, false);
  level.parts.back().moves = true;
  LiveLight light = hostileLight(level, 2, false);
  const auto bytes = [&] {
    std::size_t sum = 0;
    for (const auto& [name, size] : light.bufferSizes()) sum += size;
    return sum;
  };
  std::size_t most = 0, later = 0;
  for (int f = 0; f < 240; ++f) {
    const float t = 0.05f * static_cast<float>(f % 60);
    const std::array<glm::mat4x3, 1> to{glm::mat4x3(glm::translate(glm::mat4(1.0f), glm::vec3(-t, 0, 0)))};
    ASSERT_TRUE(light.move(to));
    if (f % 7 == 0) {
      const std::array<PartEdit, 1> edit{{{1, glm::mat4x3(glm::translate(glm::mat4(1.0f), {0, t, 0})), f % 3 != 0}}};
      ASSERT_TRUE(light.edit(edit));
    }
    const glm::vec3 eye = f % 5 == 0 ? glm::vec3(t, -t, 0.0f) : glm::vec3(0.0f);
    ASSERT_TRUE(light.centre(eye));
    ASSERT_TRUE(light.update({}, {}));
    std::size_t& sum = f < 120 ? most : later;
    sum = std::max(sum, bytes());
  }
  EXPECT_LE(static_cast<double>(later), 1.05 * static_cast<double>(most));
}

}  // namespace
}  // namespace relume
