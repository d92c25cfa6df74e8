// SPDX-License-Identifier: MIT
// See vulkan_host.h.
#include "tests/vulkan/vulkan_host.h"

#include <gtest/gtest.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>

namespace relume::test {
namespace {

std::atomic<int> created = 0, freed = 0, callsToFailure = -1;

// Whether this call is the one to fail.
bool fails() {
  const int n = callsToFailure.load();
  if (n < 0) return false;
  callsToFailure = n - 1;
  return n == 0;
}

// Functions that make and destroy one object, which all have these parameters but for pipelines.
// clang-format off
#define RELUME_MADE(X) \
  X(CreateBuffer) X(CreateCommandPool) X(CreateDescriptorPool) X(CreateDescriptorSetLayout) X(CreateImage) \
  X(CreateImageView) X(CreatePipelineLayout) X(CreateSampler) X(CreateShaderModule) X(AllocateMemory)
#define RELUME_DESTROYED(X) \
  X(DestroyBuffer) X(DestroyCommandPool) X(DestroyDescriptorPool) X(DestroyDescriptorSetLayout) X(DestroyImage) \
  X(DestroyImageView) X(DestroyPipeline) X(DestroyPipelineLayout) X(DestroySampler) X(DestroyShaderModule) X(FreeMemory)
// clang-format on

#define RELUME_COUNT_MADE(name)                                        \
  template <class... Arguments>                                        \
  VKAPI_ATTR VkResult VKAPI_CALL count##name(Arguments... arguments) { \
    if (fails()) return VK_ERROR_OUT_OF_DEVICE_MEMORY;                 \
    const VkResult result = vk##name(arguments...);                    \
    created += result == VK_SUCCESS ? 1 : 0;                           \
    return result;                                                     \
  }
RELUME_MADE(RELUME_COUNT_MADE)
RELUME_COUNT_MADE(CreateComputePipelines)
#define RELUME_COUNT_DESTROYED(name)                                                                            \
  template <class Handle>                                                                                       \
  VKAPI_ATTR void VKAPI_CALL count##name(VkDevice device, Handle handle, const VkAllocationCallbacks* memory) { \
    freed += handle != VK_NULL_HANDLE ? 1 : 0;                                                                  \
    vk##name(device, handle, memory);                                                                           \
  }
