// SPDX-License-Identifier: MIT
// See frame_plan.h: what moving parts add to a plan, and to the frames that have some. Other frames run what they would
// run without.
#include "runtime/passes/add_dispatch.h"
#include "runtime/passes/pack_moving.h"

#include <array>
#include <span>
#include <string>

namespace relume::gpu {
namespace {

template <class T>
std::span<const std::byte> bytesOf(const std::pmr::vector<T>& array) {
  return std::as_bytes(std::span(array.data(), array.size()));
}

}  // namespace

void FramePlan::makeMovingBuffers(std::uint32_t parts, std::uint32_t lag) {
  moving_.most = parts;
  if (parts == 0) return;
  moving_.turns.emplace(bake_.caches, lag, memory_);
  SenderWords senders = packSenderPoints(bake_, memory_);
  moving_.points = senders.points;
  moving_.places = senders.places;
  moving_.firstLight = RELUME_CHANGE_WORDS * bake_.caches.count();
  moving_.firstView = moving_.firstLight + 2 * parts * (1 + kMaxShapePatches);
  moving_.sphere.reserve(parts);
  moving_.part.reserve(parts);
  moving_.shapeWord.reserve(1);
  // Buffers of a grid's texture that is not there come before.
  for (const BufferIndex each : {kGridFactors, kGridShares, kGridVectors}) {
    if (buffers_.size() <= each) addBuffer(each, "none", GpuUse::constant, {});
  }
  addBuffer(kSenderPoints, "places on senders", GpuUse::constant, keep(std::move(senders.word)));
  addBuffer(kMovingParts, "moving parts", GpuUse::frame, {}, parts * sizeof(gl::RelumePart));
  addBuffer(kMovingShapes, "moving shapes", GpuUse::frame, {}, device_.movingShapeBytes);
  // A mean a part, and as many patches as a shape may have.
  addBuffer(kMovingLight, "light of moving parts", GpuUse::light, {},
            (moving_.firstView + 2 * std::size_t{parts} * kViews) * sizeof(glm::vec4));
}

Status FramePlan::checkShapes(const LightSetup& setup) const {
  if (setup.movingParts.empty() || moving_.shapes == setup.movingShapes->id()) return done();
  // No shape is larger there than here.
  const std::size_t bytes = setup.movingShapes->bytes();
  if (bytes <= device_.storageBytes) return done();
  return Error{ErrorCode::unsupported, "light setup: movingShapes has " + std::to_string(setup.movingShapes->count()) +
                                           " shapes of " + std::to_string(bytes) +
                                           " bytes, this device binds at most " + std::to_string(device_.storageBytes)};
}

void FramePlan::reserveMoving(const LightSetup& setup) {
  if (setup.movingParts.empty() || moving_.shapes == setup.movingShapes->id()) return;
  // Until they are packed, there are none.
  moving_.shapes = 0;
  packShapes(*setup.movingShapes, moving_.shapeWord, moving_.firstWord);
  moving_.shapes = setup.movingShapes->id();
  moving_.isPacked = true;
}

// Before the caches: the light of this frame's parts by last frame's grid, and what they hide of each link. Returns
// whether there are some.
bool FramePlan::addMoving(const LightSetup& setup, bool bounces) {
  moving_.part.clear();
  moving_.sphere.clear();
  // Without parts, what is kept of caches is of no use any more.
  if (setup.movingParts.empty()) {
    if (moving_.turns) moving_.turns->forget();
    return false;
  }
  std::uint32_t patches = 0;
  const bool emits = setup.emissionScale != glm::vec3(0.0f);
  for (const MovingPart& each : setup.movingParts) {
    const MovingShape& shape = setup.movingShapes->shape(each.shape);
    ShapePlace place;
    if (!placeShape(shape, each.toWorld, emits, place)) continue;
    moving_.part.push_back(packPart(shape, place, moving_.firstWord[each.shape], moving_.most + patches));
    moving_.sphere.push_back(place.sphere);
    patches += static_cast<std::uint32_t>(shape.patch.size());
  }
  if (moving_.part.empty()) {
    moving_.turns->forget();
    return false;
  }
  moving_.turns->begin({moving_.sphere.data(), moving_.sphere.size()});
  for (std::size_t i = 0; i < moving_.part.size(); ++i)
    moving_.part[i].least = moving_.sphere[i].emits ? moving_.turns->leastOfLamps() : kMinCovered;
  if (moving_.isPacked) uploads_.push_back({false, kMovingShapes, 0, bytesOf(moving_.shapeWord)});
  moving_.isPacked = false;
  uploads_.push_back({false, kMovingParts, 0, bytesOf(moving_.part)});

  const auto parts = static_cast<std::uint32_t>(moving_.part.size());
  gl::RelumePartLightParameters light{};
  light.relumeEndPart = parts;
  light.relumeFirstLight = moving_.firstLight;
  light.relumeLightCount = static_cast<std::uint32_t>(lights_.size());
  light.relumeFirstView = moving_.firstView;
  light.relumeEmissionScale = setup.emissionScale;
  light.relumeBounceScale = bounces ? setup.bounceScale : 0.0f;
  dispatch(GpuPass::movingParts, moving_.lightSet, light, &gl::RelumePartLightParameters::relumeFirstPart, 0, parts, 1,
           false);
  bool waits = true;
  for (const Batch& batch : batches_) {
    const LinkBatch& links = batch.links;
    auto parameters = batchParameters<gl::RelumeOccludeParameters>(links);
    parameters.relumePartCount = parts;
    parameters.relumeFirstLight = moving_.firstLight;
    parameters.relumePoints = moving_.points;
    parameters.relumePlaces = moving_.places;
    parameters.relumeFirstView = moving_.firstView;
    parameters.relumeFrame = moving_.turns->frame();
    parameters.relumeLag = moving_.turns->lag();
    parameters.relumeEachFrame = moving_.turns->eachFrame();
    dispatch(GpuPass::movingParts, batch.occludeSet, parameters, &gl::RelumeOccludeParameters::relumeFirstCache,
             links.firstCache, links.endCache, moving_.cachesPerGroup, waits);
    waits = false;
  }
  return true;
}

}  // namespace relume::gpu
