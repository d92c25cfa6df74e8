// SPDX-License-Identifier: MIT
// A renderer's side of Vulkan for tests: a device without a window, with the validation layer where it is installed,
// which looks at barriers as well; its objects counted; commands run and waited for, buffers read, compute shaders
// compiled and run over floats.
#pragma once

#include "relume/vulkan_executor.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace relume::test {

class VulkanHost {
 public:
  // The first device with compute; nothing, and said why, where there is none. validates: with the layer, if any.
  static std::unique_ptr<VulkanHost> open(std::string& why, bool validates = true);
  ~VulkanHost();
  VulkanHost(const VulkanHost&) = delete;
  VulkanHost& operator=(const VulkanHost&) = delete;

  // Its functions count what they make and destroy.
  const VulkanDevice& device() const { return device_; }
  const std::string& name() const { return name_; }
  bool isValidated() const { return messenger_ != VK_NULL_HANDLE; }
  // What the validation layer has said, one line each.
  const std::vector<std::string>& complaints() const { return complaints_; }
  void forgetComplaints() { complaints_.clear(); }

  // Objects, memory included, by way of device() since the process began. Of all hosts.
  static int objectsMade();
  static int objectsDestroyed();
  // Let the n-th call from now on that makes something fail (0 = the next); -1 = none.
  static void failAt(int n);

  // Record, submit, and wait until it is done.
  void run(const std::function<void(VkCommandBuffer)>& record);
  std::vector<std::byte> read(VkBuffer buffer, std::size_t bytes);
  // All layers of an image that is one of GpuPasses::images(), without mip levels.
  std::vector<std::byte> read(VkImage image, const GpuImage& shape);
  // As runCompute() of gl_test_support.h: set 0 is the caller's, whose functions are in `text`.
  std::vector<float> compute(const std::string& text, const std::string& body, VkDescriptorSetLayout layout,
                             VkDescriptorSet set, const std::vector<float>& in, std::size_t threads,
                             std::size_t outFloats);

 private:
  VulkanHost() = default;

  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  VulkanDevice device_;
  std::string name_;
  std::vector<std::string> complaints_;
};

// SPIR-V of a compute shader by glslangValidator. [Size 0, and the log on stderr, where it does not compile]
std::vector<std::uint32_t> compileCompute(const std::string& glsl);

}  // namespace relume::test
