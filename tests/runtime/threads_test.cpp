// SPDX-License-Identifier: MIT
// Two threads share one bake: each relights by a Relighter of its own, with helpers from a pool of the host's; and both
// read the same bytes of a file. Nothing here links Embree, oneTBB or OpenGL, which are not built for ThreadSanitizer:
// the preset `tsan` runs this program.
#include "formats/validate.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"

#include "tests/formats/small_bake.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <array>
#include <atomic>
#include <thread>
#include <vector>

namespace relume {
namespace {

// Helpers that draw tasks from a counter, as a game's job system would.
void runInTwo(std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
  std::atomic<std::uint32_t> next{0};
  const auto work = [&] {
    for (std::uint32_t task = next++; task < tasks; task = next++) body(task);
  };
  std::thread helper(work);
  work();
  helper.join();
}

// What a host that lives beside another sees of three frames.
struct Seen {
  std::vector<float> coefficients;
  std::vector<glm::vec3> irradiance;
  bool operator==(const Seen&) const = default;
};

Seen relightAndRead(const Bake& bake, const RelightOptions& options, const glm::vec3& lamp) {
  Result<Relighter> relighter = Relighter::create(bake, options);
  EXPECT_TRUE(relighter) << (relighter ? "" : relighter.error().message);
  if (!relighter) return {};
  const Light light{.intensity = glm::vec3(20.0f, 15.0f, 10.0f), .positionWorld = lamp};
  LightSetup setup;
  setup.lights = std::span(&light, 1);
  setup.skyRadiance = glm::vec3(0.5f);
  setup.visibility = [](std::uint32_t, const glm::vec3& position, const glm::vec3&) {
    return position.y > 1.0f ? 1.0f : 0.5f;
  };
  Seen seen;
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_TRUE(relighter->relight(setup));
    for (float x = 0.1f; x < 1.0f; x += 0.2f) {
      seen.irradiance.push_back(relighter->irradianceOnLightmap({x, 0.5f}, {0, 1, 0}));
      seen.irradiance.push_back(relighter->irradianceInGrid({4.0f * x, 1.5f, 2.0f}, {1, 0, 0}));
    }
  }
  seen.coefficients = relighter->cacheCoefficients();
  return seen;
}

TEST(TwoThreads, relightOneBakeAsIfEachWereAlone) {
  for (const LinkKind kind : kLinkKinds) {
    for (const Simd simd : {Simd::baseline, Simd::best}) {
      const Bake bake = test::makeSyntheticBake({.surfels = 3000, .skyPatches = 16, .linksPerCache = 32, .kind = kind});
      RelightOptions options;
      options.parallelFor = runInTwo;
      options.simd = simd;
      const Seen aloneA = relightAndRead(bake, options, {1, 2, 1}), aloneB = relightAndRead(bake, options, {3, 1, 2});
      EXPECT_FALSE(aloneA == aloneB) << "two lamps must differ, or nothing is tested";
      Seen a, b;
      std::thread other([&] { b = relightAndRead(bake, options, {3, 1, 2}); });
      a = relightAndRead(bake, options, {1, 2, 1});
      other.join();
      EXPECT_TRUE(a == aloneA) << "kind " << static_cast<int>(kind);
      EXPECT_TRUE(b == aloneB) << "kind " << static_cast<int>(kind);
    }
  }
}

// The const functions of one Relighter, from many threads between two frames.
TEST(ManyThreads, lookUpInOneRelighterAsOneWould) {
  for (const LinkKind kind : kLinkKinds) {
    const Bake bake = test::makeSyntheticBake({.surfels = 2000, .skyPatches = 16, .linksPerCache = 32, .kind = kind});
    Result<Relighter> made = Relighter::create(bake, {});
    ASSERT_TRUE(made) << made.error().message;
    const Relighter& relighter = *made;
    const Light light{.intensity = glm::vec3(20.0f, 15.0f, 10.0f), .positionWorld = {1, 2, 1}};
    LightSetup setup;
    setup.lights = std::span(&light, 1);
    const auto lookUp = [&] {
      Seen seen;
      for (float x = 0.05f; x < 1.0f; x += 0.05f) {
        const glm::vec3 n = glm::normalize(glm::vec3(x, 1.0f, 0.3f));
        seen.irradiance.push_back(relighter.irradianceOnLightmap({x, 1.0f - x}, n));
        seen.irradiance.push_back(relighter.irradianceOnLightmap({x, 0.5f}, n, {0, 1, 0}));
        seen.irradiance.push_back(relighter.irradianceInGrid({4.0f * x, 1.5f, 2.0f}, n));
      }
      seen.coefficients = relighter.cacheCoefficients();
      for (const glm::vec3& node : relighter.nodeRadiosity()) seen.irradiance.push_back(node);
      EXPECT_TRUE(relighter.check(setup));
      EXPECT_EQ(relighter.passTimes().size(), 3u);
      EXPECT_FALSE(relighter.bufferSizes().empty());
      return seen;
    };
    for (int frame = 0; frame < 2; ++frame) {
      ASSERT_TRUE(made->relight(setup));
      std::array<Seen, 4> seen;
      std::vector<std::thread> threads;
      for (Seen& each : seen) threads.emplace_back([&] { each = lookUp(); });
      for (std::thread& thread : threads) thread.join();
      const Seen alone = lookUp();
      for (const Seen& each : seen) EXPECT_TRUE(each == alone) << "kind " << static_cast<int>(kind);
    }
  }
}

TEST(TwoThreads, parseAndValidateTheSameBytes) {
  const Result<std::vector<std::byte>> file = serializeBake(makeSmallBake());
  ASSERT_TRUE(file) << file.error().message;
  std::atomic<int> good{0};
  const auto read = [&] {
    const Result<Bake> parsed = parseBake(*file, nullptr);
    if (!parsed) return;
    validateBake(*parsed);
    const Result<std::vector<std::byte>> again = serializeBake(*parsed);
    good += again && *again == *file ? 1 : 0;
  };
  std::thread other(read);
  read();
  other.join();
  EXPECT_EQ(good, 2);
}

}  // namespace
}  // namespace relume
