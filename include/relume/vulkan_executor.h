// SPDX-License-Identifier: MIT
// Runs GpuPasses in Vulkan 1.1, on the host's device and in the host's command buffers: makes buffers, images,
// pipelines and descriptor sets once, and records frames without making anything. A renderer that has all this by
// itself needs nothing of it. It takes Vulkan's functions from getInstanceProcAddr: no library is linked.
//
//   Result<GpuPasses> passes = GpuPasses::create(bake, options, gpuDeviceOf(vulkan));
//   auto executor = VulkanExecutor::create(vulkan, *passes);  // uploads, and waits for it
//   every frame:  Result<GpuFrame> frame = passes->frame(setup);  (*executor)->record(commands, *frame);
//   to resolve:   resolveLayout() and resolveSet(), with GpuPasses::resolveGlsl() in the host's shader
//
// Threads: create(), record() and destruction by one thread at a time; create() submits to the queue, which nobody else
// may use meanwhile. The device must be done with all recorded frames when the executor dies. With
// RelightOptions::gridTexture the device needs the feature shaderStorageImageExtendedFormats, switched on.
#pragma once

#include "relume/gpu_passes.h"
#include "relume/vulkan_objects.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

namespace relume {

class VulkanExecutor {
 public:
  // `passes` must still have its contents, which may be forgotten afterwards. usage: a null handle; unsupported: no
  // Vulkan 1.1, a function, limit, format or kind of memory missing, no SPIR-V for these bands; memory: the host's or
  // the device's ran out; failed: what else Vulkan said.
  static Result<std::unique_ptr<VulkanExecutor>> create(const VulkanDevice& vulkan, const GpuPasses& passes) try {
    std::unique_ptr<VulkanExecutor> made(new VulkanExecutor(vulkan));
    made->check(passes);
    made->makeBuffers(passes);
    made->makeImages(passes);
    made->makeSamplers();
    made->makePrograms(passes);
    made->makeSets(passes);
    made->upload(passes);
    return made;
  } catch (const VulkanFailure& failure) {
    return Error{failure.code, "Vulkan executor: " + failure.what};
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::memory, "Vulkan executor: memory ran out"};
  }
  VulkanExecutor(const VulkanExecutor&) = delete;
  VulkanExecutor& operator=(const VulkanExecutor&) = delete;

