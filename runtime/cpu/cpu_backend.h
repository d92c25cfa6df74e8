// SPDX-License-Identifier: MIT
// The CPU backend: steps 2 to 4 in order. Step 5 is nothing here, because step 6 reads the light map's cache indices
// itself. All is kept packed.
#pragma once

#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "runtime/backend.h"
#include "runtime/cpu/bounce.h"
#include "runtime/cpu/grid_vectors.h"
#include "runtime/cpu/light_caches.h"
#include "runtime/cpu/occlude_links.h"
#include "runtime/cpu/placed_parts.h"
#include "runtime/cpu/pull.h"
#include "runtime/cpu/surfel_set.h"
#include "runtime/shared/stored_light.h"

#include <array>
#include <memory_resource>
#include <string>
#include <utility>
#include <vector>

namespace relume::cpu {

class CpuBackend final : public Backend {
 public:
  // The bake must pass checkBake() and is read here only, but for moving parts. `simd` must be one that this
  // processor has. texture: of the grid, may be empty.
  CpuBackend(const Bake& bake, const BackendRequest& request, Simd simd, GridTexture texture);

  Status checkTextures(const LightSetup&) const override { return done(); }
  void reserve(const LightSetup& setup) override {
    lights_.reserve(setup.lights.size());
    if (kHasMovingParts && !setup.movingParts.empty()) moving_->parts.reserve(setup);
  }
  void relight(const LightSetup& setup) override;
  void reset() override;
  CacheLight light() const override { return cacheLight(light_); }
  const GridTexture* gridTexture() const override { return grid_.texture().empty() ? nullptr : &grid_.texture(); }
  std::span<const float> gridTexels() const override { return grid_.texels(); }
  std::vector<glm::vec3> nodeRadiosity() const override;
  std::vector<PassTime> passTimes() const override;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const override;

 private:
  // What RelightOptions::movingParts needs.
  struct Moving {
    Moving(const Bake& bake, const LinkSet& links, const BackendRequest& request, Simd simd)
        : parts(request.options.movingParts, request.memory),
          occluders(bake, links, request.bands, request.options.movingLag, simd, request.memory) {}

    PlacedParts parts;
    OccludeLinks occluders;
  };

  CpuBackend(const Bake& bake, const BackendRequest& request, Simd simd, GridTexture texture,
             std::pmr::vector<std::uint32_t> order);

  const PackedCaches& caches_;
  LinkSet links_;
  LightCachesKernel cachesKernel_;
  const LightSurfelsKernel& surfelsKernel_;
  ParallelFor parallelFor_;
  Bounce bounce_;
  DrivenEmission driven_;
  SurfelSet surfels_;
  PullTree tree_;
  std::pmr::vector<PreparedLight> lights_;  // of the frame; keeps its memory
  std::pmr::vector<std::uint32_t> node_;    // [W/m²] [Size nodes] radiosity (runtime/shared/pack_color.h)
  StoredLight light_;
  GridVectors grid_;
  Owned<Moving> moving_;  // null = no frame has moving parts
  bool lit_ = false;      // whether light_ is that of a frame
  std::array<double, 5> passMs_{};
};

}  // namespace relume::cpu
