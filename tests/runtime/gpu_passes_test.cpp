// SPDX-License-Identifier: MIT
// The passes as data, without any graphics API: what they hand out holds together, what cannot be is refused by name,
// and no memory is leaked or taken in a frame.
#include "relume/gpu_passes.h"

#include "runtime/passes/pack_textures.h"
#include "tests/runtime/ball.h"
#include "tests/runtime/driven_bake.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"
#include "tests/runtime/tracking_memory.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <set>
#include <string>

namespace relume {
namespace {

Bake bakeOf(LinkKind kind) {
  return test::makeDrivenBake(
      {.surfels = 900, .skyPatches = 8, .lightmapCaches = 40, .linksPerCache = 400, .kind = kind, .bands = 4});
}

RelightOptions everything(std::uint32_t movingParts = 0) {
  RelightOptions options;
  options.movingParts = movingParts;
  options.gridTexture = true;
  options.gridTrust = 1.0f;
  options.drivenImages = {{"screen", 45, 32}};
  return options;
}

MovingShapes balls(std::size_t count) {
  const test::Ball ball(0.5f, 16);
  const glm::vec3 grey(0.5f);
  const std::vector<MovingMesh> meshes(count, MovingMesh{ball.position, ball.triangle, {&grey, 1}});
  Result<MovingShapes> made = MovingShapes::create(meshes);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

// Parts in the synthetic room.
std::vector<MovingPart> partsOf(std::size_t count, std::uint32_t shape = 0) {
  std::vector<MovingPart> parts(count);
  for (std::size_t i = 0; i < count; ++i) {
    parts[i].shape = shape;
    parts[i].toWorld[3] = glm::vec3(2.0f + static_cast<float>(i), 2.0f, 3.0f);
  }
  return parts;
}

std::string messageOf(const Result<GpuPasses>& refused, ErrorCode code) {
  if (refused) return "made";
  EXPECT_EQ(refused.error().code, code) << refused.error().message;
  return refused.error().message;
}

bool has(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

TEST(GpuPasses, normalsKeepTheirLength) {
  Caches caches;
  std::vector<glm::vec3> normals{{0, 0, 0}, {0, -1, 0}};
  for (int i = 0; i < 20000; ++i) {
    const float z = -1.0f + 2.0f * (static_cast<float>(i) + 0.5f) / 20000.0f, turn = 2.3999632f * static_cast<float>(i);
    const float r = std::sqrt(1.0f - z * z);
    normals.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  std::vector<std::uint32_t> texels(normals.size());
  for (std::size_t i = 0; i < texels.size(); ++i) texels[i] = static_cast<std::uint32_t>(i);
  caches.normal = normals;
  caches.positionWorld = std::vector<glm::vec3>(normals.size());
  caches.lightmap.width = static_cast<std::uint32_t>(texels.size());
  caches.lightmap.height = 1;
  caches.lightmap.cache = texels;
  const auto packed = gpu::packNormals(caches, std::pmr::new_delete_resource());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const glm::vec3 n = glm::vec3(packed[4 * i], packed[4 * i + 1], packed[4 * i + 2]) / 127.0f;
    ASSERT_NEAR(glm::length(n), glm::length(normals[i]), 0.0035f) << i;
    ASSERT_LT(glm::distance(n, normals[i]), 0.015f) << i;
    ASSERT_EQ(packed[4 * i + 3], 127);
  }
}

TEST(GpuPasses, bindingsStayInsideTheirResourcesAndTheDevicesLimits) {
  for (const LinkKind kind : kLinkKinds) {
    const Bake bake = bakeOf(kind);
    for (const std::size_t limit : {std::size_t{40000}, std::size_t{1} << 27}) {
      SCOPED_TRACE(std::string(linkKindName(kind)) + " " + std::to_string(limit));
      GpuDevice device;
      device.storageBytes = limit;
      device.groups = limit == 40000 ? 20 : 65535;
      // What parts need is larger than the lower limit.
      const Result<GpuPasses> made = GpuPasses::create(bake, everything(limit == 40000 ? 0 : 5), device);
      ASSERT_TRUE(made) << made.error().message;
      std::size_t batches = 0;
      EXPECT_TRUE(made->checkDevice(device));
      for (const GpuBindingSet& set : made->bindingSets()) {
        std::set<std::uint32_t> numbers;
        const auto isStorage = [](const GpuBinding& b) { return b.kind == GpuBindingKind::storageBuffer; };
        EXPECT_LE(std::count_if(set.bindings.begin(), set.bindings.end(), isStorage), kGpuStorageBuffers);
        ASSERT_LT(set.program, made->programs().size());
        for (const GpuBinding& each : set.bindings) {
          EXPECT_TRUE(numbers.insert(each.binding).second) << each.binding;
          const bool isImage = each.kind == GpuBindingKind::sampledImage || each.kind == GpuBindingKind::storageImage;
          if (isImage) {
            ASSERT_LT(each.resource, made->images().size());
            continue;
          }
          const GpuBuffer& buffer = made->buffers()[each.resource];
          const std::size_t bytes = each.bytes ? each.bytes : buffer.bytes;
          EXPECT_LE(each.offset + bytes, buffer.bytes) << buffer.name;
          EXPECT_LE(bytes, limit) << buffer.name;
          EXPECT_EQ(each.offset % device.storageAlignment, 0u) << buffer.name;
          EXPECT_EQ(buffer.isUniform, each.kind == GpuBindingKind::uniformBuffer);
          EXPECT_TRUE(!each.isWritten || buffer.use == GpuUse::light) << buffer.name;
        }
        batches += has(made->programs()[set.program].name, "light_caches") ? 1 : 0;
      }
      EXPECT_GE(batches, limit == 40000 ? 3u : 2u);
      for (const GpuBuffer& buffer : made->buffers()) {
        EXPECT_GE(buffer.bytes, 16u) << buffer.name;
        EXPECT_EQ(buffer.bytes % 4, 0u) << buffer.name;
        EXPECT_LE(buffer.contents.size(), buffer.bytes) << buffer.name;
      }
      for (const GpuImage& image : made->images()) {
        const std::size_t bytes = std::size_t{image.size.x} * image.size.y * image.size.z * texelBytes(image.format);
        EXPECT_TRUE(image.contents.empty() || image.contents.size() == bytes) << image.name;
      }
    }
  }
}

TEST(GpuPasses, everyProgramHasGlslAndThoseOfUsualBandsSpirv) {
  for (const LinkKind kind : kLinkKinds) {
    for (const bool isSerial : {false, true}) {
      GpuDevice device;
      device.isSerial = isSerial;
      RelightOptions options = everything(5);
      options.lumaBands = 4;
      options.chromaBands = 2;
      const Result<GpuPasses> made = GpuPasses::create(bakeOf(kind), options, device);
      ASSERT_TRUE(made) << made.error().message;
      bool any = false;
      for (std::size_t i = 0; i < made->programs().size(); ++i) {
        const GpuProgram& program = made->programs()[i];
        const Result<std::string> glsl = made->programGlsl(i);
        ASSERT_TRUE(glsl) << glsl.error().message;
        EXPECT_TRUE(has(*glsl, "#version 450") && has(*glsl, "void main()")) << program.name;
        // Renderers that compile by themselves put a function of their own here.
        const bool lightsParts = program.name.starts_with("light_parts.comp");
        EXPECT_TRUE(!lightsParts || has(*glsl, "float relumeVisibility(uint light, vec3 positionWorld, vec3 normal)"));
        EXPECT_LE(program.parameterBytes, kGpuParameterBytes);
        any = any || !program.spirv.empty();
        // 0x07230203 opens every SPIR-V. All of them are there, or the build has none.
        EXPECT_TRUE(program.spirv.empty() || program.spirv[0] == 0x07230203u) << program.name;
      }
      for (const GpuProgram& program : made->programs()) EXPECT_EQ(any, !program.spirv.empty()) << program.name;
      EXPECT_FALSE(made->programGlsl(made->programs().size()));
    }
  }
}

TEST(GpuPasses, dispatchesCoverWhatTheDeviceCutsThemInto) {
  const Bake bake = bakeOf(LinkKind::oct6);
  GpuDevice device;
  device.groups = 20;
  Result<GpuPasses> cut = GpuPasses::create(bake, everything(30), device),
                    whole = GpuPasses::create(bake, everything(30), {});
  ASSERT_TRUE(cut && whole);
  const MovingShapes shapes = balls(1);
  const std::vector<MovingPart> parts = partsOf(30);
  LightSetup setup;
  setup.movingParts = parts;
  setup.movingShapes = &shapes;
  const Result<GpuFrame> few = whole->frame(setup), many = cut->frame(setup);
  ASSERT_TRUE(few && many);
  const auto groups = [](const GpuFrame& frame, GpuPass pass) {
    std::size_t sum = 0;
    for (const GpuDispatch& each : frame.dispatches) sum += each.pass == pass ? each.groups : 0;
    return sum;
  };
  EXPECT_GT(many->dispatches.size(), few->dispatches.size());
  for (const GpuDispatch& each : many->dispatches) EXPECT_LE(each.groups, 20u);
  for (const GpuPass pass :
       {GpuPass::surfels, GpuPass::pull, GpuPass::movingParts, GpuPass::caches, GpuPass::gridTexture})
    EXPECT_EQ(groups(*many, pass), groups(*few, pass)) << static_cast<int>(pass);
  // The first frame has no light to bounce, the next ones have; after a reset they have none again.
  const std::size_t first = few->dispatches.size();
  EXPECT_GT(whole->frame(setup)->dispatches.size(), first);
  whole->reset();
  EXPECT_EQ(whole->frame(setup)->dispatches.size(), first);
}

// What hosts have made once is what frames with parts need, and other frames have nothing of it.
TEST(GpuPasses, framesWithPartsUploadThemAndTheShapesOnce) {
  const Bake bake = bakeOf(LinkKind::oct6);
  Result<GpuPasses> made = GpuPasses::create(bake, everything(3), {}), none = GpuPasses::create(bake, everything(), {});
  ASSERT_TRUE(made && none);
  const MovingShapes shapes = balls(2), others = balls(1);
  const std::vector<MovingPart> parts = partsOf(3);
  const auto uploaded = [&](const GpuFrame& frame, const std::string& name) {
    std::size_t bytes = 0;
    for (const GpuUpload& each : frame.uploads) {
      const GpuBuffer* buffer = each.isImage ? nullptr : &made->buffers()[each.resource];
      if (!buffer || name != buffer->name) continue;
      EXPECT_EQ(buffer->use, GpuUse::frame);
      EXPECT_LE(each.bytes.size(), buffer->bytes);
      bytes += each.bytes.size();
    }
    return bytes;
  };
  const auto moving = [](const GpuFrame& frame) {
    return std::count_if(frame.dispatches.begin(), frame.dispatches.end(),
                         [](const GpuDispatch& each) { return each.pass == GpuPass::movingParts; });
  };
  const auto frameOf = [&](std::size_t count, const MovingShapes& of) {
    LightSetup setup;
    setup.movingParts = std::span(parts).first(count);
    setup.movingShapes = &of;
    const Result<GpuFrame> frame = made->frame(setup);
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
    return *frame;
  };
  const GpuFrame first = frameOf(3, shapes);
  EXPECT_GT(moving(first), 1);
  const std::size_t bytes = uploaded(first, "moving shapes"), three = uploaded(first, "moving parts");
  EXPECT_GT(bytes, 0u);
  EXPECT_LE(bytes, shapes.bytes());
  EXPECT_EQ(uploaded(frameOf(3, shapes), "moving shapes"), 0u);
  const GpuFrame one = frameOf(1, shapes);
  EXPECT_EQ(3 * uploaded(one, "moving parts"), three);
  EXPECT_LT(uploaded(frameOf(1, others), "moving shapes"), bytes);
  EXPECT_EQ(uploaded(frameOf(1, shapes), "moving shapes"), bytes);
  // A frame without.
  const GpuFrame open = frameOf(0, shapes);
  EXPECT_EQ(moving(open) + static_cast<std::ptrdiff_t>(uploaded(open, "moving parts")), 0);
  ASSERT_TRUE(none->frame({}));
  EXPECT_EQ(open.dispatches.size(), none->frame({})->dispatches.size());
  EXPECT_EQ(uploaded(frameOf(3, shapes), "moving shapes"), 0u);
  // After a frame that was lost.
  made->reset();
  EXPECT_EQ(uploaded(frameOf(3, shapes), "moving shapes"), bytes);
}

TEST(GpuPasses, whatCannotBeIsRefused) {
  const Bake bake = bakeOf(LinkKind::cone);
  GpuDevice device;
  const auto with = [&](const auto& change) {
    GpuDevice changed;
    change(changed);
    return GpuPasses::create(bake, everything(), changed);
  };
  EXPECT_TRUE(has(messageOf(with([](GpuDevice& d) { d.storageBytes = 0; }), ErrorCode::usage), "storageBytes is 0"));
  EXPECT_TRUE(has(messageOf(with([](GpuDevice& d) { d.storageAlignment = 48; }), ErrorCode::usage), "power of 2"));
  EXPECT_TRUE(has(messageOf(with([](GpuDevice& d) { d.groups = 0; }), ErrorCode::usage), "groups is 0"));
  EXPECT_TRUE(has(messageOf(with([](GpuDevice& d) { d.groups = 3; }), ErrorCode::unsupported), "slots of senders"));
  EXPECT_TRUE(has(messageOf(with([](GpuDevice& d) { d.imageSide = 8; }), ErrorCode::unsupported), "largest image, 8"));
  EXPECT_TRUE(has(messageOf(with([](GpuDevice& d) { d.storageBytes = 64; }), ErrorCode::unsupported), "64"));
  RelightOptions options;
  options.visibilityGlsl = "float relumeVisibility(uint l, vec3 p, vec3 n) { return 1.0; }";
  EXPECT_TRUE(has(messageOf(GpuPasses::create(bake, options, device), ErrorCode::usage), "gpuSurfelGlsl"));
  options = {};
  options.movingParts = kMaxMovingParts + 1;
  EXPECT_TRUE(has(messageOf(GpuPasses::create(bake, options, device), ErrorCode::usage), "movingParts is 257"));
  options.movingParts = 1;
  options.movingLag = 3;
  EXPECT_TRUE(has(messageOf(GpuPasses::create(bake, options, device), ErrorCode::usage), "movingLag is 3"));
  options.movingLag = 1;
  device.movingShapeBytes = device.storageBytes + 4;
  EXPECT_TRUE(has(messageOf(GpuPasses::create(bake, options, device), ErrorCode::unsupported), "\"moving shapes\""));
  options = {};
  options.lumaBands = 9;
  EXPECT_TRUE(has(messageOf(GpuPasses::create(bake, options, device), ErrorCode::usage), "lumaBands is 9"));
  options = {};
  options.drivenImages = {{"nothing", 8, 8}};
  EXPECT_TRUE(has(messageOf(GpuPasses::create(bake, options, device), ErrorCode::usage), "no such drivable material"));
  Bake damaged = bake;
  damaged.links.rowBegin = std::vector<std::uint32_t>(damaged.links.rowBegin.size(), 7u);
  EXPECT_TRUE(has(messageOf(GpuPasses::create(damaged, {}, device), ErrorCode::invalidFile), "bake cannot be lit"));
}

TEST(GpuPasses, devicesThatTakeLessThanTheyWereMadeForAreRefused) {
  const Bake bake = bakeOf(LinkKind::cone);
  GpuDevice roomy;
  roomy.storageAlignment = 16;
  const Result<GpuPasses> made = GpuPasses::create(bake, everything(), roomy);
  ASSERT_TRUE(made) << made.error().message;
  const auto refusal = [&](const auto& change) {
    GpuDevice changed = roomy;
    change(changed);
    const Status fits = made->checkDevice(changed);
    return fits ? std::string() : fits.error().message;
  };
  EXPECT_EQ(refusal([](GpuDevice& d) { d.storageBytes *= 2; }), "");
  EXPECT_TRUE(has(refusal([](GpuDevice& d) { d.storageBytes = 4096; }), "of other limits"));
  EXPECT_TRUE(has(refusal([](GpuDevice& d) { d.imageSide = 4; }), "of other limits"));
  EXPECT_TRUE(has(refusal([](GpuDevice& d) { d.volumeSide = 2; }), "of other limits"));
  EXPECT_TRUE(has(refusal([](GpuDevice& d) { d.groups = 2; }), "of other limits"));
  EXPECT_EQ(refusal([](GpuDevice& d) { d.sharedBytes = 12288; }), "") << "which four bands and one fit in";
  EXPECT_TRUE(has(refusal([](GpuDevice& d) { d.sharedBytes = 2048; }), "of other limits"));
  // What create() refuses is no device: offsets are counted in its alignment.
  EXPECT_EQ(refusal([](GpuDevice& d) { d.storageAlignment = 0; }),
            "GpuDevice::storageAlignment is 0, expected a limit of the device");
  EXPECT_TRUE(has(refusal([](GpuDevice& d) { d.storageAlignment = 48; }), "power of 2"));
}

// Of eight bands each, a cache's sums take 24 KiB where hardware shares them.
TEST(GpuPasses, devicesWithLessMemoryForAGroupAreRefused) {
  RelightOptions options;
  options.lumaBands = options.chromaBands = 8;
  GpuDevice roomy;
  roomy.sharedBytes = 32768;
  const Bake bake = test::makeSyntheticBake({.surfels = 300, .linksPerCache = 8, .kind = LinkKind::oct6});
  const Result<GpuPasses> made = GpuPasses::create(bake, options, roomy), least = GpuPasses::create(bake, options, {});
  ASSERT_TRUE(made && least);
  EXPECT_TRUE(made->checkDevice(roomy));
  EXPECT_FALSE(made->checkDevice({}));
  EXPECT_TRUE(least->checkDevice({}));
}

// The emission on the device is that of the last frame that was run.
TEST(GpuPasses, aLostFrameWithoutDrivenMaterialsIsMadeUpFor) {
  Result<GpuPasses> made = GpuPasses::create(bakeOf(LinkKind::oct6), everything(), {});
  ASSERT_TRUE(made);
  const auto emissions = [](const Result<GpuFrame>& frame) {
    EXPECT_TRUE(frame);
    return std::count_if(frame->dispatches.begin(), frame->dispatches.end(),
                         [](const GpuDispatch& each) { return each.pass == GpuPass::emission; });
  };
  made->reset();
  EXPECT_EQ(emissions(made->frame({})), 0) << "nothing has driven any";
  const MaterialEmission red{.radiance = {1, 0, 0}};
  LightSetup driven;
  driven.materialEmissions = {&red, 1};
  EXPECT_GT(emissions(made->frame(driven)), 0);
  EXPECT_GT(emissions(made->frame({})), 0);  // and is lost
  made->reset();
  EXPECT_GT(emissions(made->frame({})), 0);
  EXPECT_EQ(emissions(made->frame({})), 0);
}

TEST(GpuPasses, framesThatCannotBeAreRefusedAndChangeNothing) {
  const Bake bake = bakeOf(LinkKind::oct6);
  GpuDevice device;
  device.maxLights = 2;
  const MovingShapes shapes = balls(2), others = balls(3);
  device.movingShapeBytes = shapes.bytes();
  Result<GpuPasses> made = GpuPasses::create(bake, everything(2), device),
                    same = GpuPasses::create(bake, everything(2), device),
                    none = GpuPasses::create(bake, everything(), device);
  ASSERT_TRUE(made && same && none);
  const std::vector<MovingPart> three = partsOf(3), ofOthers = partsOf(1, 2);
  std::vector<MovingPart> odd = partsOf(2);
  odd[1].toWorld[0].x = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Light> lights = test::someLights();
  const std::vector<glm::vec3> colors(bake.surfels.count(), glm::vec3(0.5f)), few(3, glm::vec3(1.0f));
  MaterialEmission texture;
  texture.texture = 4;
  const auto refused = [&](const auto& change, const char* words) {
    LightSetup setup;
    change(setup);
    const Result<GpuFrame> frame = made->frame(setup);
    ASSERT_FALSE(frame) << words;
    EXPECT_EQ(frame.error().code, ErrorCode::usage);
    EXPECT_TRUE(has(frame.error().message, words)) << frame.error().message;
  };
  refused([&](LightSetup& s) { s.lights = lights; }, "at most the 2 of GpuDevice::maxLights");
  refused([&](LightSetup& s) { s.surfelIrradiance = colors; }, "GpuDevice::hasSurfelArrays");
  refused([&](LightSetup& s) { s.surfelEmission = colors; }, "GpuDevice::hasSurfelArrays");
  refused([&](LightSetup& s) { s.surfelIrradianceOnGpu = true; }, "GpuDevice::hasSurfelShader");
  refused([&](LightSetup& s) { s.skyPatches = few; }, "skyPatches");
  refused([&](LightSetup& s) { s.materialEmissions = {&texture, 1}; }, "texture");
  refused([&](LightSetup& s) { s.skyRadiance.x = std::numeric_limits<float>::quiet_NaN(); }, "skyRadiance");
  const auto moving = [&](std::span<const MovingPart> parts, const MovingShapes* of, const char* words) {
    refused(
        [&](LightSetup& s) {
          s.movingParts = parts;
          s.movingShapes = of;
        },
        words);
  };
  moving(three, &shapes, "movingParts has 3 elements, expected at most 2");
  moving(odd, &shapes, "movingParts[1].toWorld");
  moving(odd, nullptr, "without movingShapes");
  // A shape of another set, and a set that there is no room for.
  moving(ofOthers, &shapes, "movingParts[0].shape is 2, there are 2");
  moving(ofOthers, &others, "of GpuDevice::movingShapeBytes");
  LightSetup setup;
  setup.lights = {lights.data(), 2};
  setup.movingShapes = &shapes;
  setup.movingParts = std::span(three).first(1);
  EXPECT_FALSE(none->frame(setup));
  for (int i = 0; i < 2; ++i) {
    const Result<GpuFrame> a = made->frame(setup), b = same->frame(setup);
    ASSERT_TRUE(a && b);
    ASSERT_EQ(a->dispatches.size(), b->dispatches.size());
    EXPECT_EQ(a->uploads.size(), b->uploads.size());
    for (std::size_t k = 0; k < a->dispatches.size(); ++k)
      EXPECT_EQ(a->dispatches[k].parameters, b->dispatches[k].parameters);
  }
}

TEST(GpuPasses, memoryComesFromTheHostGoesBackAndMayBeRefused) {
  test::TrackingMemory memory;
  const Bake bake = bakeOf(LinkKind::oct6);
  RelightOptions options = everything(2);
  options.memory = &memory;
  GpuDevice device;
  device.hasSurfelArrays = true;
  const std::vector<Light> lights = test::someLights();
  const std::vector<glm::vec3> colors(bake.surfels.count(), glm::vec3(0.5f));
  const MovingShapes shapes = balls(2);
  const std::vector<MovingPart> parts = partsOf(2, 1);
  LightSetup byLights, byHost;
  byLights.lights = lights;
  byLights.movingParts = parts;
  byLights.movingShapes = &shapes;
  byHost.surfelIrradiance = colors;
  std::size_t requests = 0;
  {
    Result<GpuPasses> made = GpuPasses::create(bake, options, device);
    ASSERT_TRUE(made) << made.error().message;
    requests = memory.requests();
    const std::size_t bytes = memory.bytes();
    made->forgetContents();
    EXPECT_LT(2 * memory.bytes(), bytes);
    for (int i = 0; i < 2; ++i) ASSERT_TRUE(made->frame(byLights) && made->frame(byHost));
    const std::size_t before = memory.requests();
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(made->frame(byLights) && made->frame(byHost));
    EXPECT_EQ(memory.requests(), before);
  }
  EXPECT_EQ(memory.blocks(), 0u);
  for (std::size_t n = 0; n < requests; ++n) {
    memory.refuse(n);
    const Result<GpuPasses> refused = GpuPasses::create(bake, options, device);
    ASSERT_FALSE(refused) << "request " << n;
    EXPECT_EQ(refused.error().code, ErrorCode::memory) << refused.error().message;
    EXPECT_EQ(memory.blocks(), 0u) << "request " << n;
  }
}

}  // namespace
}  // namespace relume
