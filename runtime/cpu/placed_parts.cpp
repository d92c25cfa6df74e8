// SPDX-License-Identifier: MIT
// See placed_parts.h.
#include "runtime/cpu/placed_parts.h"

#include "runtime/direct_light.h"
#include "runtime/shared/chunks.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace relume::cpu {
namespace {

constexpr std::uint32_t kPatches = 64;  // of a task

}  // namespace

PlacedParts::PlacedParts(std::uint32_t most, std::pmr::memory_resource* memory)
    : part_(memory), sphere_(memory), partOf_(memory), light_(memory), view_(memory) {
  part_.reserve(most);
  sphere_.reserve(most);
  view_.reserve(kViews * std::size_t{most});
}

void PlacedParts::reserve(const LightSetup& setup) {
  std::size_t patches = 0;
  for (const MovingPart& part : setup.movingParts) patches += setup.movingShapes->shape(part.shape).patch.size();
  partOf_.reserve(patches);
  light_.reserve(patches);
}

void PlacedParts::place(const LightSetup& setup, const PackedCaches& caches, const CacheLight* light,
                        const ParallelFor& parallelFor) {
  part_.clear();
  sphere_.clear();
  partOf_.clear();
  const bool emits = setup.emissionScale != glm::vec3(0.0f);
  for (const MovingPart& each : setup.movingParts) {
    PlacedPart part;
    const MovingShape& shape = setup.movingShapes->shape(each.shape);
    if (!placeShape(shape, each.toWorld, emits, part)) continue;
    part.shape = &shape;
    part.firstPatch = static_cast<std::uint32_t>(partOf_.size());
    partOf_.insert(partOf_.end(), shape.patch.size(), static_cast<std::uint32_t>(part_.size()));
    part_.push_back(part);
    sphere_.push_back(part.sphere);
  }
  light_.resize(partOf_.size());
  forChunks(parallelFor, static_cast<std::uint32_t>(partOf_.size()), kPatches,
            [&](std::uint32_t begin, std::uint32_t end) { lightPatches(setup, caches, light, begin, end); });
  for (PlacedPart& part : part_) {
    PatchLight sum;
    float area = 0.0f;
    for (std::uint32_t i = 0; i < part.shape->patch.size(); ++i) {
      const float each = part.shape->patch[i].area;
      sum.own += each * light_[part.firstPatch + i].own;
      sum.bounced += each * light_[part.firstPatch + i].bounced;
      area += each;
    }
    if (area > 0.0f) part.mean = {sum.own / area, sum.bounced / area};
  }
  view_.resize(kViews * part_.size());
  for (std::size_t i = 0; i < part_.size(); ++i) lightViews(part_[i], view_.data() + kViews * i);
}

void PlacedParts::lightViews(const PlacedPart& part, View* view) const {
  const glm::mat3 linear(part.toWorld[0], part.toWorld[1], part.toWorld[2]);
  const float viewShare = part.viewShare(*part.shape), viewDepth = part.viewDepth(*part.shape);
  for (std::uint32_t v = 0; v < kViews; ++v) {
    const ShapeView& seen = part.shape->view[v];
    View& each = view[v];
    each = {{}, viewShare * seen.share / glm::length(linear * directionOfView(v)), viewDepth * seen.depth};
    for (std::uint32_t i = 0; i < kViewPatches && seen.weight[i] > 0.0f; ++i) {
      const PatchLight& patch = seen.patch[i] == kNoPatch ? part.mean : light_[part.firstPatch + seen.patch[i]];
      each.light.own += seen.weight[i] * patch.own;
      each.light.bounced += seen.weight[i] * patch.bounced;
    }
  }
}

void PlacedParts::lightPatches(const LightSetup& setup, const PackedCaches& caches, const CacheLight* light,
                               std::uint32_t begin, std::uint32_t end) {
  const std::uint32_t count = end - begin;
  std::array<glm::vec3, kPatches> place, normal, irradiance{}, bounced{};
  for (std::uint32_t i = 0; i < count; ++i) {
    const PlacedPart& part = part_[partOf_[begin + i]];
    const ShapePatch& patch = part.shape->patch[begin + i - part.firstPatch];
    normal[i] = glm::normalize(glm::transpose(part.toShape) * patch.normal);
    // Off the surface by a voxel, since the mean of a curved patch lies below it.
    const glm::vec3 lifted = patch.position + part.shape->grid.voxel * patch.normal;
    place[i] = glm::mat3(part.toWorld[0], part.toWorld[1], part.toWorld[2]) * lifted + part.toWorld[3];
    if (light != nullptr && setup.bounceScale > 0.0f)
      bounced[i] = setup.bounceScale * irradianceInGrid(caches, *light, place[i], normal[i]);
  }
  for (std::uint32_t k = 0; k < setup.lights.size(); ++k) {
    std::array<glm::vec3, kPatches> litPlace, litNormal, arriving;
    std::array<std::uint32_t, kPatches> slot;
    std::array<float, kPatches> visible;
    std::uint32_t lit = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      arriving[lit] = directIrradiance(setup.lights[k], place[i], normal[i]);
      if (arriving[lit] == glm::vec3(0.0f)) continue;
      litPlace[lit] = place[i];
      litNormal[lit] = normal[i];
      slot[lit++] = i;
    }
    if (lit == 0) continue;
    std::fill_n(visible.begin(), lit, setup.visibilityBatch ? 0.0f : 1.0f);
    if (setup.visibilityBatch) {
      setup.visibilityBatch(k, {litPlace.data(), lit}, {litNormal.data(), lit}, {visible.data(), lit});
    } else if (setup.visibility) {
      for (std::uint32_t i = 0; i < lit; ++i) visible[i] = setup.visibility(k, litPlace[i], litNormal[i]);
    }
    // A number of the host's that is not finite would never leave the bounces.
    for (std::uint32_t i = 0; i < lit; ++i) {
      if (visible[i] > 0.0f) irradiance[slot[i]] += arriving[i] * std::min(visible[i], 1.0f);
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const PlacedPart& part = part_[partOf_[begin + i]];
    const ShapePatch& patch = part.shape->patch[begin + i - part.firstPatch];
    light_[begin + i] = {
        patch.albedo * irradiance[i] + std::numbers::pi_v<float> * setup.emissionScale * patch.emission,
        patch.albedo * bounced[i]};
  }
}

const PatchLight& PlacedParts::lightAt(const PlacedPart& part, const glm::ivec3& voxel,
                                       const glm::vec3& direction) const {
  const std::uint32_t patch = part.shape->patchToward(voxel, direction);
  return patch == kNoPatch ? part.mean : light_[part.firstPatch + patch];
}

std::size_t PlacedParts::bytes() const {
  return (sizeof(PlacedPart) + sizeof(PartSphere)) * part_.capacity() + sizeof(std::uint32_t) * partOf_.capacity() +
         sizeof(PatchLight) * light_.capacity() + sizeof(View) * view_.capacity();
}

}  // namespace relume::cpu
