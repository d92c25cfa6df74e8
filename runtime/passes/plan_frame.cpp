// SPDX-License-Identifier: MIT
// See frame_plan.h: what a frame copies and dispatches, in the order of relighter.h.
#include "runtime/passes/add_dispatch.h"
#include "runtime/passes/pack_lights.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

namespace relume::gpu {
namespace {

using gl::kRelumeNone;

template <class T>
void addUpload(std::pmr::vector<GpuUpload>& uploads, BufferIndex buffer, const std::pmr::vector<T>& elements) {
  if (!elements.empty())
    uploads.push_back({false, buffer, 0, std::as_bytes(std::span(elements.data(), elements.size()))});
}

}  // namespace

// The emission of this frame, where it is not that of the frame before. Returns whether anything writes it.
bool FramePlan::addEmission(const LightSetup& setup, bool waits) {
  const bool drives = !setup.materialEmissions.empty();
  if (!drives && !drove_) return false;
  drove_ = drives;
  everDrove_ = everDrove_ || drives;
  driven_.begin(setup.materialEmissions, {});
  // Light of surfels that is handed over has their baked emission already.
  const glm::vec3 undriven =
      !drives ? glm::vec3(1.0f) : (setup.surfelEmission.empty() ? setup.emissionScale : glm::vec3(0.0f));
  const Emitters& emitters = driven_.emitters();
  const std::size_t before = dispatches_.size();
  const auto add = [&](std::uint32_t set, std::uint32_t first, std::uint32_t end, std::uint32_t by,
                       const glm::vec3& factor, std::uint32_t texture = 0) {
    gl::RelumeDriveParameters parameters{};
    parameters.relumeFactor = factor;
    parameters.relumeDrivenBy = by;
    parameters.relumeEndEntry = end;
    dispatch(GpuPass::emission, set, parameters, &gl::RelumeDriveParameters::relumeFirstEntry, first, end,
             RELUME_SURFEL_GROUP, waits, texture);
    waits = false;
  };
  for (std::uint32_t m = 0; m < emitters.materials.size(); ++m) {
    const DrivableMaterial& material = emitters.materials[m];
    const std::uint32_t first = material.firstEntry, set = driveSets_[m];
    std::uint32_t end = first + material.entryCount;
    const MaterialEmission* emission = driven_.of(m);
    if (emission == nullptr) {
      // The undriven ones behind it as well.
      for (; m + 1 < emitters.materials.size() && driven_.of(m + 1) == nullptr; ++m)
        end += emitters.materials[m + 1].entryCount;
      add(set_.drive, first, end, gl::kRelumeBaked, undriven);
    } else if (emission->image.empty() && emission->texture == 0) {
      add(set_.drive, first, end, gl::kRelumeColor, emission->radiance);
    } else {
      if (emission->texture == 0) {
        const ImagePyramid& image = *driven_.image(m);
        for (std::uint32_t level = 0; level < image.levels(); ++level)
          uploads_.push_back({true, drivenImages_[m], level, std::as_bytes(image.texels(level))});
      }
      add(set, first, end, gl::kRelumeImage, emission->radiance, emission->texture);
    }
  }
  return dispatches_.size() > before;
}

// Step 2, first half: what tilted and gridded surfels receive.
bool FramePlan::addBounce(bool waits) {
  const auto add = [&](std::uint32_t set, std::uint32_t first, std::uint32_t end) {
    if (first == end) return;
    gl::RelumeBounceParameters parameters{};
    parameters.relumeEndSurfel = end;
    dispatch(GpuPass::surfels, set, parameters, &gl::RelumeBounceParameters::relumeFirstSurfel, first, end,
             RELUME_SURFEL_GROUP, waits);
    waits = false;
  };
  add(set_.tilted, flatEnd_, tiltedEnd_);
  add(set_.gridded, tiltedEnd_, surfelEnd_);
  return surfelEnd_ > flatEnd_;
}

// Step 2, second half. bounces: whether last frame's light may be read.
void FramePlan::addSurfels(const LightSetup& setup, bool bounces, bool waits) {
  packLights(setup.lights, lights_);
  addUpload(uploads_, kLights, lights_);
  // What the host hands over, one after the other: a colour a surfel and a colour a patch, in their order here.
  host_.clear();
  const auto append = [this](std::span<const glm::vec3> colors, std::span<const std::uint32_t> order) {
    if (colors.empty()) return std::uint32_t{kRelumeNone};
    const auto offset = static_cast<std::uint32_t>(host_.size());
    for (const std::uint32_t i : order) host_.emplace_back(i == kRelumeNone ? glm::vec3(0.0f) : colors[i], 0.0f);
    return offset;
  };
  gl::RelumeSurfelParameters parameters{};
  parameters.relumeHostOffset.x = append(setup.surfelIrradiance, surfelOrder_);
  parameters.relumeHostOffset.y = append(setup.surfelEmission, surfelOrder_);
  parameters.relumeHostOffset.z = append(setup.skyPatches, skyOrder_);
  addUpload(uploads_, kHost, host_);

  const bool drives = !setup.materialEmissions.empty();
  parameters.relumeLitOnGpu = setup.surfelIrradianceOnGpu ? 1 : 0;
  parameters.relumeEmits = emits_ && (drives || setup.surfelEmission.empty()) ? 1 : 0;
  parameters.relumeBoxOrigin = surfelBox_.origin;
  parameters.relumeBoxStep = surfelBox_.step_;
  parameters.relumeSurfelRadius = surfelBox_.radius;
  parameters.relumeFlatEnd = flatEnd_;
  const Lightmap& map = bake_.caches.lightmap;
  parameters.relumeMapSize = map.cache.empty() ? glm::uvec2(1u) : glm::uvec2(map.width, map.height);
  parameters.relumeSurfelEnd = surfelEnd_;
  parameters.relumeSenderEnd = senderEnd_;
  parameters.relumeLightCount = static_cast<std::uint32_t>(lights_.size());
  parameters.relumeEmissionScale = drives ? glm::vec3(1.0f) : setup.emissionScale;
  parameters.relumeSkyRadiance = setup.skyRadiance;
  parameters.relumeBounceScale = bounces ? setup.bounceScale : 0.0f;
  GpuDispatch& added = dispatches_.emplace_back();
  hostTextures_.push_back(0);
  added.pass = GpuPass::surfels;
  added.waits = waits;
  added.bindingSet = set_.surfels;
  added.groups = senderEnd_ / RELUME_SURFEL_GROUP;
  std::memcpy(added.parameters.data(), &parameters, sizeof parameters);
}

// Step 3.
void FramePlan::addPull() {
  gl::RelumePullParameters parameters{};
  dispatch(GpuPass::pull, set_.pull, parameters, &gl::RelumePullParameters::relumeFirst, 0, pullGroupCount_, 1, true);
  if (pullRoundCount_ == 0) return;
  // The top's rounds come after the groups' beginnings, which are one more than groups.
  const std::uint32_t first = pullGroupCount_ + 1;
  parameters.relumeEndRound = first + pullRoundCount_;
  dispatch(GpuPass::pull, set_.pullTop, parameters, &gl::RelumePullParameters::relumeFirst, first, first + 1, 1, true);
}

// Steps 4 and 5. moves: parts have changed what caches receive.
void FramePlan::addCaches(bool moves) {
  bool waits = true;
  for (const Batch& batch : batches_) {
    const LinkBatch& links = batch.links;
    const bool map = links.firstCache >= firstMapCache_;
    auto parameters = batchParameters<gl::RelumeCacheParameters>(links);
    parameters.relumeGridLinks = shapedLinks_;
    parameters.relumeFirstMapCache = firstMapCache_;
    parameters.relumeMapWidth = bake_.caches.lightmap.width;
    dispatch(GpuPass::caches, moves ? batch.movingSet : batch.set, parameters,
             &gl::RelumeCacheParameters::relumeFirstCache, links.firstCache, links.endCache,
             map ? mapCachesPerGroup_ : gridCachesPerGroup_, waits);
    waits = false;
  }
}

// Step 5a.
void FramePlan::addFill(bool waits) {
  if (!gridImages_) return;
  gl::RelumeFillParameters parameters{};
  parameters.relumeResolution = textureResolution_;
  parameters.relumeEnd = vectorCaches_;
  dispatch(GpuPass::gridTexture, set_.vectors, parameters, &gl::RelumeFillParameters::relumeFirst, 0, vectorCaches_,
           RELUME_FILL_GROUP, waits);
  parameters.relumeEnd = texelCount_;
  dispatch(GpuPass::gridTexture, set_.texels, parameters, &gl::RelumeFillParameters::relumeFirst, 0, texelCount_,
           RELUME_FILL_GROUP, true);
}

Status FramePlan::checkHost(const LightSetup& setup) const {
  const auto of = [](std::span<const glm::vec3> handed, std::uint32_t slots) {
    return handed.empty() ? std::size_t{0} : std::size_t{slots};
  };
  const std::size_t colors = of(setup.surfelIrradiance, surfelEnd_) + of(setup.surfelEmission, surfelEnd_) +
                             of(setup.skyPatches, senderEnd_ - surfelEnd_);
  for (const auto& [what, bytes] : {std::pair("lights", setup.lights.size() * sizeof(gl::RelumeLight)),
                                    std::pair("colours of surfels and sky", colors * sizeof(glm::vec4))}) {
    if (bytes > device_.storageBytes)
      return Error{ErrorCode::unsupported, "light setup: its " + std::string(what) + " take " + std::to_string(bytes) +
                                               " bytes, this device binds at most " +
                                               std::to_string(device_.storageBytes)};
  }
  return done();
}

void FramePlan::reserve(const LightSetup& setup) {
  reserveMoving(setup);
  lights_.reserve(setup.lights.size());
  const bool irradiance = !setup.surfelIrradiance.empty(), emission = !setup.surfelEmission.empty();
  if ((irradiance || emission) && surfelOrder_.empty()) surfelOrder_ = orderSurfels(bake_, bands_.lumaBands, memory_);
  host_.reserve((irradiance ? surfelOrder_.size() : 0) + (emission ? surfelOrder_.size() : 0) +
                (setup.skyPatches.empty() ? 0 : skyOrder_.size()));
}

GpuFrame FramePlan::frame(const LightSetup& setup) {
  uploads_.clear();
  dispatches_.clear();
  hostTextures_.clear();
  // The first dispatch waits for what the host's shader has written.
  bool waits = setup.surfelIrradianceOnGpu;
  if (addEmission(setup, waits)) waits = true;
  const bool bounces = lit_ && setup.bounceScale > 0.0f;
  if (bounces && addBounce(waits)) waits = true;
  addSurfels(setup, bounces, waits);
  addPull();
  addCaches(addMoving(setup, bounces));
  addFill(true);
  lit_ = true;
  return {uploads_, dispatches_};
}

GpuFrame FramePlan::fill() {
  uploads_.clear();
  dispatches_.clear();
  hostTextures_.clear();
  addFill(false);
  return {uploads_, dispatches_};
}

}  // namespace relume::gpu
