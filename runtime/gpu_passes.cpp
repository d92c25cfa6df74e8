// SPDX-License-Identifier: MIT
// See relume/gpu_passes.h: checks what comes in, and shows the plan of a level's passes.
#include "relume/gpu_passes.h"

#include "formats/sh.h"
#include "runtime/check_options.h"
#include "runtime/check_setup.h"
#include "runtime/passes/frame_plan.h"
#include "runtime/passes/spirv.h"
#include "runtime/shared/memory.h"
#include "runtime/shared/resolve_defines.h"
#include "runtime/shared/shader_text.h"
#include "runtime/shared/usage_error.h"

#include <algorithm>
#include <string>
#include <utility>

namespace relume {

struct GpuPasses::State {
  explicit State(std::pmr::memory_resource* host) : memory(host), imageSizes(&memory), lights(&memory) {}

  AlignedMemory memory;  // of all that follows
  CacheBands bands;
  ImageSizes imageSizes;
  std::size_t surfelCount = 0, skyPatchCount = 0;
  std::uint32_t movingParts = 0;  // of a frame, at most
  Emitters emitters;              // shares the bake's arrays
  GpuDevice device;
  Owned<gpu::FramePlan> plan;
  std::vector<GpuProgram> programs;
  std::string resolveGlsl;
  std::pmr::vector<Light> lights;  // this frame's, with directions of length 1
};

namespace {

Status checkLimits(const GpuDevice& device) {
  const std::pair<const char*, std::size_t> least[] = {{"storageBytes", device.storageBytes},
                                                       {"storageAlignment", device.storageAlignment},
                                                       {"imageSide", device.imageSide},
                                                       {"volumeSide", device.volumeSide},
                                                       {"groups", device.groups}};
  for (const auto& [name, value] : least) {
    if (value == 0) return usageError(std::string("GpuDevice::") + name + " is 0, expected a limit of the device");
  }
  if ((device.storageAlignment & (device.storageAlignment - 1)) != 0) {
    return usageError("GpuDevice::storageAlignment is " + std::to_string(device.storageAlignment) +
                      ", expected a power of 2");
  }
  return done();
}

GpuProgram describe(const gpu::ProgramSource& source) {
  GpuProgram program;
  program.name = gpu::spirvKey(source);
  program.parameterBytes = source.parameterBytes();
  for (const gpu::ProgramConstant& each : source.constants) program.constants.push_back({each.id, each.value});
  const std::span<const gpu::EmbeddedSpirv> all = gpu::embeddedSpirv();
  const auto found = std::lower_bound(all.begin(), all.end(), program.name,
                                      [](const gpu::EmbeddedSpirv& a, const std::string& key) { return a.key < key; });
  if (found != all.end() && found->key == program.name) program.spirv = found->words;
  return program;
}

// Their buffer does not grow.
Status checkMovingShapes(const LightSetup& setup, const GpuDevice& device) {
  if (setup.movingParts.empty() || setup.movingShapes->bytes() <= device.movingShapeBytes) return done();
  return usageError("light setup: movingShapes has " + std::to_string(setup.movingShapes->count()) + " shapes of " +
                    std::to_string(setup.movingShapes->bytes()) + " bytes, expected at most the " +
                    std::to_string(device.movingShapeBytes) + " of GpuDevice::movingShapeBytes");
}

constexpr std::pair<const char*, const char*> kForVulkan{"RELUME_VULKAN", "1"};

Result<std::string> resolveText(const CacheBands& bands, bool gridTexture) {
  auto defines = resolveDefines(bands, gridTexture);
  defines.emplace_back(kForVulkan);
  return expandShader("resolve.glsl", defines);
}

}  // namespace

Result<std::string> gpuResolveGlsl(const RelightOptions& options, LinkKind kind) try {
  if (options.chromaBands < 1 || options.chromaBands > options.lumaBands || options.lumaBands > kMaxBands) {
    return usageError("lumaBands is " + std::to_string(options.lumaBands) + " and chromaBands " +
                      std::to_string(options.chromaBands) + ", expected 1 to " + std::to_string(kMaxBands) +
                      ", chroma at most luma: no bake is here to recommend them");
  }
  return resolveText({options.lumaBands, options.chromaBands, kind == LinkKind::irradiance, options.glossy},
                     options.gridTexture);
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Result<std::string> gpuSurfelGlsl() try {
  const std::pair<std::string, std::string> define = kForVulkan;
  return expandShader("surfels.glsl", {&define, 1});
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

GpuPasses::GpuPasses(std::unique_ptr<State, Destroy> state) : state_(std::move(state)) {}
GpuPasses::GpuPasses(GpuPasses&&) noexcept = default;
GpuPasses& GpuPasses::operator=(GpuPasses&&) noexcept = default;
GpuPasses::~GpuPasses() = default;

void GpuPasses::Destroy::operator()(State* state) const noexcept {
  std::pmr::memory_resource* host = state->memory.host();
  state->~State();
  host->deallocate(state, sizeof(State), alignof(State));
}

Result<GpuPasses> GpuPasses::create(const Bake& bake, const RelightOptions& options, const GpuDevice& device) try {
  if (Status ok = checkLimits(device); !ok) return ok.error();
  if (!options.visibilityGlsl.empty())
    return usageError("visibilityGlsl is for the OpenGL backend; gpuSurfelGlsl() is for shadows here");
  std::pmr::memory_resource* host = memoryOr(options.memory);
  std::unique_ptr<State, Destroy> state(makeOwned<State>(host, host).release());
  Result<CheckedOptions> checked = checkOptions(bake, options, &state->memory);
  if (!checked) return checked.error();
  state->bands = checked->bands;
  state->imageSizes = std::move(checked->images);
  state->surfelCount = bake.surfels.count();
  state->skyPatchCount = bake.hierarchy.skyDirection.size();
  state->movingParts = options.movingParts;
  state->emitters = bake.emitters;
  state->device = device;
  GridTexture texture(&state->memory);
  if (options.gridTexture) {
    texture = makeGridTexture(PackedCaches(bake.caches, &state->memory),
                              {options.gridTrust, options.gridTextureBytes, device.volumeSide}, options.parallelFor,
                              &state->memory);
    if (texture.bytes() > device.storageBytes) texture = GridTexture(&state->memory);
  }
  Result<Owned<gpu::FramePlan>> plan =
      gpu::FramePlan::create(checked->bake, texture, state->bands, state->imageSizes, device, &state->memory,
                             options.movingParts, options.movingLag);
  if (!plan) return plan.error();
  state->plan = std::move(*plan);
  for (const gpu::ProgramSource& source : state->plan->programs()) state->programs.push_back(describe(source));
  Result<std::string> resolve = resolveText(state->bands, !texture.empty());
  if (!resolve) return resolve.error();
  state->resolveGlsl = std::move(*resolve);
  return GpuPasses(std::move(state));
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Status GpuPasses::checkDevice(const GpuDevice& device) const {
  if (Status ok = checkLimits(device); !ok) return ok;
  const Error other{ErrorCode::unsupported, "GpuPasses are for a device of other limits: make them with gpuDeviceOf()"};
  if (state_->device.groups > device.groups || state_->plan->sharedBytes() > device.sharedBytes) return other;
  for (const GpuBindingSet& set : bindingSets()) {
    for (const GpuBinding& each : set.bindings) {
      if (each.kind != GpuBindingKind::storageBuffer) continue;
      const std::size_t bytes = each.bytes != 0 ? each.bytes : buffers()[each.resource].bytes;
      if (bytes > device.storageBytes || each.offset % device.storageAlignment != 0) return other;
    }
  }
  for (const GpuImage& each : images()) {
    const glm::uvec3 size = levelSize(each, 0);
    if (std::max({size.x, size.y, size.z}) >
        (each.shape == TextureShape::volume ? device.volumeSide : device.imageSide))
      return other;
  }
  return done();
}

std::span<const GpuBuffer> GpuPasses::buffers() const { return state_->plan->buffers(); }
std::span<const GpuImage> GpuPasses::images() const { return state_->plan->images(); }
std::span<const GpuProgram> GpuPasses::programs() const { return state_->programs; }
std::span<const GpuBindingSet> GpuPasses::bindingSets() const { return state_->plan->bindingSets(); }

Result<std::string> GpuPasses::programGlsl(std::size_t i) const try {
  if (i >= state_->programs.size()) {
    return Error{ErrorCode::failed,
                 "there is no program " + std::to_string(i) + ", there are " + std::to_string(state_->programs.size())};
  }
  return gpu::vulkanGlsl(state_->plan->programs()[i]);
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

void GpuPasses::forgetContents() { state_->plan->forgetContents(); }

Result<GpuFrame> GpuPasses::frame(const LightSetup& setup) try {
  const GpuDevice& device = state_->device;
  if (Status ok = checkSetup(setup, state_->surfelCount, state_->skyPatchCount); !ok) return ok.error();
  if (Status ok = checkEmissions(setup, state_->emitters, state_->imageSizes, BackendKind::cpu); !ok) return ok.error();
  if (Status ok = checkMovingParts(setup, state_->movingParts); !ok) return ok.error();
  if (Status ok = checkMovingShapes(setup, device); !ok) return ok.error();
  if (setup.lights.size() > device.maxLights) {
    return usageError("light setup: " + std::to_string(setup.lights.size()) + " lights, expected at most the " +
                      std::to_string(device.maxLights) + " of GpuDevice::maxLights");
  }
  if (!device.hasSurfelArrays && !(setup.surfelIrradiance.empty() && setup.surfelEmission.empty()))
    return usageError("light setup: surfelIrradiance or surfelEmission without GpuDevice::hasSurfelArrays");
  if (!device.hasSurfelShader && setup.surfelIrradianceOnGpu)
    return usageError("light setup: surfelIrradianceOnGpu without GpuDevice::hasSurfelShader");
  normaliseLights(setup.lights, state_->lights);
  LightSetup applied = withoutFunctions(setup);
  applied.lights = state_->lights;
  state_->plan->reserve(applied);
  return state_->plan->frame(applied);
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

void GpuPasses::reset() { state_->plan->reset(); }

const std::string& GpuPasses::resolveGlsl() const { return state_->resolveGlsl; }
std::span<const GpuBinding> GpuPasses::resolveBindings() const { return state_->plan->resolveBindings(); }

std::span<const GpuBinding> GpuPasses::surfelBindings() const {
  return state_->device.hasSurfelShader ? state_->plan->surfelBindings() : std::span<const GpuBinding>();
}

std::uint32_t GpuPasses::surfelSlots() const {
  return state_->device.hasSurfelShader ? state_->plan->surfelSlots() : 0;
}
int GpuPasses::lumaBands() const { return state_->bands.lumaBands; }
int GpuPasses::chromaBands() const { return state_->bands.chromaBands; }

}  // namespace relume
