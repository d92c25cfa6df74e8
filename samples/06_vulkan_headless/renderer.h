// SPDX-License-Identifier: MIT
// The sample's renderer: the level in buffers, a pass that lights the surfels, Relume's passes, and the picture.
#pragma once

#include "device.h"
#include "level.h"

#include <relume/vulkan_executor.h>

#include <array>
#include <memory>
#include <vector>

class Renderer {
 public:
  // Throws relume::Error. `device` and `passes`, whose contents are forgotten, must outlive this.
  Renderer(const Device& device, const Level& level, relume::GpuPasses& passes);

  // One frame of light: direct light at the surfels, and all of Relume's passes.
  relume::Status relight(const Level& level);
  // RGBA, sRGB, row 0 on top. indirect: irradiance / pi by indirect light alone.
  std::vector<unsigned char> draw(const Level& level, std::uint32_t width, std::uint32_t height, bool indirect);

 private:
  struct Pass {
    VkPipelineLayout layout = VK_NULL_HANDLE;
    VkPipeline pipeline = VK_NULL_HANDLE;
  };
  // A buffer that the processor sees, filled at first.
  std::byte* makeBuffer(std::span<const std::byte> contents, std::size_t bytes, VkBuffer& buffer);
  Pass makePass(std::span<const std::uint32_t> spirv, VkDescriptorSetLayout relume);
  void makeSceneSet(std::span<const VkBuffer> buffers);
  void makeCommands();
  void begin() const;
  // End the recording, submit it, and wait until the queue has done it.
  void submitAndWait() const;
  void run(const Pass& pass, VkDescriptorSet relume, const Level& level, std::uint32_t width, std::uint32_t height,
           bool indirect, std::uint32_t groupsX, std::uint32_t groupsY);

  const Device& device_;
  VkDevice vk_;
  Objects objects_;
  relume::GpuPasses& passes_;
  std::unique_ptr<relume::VulkanExecutor> executor_;
  VkDescriptorSetLayout sceneLayout_ = VK_NULL_HANDLE;
  VkDescriptorSet sceneSet_ = VK_NULL_HANDLE;
  Pass surfels_, picture_;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  std::byte* pixels_ = nullptr;
};
