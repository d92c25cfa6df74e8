// SPDX-License-Identifier: MIT
// A Vulkan device without a window, and an owner of what is made with it.
#pragma once

#include <relume/vulkan_executor.h>

#include <vulkan/vulkan.h>

#include <functional>
#include <vector>

// Owns an instance and its first device that has compute; nothing of them where there is none.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device();

  // unsupported: no Vulkan, or no device with compute.
  relume::Status open();
  const relume::VulkanDevice& handles() const { return handles_; }
  VkQueue queue() const { return queue_; }
  std::uint32_t queueFamily() const { return queueFamily_; }

 private:
  relume::VulkanDevice handles_;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::uint32_t queueFamily_ = 0;
};

// Throws a relume::Error that names the call.
void need(VkResult result, const char* call);

// Objects of a device, destroyed in the opposite order.
class Objects {
 public:
  explicit Objects(VkDevice device) : device_(device) {}
  Objects(const Objects&) = delete;
  Objects& operator=(const Objects&) = delete;
  ~Objects() {
    for (; !ends_.empty(); ends_.pop_back()) ends_.back()();
  }

  template <class Create, class Destroy, class Info, class Handle>
  void make(Create create, Destroy destroy, const Info& info, Handle& handle, const char* call) {
    need(create(device_, &info, nullptr, &handle), call);
    ends_.push_back([device = device_, destroy, handle] { destroy(device, handle, nullptr); });
  }

 private:
  VkDevice device_;
  std::vector<std::function<void()>> ends_;
};
