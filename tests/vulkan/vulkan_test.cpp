// SPDX-License-Identifier: MIT
// The passes in Vulkan, by the executor, are OpenGL's: radiosity of all nodes, and what a shader resolves, for all
// kinds of links, lights, sky, emission, bounces and several frames; nothing is made in a frame, and all that is made
// dies.
#include "relume/vulkan_executor.h"

#include "relume/bake_file.h"
#include "tests/long_tests.h"
#include "tests/runtime/driven_bake.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/some_lights.h"
#include "tests/vulkan/vulkan_level.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <random>

namespace relume {
namespace {

using test::Level;
using test::makeExecutor;
using test::VulkanHost;

class Vulkan : public test::VulkanTest {};

// Six floats per receiver: a position around the grid, whose x and y are a place on the light map as well, and a
// normal.
std::vector<float> receivers(const CacheGrid& grid, int count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-0.1f, 1.1f);
  std::normal_distribution<float> gauss;
  std::vector<float> in;
  for (int i = 0; i < count; ++i) {
    const glm::vec3 share(uniform(random), uniform(random), uniform(random));
    const glm::vec3 p = grid.originWorld + share * grid.spacing * glm::vec3(grid.resolution - 1u);
    const glm::vec3 n = glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random)));
    in.insert(in.end(), {p.x, p.y, p.z, n.x, n.y, n.z, share.x, share.y});
  }
  return in;
}

constexpr const char* kBody =
    "uint k = 8u * i; vec3 p = vec3(inData[k], inData[k+1u], inData[k+2u]), n = vec3(inData[k+3u], inData[k+4u], "
    "inData[k+5u]); vec2 uv = vec2(inData[k+6u], inData[k+7u]); vec3 e[4] = vec3[4](relumeIrradianceGrid(p, n), "
    "relumeIrradianceGridTexture(p, n), relumeIrradianceLightmap(uv, n), relumeGlossyGrid(p, n, n, 4.0));\n"
    "for (int j = 0; j < 12; ++j) outData[12u*i+uint(j)] = e[j/3][j%3];\n";

// Light is stored in halves: what two compilers sum otherwise may round to another one.
double largestRounding() { return test::isSoftware() ? 2e-3 : 5e-3; }

// Largest difference relative to the root mean square.
double differenceOf(const std::vector<float>& a, const std::vector<float>& b) {
  EXPECT_EQ(a.size(), b.size());
  if (a.size() != b.size()) return 1e9;
  return test::difference(a, b);
}

std::vector<float> floatsOf(const std::vector<glm::vec3>& colors) {
  std::vector<float> floats;
  for (const glm::vec3& c : colors) floats.insert(floats.end(), {c.r, c.g, c.b});
  return floats;
}

// OpenGL's light of the same frames, and what its shader resolves.
struct GlLevel {
  GlLevel(const Bake& bake, RelightOptions options) : relighter(make(bake, std::move(options))) {}
  static Relighter make(const Bake& bake, RelightOptions options) {
    options.backend = BackendKind::gl;
    options.getProcAddress = EglContext::getProcAddress;
    Result<Relighter> made = Relighter::create(bake, options);
    if (!made) throw std::runtime_error(made.error().message);
    return std::move(*made);
  }
  std::vector<float> resolve(const std::vector<float>& in, std::size_t threads) const {
    relighter.gl()->bind();
    return test::runCompute(relighter.gl()->glsl(), kBody, in, threads, 12 * threads);
  }
  Relighter relighter;
};

// Frames of a day: lamps, then a sky, then emission halved and no lamps, then one bounce alone.
std::vector<LightSetup> someFrames(std::span<const Light> lights, std::span<const glm::vec3> sky) {
  std::vector<LightSetup> frames(6);
  for (std::size_t i = 0; i < 4; ++i) frames[i].lights = lights.subspan(0, lights.size() - i % 2);
  frames[1].skyRadiance = frames[2].skyRadiance = {0.2f, 0.3f, 0.4f};
  frames[3].skyPatches = frames[4].skyPatches = sky;
  frames[4].emissionScale = {0.5f, 0.25f, 1.0f};
  frames[5].bounceScale = 0.0f;
  frames[5].lights = lights.subspan(0, 1);
  return frames;
}

class VulkanAndGl : public Vulkan {
 protected:
  void SetUp() override {
    Vulkan::SetUp();
    if (IsSkipped()) return;
    Result<EglContext> context = EglContext::create();
    if (!context) GTEST_SKIP() << context.error().message;
    context_.emplace(std::move(*context));
  }
  void TearDown() override {
    RecordProperty("largestDifference", std::to_string(largest_));
    context_.reset();
    Vulkan::TearDown();
  }

