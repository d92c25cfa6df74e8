// SPDX-License-Identifier: MIT
// A host's memory resource serves what loads and lights a bake, gets all of it back, and may refuse any request: an
// error comes of it, nothing is lost, and light stays as it was.
#include "formats/memory.h"
#include "relume/bake_file.h"
#include "relume/edit_blend.h"
#include "relume/gpu_passes.h"
#include "relume/live_light.h"
#include "relume/relighter.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/hot_reload.h"
#include "tests/runtime/make_relighter.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"
#include "tests/runtime/tracking_memory.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::TrackingMemory;

// std::pmr's default resource gives nothing in this program: a container that was not handed a resource shows.
const auto kNoDefault = std::pmr::set_default_resource(std::pmr::null_memory_resource());

// A level with names: more instances than fit into small blocks, each with a name that does.
Bake makeLevel(LinkKind kind, std::uint32_t surfels = 3000) {
  Bake bake = test::makeSyntheticBake(
      {.surfels = surfels, .skyPatches = 16, .lightmapCaches = 200, .linksPerCache = 48, .kind = kind});
  bake.instances = std::vector<BakedInstance>(300, BakedInstance{"node", "mesh", ""});
  bake.caches.lightmap.parts = std::vector<LightmapPart>(300);
  return bake;
}

std::vector<std::byte> bytesOf(const Bake& bake) {
  const Result<std::vector<std::byte>> bytes = serializeBake(bake);
  EXPECT_TRUE(bytes) << bytes.error().message;
  return *bytes;
}

std::vector<float> lightOf(const Relighter& relighter) { return relighter.cacheCoefficients(); }

// What the relighter says it holds, less the bake's own arrays among it.
std::size_t bytesHeld(const Relighter& relighter, const Bake& bake) {
  std::size_t held = 0;
  for (const auto& [name, bytes] : relighter.bufferSizes()) held += bytes;
  const auto bytes = [](const auto& array) { return array.size() * sizeof(array[0]); };
  const bool packedAgain = bake.links.kind == LinkKind::oct6;
  const Links& l = bake.links;
  held -= bytes(l.cone) + bytes(l.shNode) + bytes(l.shCoefficients);
  if (!packedAgain) held -= bytes(l.head) + bytes(l.shape);
  return held;
}

TEST(Memory, allOfARelightersIsTheHosts) {
  constexpr std::size_t kScratch = 256;  // [byte] texts, and what cereal keeps while it reads
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "relume_memory_test.relume";
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    ASSERT_TRUE(writeBake(makeLevel(kind), path));
    const std::size_t file = std::filesystem::file_size(path);
    const std::vector<Light> lights = test::someLights();
    LightSetup setup;
    setup.lights = lights;
    for (const bool map : {true, false}) {
      TrackingMemory memory;
      {
        test::forgetLargest();
        const Result<Bake> bake =
            map ? mapBake(path, Checksums::verify, &memory) : readBake(path, Checksums::verify, &memory);
        ASSERT_TRUE(bake) << bake.error().message;
        const std::size_t loaded = memory.bytes(), list = bake->instances.size() * sizeof(BakedInstance);
        EXPECT_GE(loaded, list + (map ? 0 : file));
        EXPECT_LE(loaded, list + (map ? 0 : file) + 512);
        RelightOptions options;
        options.memory = &memory;
        options.gridTexture = map;
        Result<Relighter> relighter = Relighter::create(*bake, options), heir = Relighter::create(*bake, options);
        ASSERT_TRUE(relighter && heir);
        ASSERT_TRUE(relighter->relight(setup));
        ASSERT_TRUE(heir->inherit(*relighter, *bake));
        ASSERT_TRUE(heir->relight(setup));
        EXPECT_LE(test::largestAllocation(), kScratch) << "not from the host's memory";
        const std::size_t expected = 2 * bytesHeld(*relighter, *bake);
        EXPECT_GE(memory.bytes() - loaded, expected);
        EXPECT_LE(memory.bytes() - loaded, expected + expected / 10 + 16384);
        // Frames that follow take none, neither there nor elsewhere.
        const std::size_t requests = memory.requests(), others = test::allocations();
        for (int frame = 0; frame < 4; ++frame) ASSERT_TRUE(heir->relight(setup));
        EXPECT_EQ(memory.requests(), requests);
        EXPECT_EQ(test::allocations(), others);
      }
      EXPECT_GT(memory.requests(), 20u);
      EXPECT_EQ(memory.blocks(), 0u);
      EXPECT_EQ(memory.mistakes(), 0u);
    }
  }
  std::filesystem::remove(path);
}

