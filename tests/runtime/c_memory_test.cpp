// SPDX-License-Identifier: MIT
// relume_context_desc.allocate and deallocate: serve everything that a context makes, both or neither, and may answer
// NULL at any time.
#include "relume/bake_file.h"
#include "relume/relume.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/c_lights.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"
#include "tests/runtime/tracking_memory.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::TrackingMemory;

// What the callbacks get as `user`.
struct Game {
  TrackingMemory memory;
  std::string log;
};

relume_context_desc describe(Game& game) {
  relume_context_desc desc{};
  desc.struct_size = sizeof desc;
  desc.api_version = RELUME_API_VERSION;
  desc.user = &game;
  desc.log = [](void* user, relume_severity, const char* text) { static_cast<Game*>(user)->log = text; };
  desc.parallel_for = [](void*, unsigned int tasks, relume_task task, void* data) {
    std::thread other([&] {
      for (unsigned int i = 1; i < tasks; i += 2) task(data, i);
    });
    for (unsigned int i = 0; i < tasks; i += 2) task(data, i);
    other.join();
  };
  desc.allocate = [](void* user, std::size_t size, std::size_t alignment) {
    return static_cast<Game*>(user)->memory.give(size, alignment);
  };
  desc.deallocate = [](void* user, void* block, std::size_t size, std::size_t alignment) {
    static_cast<Game*>(user)->memory.takeBack(block, size, alignment);
  };
  return desc;
}

class CMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    Bake bake =
        test::makeSyntheticBake({.surfels = 1500, .lightmapCaches = 100, .linksPerCache = 32, .kind = LinkKind::oct6});
    bake.instances = std::vector<BakedInstance>{{"room", {}, {}}};
    bake.caches.lightmap.parts = std::vector<LightmapPart>(1);
    caches_ = bake.caches.count();
    const Result<std::vector<std::byte>> bytes = serializeBake(bake);
    ASSERT_TRUE(bytes) << bytes.error().message;
    bytes_ = *bytes;
    lights_ = test::cLights(test::someLights());
    relume_light_setup_default(&setup_, sizeof setup_);
    setup_.lights = lights_.data();
    setup_.light_count = lights_.size();
  }

  // What a game does with a level, up to the first failure: the functions' light, and the text of the handle that knows
  // of the failure. The bytes are released once, whatever happens.
  struct Played {
    relume_status status = RELUME_OK;
    std::string text;
    std::vector<float> light;
  };
  Played play(const relume_context_desc& desc) {
    Played played;
    relume_context* context = nullptr;
    relume_bake* bake = nullptr;
    relume_relighter *relighter = nullptr, *next = nullptr;
    int released = 0;
    const auto release = [](void* count) { ++*static_cast<int*>(count); };
    const std::vector<std::pair<std::function<relume_status()>, std::function<const char*()>>> steps = {
        {[&] { return relume_context_create(&desc, &context); }, [&] { return relume_context_error(context); }},
        {[&] { return relume_bake_from_memory(context, bytes_.data(), bytes_.size(), release, &released, &bake); },
         [&] { return relume_context_error(context); }},
        {[&] { return relume_relighter_create(bake, nullptr, &relighter); }, [&] { return relume_bake_error(bake); }},
        {[&] { return relume_relight(relighter, &setup_); }, [&] { return relume_relighter_error(relighter); }},
        {[&] { return relume_relighter_create(bake, nullptr, &next); }, [&] { return relume_bake_error(bake); }},
        {[&] { return relume_inherit(next, bake, relighter); }, [&] { return relume_relighter_error(next); }},
        {[&] { return relume_relight(next, &setup_); }, [&] { return relume_relighter_error(next); }}};
    for (const auto& [step, text] : steps) {
      played.status = step();
      played.text = text();
      if (played.status != RELUME_OK) break;
    }
    if (played.status == RELUME_OK) {
      played.light.resize(std::size_t{caches_} * relume_coefficients_per_cache(next));
      EXPECT_EQ(relume_cache_coefficients(next, played.light.data(), played.light.size() * sizeof(float)), RELUME_OK);
    }
    // The host goes with the last of them.
    relume_context_destroy(context);
    relume_bake_destroy(bake);
    relume_relighter_destroy(relighter);
    relume_relighter_destroy(next);
    EXPECT_EQ(released, context == nullptr ? 0 : 1);
    return played;
  }

  std::vector<std::byte> bytes_;
  std::vector<relume_light> lights_;
  relume_light_setup setup_;
  std::uint32_t caches_ = 0;
};

TEST_F(CMemory, allThatAContextMakesIsTheHosts) {
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "relume_c_memory_test.relume";
  const Result<Bake> parsed = parseBake(bytes_, nullptr);
  ASSERT_TRUE(parsed && writeBake(*parsed, path));
  Game game;
  const relume_context_desc desc = describe(game);
  relume_context* context = nullptr;
  relume_bake* bake = nullptr;
  relume_relighter* relighter = nullptr;
  test::forgetLargest();
  ASSERT_EQ(relume_context_create(&desc, &context), RELUME_OK);
  EXPECT_EQ(game.memory.blocks(), 2u);  // the context, and what its handles share
  ASSERT_EQ(relume_bake_load(context, path.string().c_str(), &bake), RELUME_OK) << relume_context_error(context);
  ASSERT_EQ(relume_relighter_create(bake, nullptr, &relighter), RELUME_OK) << relume_bake_error(bake);
  ASSERT_EQ(relume_relight(relighter, &setup_), RELUME_OK);
  EXPECT_LE(test::largestAllocation(), 512u) << "not from the host's memory";
  EXPECT_GT(game.memory.bytes(), 16u * parsed->surfels.count() + 4u * parsed->hierarchy.nodeCount());
  std::vector<float> light(std::size_t{caches_} * relume_coefficients_per_cache(relighter));
  const std::size_t requests = game.memory.requests();
  test::forgetLargest();
  for (int frame = 0; frame < 3; ++frame) ASSERT_EQ(relume_relight(relighter, &setup_), RELUME_OK);
  ASSERT_EQ(relume_cache_coefficients(relighter, light.data(), light.size() * sizeof(float)), RELUME_OK);
  EXPECT_LE(test::largestAllocation(), 256u) << "more than the test's threads need";
  EXPECT_EQ(game.memory.requests(), requests);
  relume_bake_destroy(bake);
  relume_context_destroy(context);
  EXPECT_GT(game.memory.blocks(), 0u);
  ASSERT_EQ(relume_relight(relighter, &setup_), RELUME_OK);
  relume_relighter_destroy(relighter);
  EXPECT_EQ(game.memory.blocks(), 0u);
  EXPECT_EQ(game.memory.mistakes(), 0u);
  std::filesystem::remove(path);
}

