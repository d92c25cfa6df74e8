// SPDX-License-Identifier: MIT
// See device.h.
#include "device.h"

#include <string>

relume::Status Device::open() {
  VkApplicationInfo application{};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.apiVersion = VK_API_VERSION_1_1;
  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &application;
  handles_.getInstanceProcAddr = vkGetInstanceProcAddr;
  if (vkCreateInstance(&info, nullptr, &handles_.instance) != VK_SUCCESS)
    return relume::Error{relume::ErrorCode::unsupported, "no Vulkan driver"};
  std::uint32_t count = 0;
  vkEnumeratePhysicalDevices(handles_.instance, &count, nullptr);
  std::vector<VkPhysicalDevice> devices(count);
  vkEnumeratePhysicalDevices(handles_.instance, &count, devices.data());
  for (const VkPhysicalDevice each : devices) {
    std::uint32_t families = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(each, &families, nullptr);
    std::vector<VkQueueFamilyProperties> family(families);
    vkGetPhysicalDeviceQueueFamilyProperties(each, &families, family.data());
    for (std::uint32_t f = 0; f < families; ++f) {
      if (!(family[f].queueFlags & VK_QUEUE_COMPUTE_BIT)) continue;
      const float priority = 1.0f;
      const VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, nullptr, 0, f, 1, &priority};
      VkDeviceCreateInfo device{};
      device.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
      device.queueCreateInfoCount = 1;
      device.pQueueCreateInfos = &queue;
      if (vkCreateDevice(each, &device, nullptr, &handles_.device) != VK_SUCCESS) continue;
      handles_.physicalDevice = each;
      queueFamily_ = f;
      vkGetDeviceQueue(handles_.device, f, 0, &queue_);
      return relume::done();
    }
  }
  return relume::Error{relume::ErrorCode::unsupported, "no Vulkan device with compute"};
}

Device::~Device() {
  if (handles_.device) vkDestroyDevice(handles_.device, nullptr);
  if (handles_.instance) vkDestroyInstance(handles_.instance, nullptr);
}

void need(VkResult result, const char* call) {
  if (result == VK_SUCCESS) return;
  const bool memory = result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY;
  throw relume::Error{memory ? relume::ErrorCode::memory : relume::ErrorCode::failed,
                      std::string(call) + " returned VkResult " + std::to_string(static_cast<int>(result))};
}