// Whatever the resource gives, light is the same: blocks of a relighter's are as aligned as those of operator new, and
// no number comes from memory that was not written.
TEST(Memory, lightIsThatOfOperatorNew) {
  for (const LinkKind kind : kLinkKinds) {
    const Bake bake = makeLevel(kind);
    TrackingMemory memory;
    RelightOptions options;
    Result<Relighter> expected = Relighter::create(bake, options);
    options.memory = &memory;
    Result<Relighter> found = Relighter::create(bake, options);
    ASSERT_TRUE(expected && found);
    EXPECT_GE(memory.minAlignment(), alignof(void*));  // the relighter itself
    const std::vector<Light> lights = test::someLights();
    LightSetup setup;
    setup.lights = lights;
    for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(expected->relight(setup) && found->relight(setup));
    EXPECT_EQ(lightOf(*expected), lightOf(*found));
  }
}

// A bake's arrays and a relighter may go in any order, and moves take the memory along.
TEST(Memory, goesBackInAnyOrder) {
  const std::vector<std::byte> bytes = bytesOf(makeLevel(LinkKind::oct6));
  TrackingMemory memory, other;
  const auto load = [&](TrackingMemory& from) {
    auto owner = std::make_shared<std::vector<std::byte>>(bytes);
    Result<Bake> bake = parseBake(*owner, owner, Checksums::verify, &from);
    EXPECT_TRUE(bake);
    return std::make_unique<Bake>(std::move(*bake));
  };
  const auto light = [](const Bake& bake, TrackingMemory& from) {
    RelightOptions options;
    options.memory = &from;
    Result<Relighter> made = Relighter::create(bake, options);
    EXPECT_TRUE(made);
    return std::move(*made);
  };
  const LightSetup setup;
  {
    std::unique_ptr<Bake> bake = load(memory);
    Relighter relighter = light(*bake, memory);
    bake.reset();
    EXPECT_TRUE(relighter.relight(setup));
  }
  {
    // Assignment between two resources: each block goes back to where it came from.
    std::unique_ptr<Bake> a = load(memory), b = load(other);
    Relighter first = light(*a, memory), second = light(*b, other);
    const std::size_t requests = memory.requests() + other.requests();
    first = std::move(second);
    *a = std::move(*b);
    Bake copy = *a;
    EXPECT_EQ(memory.requests() + other.requests(), requests) << "moved by copying";
    EXPECT_EQ(memory.blocks(), 0u);
    a.reset();
    b.reset();
    EXPECT_EQ(copy.instances[299].node, "node");
    EXPECT_TRUE(first.relight(setup));
  }
  EXPECT_EQ(memory.blocks() + other.blocks(), 0u);
  EXPECT_EQ(memory.mistakes() + other.mistakes(), 0u);
}

// All that a game does with a level, in memory of its own: the light of the second frame, or the first error.
Result<std::vector<float>> play(std::span<const std::byte> bytes, const Relighter& previous, const LightSetup& setup,
                                TrackingMemory& memory) {
  const Result<Bake> bake = parseBake(bytes, nullptr, Checksums::verify, &memory);
  if (!bake) return bake.error();
  RelightOptions options;
  options.memory = &memory;
  Result<Relighter> relighter = Relighter::create(*bake, options);
  if (!relighter) return relighter.error();
  if (Status ok = relighter->relight(setup); !ok) return ok.error();
  if (Status ok = relighter->inherit(previous, *bake); !ok) return ok.error();
  if (Status ok = relighter->relight(setup); !ok) return ok.error();
  return lightOf(*relighter);
}

