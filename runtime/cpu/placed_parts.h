// SPDX-License-Identifier: MIT
// The moving parts of a frame: where each shape stands, the sphere around it, and the radiosity of its patches.
#pragma once

#include "relume/lights.h"
#include "relume/relighter.h"
#include "runtime/moving/place_shape.h"
#include "runtime/shared/packed_caches.h"
#include "runtime/shared/resolve.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume::cpu {

// Radiosity of a patch. [W/m²]
struct PatchLight {
  glm::vec3 own{0.0f};      // emission, and what is reflected of punctual lights
  glm::vec3 bounced{0.0f};  // reflected light of the grid, which does not know of the part

  // What a receiver at some distance has of it: between a part of that radius and what is close to it comes little of
  // the light around.
  glm::vec3 seenFrom(float distance, float radius) const {
    return own + distance / (distance + 0.3f * radius) * bounced;
  }
};

struct PlacedPart : ShapePlace {
  const MovingShape* shape = nullptr;
  std::uint32_t firstPatch = 0;  // among all patches of the frame
  PatchLight mean;               // of its patches by area

  // A point in the grid of the shape. [voxels]
  glm::vec3 pointInGrid(const glm::vec3& world) const { return shape->grid.toGrid(toShape * (world - toWorld[3])); }
};

class PlacedParts {
 public:
  // most: of a frame. memory: keeps the arrays.
  PlacedParts(std::uint32_t most, std::pmr::memory_resource* memory);
  PlacedParts(const PlacedParts&) = delete;
  PlacedParts& operator=(const PlacedParts&) = delete;

  // Memory for the patches of these parts. Throws std::bad_alloc.
  void reserve(const LightSetup& setup);
  // Place the frame's parts, which checkMovingParts() has passed, and light their patches: punctual lights, and
  // bounceScale times what the grid has. Parts that are flattened are left out. light: null = no light yet.
  void place(const LightSetup& setup, const PackedCaches& caches, const CacheLight* light,
             const ParallelFor& parallelFor);

  std::span<const PlacedPart> parts() const { return part_; }
  std::span<const PartSphere> spheres() const { return sphere_; }  // of the same
  // What a ray of this direction, in the axes of the shape and of any length, meets in a voxel of it.
  const PatchLight& lightAt(const PlacedPart& part, const glm::ivec3& voxel, const glm::vec3& direction) const;
  // What a part shows a place that is far from it.
  struct View {
    PatchLight light;
    float share = 0.0f;  // of the sphere's disc
    float depth = 0.0f;  // [m] before the sphere's middle
  };
  const View& viewFrom(const PlacedPart& part, const glm::vec3& place) const {
    return view_[kViews * static_cast<std::size_t>(&part - part_.data()) +
                 viewAlong(part.toGrid * (place - part.sphere.centre))];
  }
  std::size_t bytes() const;

 private:
  void lightViews(const PlacedPart& part, View* view) const;
  void lightPatches(const LightSetup& setup, const PackedCaches& caches, const CacheLight* light, std::uint32_t begin,
                    std::uint32_t end);

  std::pmr::vector<PlacedPart> part_;
  std::pmr::vector<PartSphere> sphere_;
  std::pmr::vector<std::uint32_t> partOf_;  // [Size patches] of each patch
  std::pmr::vector<PatchLight> light_;      // [Size patches] of all parts
  std::pmr::vector<View> view_;             // [Size parts * kViews]
};

}  // namespace relume::cpu
