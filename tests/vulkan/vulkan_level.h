// SPDX-License-Identifier: MIT
// Tests with a device, and a level on it: passes of a bake and their executor.
#pragma once

#include "relume/vulkan_executor.h"

#include "runtime/shared/pack_color.h"
#include "tests/vulkan/vulkan_host.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace relume::test {

// An executor whose contents are on the device.
inline Result<std::unique_ptr<VulkanExecutor>> makeExecutor(VulkanHost& host, const VulkanDevice& device,
                                                            const GpuPasses& passes) {
  Result<std::unique_ptr<VulkanExecutor>> made = Error{};
  host.run([&](VkCommandBuffer commands) { made = VulkanExecutor::create(device, passes, commands); });
  return made;
}

// A device, which must end without a complaint of the validation layer and without objects.
class VulkanTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string why;
    host_ = VulkanHost::open(why);
    if (!host_) GTEST_SKIP() << why;
    made_ = VulkanHost::objectsMade() - VulkanHost::objectsDestroyed();
  }
  void TearDown() override {
    if (!host_) return;
    EXPECT_EQ(VulkanHost::objectsMade() - VulkanHost::objectsDestroyed(), made_) << "objects outlived their owner";
    for (const std::string& complaint : host_->complaints()) ADD_FAILURE() << complaint;
    host_ = nullptr;
  }
  std::unique_ptr<VulkanHost> host_;
  int made_ = 0;
};

// Passes of a bake and their executor, which must come about.
struct Level {
  Level(VulkanHost& host, const Bake& bake, const RelightOptions& options, GpuDevice device)
      : host_(host), passes(make(bake, options, device)) {
    auto created = makeExecutor(host, host.device(), passes);
    if (!created) throw std::runtime_error(created.error().message);
    executor = std::move(*created);
    passes.forgetContents();
  }
  static GpuPasses make(const Bake& bake, const RelightOptions& options, const GpuDevice& device) {
    Result<GpuPasses> made = GpuPasses::create(bake, options, device);
    if (!made) throw std::runtime_error(made.error().message);
    return std::move(*made);
  }

  void relight(const LightSetup& setup) {
    const Result<GpuFrame> frame = passes.frame(setup);
    ASSERT_TRUE(frame) << frame.error().message;
    host_.run([&](VkCommandBuffer commands) { executor->record(commands, *frame); });
  }
  // Words or halves of the buffer or image of this name.
  template <class T>
  std::vector<T> read(const std::string& name) const {
    std::vector<std::byte> bytes;
    for (std::size_t i = 0; i < passes.buffers().size(); ++i) {
      if (name == passes.buffers()[i].name) bytes = host_.read(executor->buffer(i), passes.buffers()[i].bytes);
    }
    for (std::size_t i = 0; i < passes.images().size(); ++i) {
      if (name == passes.images()[i].name) bytes = host_.read(executor->image(i), passes.images()[i]);
    }
    std::vector<T> elements(bytes.size() / sizeof(T));
    std::memcpy(elements.data(), bytes.data(), elements.size() * sizeof(T));
    return elements;
  }
  std::vector<float> nodes() const {
    std::vector<float> floats;
    for (const std::uint32_t word : read<std::uint32_t>("radiosity")) {
      const glm::vec3 color = unpackColor(word);
      floats.insert(floats.end(), {color.r, color.g, color.b});
    }
    return floats;
  }
  std::vector<float> resolve(const std::string& body, const std::vector<float>& in, std::size_t threads,
                             std::size_t floats) {
    return host_.compute(passes.resolveGlsl(), body, executor->resolveLayout(), executor->resolveSet(), in, threads,
                         floats);
  }

  VulkanHost& host_;
  GpuPasses passes;
  std::unique_ptr<VulkanExecutor> executor;
};

}  // namespace relume::test
