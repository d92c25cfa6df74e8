// SPDX-License-Identifier: MIT
// A host's Vulkan device with its functions, and an owner of what is made with it: vulkan_executor.h is written in
// these, and samples/06_vulkan_headless. Functions come from getInstanceProcAddr: no library is linked. VulkanObjects
// throws VulkanFailure, which ends in whoever makes things with it; nothing else of Relume's throws one.
#pragma once

#include "relume/gpu_passes.h"

#include <vulkan/vulkan_core.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {

// The host's; none may be null. The queue's family must have compute.
struct VulkanDevice {
  PFN_vkGetInstanceProcAddr getInstanceProcAddr = nullptr;
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physicalDevice = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  std::uint32_t queueFamily = 0;
};

// What the device can do. The defaults where a handle is null.
inline GpuDevice gpuDeviceOf(const VulkanDevice& vulkan) {
  GpuDevice device;
  const auto get = !vulkan.getInstanceProcAddr || !vulkan.instance || !vulkan.physicalDevice
                       ? nullptr
                       : vulkan.getInstanceProcAddr(vulkan.instance, "vkGetPhysicalDeviceProperties");
  if (!get) return device;
  VkPhysicalDeviceProperties properties{};
  reinterpret_cast<PFN_vkGetPhysicalDeviceProperties>(get)(vulkan.physicalDevice, &properties);
  const VkPhysicalDeviceLimits& limits = properties.limits;
  device.storageBytes = limits.maxStorageBufferRange;
  device.storageAlignment = static_cast<std::size_t>(limits.minStorageBufferOffsetAlignment);
  device.imageSide = limits.maxImageDimension2D;
  device.volumeSide = limits.maxImageDimension3D;
  device.sharedBytes = limits.maxComputeSharedMemorySize;
  device.groups = limits.maxComputeWorkGroupCount[0];
  device.isSerial = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
  return device;
}

struct VulkanFailure {
  ErrorCode code;
  std::string what;
};

// clang-format off
#define RELUME_VULKAN_FUNCTIONS(X) \
  X(AllocateCommandBuffers) X(AllocateDescriptorSets) X(AllocateMemory) X(BeginCommandBuffer) X(BindBufferMemory) \
  X(BindImageMemory) X(CmdBindDescriptorSets) X(CmdBindPipeline) X(CmdClearColorImage) X(CmdCopyBuffer) \
  X(CmdCopyBufferToImage) X(CmdDispatch) X(CmdFillBuffer) X(CmdPipelineBarrier) X(CmdPushConstants) \
  X(CmdUpdateBuffer) X(CreateBuffer) X(CreateCommandPool) X(CreateComputePipelines) X(CreateDescriptorPool) \
  X(CreateDescriptorSetLayout) X(CreateImage) X(CreateImageView) X(CreatePipelineLayout) X(CreateSampler) \
  X(CreateShaderModule) X(DestroyBuffer) X(DestroyCommandPool) X(DestroyDescriptorPool) \
  X(DestroyDescriptorSetLayout) X(DestroyImage) X(DestroyImageView) X(DestroyPipeline) X(DestroyPipelineLayout) \
  X(DestroySampler) X(DestroyShaderModule) X(EndCommandBuffer) X(FreeMemory) X(GetBufferMemoryRequirements) \
  X(GetImageMemoryRequirements) X(MapMemory) X(QueueSubmit) X(QueueWaitIdle) X(UpdateDescriptorSets)
// clang-format on

// Functions of a device, by their names without vk, and the objects that are made by them: destroyed in the opposite
// order, by rollBack() or at last.
struct VulkanObjects {
  // usage: a null handle; unsupported: a function that getInstanceProcAddr does not know.
  explicit VulkanObjects(const VulkanDevice& vulkan) : host(vulkan), device(vulkan.device) {
    if (!host.getInstanceProcAddr || !host.instance || !host.physicalDevice || !device || !host.queue)
      throw VulkanFailure{ErrorCode::usage, "a handle or getInstanceProcAddr of VulkanDevice is null"};
    const auto get = ofInstance<PFN_vkGetDeviceProcAddr>("vkGetDeviceProcAddr");
#define RELUME_VULKAN_LOAD(name)                                  \
  name = reinterpret_cast<PFN_vk##name>(get(device, "vk" #name)); \
  if (!name) unsupported("the device does not know vk" #name);
    RELUME_VULKAN_FUNCTIONS(RELUME_VULKAN_LOAD)
#undef RELUME_VULKAN_LOAD
    ofInstance<PFN_vkGetPhysicalDeviceProperties>("vkGetPhysicalDeviceProperties")(host.physicalDevice, &properties);
    ofInstance<PFN_vkGetPhysicalDeviceMemoryProperties>("vkGetPhysicalDeviceMemoryProperties")(host.physicalDevice,
                                                                                               &memoryProperties);
  }
  VulkanObjects(const VulkanObjects&) = delete;
  VulkanObjects& operator=(const VulkanObjects&) = delete;
  ~VulkanObjects() { rollBack(0); }

  [[noreturn]] static void unsupported(const std::string& what) { throw VulkanFailure{ErrorCode::unsupported, what}; }
  static void need(VkResult result, const char* call) {
    if (result == VK_SUCCESS) return;
    const bool memory = result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY;
    throw VulkanFailure{memory ? ErrorCode::memory : ErrorCode::failed,
                        std::string(call) + " returned VkResult " + std::to_string(static_cast<int>(result))};
  }
  template <class Function>
  Function ofInstance(const char* name) const {
    const auto found = reinterpret_cast<Function>(host.getInstanceProcAddr(host.instance, name));
    return found ? found : (unsupported(std::string("getInstanceProcAddr does not know ") + name), nullptr);
  }

  // Make an object that dies with this, whatever comes after.
  template <class Create, class Destroy, class Info, class Handle>
  void make(Create creator, Destroy destroy, const Info& info, Handle& handle, const char* call) {
    made_.push_back({[](VkDevice owner, PFN_vkVoidFunction function, std::uint64_t old) {
                       reinterpret_cast<Destroy>(function)(owner, (Handle)old, nullptr);
                     },
                     reinterpret_cast<PFN_vkVoidFunction>(destroy), 0});
    need(creator(device, &info, nullptr, &handle), call);
    made_.back().handle = (std::uint64_t)handle;
  }
  std::size_t madeCount() const { return made_.size(); }
  // Destroy the last ones, but for so many.
  void rollBack(std::size_t count) {
    for (; made_.size() > count; made_.pop_back()) made_.back().run(device, made_.back().destroy, made_.back().handle);
  }

  VkDeviceMemory allocate(const VkMemoryRequirements& needs, VkMemoryPropertyFlags wanted) {
    for (std::uint32_t type = 0; type < memoryProperties.memoryTypeCount; ++type) {
      const VkMemoryPropertyFlags has = memoryProperties.memoryTypes[type].propertyFlags;
      if ((has & wanted) != wanted || (needs.memoryTypeBits >> type & 1u) == 0) continue;
      const VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, nullptr, needs.size, type};
      VkDeviceMemory memory = VK_NULL_HANDLE;
      make(AllocateMemory, FreeMemory, info, memory, "vkAllocateMemory");
      return memory;
    }
    unsupported("the device has no memory of the kind that is needed");
  }