  // Both over the same frames; differences after each.
  void expectSame(const Bake& bake, const RelightOptions& options, bool isSerial) {
    GpuDevice device = gpuDeviceOf(host_->device());
    device.isSerial = isSerial;
    Level vulkan(*host_, bake, options, device);
    GlLevel gl(bake, options);
    const std::vector<Light> lights = test::someLights();
    const std::vector<glm::vec3> sky(bake.hierarchy.skyDirection.size(), glm::vec3(0.4f, 0.3f, 0.2f));
    const std::vector<float> in = receivers(bake.caches.grid, 300);
    for (const LightSetup& frame : someFrames(lights, sky)) {
      vulkan.relight(frame);
      ASSERT_TRUE(gl.relighter.relight(frame));
      const double difference = differenceOf(gl.resolve(in, 300), vulkan.resolve(kBody, in, 300, 3600));
      EXPECT_LT(difference, largestRounding());
      largest_ = std::max(largest_, difference);
    }
    const std::vector<float> a = floatsOf(gl.relighter.nodeRadiosity()), b = vulkan.nodes();
    ASSERT_LE(a.size(), b.size());
    // Packed colours have nine bits, dithered: where sums differ by a rounding one of them may step.
    double sum = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      sum += std::abs(static_cast<double>(a[i]) - b[i]);
      squares += static_cast<double>(a[i]);
    }
    EXPECT_LT(sum, 1e-3 * squares);
  }

  std::optional<EglContext> context_;
  double largest_ = 0.0;  // difference of all frames
};

// All bands with all kinds in long runs; otherwise each kind with bands of its own.
TEST_F(VulkanAndGl, lightIsTheSameForAllKindsOfLinks) {
  constexpr std::array<std::pair<int, int>, 4> kBands = {{{1, 1}, {2, 1}, {3, 2}, {4, 2}}};
  for (std::size_t k = 0; k < std::size(kLinkKinds); ++k) {
    const LinkKind kind = kLinkKinds[k];
    for (std::size_t b = 0; b < kBands.size(); ++b) {
      if (!test::longTests() && b != k % kBands.size()) continue;
      const auto& [luma, chroma] = kBands[b];
      SCOPED_TRACE(std::string(linkKindName(kind)) + " Y" + std::to_string(luma) + "Co" + std::to_string(chroma));
      RelightOptions options;
      options.lumaBands = luma;
      options.chromaBands = chroma;
      const Bake bake = test::makeDrivenBake(
          {.surfels = 3000, .skyPatches = 12, .lightmapCaches = 60, .linksPerCache = 61, .kind = kind, .bands = 4});
      for (const bool isSerial : {true, false}) expectSame(bake, options, isSerial);
    }
  }
}

TEST_F(VulkanAndGl, lightOfTheSampleLevelIsTheSame) {
#if !defined(RELUME_BINARY)
  GTEST_SKIP() << "built without the baker";
#else
  const std::string path = testing::TempDir() + "/relume_vulkan_level.relume";
  const std::string command = RELUME_BINARY " bake '" RELUME_SOURCE_DIR "/samples/level/two_rooms.glb' -o '" + path +
                              "' --preset draft --sky-patches 16 --force --progress none 2>/dev/null >/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  const Result<Bake> bake = readBake(path);
  std::remove(path.c_str());
  ASSERT_TRUE(bake) << bake.error().message;
  ASSERT_FALSE(bake->hierarchy.skyDirection.empty());
  for (const bool isSerial : {true, false}) expectSame(*bake, {}, isSerial);
#endif
}

