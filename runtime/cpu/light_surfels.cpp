// SPDX-License-Identifier: MIT
// See light_surfels.h.
#include "runtime/cpu/light_surfels.h"

#include "runtime/cpu/simd.h"
#include "runtime/direct_light.h"
#include "runtime/light_window.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/pack_color.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>
#include <vector>

namespace relume::cpu {
namespace {

// Blocks of a task.
constexpr std::uint32_t kBlocksAtOnce = 16;

// Numbers of a block: red, green, blue of each surfel.
struct BlockColors {
  alignas(64) float value[3 * kSurfelBlock];

  void put(std::uint32_t slot, const glm::vec3& v) {
    value[slot] = v.r;
    value[kSurfelBlock + slot] = v.g;
    value[2 * kSurfelBlock + slot] = v.b;
  }
};

PreparedLight prepare(const Light& light) {
  PreparedLight p;
  p.kind = static_cast<std::uint32_t>(light.kind);
  for (int k = 0; k < 3; ++k) {
    p.position[k] = light.positionWorld[k];
    p.direction[k] = light.direction[k];
    p.intensity[k] = light.intensity[k];
  }
  p.inverseRange2 = inverseRangeSquared(light.range);
  const SpotEdge edge = spotEdge(light);
  p.cosOuter = edge.cosOuter;
  p.coneScale = edge.scale;
  return p;
}

// Direct light of a block whose host answers for the shadows of many surfels at once: one call per light, of the
// surfels that face it.
void lightByBatches(const LightSetup& setup, const LightSurfelsJob& job, std::uint32_t first, std::uint32_t count,
                    BlockColors& e) {
  glm::vec3 position[kSurfelBlock], normal[kSurfelBlock], sum[kSurfelBlock];
  std::fill(sum, sum + count, glm::vec3(0.0f));
  for (std::uint32_t k = 0; k < setup.lights.size(); ++k) {
    glm::vec3 light[kSurfelBlock];
    std::uint32_t slot[kSurfelBlock], lit = 0;
    float visible[kSurfelBlock];
    for (std::uint32_t i = 0; i < count; ++i) {
      position[lit] = surfelPosition(job, first + i);
      normal[lit] = unpackSurfelNormal(job.word[2][first + i]);
      light[lit] = directIrradiance(setup.lights[k], position[lit], normal[lit], job.radius);
      slot[lit] = i;
      if (light[lit] != glm::vec3(0.0f)) ++lit;
    }
    if (lit == 0) continue;
    std::fill(visible, visible + lit, 0.0f);
    setup.visibilityBatch(k, {position, lit}, {normal, lit}, {visible, lit});
    for (std::uint32_t i = 0; i < lit; ++i) {
      if (visible[i] > 0.0f) sum[slot[i]] += light[i] * std::min(visible[i], 1.0f);
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) e.put(i, sum[i]);
}

// Direct light of a block whose host brings its own shadows or its own light.
void lightByHost(const SurfelSet& surfels, const LightSetup& setup, const LightSurfelsJob& job, std::uint32_t first,
                 std::uint32_t count, BlockColors& e) {
  if (setup.surfelIrradiance.empty() && setup.visibilityBatch) return lightByBatches(setup, job, first, count, e);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!setup.surfelIrradiance.empty()) {
      e.put(i, setup.surfelIrradiance[surfels.bakedSurfel(first + i)]);
      continue;
    }
    const glm::vec3 position = surfelPosition(job, first + i), normal = unpackSurfelNormal(job.word[2][first + i]);
    glm::vec3 sum(0.0f);
    for (std::uint32_t k = 0; k < setup.lights.size(); ++k) {
      const glm::vec3 light = directIrradiance(setup.lights[k], position, normal, job.radius);
      if (light == glm::vec3(0.0f)) continue;
      // A number of the host's that is not finite would never leave the bounces.
      const float visible = setup.visibility(k, position, normal);
      if (visible > 0.0f) sum += light * std::min(visible, 1.0f);
    }
    e.put(i, sum);
  }
}

// Radiosity by emission of a block; false when it has none.
bool emit(const SurfelSet& surfels, const LightSetup& setup, std::uint32_t first, std::uint32_t count,
          BlockColors& radiosity) {
  const std::span<const SurfelSet::Emitter> emitters = surfels.emitters(first, first + count);
  const bool drives = !setup.materialEmissions.empty();
  if (!setup.surfelEmission.empty()) {
    for (std::uint32_t i = 0; i < count; ++i)
      radiosity.put(i, std::numbers::pi_v<float> * setup.surfelEmission[surfels.bakedSurfel(first + i)]);
    for (std::size_t k = 0; k < emitters.size() && drives; ++k) {
      const std::uint32_t i = emitters[k].surfel - first;
      radiosity.put(i, std::numbers::pi_v<float> * (setup.surfelEmission[surfels.bakedSurfel(emitters[k].surfel)] +
                                                    surfels.driven(emitters[k])));
    }
    return true;
  }
  if (drives && !emitters.empty()) {
    std::fill(std::begin(radiosity.value), std::end(radiosity.value), 0.0f);
    for (const SurfelSet::Emitter& each : emitters)
      radiosity.put(each.surfel - first, std::numbers::pi_v<float> * surfels.driven(each));
    return true;
  }
  if (emitters.empty() || setup.emissionScale == glm::vec3(0.0f)) return false;
  std::fill(std::begin(radiosity.value), std::end(radiosity.value), 0.0f);
  for (const SurfelSet::Emitter& each : emitters)
    radiosity.put(each.surfel - first, std::numbers::pi_v<float> * each.emission * setup.emissionScale);
  return true;
}

void lightSky(const SurfelSet& surfels, const LightSetup& setup, std::span<std::uint32_t> node) {
  for (std::size_t p = 0; p < surfels.skyLeaves().size(); ++p) {
    const glm::vec3 radiance = setup.skyPatches.empty() ? setup.skyRadiance : setup.skyPatches[p];
    node[surfels.skyLeaves()[p]] = packColor(std::numbers::pi_v<float> * radiance, ditherOf(surfels.skyLeaves()[p]));
  }
}

}  // namespace