  // A buffer in memory of a kind, which comes back; it may be copied from and to.
  VkDeviceMemory makeBuffer(VkDeviceSize size, VkBufferUsageFlags usage, VkMemoryPropertyFlags kind, VkBuffer& buffer) {
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size = size;
    info.usage = usage | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    make(CreateBuffer, DestroyBuffer, info, buffer, "vkCreateBuffer");
    VkMemoryRequirements needs{};
    GetBufferMemoryRequirements(device, buffer, &needs);
    const VkDeviceMemory memory = allocate(needs, kind);
    need(BindBufferMemory(device, buffer, memory, 0), "vkBindBufferMemory");
    return memory;
  }

  // Of SPIR-V whose function is main. constants: of the shader's specialisation; null = its own.
  VkPipeline makeComputePipeline(std::span<const std::uint32_t> spirv, VkPipelineLayout layout,
                                 const VkSpecializationInfo* constants) {
    const VkShaderModuleCreateInfo code{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, nullptr, 0, spirv.size_bytes(),
                                        spirv.data()};
    VkComputePipelineCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    info.layout = layout;
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.pName = "main";
    info.stage.pSpecializationInfo = constants;
    make(CreateShaderModule, DestroyShaderModule, code, info.stage.module, "vkCreateShaderModule");
    const auto creator = [this](VkDevice owner, const auto* one, auto memory, VkPipeline* made) {
      return CreateComputePipelines(owner, VK_NULL_HANDLE, 1, one, memory, made);
    };
    VkPipeline pipeline = VK_NULL_HANDLE;
    make(creator, DestroyPipeline, info, pipeline, "vkCreateComputePipelines");
    return pipeline;
  }

  // A command buffer of a pool of its own, which dies with this.
  VkCommandBuffer makeCommands(VkCommandPoolCreateFlags flags) {
    const VkCommandPoolCreateInfo info{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr, flags, host.queueFamily};
    VkCommandPool pool = VK_NULL_HANDLE;
    make(CreateCommandPool, DestroyCommandPool, info, pool, "vkCreateCommandPool");
    const VkCommandBufferAllocateInfo one{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, nullptr, pool,
                                          VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
    VkCommandBuffer commands = VK_NULL_HANDLE;
    need(AllocateCommandBuffers(device, &one, &commands), "vkAllocateCommandBuffers");
    return commands;
  }
  void begin(VkCommandBuffer commands) const {
    const VkCommandBufferBeginInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr, 0, nullptr};
    need(BeginCommandBuffer(commands, &info), "vkBeginCommandBuffer");
  }
  // End the recording, submit it, and wait until the queue has done all it was given.
  void submitAndWait(VkCommandBuffer commands) const {
    need(EndCommandBuffer(commands), "vkEndCommandBuffer");
    VkSubmitInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    info.commandBufferCount = 1;
    info.pCommandBuffers = &commands;
    need(QueueSubmit(host.queue, 1, &info, VK_NULL_HANDLE), "vkQueueSubmit");
    need(QueueWaitIdle(host.queue), "vkQueueWaitIdle");
  }

  VulkanDevice host;
  VkDevice device;
  VkPhysicalDeviceProperties properties{};
  VkPhysicalDeviceMemoryProperties memoryProperties{};
#define RELUME_VULKAN_POINTER(name) PFN_vk##name name = nullptr;
  RELUME_VULKAN_FUNCTIONS(RELUME_VULKAN_POINTER)
#undef RELUME_VULKAN_POINTER

 private:
  // An object that was made, and how it is destroyed.
  struct Made {
    void (*run)(VkDevice owner, PFN_vkVoidFunction destroy, std::uint64_t handle);
    PFN_vkVoidFunction destroy;
    std::uint64_t handle;
  };

  std::vector<Made> made_;
};
#undef RELUME_VULKAN_FUNCTIONS

}  // namespace relume
