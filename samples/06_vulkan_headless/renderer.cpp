// SPDX-License-Identifier: MIT
// See renderer.h.
#include "renderer.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "light_surfels.spv.h"
#include "picture.spv.h"

namespace {

constexpr std::size_t kMaxPixels = 960 * 540;
constexpr std::uint32_t kSceneBuffers = 4;

// As scene.glsl has them.
struct Corner {
  glm::vec4 position, normal, uv;
};
struct Mesh {
  glm::vec4 low{1e30f, 1e30f, 1e30f, 0.0f}, high{-1e30f, -1e30f, -1e30f, 0.0f}, color, emission;
  glm::uvec4 image{0u};
};
struct FrameConstants {
  glm::mat4 worldFromCamera;
  glm::vec4 sunDirection, sunIrradiance, lampPosition, lampIntensity;
};
static_assert(sizeof(FrameConstants) == 128, "every Vulkan has 128 bytes of push constants");

void flatten(const Level& level, std::vector<Corner>& corners, std::vector<Mesh>& meshes,
             std::vector<std::uint32_t>& texels) {
  std::vector<glm::uvec4> images;
  for (const Image& image : level.images) {
    const std::size_t count = image.rgba.size() / 4;
    images.push_back(count == 0 ? glm::uvec4(0u) : glm::uvec4(texels.size(), image.width, image.height, 0));
    texels.resize(texels.size() + count);
    if (count > 0) std::memcpy(texels.data() + texels.size() - count, image.rgba.data(), 4 * count);
  }
  texels.push_back(0);
  for (const Draw& draw : level.draws) {
    Mesh mesh;
    mesh.low.w = static_cast<float>(corners.size() / 3);
    mesh.high.w = static_cast<float>(draw.indexCount / 3);
    const Material& material = level.materials[draw.material];
    mesh.color = material.color;
    mesh.emission = glm::vec4(material.emission, material.alphaCutoff);
    if (material.image >= 0) mesh.image = images[static_cast<std::size_t>(material.image)];
    for (std::uint32_t i = draw.firstIndex; i < draw.firstIndex + draw.indexCount; ++i) {
      const Vertex& v = level.vertices[level.indices[i]];
      corners.push_back({glm::vec4(v.position, static_cast<float>(v.lightmapUv[0]) / 65535.0f),
                         glm::vec4(v.normal, static_cast<float>(v.lightmapUv[1]) / 65535.0f),
                         glm::vec4(v.uv, 0.0f, 0.0f)});
      mesh.low = glm::vec4(glm::min(glm::vec3(mesh.low), v.position), mesh.low.w);
      mesh.high = glm::vec4(glm::max(glm::vec3(mesh.high), v.position), mesh.high.w);
    }
    meshes.push_back(mesh);
  }
}

template <class T>
std::span<const std::byte> bytesOf(const std::vector<T>& elements) {
  return std::as_bytes(std::span(elements));
}

}  // namespace

Renderer::Renderer(const Device& device, const Level& level, relume::GpuPasses& passes)
    : device_(device), vk_(device.handles().device), objects_(vk_), passes_(passes) {
  makeCommands();
  begin();
  auto executor = relume::VulkanExecutor::create(device.handles(), passes, commands_);
  if (!executor) throw executor.error();
  executor_ = std::move(*executor);
  submitAndWait();
  passes.forgetContents();
  std::vector<Corner> corners;
  std::vector<Mesh> meshes;
  std::vector<std::uint32_t> texels;
  flatten(level, corners, meshes, texels);
  std::array<VkBuffer, kSceneBuffers> buffers{};
  makeBuffer(bytesOf(corners), corners.size() * sizeof(Corner), buffers[0]);
  makeBuffer(bytesOf(meshes), meshes.size() * sizeof(Mesh), buffers[1]);
  pixels_ = makeBuffer({}, kMaxPixels * 4, buffers[2]);
  makeBuffer(bytesOf(texels), texels.size() * 4, buffers[3]);
  makeSceneSet(buffers);
  surfels_ = makePass(light_surfels_spirv, executor_->surfelLayout());
  picture_ = makePass(picture_spirv, executor_->resolveLayout());
}

