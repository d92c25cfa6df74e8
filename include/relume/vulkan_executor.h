// SPDX-License-Identifier: MIT
// Runs GpuPasses in Vulkan 1.1, on the host's device and in the host's command buffers: makes buffers, images,
// pipelines and descriptor sets once, and records frames without making anything. A renderer that has all this by
// itself needs nothing of it. It takes Vulkan's functions from getInstanceProcAddr: no library is linked.
//
//   Result<GpuPasses> passes = GpuPasses::create(bake, options, gpuDeviceOf(vulkan));
//   auto executor = VulkanExecutor::create(vulkan, *passes, commands);  // submit commands; passes->forgetContents()
//   every frame:  Result<GpuFrame> frame = passes->frame(setup);  (*executor)->record(commands, *frame);
//   to resolve:   resolveLayout() and resolveSet(), with GpuPasses::resolveGlsl() in the host's shader
//
// Command buffers are those of a queue with compute. Threads: create(), record() and destruction by one thread at a
// time. The device must be done with all that was recorded when the executor dies. With RelightOptions::gridTexture the
// device needs the feature shaderStorageImageExtendedFormats, switched on. What includes this header is compiled with
// exceptions: -fno-exceptions refuses its try, by which it says that the host's memory ran out.
#pragma once

#include "relume/gpu_passes.h"

#include <vulkan/vulkan_core.h>

#include <algorithm>
#include <cstring>
#include <new>