RELUME_DESTROYED(RELUME_COUNT_DESTROYED)

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL instanceFunction(VkInstance instance, const char* name) {
#define RELUME_RETURN(function)                            \
  if (std::strcmp(name, "vk" #function) == 0) {            \
    const PFN_vk##function counting = count##function;     \
    return reinterpret_cast<PFN_vkVoidFunction>(counting); \
  }
  RELUME_MADE(RELUME_RETURN)
  RELUME_RETURN(CreateComputePipelines)
  RELUME_DESTROYED(RELUME_RETURN)
  return vkGetInstanceProcAddr(instance, name);
}

constexpr const char* kLayer = "VK_LAYER_KHRONOS_validation";

bool hasLayer() {
  std::uint32_t count = 0;
  vkEnumerateInstanceLayerProperties(&count, nullptr);
  std::vector<VkLayerProperties> layers(count);
  vkEnumerateInstanceLayerProperties(&count, layers.data());
  for (const VkLayerProperties& each : layers) {
    if (std::strcmp(each.layerName, kLayer) == 0) return true;
  }
  return false;
}

// Whether the layer looks at barriers, too.
bool seesHazards() {
  std::uint32_t count = 0;
  vkEnumerateInstanceExtensionProperties(kLayer, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateInstanceExtensionProperties(kLayer, &count, extensions.data());
  return std::any_of(extensions.begin(), extensions.end(), [](const VkExtensionProperties& each) {
    return std::strcmp(each.extensionName, VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME) == 0;
  });
}

VKAPI_ATTR VkBool32 VKAPI_CALL complain(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                        const VkDebugUtilsMessengerCallbackDataEXT* data, void* complaints) {
  static_cast<std::vector<std::string>*>(complaints)->push_back(data->pMessage);
  return VK_FALSE;
}

void need(VkResult result, const char* what) {
  if (result != VK_SUCCESS) ADD_FAILURE() << what << " returned " << result;
}

// Objects of a test's own, which are not counted and die with this, the last ones first.
class Objects {
 public:
  explicit Objects(const VulkanDevice& vulkan) : vulkan_(vulkan) {}
  Objects(const Objects&) = delete;
  Objects& operator=(const Objects&) = delete;
  ~Objects() {
    for (; !ends_.empty(); ends_.pop_back()) ends_.back()();
  }

  template <class Create, class Destroy, class Info, class Handle>
  void make(Create create, Destroy destroy, const Info& info, Handle& handle) {
    need(create(vulkan_.device, &info, nullptr, &handle), "a function that makes an object");
    ends_.push_back([this, destroy, handle] { destroy(vulkan_.device, handle, nullptr); });
  }
  // Bytes of a storage buffer that the processor sees.
  std::byte* makeBuffer(std::size_t bytes, VkBuffer& buffer) {
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size = bytes;
    info.usage =
        VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    make(vkCreateBuffer, vkDestroyBuffer, info, buffer);
    VkMemoryRequirements needs{};
    vkGetBufferMemoryRequirements(vulkan_.device, buffer, &needs);
    VkPhysicalDeviceMemoryProperties memories{};
    vkGetPhysicalDeviceMemoryProperties(vulkan_.physicalDevice, &memories);
    const VkMemoryPropertyFlags kind = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    VkMemoryAllocateInfo taken{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, nullptr, needs.size, 0};
    while ((memories.memoryTypes[taken.memoryTypeIndex].propertyFlags & kind) != kind ||
           (needs.memoryTypeBits >> taken.memoryTypeIndex & 1u) == 0)
      ++taken.memoryTypeIndex;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    make(vkAllocateMemory, vkFreeMemory, taken, memory);
    need(vkBindBufferMemory(vulkan_.device, buffer, memory, 0), "vkBindBufferMemory");
    void* mapped = nullptr;
    need(vkMapMemory(vulkan_.device, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
    return static_cast<std::byte*>(mapped);
  }
  VkPipeline makePipeline(std::span<const std::uint32_t> spirv, VkPipelineLayout layout) {
    const VkShaderModuleCreateInfo code{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, nullptr, 0, spirv.size_bytes(),
                                        spirv.data()};
    VkComputePipelineCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    info.layout = layout;
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.pName = "main";
    make(vkCreateShaderModule, vkDestroyShaderModule, code, info.stage.module);
    VkPipeline pipeline = VK_NULL_HANDLE;
    const auto create = [](VkDevice device, const auto* one, auto memory, VkPipeline* made) {
      return vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, one, memory, made);
    };
    make(create, vkDestroyPipeline, info, pipeline);
    return pipeline;
  }

 private:
  const VulkanDevice vulkan_;
  std::vector<std::function<void()>> ends_;
};

}  // namespace

int VulkanHost::objectsMade() { return created; }
int VulkanHost::objectsDestroyed() { return freed; }
void VulkanHost::failAt(int n) { callsToFailure = n; }

std::unique_ptr<VulkanHost> VulkanHost::open(std::string& why, bool validates) {
  std::unique_ptr<VulkanHost> host(new VulkanHost);
  VkApplicationInfo application{};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.apiVersion = VK_API_VERSION_1_1;
  VkInstanceCreateInfo instance{};
  instance.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  instance.pApplicationInfo = &application;
  const std::array<const char*, 2> extensions{VK_EXT_DEBUG_UTILS_EXTENSION_NAME,
                                              VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
  const VkValidationFeatureEnableEXT hazards = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  VkValidationFeaturesEXT features{};
  features.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
  features.enabledValidationFeatureCount = 1;
  features.pEnabledValidationFeatures = &hazards;
  validates = validates && hasLayer();
  if (validates) {
    instance.enabledLayerCount = 1;
    instance.ppEnabledLayerNames = &kLayer;
    instance.enabledExtensionCount = seesHazards() ? 2 : 1;
    instance.ppEnabledExtensionNames = extensions.data();
    if (seesHazards()) instance.pNext = &features;
  }
  // One instance stays, and with it the drivers: leak checkers cannot tell whose memory one that is unloaded has left.
  static VkInstance kept = VK_NULL_HANDLE;
  if (!kept) vkCreateInstance(&instance, nullptr, &kept);
  if (vkCreateInstance(&instance, nullptr, &host->instance_) != VK_SUCCESS) return why = "no Vulkan driver", nullptr;
  if (validates) {
    VkDebugUtilsMessengerCreateInfoEXT messenger{};
    messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    messenger.pfnUserCallback = complain;
    messenger.pUserData = &host->complaints_;
    const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(host->instance_, "vkCreateDebugUtilsMessengerEXT"));
    if (create) create(host->instance_, &messenger, nullptr, &host->messenger_);
  }
  std::uint32_t count = 0;
  vkEnumeratePhysicalDevices(host->instance_, &count, nullptr);
  std::vector<VkPhysicalDevice> devices(count);
  vkEnumeratePhysicalDevices(host->instance_, &count, devices.data());
  for (const VkPhysicalDevice each : devices) {
    VkPhysicalDeviceProperties properties{};
    vkGetPhysicalDeviceProperties(each, &properties);
    std::uint32_t families = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(each, &families, nullptr);
    std::vector<VkQueueFamilyProperties> family(families);
    vkGetPhysicalDeviceQueueFamilyProperties(each, &families, family.data());
    for (std::uint32_t f = 0; f < families; ++f) {
      if (!(family[f].queueFlags & VK_QUEUE_COMPUTE_BIT) || properties.apiVersion < VK_API_VERSION_1_1) continue;
      const float priority = 1.0f;
      const VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, nullptr, 0, f, 1, &priority};
      VkPhysicalDeviceFeatures has{}, wanted{};
      vkGetPhysicalDeviceFeatures(each, &has);
      wanted.shaderStorageImageExtendedFormats = has.shaderStorageImageExtendedFormats;
      VkDeviceCreateInfo info{};
      info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
      info.queueCreateInfoCount = 1;
      info.pQueueCreateInfos = &queue;
      info.pEnabledFeatures = &wanted;
      VkDevice device = VK_NULL_HANDLE;
      if (vkCreateDevice(each, &info, nullptr, &device) != VK_SUCCESS) continue;
      host->device_ = {instanceFunction, host->instance_, each, device};
      vkGetDeviceQueue(device, f, 0, &host->queue_);
      host->name_ = properties.deviceName;
      const VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr, 0, f};
      need(vkCreateCommandPool(device, &pool, nullptr, &host->pool_), "vkCreateCommandPool");
      return host;
    }
  }
  return why = "no Vulkan 1.1 device with compute among " + std::to_string(count), nullptr;
}