void lightSurfels(const LightSurfelsKernel& kernel, const SurfelSet& surfels, const LightSetup& setup,
                  const Bounce* bounce, LightSurfelsJob job, std::pmr::vector<PreparedLight>& lights,
                  std::span<std::uint32_t> node, const ParallelFor& parallelFor) {
  lights.clear();
  for (const Light& light : setup.lights) lights.push_back(prepare(light));
  surfels.describe(job);
  job.light = lights.data();
  job.lightCount = static_cast<std::uint32_t>(lights.size());
  job.bounceScale = setup.bounceScale;
  const bool bounces = bounce && setup.bounceScale > 0.0f;
  const bool byHost =
      !setup.surfelIrradiance.empty() || ((setup.visibility || setup.visibilityBatch) && !lights.empty());
  const std::uint32_t blocks = (surfels.count() + kSurfelBlock - 1) / kSurfelBlock;
  forChunks(parallelFor, blocks, kBlocksAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
    BlockColors e, emitted;
    alignas(64) std::uint32_t at[kSurfelBlock + kAtRoom] = {};
    for (std::uint32_t block = begin; block < end; ++block) {
      const std::uint32_t first = block * kSurfelBlock, count = std::min(kSurfelBlock, surfels.count() - first);
      if (byHost) {
        lightByHost(surfels, setup, job, first, count, e);
      } else {
        kernel.direct(job, first, count, e.value);
      }
      if (bounces) bounce->add(kernel, job, block, count, e.value);
      const bool emits = emit(surfels, setup, first, count, emitted);
      surfels.leaves(kernel, block, count, at);
      kernel.store(job, first, count, e.value, emits ? emitted.value : nullptr, at, node.data());
    }
  });
  lightSky(surfels, setup, node);
}

const LightSurfelsKernel* lightSurfelsKernel(Simd simd) {
  switch (chooseSimd(simd)) {
#if defined(RELUME_X86_KERNELS)
    case Simd::avx512:
      return &kLightSurfelsAvx512;
    case Simd::avx2:
      return &kLightSurfelsAvx2;
#endif
    case Simd::baseline:
      return &kLightSurfelsBaseline;
    default:
      return nullptr;
  }
}

}  // namespace relume::cpu
