// SPDX-License-Identifier: MIT
// Surfaces as sums over the triangles of a voxel take them: six bytes each, and twenty more of those that emit.
#pragma once

#include "relume/voxel_geometry.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr int kAlbedoSteps = 4095;

struct SurfaceEmission {
  std::uint32_t surface = 0;
  glm::vec3 emission{0.0f};  // [W/m²/sr] not 0
  bool doubleSided = false;
};

class SummedSurfaces {
 public:
  SummedSurfaces() = default;
  explicit SummedSurfaces(std::span<const VoxelSurface> surfaces) {
    for (const VoxelSurface& each : surfaces) add(each);
  }

  void reserve(std::size_t count) { albedo_.reserve(count); }
  void add(const VoxelSurface& surface) {
    Albedo steps;
    for (int k = 0; k < 3; ++k)
      steps[static_cast<std::size_t>(k)] =
          static_cast<std::uint16_t>(std::floor(surface.albedo[k] * float{kAlbedoSteps} + 0.5f));
    if (surface.emission != glm::vec3(0.0f)) {
      steps[0] |= kEmits;
      emission_.push_back({size(), surface.emission, surface.doubleSided});
      brightest_ = std::max({brightest_, surface.emission.x, surface.emission.y, surface.emission.z});
    }
    albedo_.push_back(steps);
  }

  std::uint32_t size() const { return static_cast<std::uint32_t>(albedo_.size()); }
  glm::ivec3 albedo(std::uint32_t surface) const {  // [1/kAlbedoSteps]
    const Albedo& steps = albedo_[surface];
    return {steps[0] & ~kEmits, steps[1], steps[2]};
  }
  const SurfaceEmission* emission(std::uint32_t surface) const {  // null: none
    if ((albedo_[surface][0] & kEmits) == 0) return nullptr;
    const auto less = [](const SurfaceEmission& a, std::uint32_t b) { return a.surface < b; };
    return &*std::lower_bound(emission_.begin(), emission_.end(), surface, less);
  }
  float brightest() const { return brightest_; }  // [W/m²/sr] of any channel
  std::size_t bytes() const { return albedo_.size() * sizeof(Albedo) + emission_.size() * sizeof(SurfaceEmission); }

 private:
  using Albedo = std::array<std::uint16_t, 3>;
  static constexpr std::uint16_t kEmits = 0x8000;  // beyond kAlbedoSteps, in the first

  std::vector<Albedo> albedo_;
  std::vector<SurfaceEmission> emission_;  // by ascending surface
  float brightest_ = 0.0f;
};

}  // namespace relume