namespace relume {

// The host's; none may be null.
struct VulkanDevice {
  PFN_vkGetInstanceProcAddr getInstanceProcAddr = nullptr;
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physicalDevice = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
};

// What the device can do. The defaults where a handle is null.
inline GpuDevice gpuDeviceOf(const VulkanDevice& vulkan) {
  GpuDevice device;
  if (!vulkan.getInstanceProcAddr || !vulkan.instance || !vulkan.physicalDevice) return device;
  const auto get = vulkan.getInstanceProcAddr(vulkan.instance, "vkGetPhysicalDeviceProperties");
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

class VulkanExecutor {
 public:
  // Makes everything, and records the contents of `passes` into `commands`, to be run before the first frame; nothing
  // is recorded where it fails. usage: a null handle; unsupported: no Vulkan 1.1, a function, limit, format or kind of
  // memory missing, no SPIR-V for these bands; memory: the host's or the device's ran out; failed: what else Vulkan
  // said.
  static Result<std::unique_ptr<VulkanExecutor>> create(const VulkanDevice& vulkan, const GpuPasses& passes,
                                                        VkCommandBuffer commands) try {
    if (!vulkan.getInstanceProcAddr || !vulkan.instance || !vulkan.physicalDevice || !vulkan.device || !commands)
      return Error{ErrorCode::usage, "Vulkan executor: a handle or getInstanceProcAddr is null"};
    return std::unique_ptr<VulkanExecutor>(new VulkanExecutor(vulkan, passes, commands));
  } catch (const Error& error) {
    return Error{error.code, "Vulkan executor: " + error.message};
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::memory, "Vulkan executor: memory ran out"};
  }
  VulkanExecutor(const VulkanExecutor&) = delete;

  // Record a frame, outside of a render pass: each frame of `passes` once, in order. What it copies is taken at once.
  // It waits for what the queue was given before, and what is recorded later may read its light in any shader.
  void record(VkCommandBuffer commands, const GpuFrame& frame) {
    barrier(commands, kAll, kCopy | kCompute);
    for (const GpuUpload& each : frame.uploads) {
      if (each.isImage)
        copyToImage(commands, images_[each.resource], each.level, padded(each.bytes));
      else
        copyToBuffer(commands, buffers_[each.resource], each.bytes);
    }
    if (!frame.uploads.empty()) barrier(commands, kCopy, kCompute);
    for (const GpuDispatch& each : frame.dispatches) {
      if (each.waits) barrier(commands, kCompute, kCompute);
      const Set& set = sets_[each.bindingSet];
      CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, set.pipeline);
      CmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, set.pipelineLayout, 0, 1, &set.set, 0, nullptr);
      CmdPushConstants(commands, set.pipelineLayout, VK_SHADER_STAGE_COMPUTE_BIT, 0, set.bytes, each.parameters.data());
      CmdDispatch(commands, each.groups, 1, 1);
    }
    barrier(commands, kCompute, kAll);
  }

  // For GpuPasses::resolveGlsl() in any stage, and for gpuSurfelGlsl(); null where there is none.
  VkDescriptorSetLayout resolveLayout() const { return resolve_.layout; }
  VkDescriptorSet resolveSet() const { return resolve_.set; }
  VkDescriptorSetLayout surfelLayout() const { return surfels_.layout; }
  VkDescriptorSet surfelSet() const { return surfels_.set; }
  // Those of GpuPasses; images are in VK_IMAGE_LAYOUT_GENERAL. All may be copied from.
  VkBuffer buffer(std::size_t i) const { return buffers_[i]; }
  VkImage image(std::size_t i) const { return images_[i].image; }

 private:
  struct Image {
    GpuImage shape;
    VkImage image = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
  };
  // A descriptor set, and the program that is run with it, if that is one of GpuPasses.
  struct Set {
    std::uint32_t program = 0, bytes = 0;  // bytes: of push constants
    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    VkDescriptorSet set = VK_NULL_HANDLE;
    VkPipelineLayout pipelineLayout = VK_NULL_HANDLE;
    VkPipeline pipeline = VK_NULL_HANDLE;
  };
  static constexpr VkImageSubresourceRange kWhole{VK_IMAGE_ASPECT_COLOR_BIT, 0, VK_REMAINING_MIP_LEVELS, 0,
                                                  VK_REMAINING_ARRAY_LAYERS};
  static constexpr VkPipelineStageFlags kAll = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                                        kCopy = VK_PIPELINE_STAGE_TRANSFER_BIT,
                                        kCompute = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;

  // Errors are thrown as far as create().
  [[noreturn]] static void unsupported(const std::string& what) { throw Error{ErrorCode::unsupported, what}; }
  static void need(VkResult result, const char* call) {
    if (result == VK_SUCCESS) return;
    const bool memory = result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY;
    throw Error{memory ? ErrorCode::memory : ErrorCode::failed,
                std::string(call) + " returned VkResult " + std::to_string(static_cast<int>(result))};
  }
  template <class Function>
  Function find(const char* name) const {
    const auto found = reinterpret_cast<Function>(vulkan_.getInstanceProcAddr(vulkan_.instance, name));
    return found ? found : (unsupported(std::string("getInstanceProcAddr does not know ") + name), nullptr);
  }

  VulkanExecutor(const VulkanDevice& vulkan, const GpuPasses& passes, VkCommandBuffer commands)
      : vulkan_(vulkan), device_(vulkan.device) {
    VkPhysicalDeviceProperties properties{};
    GetPhysicalDeviceProperties(vulkan.physicalDevice, &properties);
    if (properties.apiVersion < VK_API_VERSION_1_1) unsupported("the device has no Vulkan 1.1");
    const std::uint32_t buffers = properties.limits.maxPerStageDescriptorStorageBuffers;
    if (buffers < kGpuStorageBuffers)
      unsupported("the device has " + std::to_string(buffers) + " storage buffers in a shader, 8 are needed");
    if (const Status fits = passes.checkDevice(gpuDeviceOf(vulkan)); !fits) throw fits.error();
    GetPhysicalDeviceMemoryProperties(vulkan.physicalDevice, &memory_);
    makeResources(passes);
    makePrograms(passes);
    recordContents(passes, commands);
  }

  // Make an object that dies with the executor; in which order they do does not matter to Vulkan.
  template <class Handle, class Info>
  Handle make(const char* create, const char* destroy, const Info& info) {
    Handle made = VK_NULL_HANDLE;
    const auto call = find<VkResult(VKAPI_PTR*)(VkDevice, const Info*, const VkAllocationCallbacks*, Handle*)>(create);
    need(call(device_, &info, nullptr, &made), create);
    return keep(made, destroy);
  }
  template <class Handle>
  Handle keep(Handle made, const char* destroy) {
    const auto call = find<void(VKAPI_PTR*)(VkDevice, Handle, const VkAllocationCallbacks*)>(destroy);
    std::shared_ptr<void> owner(nullptr, [call, made, device = device_](auto) { call(device, made, nullptr); });
    made_.push_back(std::move(owner));
    return made;
  }

  VkDeviceMemory allocate(const VkMemoryRequirements& needs) {
    for (std::uint32_t type = 0; type < memory_.memoryTypeCount; ++type) {
      const VkMemoryPropertyFlags flags = memory_.memoryTypes[type].propertyFlags;
      if (!(flags & VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT) || !(needs.memoryTypeBits >> type & 1u)) continue;
      const VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, nullptr, needs.size, type};
      return make<VkDeviceMemory>("vkAllocateMemory", "vkFreeMemory", info);
    }
    unsupported("the device has no memory of its own for what is needed");
  }

  VkBuffer makeBuffer(VkDeviceSize size, VkBufferUsageFlags usage) {
    usage |= VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    const VkBufferCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, nullptr, 0, size, usage, {}, 0, nullptr};
    const auto buffer = make<VkBuffer>("vkCreateBuffer", "vkDestroyBuffer", info);
    VkMemoryRequirements needs{};
    GetBufferMemoryRequirements(device_, buffer, &needs);
    need(BindBufferMemory(device_, buffer, allocate(needs), 0), "vkBindBufferMemory");
    return buffer;
  }

  Image makeImage(const GpuImage& shape) {
    constexpr VkFormat kFormats[] = {VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_R16G16_SFLOAT,
                                     VK_FORMAT_R32G32B32A32_SFLOAT, VK_FORMAT_R8G8B8A8_SNORM, VK_FORMAT_R8_UINT};
    constexpr VkImageViewType kViews[] = {VK_IMAGE_VIEW_TYPE_2D, VK_IMAGE_VIEW_TYPE_2D_ARRAY, VK_IMAGE_VIEW_TYPE_3D};
    VkImageCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
    info.imageType = shape.shape == TextureShape::volume ? VK_IMAGE_TYPE_3D : VK_IMAGE_TYPE_2D;
    info.format = kFormats[static_cast<std::size_t>(shape.format)];
    info.extent = {shape.size.x, shape.size.y, shape.size.z / layersOf(shape)};
    info.mipLevels = shape.levels;
    info.arrayLayers = layersOf(shape);
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
    VkFormatFeatureFlags wanted = VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT;
    if (shape.format != GpuFormat::r8ui) wanted |= VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT;
    if (shape.use == GpuUse::light) info.usage |= VK_IMAGE_USAGE_STORAGE_BIT;
    if (shape.use == GpuUse::light) wanted |= VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT;
    VkFormatProperties has{};
    GetPhysicalDeviceFormatProperties(vulkan_.physicalDevice, info.format, &has);
    if ((has.optimalTilingFeatures & wanted) != wanted)
      unsupported(std::string("the device has no image of the format of \"") + shape.name + "\"");
    const auto image = make<VkImage>("vkCreateImage", "vkDestroyImage", info);
    VkMemoryRequirements needs{};
    GetImageMemoryRequirements(device_, image, &needs);
    need(BindImageMemory(device_, image, allocate(needs), 0), "vkBindImageMemory");
    const VkImageViewCreateInfo view{VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,      nullptr,     0,  image,
                                     kViews[static_cast<std::size_t>(shape.shape)], info.format, {}, kWhole};
    return {shape, image, make<VkImageView>("vkCreateImageView", "vkDestroyImageView", view)};
  }

  VkSampler makeSampler(GpuSampler kind) {
    constexpr VkSamplerAddressMode kModes[] = {VK_SAMPLER_ADDRESS_MODE_REPEAT, VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE};
    VkSamplerCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
    info.magFilter = info.minFilter = kind == GpuSampler::nearest ? VK_FILTER_NEAREST : VK_FILTER_LINEAR;
    info.mipmapMode = readsMips(kind) ? VK_SAMPLER_MIPMAP_MODE_LINEAR : VK_SAMPLER_MIPMAP_MODE_NEAREST;
    info.addressModeU = kModes[clampsU(kind)];
    info.addressModeV = kModes[clampsV(kind)];
    info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    info.maxLod = readsMips(kind) ? VK_LOD_CLAMP_NONE : 0.0f;
    return make<VkSampler>("vkCreateSampler", "vkDestroySampler", info);
  }

  // Layouts for one program come out alike, so that all its sets fit its pipeline.
  Set makeSet(std::uint32_t program, std::span<const GpuBinding> bindings, VkShaderStageFlags stages) {
    constexpr VkDescriptorType kTypes[] = {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
                                           VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE};
    Set made{program};
    const auto count = static_cast<std::uint32_t>(bindings.size());
    std::vector<VkDescriptorSetLayoutBinding> slots;
    std::vector<VkDescriptorPoolSize> sizes;
    for (const GpuBinding& each : bindings) {
      sizes.push_back({kTypes[static_cast<std::size_t>(each.kind)], 1});
      slots.push_back({each.binding, sizes.back().type, 1, stages, nullptr});
    }
    const VkDescriptorSetLayoutCreateInfo layout{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, nullptr, 0, count,
                                                 slots.data()};
    made.layout = make<VkDescriptorSetLayout>("vkCreateDescriptorSetLayout", "vkDestroyDescriptorSetLayout", layout);
    const VkDescriptorPoolCreateInfo poolInfo{
        VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, nullptr, 0, 1, count, sizes.data()};
    const auto pool = make<VkDescriptorPool>("vkCreateDescriptorPool", "vkDestroyDescriptorPool", poolInfo);
    const VkDescriptorSetAllocateInfo one{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, nullptr, pool, 1,
                                          &made.layout};
    need(AllocateDescriptorSets(device_, &one, &made.set), "vkAllocateDescriptorSets");
    for (std::size_t i = 0; i < bindings.size(); ++i) {
      const GpuBinding& each = bindings[i];
      const bool isImage = each.kind == GpuBindingKind::sampledImage || each.kind == GpuBindingKind::storageImage;
      VkDescriptorImageInfo image{samplers_[static_cast<std::size_t>(each.sampler)], {}, VK_IMAGE_LAYOUT_GENERAL};
      VkDescriptorBufferInfo buffer{{}, each.offset, each.bytes ? each.bytes : VK_WHOLE_SIZE};
      if (isImage)
        image.imageView = images_[each.resource].view;
      else
        buffer.buffer = buffers_[each.resource];
      VkWriteDescriptorSet write{
          VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, nullptr, made.set, each.binding, 0, 1, {}, {}, {}, {}};
      write.descriptorType = sizes[i].type;
      write.pImageInfo = &image;
      write.pBufferInfo = &buffer;
      UpdateDescriptorSets(device_, 1, &write, 0, nullptr);
    }
    return made;
  }

  void makeResources(const GpuPasses& passes) {
    for (const GpuBuffer& each : passes.buffers()) {
      const auto usage = each.isUniform ? VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT : VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
      buffers_.push_back(makeBuffer(each.bytes, usage));
    }
    VkDeviceSize largest = 16;  // [byte]
    for (const GpuImage& each : passes.images()) {
      images_.push_back(makeImage(each));
      largest = std::max<VkDeviceSize>(largest, texelBytes(each.format) * each.size.x * each.size.y * each.size.z + 3);
    }
    texels_ = makeBuffer(largest, 0);
    for (std::size_t i = 0; i < kGpuSamplers; ++i) samplers_[i] = makeSampler(static_cast<GpuSampler>(i));
  }

  void makePrograms(const GpuPasses& passes) {
    for (const GpuBindingSet& each : passes.bindingSets())
      sets_.push_back(makeSet(each.program, each.bindings, VK_SHADER_STAGE_COMPUTE_BIT));
    resolve_ = makeSet(0, passes.resolveBindings(), VK_SHADER_STAGE_ALL);
    if (!passes.surfelBindings().empty()) surfels_ = makeSet(0, passes.surfelBindings(), VK_SHADER_STAGE_ALL);
    for (std::size_t i = 0; i < passes.programs().size(); ++i) {
      const GpuProgram& each = passes.programs()[i];
      if (each.spirv.empty()) unsupported("no SPIR-V for \"" + each.name + "\": see RELUME_VULKAN_BANDS of the build");
      const auto isOwn = [i](const Set& set) { return set.program == i; };
      const auto own = std::find_if(sets_.begin(), sets_.end(), isOwn);
      const auto bytes = static_cast<std::uint32_t>(each.parameterBytes);
      const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, bytes};
      const VkPipelineLayoutCreateInfo layout{
          VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, nullptr, 0, 1, &own->layout, 1, &range};
      const VkShaderModuleCreateInfo code{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, nullptr, 0,
                                          each.spirv.size_bytes(), each.spirv.data()};
      std::vector<VkSpecializationMapEntry> entries;
      for (const GpuConstant& constant : each.constants) {
        const std::size_t at = sizeof(GpuConstant) * entries.size() + offsetof(GpuConstant, value);
        entries.push_back({constant.id, static_cast<std::uint32_t>(at), sizeof constant.value});
      }
      const VkSpecializationInfo constants{static_cast<std::uint32_t>(entries.size()), entries.data(),
                                           sizeof(GpuConstant) * entries.size(), each.constants.data()};
      VkComputePipelineCreateInfo info{};
      info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
      info.layout = make<VkPipelineLayout>("vkCreatePipelineLayout", "vkDestroyPipelineLayout", layout);
      info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
      info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
      info.stage.module = make<VkShaderModule>("vkCreateShaderModule", "vkDestroyShaderModule", code);
      info.stage.pName = "main";
      info.stage.pSpecializationInfo = &constants;
      VkPipeline pipeline = VK_NULL_HANDLE;
      need(CreateComputePipelines(device_, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline), "vkCreateComputePipelines");
      keep(pipeline, "vkDestroyPipeline");
      for (Set& set : sets_) {
        if (isOwn(set)) set = {set.program, bytes, set.layout, set.set, info.layout, pipeline};
      }
    }
  }

  void recordContents(const GpuPasses& passes, VkCommandBuffer commands) {
    constexpr VkClearColorValue kZeros{};
    for (const VkBuffer each : buffers_) CmdFillBuffer(commands, each, 0, VK_WHOLE_SIZE, 0);
    for (const Image& each : images_) {
      VkImageMemoryBarrier change{};
      change.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
      change.dstAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
      change.newLayout = VK_IMAGE_LAYOUT_GENERAL;
      change.srcQueueFamilyIndex = change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
      change.image = each.image;
      change.subresourceRange = kWhole;
      CmdPipelineBarrier(commands, kCopy, kCopy, 0, 0, nullptr, 0, nullptr, 1, &change);
      CmdClearColorImage(commands, each.image, VK_IMAGE_LAYOUT_GENERAL, &kZeros, 1, &kWhole);
      if (!each.shape.contents.empty()) copyToImage(commands, each, 0, each.shape.contents);
    }
    barrier(commands, kCopy, kCopy);
    for (std::size_t i = 0; i < buffers_.size(); ++i) copyToBuffer(commands, buffers_[i], passes.buffers()[i].contents);
    barrier(commands, kCopy, kAll);
  }
  void barrier(VkCommandBuffer commands, VkPipelineStageFlags from, VkPipelineStageFlags to) {
    const VkMemoryBarrier all{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                              VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT};
    CmdPipelineBarrier(commands, from, to, 0, 1, &all, 0, nullptr, 0, nullptr);
  }
  // The bytes travel in the command buffer, in whole words and 64 KiB at most in a command.
  void copyToBuffer(VkCommandBuffer commands, VkBuffer to, std::span<const std::byte> bytes) {
    const std::size_t end = bytes.size() / 4 * 4;
    for (std::size_t i = 0; i < end; i += 65536)
      CmdUpdateBuffer(commands, to, i, std::min<std::size_t>(end - i, 65536), bytes.data() + i);
    if (end == bytes.size()) return;
    std::uint32_t last = 0;
    std::memcpy(&last, bytes.data() + end, bytes.size() - end);
    CmdUpdateBuffer(commands, to, end, sizeof last, &last);
  }
  void copyToImage(VkCommandBuffer commands, const Image& to, std::uint32_t level, std::span<const std::byte> bytes) {
    copyToBuffer(commands, texels_, bytes);
    barrier(commands, kCopy, kCopy);
    const VkImageSubresourceLayers layers{VK_IMAGE_ASPECT_COLOR_BIT, level, 0, layersOf(to.shape)};
    const glm::uvec3 size = levelSize(to.shape, level);
    const VkBufferImageCopy copy{0, 0, 0, layers, {0, 0, 0}, {size.x, size.y, size.z}};
    CmdCopyBufferToImage(commands, texels_, to.image, VK_IMAGE_LAYOUT_GENERAL, 1, &copy);
    barrier(commands, kCopy, kCopy);
  }
  // Three floats a texel become four; until the next call.
  std::span<const std::byte> padded(std::span<const std::byte> bytes) {
    padded_.resize(bytes.size() / sizeof(glm::vec3));
    for (std::size_t i = 0; i < padded_.size(); ++i) std::memcpy(&padded_[i], &bytes[12 * i], 12);
    return std::as_bytes(std::span(padded_));
  }

  const VulkanDevice vulkan_;
  const VkDevice device_;
  // Vulkan's functions by their names without vk; make() finds others.
  // clang-format off
