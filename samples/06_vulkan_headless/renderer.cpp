// SPDX-License-Identifier: MIT
// See renderer.h.
#include "renderer.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

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

Renderer::Renderer(const relume::VulkanDevice& device, const Level& level, relume::GpuPasses& passes,
                   relume::VulkanExecutor& executor)
    : vk_(device), passes_(passes), executor_(executor) {
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
  surfels_ = makePass(light_surfels_spirv, executor.surfelLayout());
  picture_ = makePass(picture_spirv, executor.resolveLayout());
  commands_ = vk_.makeCommands(VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT);
}

std::byte* Renderer::makeBuffer(std::span<const std::byte> contents, std::size_t bytes, VkBuffer& buffer) {
  const VkDeviceMemory memory =
      vk_.makeBuffer(bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                     VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, buffer);
  void* mapped = nullptr;
  vk_.need(vk_.MapMemory(vk_.device, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
  if (!contents.empty()) std::memcpy(mapped, contents.data(), contents.size());
  return static_cast<std::byte*>(mapped);
}

void Renderer::makeSceneSet(std::span<const VkBuffer> buffers) {
  std::array<VkDescriptorSetLayoutBinding, kSceneBuffers> bindings{};
  for (std::uint32_t i = 0; i < kSceneBuffers; ++i)
    bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  const VkDescriptorSetLayoutCreateInfo layout{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, nullptr, 0,
                                               kSceneBuffers, bindings.data()};
  vk_.make(vk_.CreateDescriptorSetLayout, vk_.DestroyDescriptorSetLayout, layout, sceneLayout_,
           "vkCreateDescriptorSetLayout");
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, kSceneBuffers};
  const VkDescriptorPoolCreateInfo poolInfo{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, nullptr, 0, 1, 1, &size};
  VkDescriptorPool pool = VK_NULL_HANDLE;
  vk_.make(vk_.CreateDescriptorPool, vk_.DestroyDescriptorPool, poolInfo, pool, "vkCreateDescriptorPool");
  const VkDescriptorSetAllocateInfo one{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, nullptr, pool, 1,
                                        &sceneLayout_};
  vk_.need(vk_.AllocateDescriptorSets(vk_.device, &one, &sceneSet_), "vkAllocateDescriptorSets");
  for (std::uint32_t i = 0; i < kSceneBuffers; ++i) {
    const VkDescriptorBufferInfo buffer{buffers[i], 0, VK_WHOLE_SIZE};
    VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, nullptr, sceneSet_, i, 0, 1, {}, {}, {}, {}};
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = &buffer;
    vk_.UpdateDescriptorSets(vk_.device, 1, &write, 0, nullptr);
  }
}

// Relume's bindings are set 0, the scene is set 1.
Renderer::Pass Renderer::makePass(std::span<const std::uint32_t> spirv, VkDescriptorSetLayout relume) {
  Pass pass;
  const std::array<VkDescriptorSetLayout, 2> sets{relume, sceneLayout_};
  const VkPushConstantRange constants{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(FrameConstants)};
  const VkPipelineLayoutCreateInfo layout{
      VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, nullptr, 0, 2, sets.data(), 1, &constants};
  vk_.make(vk_.CreatePipelineLayout, vk_.DestroyPipelineLayout, layout, pass.layout, "vkCreatePipelineLayout");
  pass.pipeline = vk_.makeComputePipeline(spirv, pass.layout, nullptr);
  return pass;
}

void Renderer::run(const Pass& pass, VkDescriptorSet relume, const Level& level, std::uint32_t width,
                   std::uint32_t height, bool indirect, std::uint32_t groupsX, std::uint32_t groupsY) {
  const FrameConstants frame{level.worldFromCamera, glm::vec4(level.sun.direction, std::tan(0.5f * level.fovYRad)),
                             glm::vec4(level.sun.intensity, static_cast<float>(width)),
                             glm::vec4(level.lamp.positionWorld, static_cast<float>(height)),
                             glm::vec4(level.lamp.intensity, indirect ? 1.0f : 0.0f)};
  const std::array<VkDescriptorSet, 2> sets{relume, sceneSet_};
  vk_.CmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, pass.pipeline);
  vk_.CmdBindDescriptorSets(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, pass.layout, 0, 2, sets.data(), 0, nullptr);
  vk_.CmdPushConstants(commands_, pass.layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof frame, &frame);
  vk_.CmdDispatch(commands_, groupsX, groupsY, 1);
}

// A game waits for a fence some frames later; here the picture is wanted at once.
relume::Status Renderer::relight(const Level& level) {
  relume::LightSetup setup;
  setup.surfelIrradianceOnGpu = true;
  const relume::Result<relume::GpuFrame> frame = passes_.frame(setup);
  if (!frame) return frame.error();
  vk_.begin(commands_);
  run(surfels_, executor_.surfelSet(), level, 0, 0, false, (passes_.surfelSlots() + 63) / 64, 1);
  executor_.record(commands_, *frame);
  vk_.submitAndWait(commands_);
  return relume::done();
}

std::vector<unsigned char> Renderer::draw(const Level& level, std::uint32_t width, std::uint32_t height,
                                          bool indirect) {
  width = std::min<std::uint32_t>(width, 960);
  height = std::min<std::uint32_t>(height, 540);
  vk_.begin(commands_);
  run(picture_, executor_.resolveSet(), level, width, height, indirect, (width + 7) / 8, (height + 7) / 8);
  const VkMemoryBarrier toHost{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_SHADER_WRITE_BIT,
                               VK_ACCESS_HOST_READ_BIT};
  vk_.CmdPipelineBarrier(commands_, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &toHost, 0,
                         nullptr, 0, nullptr);
  vk_.submitAndWait(commands_);
  const auto* rgba = reinterpret_cast<const unsigned char*>(pixels_);
  return {rgba, rgba + std::size_t{4} * width * height};
}