TEST_F(CMemory, anyRequestMayBeRefused) {
  Game game;
  const relume_context_desc desc = describe(game);
  const Played expected = play(desc);
  ASSERT_EQ(expected.status, RELUME_OK) << expected.text;
  const std::size_t requests = game.memory.requests();
  ASSERT_GT(requests, 40u);
  std::size_t spared = 0;
  for (std::size_t n = 0; n < requests; ++n) {
    game.memory.refuse(n);
    game.log.clear();
    const Played found = play(desc);
    ASSERT_EQ(game.memory.refused(), 1u) << "request " << n;
    ASSERT_EQ(game.memory.blocks(), 0u) << "request " << n;
    if (found.status == RELUME_OK) {
      ++spared;  // arrays that only shrink
      EXPECT_EQ(found.light, expected.light);
      continue;
    }
    ASSERT_EQ(found.status, RELUME_ERROR_MEMORY) << found.text;
    EXPECT_NE(game.log.find("out of memory: "), std::string::npos) << "request " << n << ": " << game.log;
    EXPECT_NE(game.log.find(" bytes"), std::string::npos) << game.log;
    // Before the first two there is no handle to hold it.
    EXPECT_EQ(found.text, n < 2 ? "" : game.log);
  }
  EXPECT_LE(spared, 8u);
  game.memory.refuse(TrackingMemory::kNever);
  EXPECT_EQ(play(desc).light, expected.light);
  EXPECT_EQ(game.memory.blocks(), 0u);
  EXPECT_EQ(game.memory.mistakes(), 0u);
}

// A frame without memory for its lights leaves the light of the one before.
TEST_F(CMemory, lightStaysWhereAFrameGetsNone) {
  Game game;
  const relume_context_desc desc = describe(game);
  relume_context* context = nullptr;
  relume_bake* bake = nullptr;
  relume_relighter* relighter = nullptr;
  ASSERT_EQ(relume_context_create(&desc, &context), RELUME_OK);
  ASSERT_EQ(relume_bake_from_memory(context, bytes_.data(), bytes_.size(), nullptr, nullptr, &bake), RELUME_OK);
  ASSERT_EQ(relume_relighter_create(bake, nullptr, &relighter), RELUME_OK);
  ASSERT_EQ(relume_relight(relighter, &setup_), RELUME_OK);
  const auto light = [&] {
    std::vector<float> all(std::size_t{caches_} * relume_coefficients_per_cache(relighter));
    EXPECT_EQ(relume_cache_coefficients(relighter, all.data(), all.size() * sizeof(float)), RELUME_OK);
    return all;
  };
  const std::vector<float> before = light();
  std::vector<relume_light> many;
  for (int i = 0; i < 8; ++i) many.insert(many.end(), lights_.begin(), lights_.end());
  setup_.lights = many.data();
  setup_.light_count = many.size();
  game.memory.refuse(0);
  EXPECT_EQ(relume_relight(relighter, &setup_), RELUME_ERROR_MEMORY);
  EXPECT_EQ(light(), before);
  EXPECT_EQ(relume_relight(relighter, &setup_), RELUME_OK);
  EXPECT_NE(light(), before);
  relume_relighter_destroy(relighter);
  relume_bake_destroy(bake);
  relume_context_destroy(context);
  EXPECT_EQ(game.memory.blocks(), 0u);
}

TEST_F(CMemory, bothCallbacksOrNeither) {
  for (const bool first : {true, false}) {
    Game game;
    relume_context_desc desc = describe(game);
    if (first) {
      desc.deallocate = nullptr;
    } else {
      desc.allocate = nullptr;
    }
    relume_context* context = nullptr;
    EXPECT_EQ(relume_context_create(&desc, &context), RELUME_ERROR_USAGE);
    EXPECT_EQ(context, nullptr);
    EXPECT_NE(game.log.find("both or neither"), std::string::npos) << game.log;
    EXPECT_EQ(game.memory.requests(), 0u);
  }
}

// A host of before there were these callbacks: what lies behind its struct is not looked at.
TEST_F(CMemory, olderHostsHaveNone) {
  Game game;
  relume_context_desc desc = describe(game);
  desc.struct_size = offsetof(relume_context_desc, allocate);
  desc.deallocate = nullptr;
  const Played played = play(desc);
  EXPECT_EQ(played.status, RELUME_OK) << played.text;
  EXPECT_EQ(game.memory.requests(), 0u);
  // With all of the struct, NULLs are the same.
  desc = describe(game);
  desc.allocate = nullptr;
  desc.deallocate = nullptr;
  EXPECT_EQ(play(desc).light, played.light);
  EXPECT_EQ(game.memory.requests(), 0u);
}

}  // namespace
}  // namespace relume