TEST_F(VulkanAndGl, theGridsTextureAndDrivenMaterialsAreTheSame) {
  constexpr std::uint32_t kWidth = 45, kHeight = 32;
  const Bake bake = test::makeDrivenBake(
      {.surfels = 3000, .grid = {6, 5, 6}, .lightmapCaches = 60, .linksPerCache = 48, .kind = LinkKind::oct6});
  RelightOptions options;
  options.gridTexture = true;
  options.gridTrust = 1.0f;
  options.glossy = true;
  options.drivenImages = {{"screen", kWidth, kHeight}, {"panel", 8, 8}};
  Level vulkan(*host_, bake, options, gpuDeviceOf(host_->device()));
  GlLevel gl(bake, options);
  const std::vector<float> in = receivers(bake.caches.grid, 300);
  const std::vector<glm::vec3> image = test::makeStripes(kWidth, kHeight), panel = test::makeStripes(8, 8, 9.0f);
  std::vector<MaterialEmission> both(2), color(1);
  both[0].material = test::kScreen;
  both[0].image = image;
  both[1].material = test::kPanel;
  both[1].image = panel;
  both[1].radiance = {0.5f, 1.0f, 2.0f};
  color[0].material = test::kPanel;
  color[0].radiance = {1.0f, 2.0f, 3.0f};
  std::vector<LightSetup> frames(4);
  frames[0].materialEmissions = frames[1].materialEmissions = both;
  frames[2].materialEmissions = color;
  std::vector<std::vector<float>> lights;
  for (const LightSetup& frame : frames) {
    vulkan.relight(frame);
    ASSERT_TRUE(gl.relighter.relight(frame));
    lights.push_back(vulkan.resolve(kBody, in, 300, 3600));
    EXPECT_LT(differenceOf(gl.resolve(in, 300), lights.back()), largestRounding());
  }
  // Every frame has light of its own.
  for (std::size_t i = 1; i < lights.size(); ++i) EXPECT_GT(differenceOf(lights[i - 1], lights[i]), 0.02);
}

TEST_F(VulkanAndGl, lightOfEachSurfelByTheHostAndByItsShader) {
  const Bake bake = test::makeSyntheticBake({.surfels = 3000, .lightmapCaches = 60, .linksPerCache = 48});
  const auto lit = [&](const glm::vec3& normal) {
    return glm::vec3(3.0f, 2.0f, 1.0f) * std::max(glm::dot(normal, glm::vec3(-0.6f, 0.8f, 0.0f)), 0.0f);
  };
  std::vector<glm::vec3> irradiance;
  for (const glm::vec3& normal : bake.surfels.normal) irradiance.push_back(lit(normal));
  LightSetup byHost, byShader;
  byHost.surfelIrradiance = irradiance;
  byShader.surfelIrradianceOnGpu = true;
  GpuDevice device = gpuDeviceOf(host_->device());
  device.hasSurfelArrays = device.hasSurfelShader = true;
  Level host(*host_, bake, {}, device), shader(*host_, bake, {}, device);
  GlLevel gl(bake, {});
  const std::vector<float> in = receivers(bake.caches.grid, 300);
  for (int frame = 0; frame < 3; ++frame) {
    host_->compute(*gpuSurfelGlsl(),
                   "relumeSetSurfelIrradiance(i, vec3(3.0, 2.0, 1.0) * max(dot(relumeSurfelNormal(i), vec3(-0.6, 0.8, "
                   "0.0)), 0.0)); outData[i] = relumeSurfelPosition(i).x;",
                   shader.executor->surfelLayout(), shader.executor->surfelSet(), {0.0f}, shader.passes.surfelSlots(),
                   shader.passes.surfelSlots());
    host.relight(byHost);
    shader.relight(byShader);
    ASSERT_TRUE(gl.relighter.relight(byHost));
  }
  EXPECT_LT(differenceOf(gl.resolve(in, 300), host.resolve(kBody, in, 300, 3600)), largestRounding());
  // Normals of surfels are packed in 24 bits.
  EXPECT_LT(differenceOf(gl.resolve(in, 300), shader.resolve(kBody, in, 300, 3600)), 5e-3);
}

// The other tests fail for what the layer says: it does say something.
TEST_F(Vulkan, theValidationLayerListens) {
  if (!host_->isValidated()) GTEST_SKIP() << "no validation layer is installed: nothing looks at the executor's calls";
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  VkBuffer buffer = VK_NULL_HANDLE;
  const VulkanDevice& vulkan = host_->device();
  const auto create = vulkan.getInstanceProcAddr(vulkan.instance, "vkCreateBuffer"),
             destroy = vulkan.getInstanceProcAddr(vulkan.instance, "vkDestroyBuffer");
  ASSERT_EQ(reinterpret_cast<PFN_vkCreateBuffer>(create)(vulkan.device, &info, nullptr, &buffer), VK_SUCCESS);
  reinterpret_cast<PFN_vkDestroyBuffer>(destroy)(vulkan.device, buffer, nullptr);
  EXPECT_FALSE(host_->complaints().empty()) << "a buffer of no bytes";
  host_->forgetComplaints();
}