std::byte* Renderer::makeBuffer(std::span<const std::byte> contents, std::size_t bytes, VkBuffer& buffer) {
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = bytes;
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  objects_.make(vkCreateBuffer, vkDestroyBuffer, info, buffer, "vkCreateBuffer");
  VkMemoryRequirements needs{};
  vkGetBufferMemoryRequirements(vk_, buffer, &needs);
  VkPhysicalDeviceMemoryProperties memories{};
  vkGetPhysicalDeviceMemoryProperties(device_.handles().physicalDevice, &memories);
  // Every device has memory of this kind for buffers.
  const VkMemoryPropertyFlags kind = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  VkMemoryAllocateInfo taken{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, nullptr, needs.size, 0};
  while ((memories.memoryTypes[taken.memoryTypeIndex].propertyFlags & kind) != kind ||
         (needs.memoryTypeBits >> taken.memoryTypeIndex & 1u) == 0)
    ++taken.memoryTypeIndex;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  objects_.make(vkAllocateMemory, vkFreeMemory, taken, memory, "vkAllocateMemory");
  need(vkBindBufferMemory(vk_, buffer, memory, 0), "vkBindBufferMemory");
  void* mapped = nullptr;
  need(vkMapMemory(vk_, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
  if (!contents.empty()) std::memcpy(mapped, contents.data(), contents.size());
  return static_cast<std::byte*>(mapped);
}

void Renderer::makeSceneSet(std::span<const VkBuffer> buffers) {
  std::array<VkDescriptorSetLayoutBinding, kSceneBuffers> bindings{};
  for (std::uint32_t i = 0; i < kSceneBuffers; ++i)
    bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  const VkDescriptorSetLayoutCreateInfo layout{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, nullptr, 0,
                                               kSceneBuffers, bindings.data()};
  objects_.make(vkCreateDescriptorSetLayout, vkDestroyDescriptorSetLayout, layout, sceneLayout_,
                "vkCreateDescriptorSetLayout");
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, kSceneBuffers};
  const VkDescriptorPoolCreateInfo poolInfo{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, nullptr, 0, 1, 1, &size};
  VkDescriptorPool pool = VK_NULL_HANDLE;
  objects_.make(vkCreateDescriptorPool, vkDestroyDescriptorPool, poolInfo, pool, "vkCreateDescriptorPool");
  const VkDescriptorSetAllocateInfo one{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, nullptr, pool, 1,
                                        &sceneLayout_};
  need(vkAllocateDescriptorSets(vk_, &one, &sceneSet_), "vkAllocateDescriptorSets");
  for (std::uint32_t i = 0; i < kSceneBuffers; ++i) {
    const VkDescriptorBufferInfo buffer{buffers[i], 0, VK_WHOLE_SIZE};
    VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, nullptr, sceneSet_, i, 0, 1, {}, {}, {}, {}};
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = &buffer;
    vkUpdateDescriptorSets(vk_, 1, &write, 0, nullptr);
  }
}

// Relume's bindings are set 0, the scene is set 1.
Renderer::Pass Renderer::makePass(std::span<const std::uint32_t> spirv, VkDescriptorSetLayout relume) {
  Pass pass;
  const std::array<VkDescriptorSetLayout, 2> sets{relume, sceneLayout_};
  const VkPushConstantRange constants{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(FrameConstants)};
  const VkPipelineLayoutCreateInfo layout{
      VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, nullptr, 0, 2, sets.data(), 1, &constants};
  objects_.make(vkCreatePipelineLayout, vkDestroyPipelineLayout, layout, pass.layout, "vkCreatePipelineLayout");
  const VkShaderModuleCreateInfo code{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, nullptr, 0, spirv.size_bytes(),
                                      spirv.data()};
  VkComputePipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  info.layout = pass.layout;
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.pName = "main";
  objects_.make(vkCreateShaderModule, vkDestroyShaderModule, code, info.stage.module, "vkCreateShaderModule");
  const auto create = [](VkDevice device, const auto* one, auto memory, VkPipeline* made) {
    return vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, one, memory, made);
  };
  objects_.make(create, vkDestroyPipeline, info, pass.pipeline, "vkCreateComputePipelines");
  return pass;
}