TEST(Memory, anyRequestMayBeRefused) {
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    // So many surfels that the tree is cut into parts, in one of the kinds.
    const Bake bake = makeLevel(kind, kind == LinkKind::cone ? 70000 : 2000);
    const std::vector<std::byte> bytes = bytesOf(bake);
    Result<Relighter> previous = Relighter::create(bake, {});
    ASSERT_TRUE(previous);
    const std::vector<Light> lights = test::someLights();
    LightSetup setup;
    setup.lights = lights;
    ASSERT_TRUE(previous->relight(setup));
    TrackingMemory memory;
    const Result<std::vector<float>> expected = play(bytes, *previous, setup, memory);
    ASSERT_TRUE(expected);
    const std::size_t requests = memory.requests();
    ASSERT_GT(requests, 20u);
    std::size_t spared = 0;
    for (std::size_t n = 0; n < requests; ++n) {
      memory.refuse(n);
      const Result<std::vector<float>> found = play(bytes, *previous, setup, memory);
      ASSERT_EQ(memory.refused(), 1u) << "request " << n;
      ASSERT_EQ(memory.blocks(), 0u) << "request " << n;
      if (found) {
        // What only shrinks an array can be done without.
        ++spared;
        EXPECT_EQ(*found, *expected) << "request " << n;
        continue;
      }
      EXPECT_EQ(found.error().code, ErrorCode::memory) << found.error().message;
      EXPECT_NE(found.error().message.find("out of memory"), std::string::npos) << found.error().message;
    }
    EXPECT_LE(spared, 4u);
    EXPECT_EQ(memory.mistakes(), 0u);
  }
}

// Files: the mapping goes as well.
TEST(Memory, anyRequestOfAReaderMayBeRefused) {
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "relume_refused_test.relume";
  ASSERT_TRUE(writeBake(makeLevel(LinkKind::oct6), path));
  const auto isMapped = [&path] {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
      if (line.ends_with(path.filename().string())) return true;
    }
    return false;
  };
  for (const auto& read : {mapBake, readBake}) {
    TrackingMemory memory;
    ASSERT_TRUE(read(path, Checksums::verify, &memory));
    const std::size_t requests = memory.requests();
    ASSERT_GE(requests, 5u);
    for (std::size_t n = 0; n < requests; ++n) {
      memory.refuse(n);
      const Result<Bake> bake = read(path, Checksums::verify, &memory);
      ASSERT_FALSE(bake) << "request " << n;
      EXPECT_EQ(bake.error().code, ErrorCode::memory) << bake.error().message;
      EXPECT_NE(bake.error().message.find("out of memory"), std::string::npos) << bake.error().message;
      EXPECT_EQ(memory.blocks(), 0u) << "request " << n;
      EXPECT_FALSE(isMapped()) << "request " << n;
    }
    memory.refuse(TrackingMemory::kNever);
    const Result<Bake> bake = read(path, Checksums::verify, &memory);
    ASSERT_TRUE(bake);
    EXPECT_EQ(isMapped(), read == mapBake);
    EXPECT_EQ(memory.mistakes(), 0u);
  }
  std::filesystem::remove(path);
}

// The error of a call that ends in a Result.
template <class T>
std::optional<ErrorCode> codeOf(const Result<T>& result) {
  return result ? std::nullopt : std::optional(result.error().code);
}

// What takes operator new, whatever resource it is given, throws nothing where that has no memory.
TEST(Memory, anyRequestOfOperatorNewMayBeRefused) {
  if (!test::countsAllocations()) GTEST_SKIP() << "sanitizers have an operator new of their own";
  const Bake bake = makeLevel(LinkKind::oct6);
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "relume_refused_new.relume";
  ASSERT_TRUE(writeBake(bake, path));
  Relighter relighter = test::makeRelighter(bake);
  const std::vector<EditBounds> boxes(40, EditBounds{{0, 0, 0}, {1, 1, 1}});
  RelightOptions bands;
  bands.lumaBands = bands.chromaBands = 2;
  const std::pair<const char*, std::function<std::optional<ErrorCode>()>> calls[] = {
      {"serializeBake", [&] { return codeOf(serializeBake(bake)); }},
      {"serializePackedBake", [&] { return codeOf(serializePackedBake(bake, 1)); }},
      {"mapBake", [&] { return codeOf(mapBake(path)); }},
      {"readBake", [&] { return codeOf(readBake(path)); }},
      {"identifyBakeFile", [&] { return codeOf(identifyBakeFile(path)); }},
      {"relightUntilConverged", [&] { return codeOf(relightUntilConverged(relighter, {}, 1e-4f, 2)); }},
      {"EditBlend::create", [&] { return codeOf(EditBlend::create(boxes)); }},
      {"gpuResolveGlsl", [&] { return codeOf(gpuResolveGlsl(bands, LinkKind::oct6)); }},
      {"gpuSurfelGlsl", [&] { return codeOf(gpuSurfelGlsl()); }},
  };
  for (const auto& [name, call] : calls) {
    std::size_t n = 1;
    for (bool refused = true; refused; ++n) {
      test::refuseAllocation(n);
      std::optional<ErrorCode> code;
      EXPECT_NO_THROW(code = call()) << name << ", request " << n;
      refused = test::refuseAllocation(0);
      // What can be done without memory may be done.
      EXPECT_EQ(code.value_or(ErrorCode::memory), ErrorCode::memory) << name << ", request " << n;
      if (HasFailure()) return;
    }
    EXPECT_GT(n, 2u) << name;
  }
  std::filesystem::remove(path);
}