TEST_F(Vulkan, twoLevelsInOneCommandBufferMakeNothingInAFrame) {
  const Bake first = test::makeSyntheticBake({.surfels = 700, .skyPatches = 8, .lightmapCaches = 24}),
             second = test::makeSyntheticBake(
                 {.surfels = 1500, .skyPatches = 8, .lightmapCaches = 40, .kind = LinkKind::oct6, .seed = 5});
  const GpuDevice device = gpuDeviceOf(host_->device());
  Level a(*host_, first, {}, device), b(*host_, second, {}, device), alone(*host_, second, {}, device);
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  setup.skyRadiance = {0.1f, 0.2f, 0.3f};
  const int made = VulkanHost::objectsMade();
  for (int frame = 0; frame < 4; ++frame) {
    const Result<GpuFrame> one = a.passes.frame(setup), two = b.passes.frame(setup);
    ASSERT_TRUE(one && two);
    host_->run([&](VkCommandBuffer commands) {
      a.executor->record(commands, *one);
      b.executor->record(commands, *two);
    });
    alone.relight(setup);
  }
  EXPECT_EQ(VulkanHost::objectsMade(), made);
  EXPECT_EQ(b.nodes(), alone.nodes());
  // After a reset the first frame is the first one again.
  const std::vector<float> many = alone.nodes();
  alone.passes.reset();
  alone.relight(setup);
  Level fresh(*host_, second, {}, device);
  fresh.relight(setup);
  EXPECT_EQ(alone.nodes(), fresh.nodes());
  EXPECT_NE(alone.nodes(), many);
}

TEST_F(Vulkan, anyObjectMayBeRefused) {
  const Bake bake = test::makeDrivenBake({.surfels = 700, .lightmapCaches = 24});
  RelightOptions options;
  options.gridTexture = true;
  options.drivenImages = {{"screen", 8, 8}};
  const GpuPasses passes = Level::make(bake, options, gpuDeviceOf(host_->device()));
  const int before = VulkanHost::objectsMade();
  ASSERT_TRUE(makeExecutor(*host_, host_->device(), passes));
  const int count = VulkanHost::objectsMade() - before;
  EXPECT_GT(count, 60);
  for (int n = 0; n < count; ++n) {
    VulkanHost::failAt(n);
    const auto refused = makeExecutor(*host_, host_->device(), passes);
    VulkanHost::failAt(-1);
    ASSERT_FALSE(refused) << n;
    EXPECT_EQ(refused.error().code, ErrorCode::memory);
    EXPECT_NE(refused.error().message.find("Vulkan executor: vk"), std::string::npos) << refused.error().message;
    EXPECT_EQ(VulkanHost::objectsMade() - VulkanHost::objectsDestroyed(), made_) << n;
  }
}

TEST_F(Vulkan, devicesThatLackSomethingAreRefused) {
  const Bake bake = test::makeSyntheticBake({.surfels = 700, .lightmapCaches = 24});
  const GpuPasses passes = Level::make(bake, {}, gpuDeviceOf(host_->device()));
  VulkanDevice none;
  const auto refused = [&](const VulkanDevice& device, const GpuPasses& of, ErrorCode code, const char* words) {
    const auto made = makeExecutor(*host_, device, of);
    ASSERT_FALSE(made) << words;
    EXPECT_EQ(made.error().code, code) << made.error().message;
    EXPECT_NE(made.error().message.find(words), std::string::npos) << made.error().message;
  };
  refused(none, passes, ErrorCode::usage, "null");
  VulkanDevice half = host_->device();
  half.getInstanceProcAddr = [](VkInstance, const char*) -> PFN_vkVoidFunction { return nullptr; };
  refused(half, passes, ErrorCode::unsupported, "getInstanceProcAddr");
  RelightOptions bands;
  bands.lumaBands = bands.chromaBands = 6;
  const GpuPasses wide = Level::make(test::makeSyntheticBake({.surfels = 700}), bands, gpuDeviceOf(host_->device()));
  bool all = true;
  for (const GpuProgram& program : wide.programs()) all = all && !program.spirv.empty();
  if (!all) refused(host_->device(), wide, ErrorCode::unsupported, "RELUME_VULKAN_BANDS");
  // Bindings of a device that binds at finer offsets.
  GpuDevice fine = gpuDeviceOf(host_->device());
  fine.storageAlignment = 1;
  fine.storageBytes = 50000;
  const GpuPasses cut = Level::make(bake, {}, fine);
  bool isAligned = true;
  for (const GpuBindingSet& set : cut.bindingSets()) {
    for (const GpuBinding& each : set.bindings)
      isAligned = isAligned && each.offset % gpuDeviceOf(host_->device()).storageAlignment == 0;
  }
  if (!isAligned) refused(host_->device(), cut, ErrorCode::unsupported, "gpuDeviceOf");
}

}  // namespace
}  // namespace relume