#define RELUME_VK(name) PFN_vk##name name = find<PFN_vk##name>("vk" #name)
  RELUME_VK(AllocateDescriptorSets); RELUME_VK(BindBufferMemory); RELUME_VK(BindImageMemory);
  RELUME_VK(CmdBindDescriptorSets); RELUME_VK(CmdBindPipeline); RELUME_VK(CmdClearColorImage);
  RELUME_VK(CmdCopyBufferToImage); RELUME_VK(CmdDispatch); RELUME_VK(CmdFillBuffer); RELUME_VK(CmdPipelineBarrier);
  RELUME_VK(CmdPushConstants); RELUME_VK(CmdUpdateBuffer); RELUME_VK(CreateComputePipelines);
  RELUME_VK(GetBufferMemoryRequirements); RELUME_VK(GetImageMemoryRequirements);
  RELUME_VK(GetPhysicalDeviceFormatProperties); RELUME_VK(GetPhysicalDeviceMemoryProperties);
  RELUME_VK(GetPhysicalDeviceProperties); RELUME_VK(UpdateDescriptorSets);
#undef RELUME_VK
  // clang-format on
  VkPhysicalDeviceMemoryProperties memory_{};
  std::vector<std::shared_ptr<void>> made_;  // owns what follows
  std::vector<VkBuffer> buffers_;
  std::vector<Image> images_;
  std::array<VkSampler, kGpuSamplers> samplers_{};
  std::vector<Set> sets_;
  Set resolve_, surfels_;
  VkBuffer texels_ = VK_NULL_HANDLE;  // a level of an image on its way there
  std::vector<glm::vec4> padded_;
};

}  // namespace relume