  // Record a frame, outside of a render pass: each frame of `passes` once, in order. What it copies is taken at once.
  // It waits for what the queue was given before, and what is recorded later may read its light in any shader.
  void record(VkCommandBuffer commands, const GpuFrame& frame) {
    constexpr VkPipelineStageFlags kAll = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, kCopy = VK_PIPELINE_STAGE_TRANSFER_BIT,
                                   kCompute = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
    barrier(commands, kAll, kCopy | kCompute);
    recordUploads(commands, frame.uploads);
    if (!frame.uploads.empty()) barrier(commands, kCopy, kCompute);
    for (const GpuDispatch& each : frame.dispatches) {
      if (each.waits) barrier(commands, kCompute, kCompute);
      const auto& [number, set] = sets_[each.bindingSet];
      const Program& program = programs_[number];
      vk_.CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, program.pipeline);
      vk_.CmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, program.layout, 0, 1, &set, 0, nullptr);
      vk_.CmdPushConstants(commands, program.layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, program.bytes,
                           each.parameters.data());
      vk_.CmdDispatch(commands, each.groups, 1, 1);
    }
    barrier(commands, kCompute, kAll);
  }

  // For GpuPasses::resolveGlsl() in any stage, and for gpuSurfelGlsl(); null where there is none.
  VkDescriptorSetLayout resolveLayout() const { return resolveLayout_; }
  VkDescriptorSet resolveSet() const { return resolveSet_; }
  VkDescriptorSetLayout surfelLayout() const { return surfelLayout_; }
  VkDescriptorSet surfelSet() const { return surfelSet_; }
  // Those of GpuPasses; images are in VK_IMAGE_LAYOUT_GENERAL. All may be copied from.
  VkBuffer buffer(std::size_t i) const { return buffers_[i]; }
  VkImage image(std::size_t i) const { return images_[i]; }

 private:
  struct Program {
    VkDescriptorSetLayout setLayout = VK_NULL_HANDLE;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    VkPipeline pipeline = VK_NULL_HANDLE;
    std::uint32_t bytes = 0;  // of push constants
  };
  explicit VulkanExecutor(const VulkanDevice& vulkan) : vk_(vulkan) {}

  void check(const GpuPasses& passes) const {
    if (vk_.properties.apiVersion < VK_API_VERSION_1_1) vk_.unsupported("the device has no Vulkan 1.1");
    for (const GpuProgram& each : passes.programs()) {
      if (each.spirv.empty())
        vk_.unsupported("no SPIR-V for \"" + each.name + "\": see RELUME_VULKAN_BANDS of the build");
    }
    const VkPhysicalDeviceLimits& limits = vk_.properties.limits;
    for (const GpuBindingSet& set : passes.bindingSets()) {
      const auto isStorage = [](const GpuBinding& b) { return b.kind == GpuBindingKind::storageBuffer; };
      if (std::count_if(set.bindings.begin(), set.bindings.end(), isStorage) >
          limits.maxPerStageDescriptorStorageBuffers)
        vk_.unsupported("the device has " + std::to_string(limits.maxPerStageDescriptorStorageBuffers) +
                        " storage buffers in a shader, 8 are needed");
      for (const GpuBinding& each : set.bindings) {
        const std::size_t bytes = !isStorage(each) || each.bytes ? each.bytes : passes.buffers()[each.resource].bytes;
        if (bytes > limits.maxStorageBufferRange || each.offset % limits.minStorageBufferOffsetAlignment != 0)
          vk_.unsupported("GpuPasses are for a device of other limits: make them with gpuDeviceOf()");
      }
    }
  }

  void makeBuffers(const GpuPasses& passes) {
    for (const GpuBuffer& each : passes.buffers()) {
      const auto usage = each.isUniform ? VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT : VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
      vk_.makeBuffer(each.bytes, usage, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, buffers_.emplace_back());
    }
  }

  static VkDeviceSize aligned(VkDeviceSize size) { return (size + 15) / 16 * 16; }
  static std::uint32_t layersOf(const GpuImage& image) { return image.shape == TextureShape::array ? image.size.z : 1; }
  static VkImageSubresourceRange wholeOf(const GpuImage& image) {
    return {VK_IMAGE_ASPECT_COLOR_BIT, 0, image.levels, 0, layersOf(image)};
  }
  static VkExtent3D extentOf(const GpuImage& image, std::uint32_t level) {
    return {std::max(image.size.x >> level, 1u), std::max(image.size.y >> level, 1u), image.size.z / layersOf(image)};
  }

  void makeImages(const GpuPasses& passes) {
    constexpr VkFormat kFormats[] = {VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_R16G16_SFLOAT,
                                     VK_FORMAT_R32G32B32A32_SFLOAT, VK_FORMAT_R8G8B8A8_SNORM, VK_FORMAT_R8_UINT};
    constexpr VkImageViewType kViews[] = {VK_IMAGE_VIEW_TYPE_2D, VK_IMAGE_VIEW_TYPE_2D_ARRAY, VK_IMAGE_VIEW_TYPE_3D};
    const auto getFormat =
        vk_.ofInstance<PFN_vkGetPhysicalDeviceFormatProperties>("vkGetPhysicalDeviceFormatProperties");
    shapes_.assign(passes.images().begin(), passes.images().end());
    VkDeviceSize largest = 16;
    for (const GpuImage& each : shapes_) {
      const bool isVolume = each.shape == TextureShape::volume, isLight = each.use == GpuUse::light,
                 isInteger = each.format == GpuFormat::r8ui;
      VkImageCreateInfo info{};
      info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
      info.imageType = isVolume ? VK_IMAGE_TYPE_3D : VK_IMAGE_TYPE_2D;
      info.format = kFormats[static_cast<std::size_t>(each.format)];
      info.extent = extentOf(each, 0);
      info.mipLevels = each.levels;
      info.arrayLayers = layersOf(each);
      info.samples = VK_SAMPLE_COUNT_1_BIT;
      info.usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT |
                   (isLight ? VkFlags{VK_IMAGE_USAGE_STORAGE_BIT} : 0);
      const VkFormatFeatureFlags wanted = VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT |
                                          (isLight ? VkFlags{VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT} : 0) |
                                          (isInteger ? 0 : VkFlags{VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT});
      VkFormatProperties has{};
      getFormat(vk_.host.physicalDevice, info.format, &has);
      const VkPhysicalDeviceLimits& limits = vk_.properties.limits;
      const std::uint32_t side = isVolume ? limits.maxImageDimension3D : limits.maxImageDimension2D;
      if ((has.optimalTilingFeatures & wanted) != wanted || info.arrayLayers > limits.maxImageArrayLayers ||
          std::max({info.extent.width, info.extent.height, info.extent.depth}) > side)
        vk_.unsupported(std::string("the device has no image of the format and size of \"") + each.name + "\"");
      VkImage& image = images_.emplace_back();
      vk_.make(vk_.CreateImage, vk_.DestroyImage, info, image, "vkCreateImage");
      VkMemoryRequirements needs{};
      vk_.GetImageMemoryRequirements(vk_.device, image, &needs);
      vk_.need(vk_.BindImageMemory(vk_.device, image, vk_.allocate(needs, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT), 0),
               "vkBindImageMemory");
      const VkImageViewCreateInfo view{VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,     nullptr,     0,  image,
                                       kViews[static_cast<std::size_t>(each.shape)], info.format, {}, wholeOf(each)};
      vk_.make(vk_.CreateImageView, vk_.DestroyImageView, view, views_.emplace_back(), "vkCreateImageView");
      if (each.use == GpuUse::frame)
        largest = std::max(largest, VkDeviceSize{16} * info.extent.width * info.extent.height);
    }
    vk_.makeBuffer(largest, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, texels_);
  }

  void makeSamplers() {
    for (std::size_t i = 0; i < samplers_.size(); ++i) {
      const bool hasMips = i >= static_cast<std::size_t>(GpuSampler::mipRepeat);
      const std::size_t clamps = hasMips ? i - static_cast<std::size_t>(GpuSampler::mipRepeat) : 3;  // bits: u, v
      VkSamplerCreateInfo info{};
      info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
      const bool isNearest = i == static_cast<std::size_t>(GpuSampler::nearest);
      info.magFilter = info.minFilter = isNearest ? VK_FILTER_NEAREST : VK_FILTER_LINEAR;
      info.mipmapMode = hasMips ? VK_SAMPLER_MIPMAP_MODE_LINEAR : VK_SAMPLER_MIPMAP_MODE_NEAREST;
      info.addressModeU = (clamps & 1) ? VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE : VK_SAMPLER_ADDRESS_MODE_REPEAT;
      info.addressModeV = (clamps & 2) ? VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE : VK_SAMPLER_ADDRESS_MODE_REPEAT;
      info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
      info.maxLod = hasMips ? VK_LOD_CLAMP_NONE : 0.0f;
      vk_.make(vk_.CreateSampler, vk_.DestroySampler, info, samplers_[i], "vkCreateSampler");
    }
  }

  static VkDescriptorType typeOf(GpuBindingKind kind) {
    constexpr VkDescriptorType kTypes[] = {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
                                           VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE};
    return kTypes[static_cast<std::size_t>(kind)];
  }

  void makeSetLayout(std::span<const GpuBinding> bindings, VkShaderStageFlags stages, VkDescriptorSetLayout& layout) {
    std::vector<VkDescriptorSetLayoutBinding> all;
    for (const GpuBinding& each : bindings) all.push_back({each.binding, typeOf(each.kind), 1, stages, nullptr});
    const VkDescriptorSetLayoutCreateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, nullptr, 0,
                                               static_cast<std::uint32_t>(all.size()), all.data()};
    vk_.make(vk_.CreateDescriptorSetLayout, vk_.DestroyDescriptorSetLayout, info, layout,
             "vkCreateDescriptorSetLayout");
  }

  void makePrograms(const GpuPasses& passes) {
    for (const GpuProgram& source : passes.programs()) {
      const auto isOwn = [&](const GpuBindingSet& set) { return &passes.programs()[set.program] == &source; };
      Program& made = programs_.emplace_back();
      made.bytes = static_cast<std::uint32_t>(source.parameterBytes);
      const auto sets = passes.bindingSets();
      makeSetLayout(std::find_if(sets.begin(), sets.end(), isOwn)->bindings, VK_SHADER_STAGE_COMPUTE_BIT,
                    made.setLayout);
      const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, made.bytes};
      const VkPipelineLayoutCreateInfo layout{
          VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, nullptr, 0, 1, &made.setLayout, 1, &range};
      vk_.make(vk_.CreatePipelineLayout, vk_.DestroyPipelineLayout, layout, made.layout, "vkCreatePipelineLayout");
      std::vector<VkSpecializationMapEntry> entries;
      for (const GpuConstant& each : source.constants) {
        const std::size_t at = sizeof(GpuConstant) * entries.size() + offsetof(GpuConstant, value);
        entries.push_back({each.id, static_cast<std::uint32_t>(at), sizeof each.value});
      }
      const VkSpecializationInfo constants{static_cast<std::uint32_t>(entries.size()), entries.data(),
                                           sizeof(GpuConstant) * entries.size(), source.constants.data()};
      made.pipeline = vk_.makeComputePipeline(source.spirv, made.layout, &constants);
    }
  }

  VkDescriptorSet makeSet(std::span<const GpuBinding> bindings, VkDescriptorSetLayout layout) {
    const VkDescriptorSetAllocateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, nullptr, pool_, 1, &layout};
    VkDescriptorSet set = VK_NULL_HANDLE;
    vk_.need(vk_.AllocateDescriptorSets(vk_.device, &info, &set), "vkAllocateDescriptorSets");
    for (const GpuBinding& each : bindings) {
      const bool isImage = each.kind == GpuBindingKind::sampledImage || each.kind == GpuBindingKind::storageImage;
      const VkDescriptorImageInfo image{samplers_[static_cast<std::size_t>(each.sampler)],
                                        isImage ? views_[each.resource] : VK_NULL_HANDLE, VK_IMAGE_LAYOUT_GENERAL};
      const VkDescriptorBufferInfo buffer{isImage ? VK_NULL_HANDLE : buffers_[each.resource], each.offset,
                                          each.bytes ? each.bytes : VK_WHOLE_SIZE};
      VkWriteDescriptorSet write{
          VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, nullptr, set, each.binding, 0, 1, {}, {}, {}, {}};
      write.descriptorType = typeOf(each.kind);
      write.pImageInfo = &image;
      write.pBufferInfo = &buffer;
      vk_.UpdateDescriptorSets(vk_.device, 1, &write, 0, nullptr);
    }
    return set;
  }

  void makeSets(const GpuPasses& passes) {
    std::array<VkDescriptorPoolSize, 4> sizes{};
    const auto count = [&sizes](std::span<const GpuBinding> bindings) {
      for (const GpuBinding& each : bindings) ++sizes[static_cast<std::size_t>(each.kind)].descriptorCount;
    };
    for (const GpuBindingSet& each : passes.bindingSets()) count(each.bindings);
    count(passes.resolveBindings());
    count(passes.surfelBindings());
    for (std::size_t kind = 0; kind < sizes.size(); ++kind) {
      sizes[kind].type = typeOf(static_cast<GpuBindingKind>(kind));
      sizes[kind].descriptorCount = std::max(sizes[kind].descriptorCount, 1u);
    }
    const auto maxSets = static_cast<std::uint32_t>(passes.bindingSets().size() + 2);
    const VkDescriptorPoolCreateInfo info{
        VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, nullptr, 0, maxSets, 4, sizes.data()};
    vk_.make(vk_.CreateDescriptorPool, vk_.DestroyDescriptorPool, info, pool_, "vkCreateDescriptorPool");
    for (const GpuBindingSet& each : passes.bindingSets())
      sets_.emplace_back(each.program, makeSet(each.bindings, programs_[each.program].setLayout));
    makeSetLayout(passes.resolveBindings(), VK_SHADER_STAGE_ALL, resolveLayout_);
    resolveSet_ = makeSet(passes.resolveBindings(), resolveLayout_);
    if (passes.surfelBindings().empty()) return;
    makeSetLayout(passes.surfelBindings(), VK_SHADER_STAGE_ALL, surfelLayout_);
    surfelSet_ = makeSet(passes.surfelBindings(), surfelLayout_);
  }

  // Copy or clear what resources begin with, and wait until it is done.
  void upload(const GpuPasses& passes) {
    const std::size_t before = vk_.madeCount();
    VkDeviceSize size = 16;
    for (const GpuBuffer& each : passes.buffers()) size += aligned(each.contents.size());
    for (const GpuImage& each : passes.images()) size += aligned(each.contents.size());
    VkBuffer staging = VK_NULL_HANDLE;
    const VkDeviceMemory memory =
        vk_.makeBuffer(size, 0, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, staging);
    void* mapped = nullptr;
    vk_.need(vk_.MapMemory(vk_.device, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
    const VkCommandBuffer commands = vk_.makeCommands(VK_COMMAND_POOL_CREATE_TRANSIENT_BIT);
    vk_.begin(commands);
    recordContents(commands, passes, staging, static_cast<std::byte*>(mapped));
    vk_.submitAndWait(commands);
    vk_.rollBack(before);
  }

  void recordContents(VkCommandBuffer commands, const GpuPasses& passes, VkBuffer staging, std::byte* bytes) {
    constexpr VkPipelineStageFlags kCopy = VK_PIPELINE_STAGE_TRANSFER_BIT;
    for (const VkBuffer each : buffers_) vk_.CmdFillBuffer(commands, each, 0, VK_WHOLE_SIZE, 0);
    for (std::size_t i = 0; i < images_.size(); ++i) {
      VkImageMemoryBarrier change{};
      change.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
      change.dstAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
      change.newLayout = VK_IMAGE_LAYOUT_GENERAL;
      change.srcQueueFamilyIndex = change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
      change.image = images_[i];
      change.subresourceRange = wholeOf(shapes_[i]);
      vk_.CmdPipelineBarrier(commands, kCopy, kCopy, 0, 0, nullptr, 0, nullptr, 1, &change);
      const VkClearColorValue zeros{};
      vk_.CmdClearColorImage(commands, images_[i], VK_IMAGE_LAYOUT_GENERAL, &zeros, 1, &change.subresourceRange);
    }
    barrier(commands, kCopy, kCopy);
    VkDeviceSize at = 0;
    for (std::size_t i = 0; i < buffers_.size() + images_.size(); ++i) {
      const bool isImage = i >= buffers_.size();
      const auto contents = isImage ? passes.images()[i - buffers_.size()].contents : passes.buffers()[i].contents;
      if (contents.empty()) continue;
      std::memcpy(bytes + at, contents.data(), contents.size());
      const VkBufferCopy copy{at, 0, contents.size()};
      if (isImage)
        copyImage(commands, staging, at, i - buffers_.size(), 0);
      else
        vk_.CmdCopyBuffer(commands, staging, buffers_[i], 1, &copy);
      at += aligned(contents.size());
    }
    barrier(commands, kCopy, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT);
  }

  void barrier(VkCommandBuffer commands, VkPipelineStageFlags from, VkPipelineStageFlags to) {
    const VkMemoryBarrier all{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                              VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT};
    vk_.CmdPipelineBarrier(commands, from, to, 0, 1, &all, 0, nullptr, 0, nullptr);
  }

  void copyImage(VkCommandBuffer commands, VkBuffer from, VkDeviceSize at, std::size_t to, std::uint32_t level) {
    const VkImageSubresourceLayers layers{VK_IMAGE_ASPECT_COLOR_BIT, level, 0, layersOf(shapes_[to])};
    const VkBufferImageCopy copy{at, 0, 0, layers, {0, 0, 0}, extentOf(shapes_[to], level)};
    vk_.CmdCopyBufferToImage(commands, from, images_[to], VK_IMAGE_LAYOUT_GENERAL, 1, &copy);
  }

  // The bytes travel in the command buffer, 64 KiB at most in a command.
  void updateBuffer(VkCommandBuffer commands, VkBuffer to, std::span<const std::byte> bytes, VkDeviceSize at = 0) {
    for (std::size_t i = 0; i < bytes.size(); i += 65536)
      vk_.CmdUpdateBuffer(commands, to, at + i, std::min<std::size_t>(bytes.size() - i, 65536), bytes.data() + i);
  }

  void recordUploads(VkCommandBuffer commands, std::span<const GpuUpload> uploads) {
    for (const GpuUpload& each : uploads) {
      if (!each.isImage) {
        updateBuffer(commands, buffers_[each.resource], each.bytes);
        continue;
      }
      // Three floats a texel become four.
      std::array<std::array<float, 4>, 4096> texels;
      const std::size_t count = each.bytes.size() / 12;
      for (std::size_t first = 0; first < count; first += texels.size()) {
        const std::size_t some = std::min(count - first, texels.size());
        for (std::size_t i = 0; i < some; ++i) std::memcpy(texels[i].data(), each.bytes.data() + 12 * (first + i), 12);
        updateBuffer(commands, texels_, std::as_bytes(std::span(texels.data(), some)), 16 * first);
      }
      barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT);
      copyImage(commands, texels_, 0, each.resource, each.level);
      barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT);
    }
  }

  VulkanObjects vk_;
  std::vector<VkBuffer> buffers_;
  std::vector<VkImage> images_;
  std::vector<VkImageView> views_;
  std::vector<GpuImage> shapes_;
  std::array<VkSampler, kGpuSamplers> samplers_{};
  std::vector<Program> programs_;
  std::vector<std::pair<std::uint32_t, VkDescriptorSet>> sets_;  // with their programs
  VkDescriptorSetLayout resolveLayout_ = VK_NULL_HANDLE, surfelLayout_ = VK_NULL_HANDLE;
  VkDescriptorSet resolveSet_ = VK_NULL_HANDLE, surfelSet_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkBuffer texels_ = VK_NULL_HANDLE;  // of a level of an image, on its way there
};

}  // namespace relume
