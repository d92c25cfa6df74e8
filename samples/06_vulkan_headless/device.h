// SPDX-License-Identifier: MIT
// A Vulkan device without a window.
#pragma once

#include <relume/vulkan_objects.h>

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

 private:
  relume::VulkanDevice handles_;
};