VulkanHost::~VulkanHost() {
  if (device_.device) {
    vkDestroyCommandPool(device_.device, pool_, nullptr);
    vkDestroyDevice(device_.device, nullptr);
  }
  if (messenger_) {
    reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"))(instance_, messenger_, nullptr);
  }
  if (instance_) vkDestroyInstance(instance_, nullptr);
}

void VulkanHost::run(const std::function<void(VkCommandBuffer)>& record) {
  const VkCommandBufferAllocateInfo one{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, nullptr, pool_,
                                        VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
  VkCommandBuffer commands = VK_NULL_HANDLE;
  need(vkAllocateCommandBuffers(device_.device, &one, &commands), "vkAllocateCommandBuffers");
  const VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr, 0, nullptr};
  need(vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
  record(commands);
  need(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
  VkSubmitInfo submit{};
  submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands;
  need(vkQueueSubmit(queue_, 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit");
  need(vkQueueWaitIdle(queue_), "vkQueueWaitIdle");
  vkFreeCommandBuffers(device_.device, pool_, 1, &commands);
}

std::vector<std::byte> VulkanHost::read(VkBuffer buffer, std::size_t bytes) {
  Objects objects(device_);
  VkBuffer to = VK_NULL_HANDLE;
  const std::byte* begin = objects.makeBuffer(bytes, to);
  run([&](VkCommandBuffer commands) {
    const VkBufferCopy copy{0, 0, bytes};
    vkCmdCopyBuffer(commands, buffer, to, 1, &copy);
  });
  return {begin, begin + bytes};
}

std::vector<std::byte> VulkanHost::read(VkImage image, const GpuImage& shape) {
  Objects objects(device_);
  VkBuffer to = VK_NULL_HANDLE;
  const glm::uvec3 size = levelSize(shape, 0);
  const std::size_t bytes = texelBytes(shape.format) * size.x * size.y * size.z * layersOf(shape);
  const std::byte* begin = objects.makeBuffer(bytes, to);
  run([&](VkCommandBuffer commands) {
    const VkImageSubresourceLayers layers{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, layersOf(shape)};
    const VkBufferImageCopy copy{0, 0, 0, layers, {0, 0, 0}, {size.x, size.y, size.z}};
    vkCmdCopyImageToBuffer(commands, image, VK_IMAGE_LAYOUT_GENERAL, to, 1, &copy);
  });
  return {begin, begin + bytes};
}

std::vector<float> VulkanHost::compute(const std::string& text, const std::string& body, VkDescriptorSetLayout layout,
                                       VkDescriptorSet set, const std::vector<float>& in, std::size_t threads,
                                       std::size_t outFloats) {
  const std::vector<std::uint32_t> spirv =
      compileCompute("#version 450\n" + text +
                     "layout(local_size_x = 64) in;\n"
                     "layout(std430, set = 1, binding = 0) readonly buffer InData { float inData[]; };\n"
                     "layout(std430, set = 1, binding = 1) writeonly buffer OutData { float outData[]; };\n"
                     "void main() { uint i = gl_GlobalInvocationID.x; if (i >= " +
                     std::to_string(threads) + "u) return; " + body + "}\n");
  if (spirv.empty()) return {};
  Objects objects(device_);
  std::array<VkBuffer, 2> buffers{};
  const std::size_t inBytes = std::max<std::size_t>(in.size() * sizeof(float), 16),
                    outBytes = outFloats * sizeof(float);
  std::memcpy(objects.makeBuffer(inBytes, buffers[0]), in.data(), in.size() * sizeof(float));
  objects.makeBuffer(outBytes, buffers[1]);

  std::array<VkDescriptorSetLayoutBinding, 2> bindings{};
  for (std::uint32_t i = 0; i < 2; ++i)
    bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  const VkDescriptorSetLayoutCreateInfo own{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, nullptr, 0, 2,
                                            bindings.data()};
  std::array<VkDescriptorSetLayout, 2> layouts{layout, VK_NULL_HANDLE};
  objects.make(vkCreateDescriptorSetLayout, vkDestroyDescriptorSetLayout, own, layouts[1]);
  const VkPipelineLayoutCreateInfo both{
      VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, nullptr, 0, 2, layouts.data(), 0, nullptr};
  VkPipelineLayout pipelineLayout = VK_NULL_HANDLE;
  objects.make(vkCreatePipelineLayout, vkDestroyPipelineLayout, both, pipelineLayout);
  const VkPipeline pipeline = objects.makePipeline(spirv, pipelineLayout);
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2};
  const VkDescriptorPoolCreateInfo poolInfo{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, nullptr, 0, 1, 1, &size};
  VkDescriptorPool pool = VK_NULL_HANDLE;
  objects.make(vkCreateDescriptorPool, vkDestroyDescriptorPool, poolInfo, pool);
  const VkDescriptorSetAllocateInfo one{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, nullptr, pool, 1, &layouts[1]};
  std::array<VkDescriptorSet, 2> sets{set, VK_NULL_HANDLE};
  need(vkAllocateDescriptorSets(device_.device, &one, &sets[1]), "vkAllocateDescriptorSets");
  for (std::uint32_t i = 0; i < 2; ++i) {
    const VkDescriptorBufferInfo buffer{buffers[i], 0, VK_WHOLE_SIZE};
    VkWriteDescriptorSet write{};
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstSet = sets[1];
    write.dstBinding = i;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = &buffer;
    vkUpdateDescriptorSets(device_.device, 1, &write, 0, nullptr);
  }
  run([&](VkCommandBuffer commands) {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelineLayout, 0, 2, sets.data(), 0, nullptr);
    vkCmdDispatch(commands, static_cast<std::uint32_t>((threads + 63) / 64), 1, 1);
    const VkMemoryBarrier all{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                              VK_ACCESS_MEMORY_READ_BIT};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1, &all,
                         0, nullptr, 0, nullptr);
  });
  const std::vector<std::byte> bytes = read(buffers[1], outBytes);
  std::vector<float> out(outFloats);
  std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

std::vector<std::uint32_t> compileCompute(const std::string& glsl) {
  namespace fs = std::filesystem;
  static std::map<std::string, std::vector<std::uint32_t>> known;
  if (const auto found = known.find(glsl); found != known.end()) return found->second;
  const fs::path folder = fs::temp_directory_path() / ("relume_vulkan_" + std::to_string(std::random_device{}()));
  fs::create_directories(folder);
  std::ofstream(folder / "shader.comp") << glsl;
  const std::string command = std::string(RELUME_GLSLANG) + " --target-env vulkan1.1 -o " +
                              (folder / "shader.spv").string() + " " + (folder / "shader.comp").string() +
                              " >/dev/null";
  std::vector<std::uint32_t> words;
  if (std::system(command.c_str()) == 0) {
    std::ifstream in(folder / "shader.spv", std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    words.resize(bytes.size() / 4);
    std::memcpy(words.data(), bytes.data(), words.size() * 4);
  }
  fs::remove_all(folder);
  return known[glsl] = words;
}

}  // namespace relume::test