// Light without a bake asks std::pmr's default resource for nothing either.
TEST(Memory, lightWithoutABakeTakesOperatorNew) {
  const std::vector<glm::vec3> position{{0, 0, 0}, {4, 0, 0}, {4, 0, 4}, {0, 0, 4}};
  const std::vector<glm::uvec3> triangle{{0, 2, 1}, {0, 3, 2}};
  const std::vector<std::uint32_t> surface(2, 0);
  const VoxelSurface white;
  const VoxelMesh floor{position, triangle, surface};
  const VoxelPart part;
  LiveLightOptions options;
  options.boxMax = {4, 2, 4};
  Result<LiveLight> live = LiveLight::create({{&white, 1}, {&floor, 1}, {&part, 1}}, options);
  ASSERT_TRUE(live) << live.error().message;
  const Light lamp{.kind = LightKind::point, .intensity = glm::vec3(9.0f), .positionWorld = {2, 1, 2}};
  LightSetup setup;
  setup.lights = {&lamp, 1};
  const Status lit = live->update(setup, {});
  EXPECT_TRUE(lit) << lit.error().message;
}

TEST(Memory, errorsOfARelighterNameTheSize) {
  const Bake bake = makeLevel(LinkKind::oct6);
  TrackingMemory memory;
  RelightOptions options;
  options.memory = &memory;
  memory.refuse(2);
  const Result<Relighter> none = Relighter::create(bake, options);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::memory);
  EXPECT_EQ(none.error().message.find("out of memory: "), 0u) << none.error().message;
  EXPECT_NE(none.error().message.find(" bytes aligned to 16"), std::string::npos) << none.error().message;
  EXPECT_EQ(exitCode(none.error().code), 4);
}

// A frame that gets no memory changes nothing: neither last frame's light, nor what was handed over for the next.
TEST(Memory, aFrameWithoutMemoryIsNoFrame) {
  const Bake bake = makeLevel(LinkKind::oct6);
  TrackingMemory memory;
  RelightOptions options;
  options.memory = &memory;
  Result<Relighter> relighter = Relighter::create(bake, options), same = Relighter::create(bake, {}),
                    previous = Relighter::create(bake, {});
  ASSERT_TRUE(relighter && same && previous);
  const std::vector<Light> few = test::someLights();
  std::vector<Light> many;
  for (int i = 0; i < 9; ++i) many.insert(many.end(), few.begin(), few.end());
  LightSetup first, second;
  first.lights = few;
  second.lights = many;
  ASSERT_TRUE(relighter->relight(first) && same->relight(first) && previous->relight(second));

  memory.refuse(0);
  EXPECT_EQ(relighter->inherit(*previous, bake).error().code, ErrorCode::memory);
  EXPECT_EQ(lightOf(*relighter), lightOf(*same));
  ASSERT_TRUE(relighter->inherit(*previous, bake) && same->inherit(*previous, bake));
  // The copy of the lights, then what is computed of them.
  for (std::size_t n = 0; n < 2; ++n) {
    memory.refuse(n);
    const Status status = relighter->relight(second);
    ASSERT_FALSE(status);
    ASSERT_EQ(status.error().code, ErrorCode::memory);
    EXPECT_EQ(lightOf(*relighter), lightOf(*same)) << "request " << n;
  }
  memory.refuse(TrackingMemory::kNever);
  ASSERT_TRUE(relighter->relight(second) && same->relight(second));
  EXPECT_EQ(lightOf(*relighter), lightOf(*same)) << "what was handed over is lost";
}

TEST(Memory, coefficientsIntoTheCallersMemory) {
  const Bake bake = makeLevel(LinkKind::cone);
  Result<Relighter> relighter = Relighter::create(bake, {});
  ASSERT_TRUE(relighter);
  ASSERT_TRUE(relighter->relight({}));
  const std::vector<float> expected = lightOf(*relighter);
  std::vector<float> found(expected.size());
  EXPECT_TRUE(relighter->cacheCoefficients(found));
  EXPECT_EQ(found, expected);
  found.pop_back();
  const Status refused = relighter->cacheCoefficients(found);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
}

}  // namespace
}  // namespace relume