void Renderer::run(const Pass& pass, VkDescriptorSet relume, const Level& level, std::uint32_t width,
                   std::uint32_t height, bool indirect, std::uint32_t groupsX, std::uint32_t groupsY) {
  const FrameConstants frame{level.worldFromCamera, glm::vec4(level.sun.direction, std::tan(0.5f * level.fovYRad)),
                             glm::vec4(level.sun.intensity, static_cast<float>(width)),
                             glm::vec4(level.lamp.positionWorld, static_cast<float>(height)),
                             glm::vec4(level.lamp.intensity, indirect ? 1.0f : 0.0f)};
  const std::array<VkDescriptorSet, 2> sets{relume, sceneSet_};
  vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, pass.pipeline);
  vkCmdBindDescriptorSets(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, pass.layout, 0, 2, sets.data(), 0, nullptr);
  vkCmdPushConstants(commands_, pass.layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof frame, &frame);
  vkCmdDispatch(commands_, groupsX, groupsY, 1);
}

void Renderer::makeCommands() {
  const VkCommandPoolCreateInfo info{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr,
                                     VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT, device_.queueFamily()};
  VkCommandPool pool = VK_NULL_HANDLE;
  objects_.make(vkCreateCommandPool, vkDestroyCommandPool, info, pool, "vkCreateCommandPool");
  const VkCommandBufferAllocateInfo one{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, nullptr, pool,
                                        VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
  need(vkAllocateCommandBuffers(vk_, &one, &commands_), "vkAllocateCommandBuffers");
}

void Renderer::begin() const {
  const VkCommandBufferBeginInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr, 0, nullptr};
  need(vkBeginCommandBuffer(commands_, &info), "vkBeginCommandBuffer");
}

void Renderer::submitAndWait() const {
  need(vkEndCommandBuffer(commands_), "vkEndCommandBuffer");
  VkSubmitInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  info.commandBufferCount = 1;
  info.pCommandBuffers = &commands_;
  need(vkQueueSubmit(device_.queue(), 1, &info, VK_NULL_HANDLE), "vkQueueSubmit");
  need(vkQueueWaitIdle(device_.queue()), "vkQueueWaitIdle");
}

// A game waits for a fence some frames later; here the picture is wanted at once.
relume::Status Renderer::relight(const Level& level) {
  relume::LightSetup setup;
  setup.surfelIrradianceOnGpu = true;
  const relume::Result<relume::GpuFrame> frame = passes_.frame(setup);
  if (!frame) return frame.error();
  begin();
  run(surfels_, executor_->surfelSet(), level, 0, 0, false, (passes_.surfelSlots() + 63) / 64, 1);
  executor_->record(commands_, *frame);
  submitAndWait();
  return relume::done();
}

std::vector<unsigned char> Renderer::draw(const Level& level, std::uint32_t width, std::uint32_t height,
                                          bool indirect) {
  width = std::min<std::uint32_t>(width, 960);
  height = std::min<std::uint32_t>(height, 540);
  begin();
  run(picture_, executor_->resolveSet(), level, width, height, indirect, (width + 7) / 8, (height + 7) / 8);
  const VkMemoryBarrier toHost{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_SHADER_WRITE_BIT,
                               VK_ACCESS_HOST_READ_BIT};
  vkCmdPipelineBarrier(commands_, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &toHost, 0,
                       nullptr, 0, nullptr);
  submitAndWait();
  const auto* rgba = reinterpret_cast<const unsigned char*>(pixels_);
  return {rgba, rgba + std::size_t{4} * width * height};
}
