// SPDX-License-Identifier: MIT
// See rsm_bounces.h.
#include "runtime/live/rsm_bounces.h"

#include "runtime/live/ray_sets.h"
#include "runtime/shared/chunks.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

namespace relume {
namespace {

constexpr std::uint32_t kBouncingCellsAtOnce = 16;  // of a chunk

constexpr float kTouching2 = 1e-12f;  // [m²] nearer than a micrometre a direction means nothing
constexpr float kMaxLight = 1e24f;    // of a sample: sums and bounces of it stay finite
constexpr auto kSide = static_cast<float>(kBrickSide);

// Call body with the numbers of coefficients of luma and chroma as constants, so that its loops are unrolled.
template <class Body>
void withCounts(const Bands& bands, const Body& body) {
  const auto chroma = [&](auto luma) {
    if (bands.chroma == 1) return body(luma, std::integral_constant<std::size_t, 1>());
    if (bands.chroma == 2) return body(luma, std::integral_constant<std::size_t, 4>());
    body(luma, std::integral_constant<std::size_t, 9>());
  };
  if (bands.luma == 1) return body(std::integral_constant<std::size_t, 1>(), std::integral_constant<std::size_t, 1>());
  if (bands.luma == 2) return chroma(std::integral_constant<std::size_t, 4>());
  chroma(std::integral_constant<std::size_t, 9>());
}

// numbers += light (Y, Co, Cg) times the basis.
template <std::size_t kLuma, std::size_t kChroma>
void addLight(const glm::vec3& light, const float* basis, float* numbers) {
  for (std::size_t i = 0; i < kLuma; ++i) numbers[i] += light.x * basis[i];
  for (std::size_t i = 0; i < kChroma; ++i) numbers[kLuma + i] += light.y * basis[i];
  for (std::size_t i = 0; i < kChroma; ++i) numbers[kLuma + kChroma + i] += light.z * basis[i];
}

template <std::size_t kLuma, std::size_t kChroma>
void addSampleOf(const RsmSample& sample, const glm::vec3& positionWorld, const CellOcclusion* occlusion, float jitter,
                 float* numbers) {
  const glm::vec3 toSample = sample.positionWorld - positionWorld;
  const float distance2 = glm::dot(toSample, toSample);
  const float facing = -glm::dot(toSample, sample.normal);
  if (!(facing > 0.0f) || !(distance2 > kTouching2)) return;
  if (occlusion != nullptr && !occlusion->reaches(occlusion->grid.toGrid(positionWorld),
                                                  occlusion->grid.toGrid(sample.positionWorld), sample.normal, jitter))
    return;
  const float distance = std::sqrt(distance2);
  std::array<float, 9> basis;
  evaluateSh(kMaxFieldBands, toSample / distance, basis);
  const glm::vec3 light = facing / (distance * (distance2 + sample.softening)) * sample.power;
  addLight<kLuma, kChroma>(glm::clamp(light, -kMaxLight, kMaxLight), basis.data(), numbers);
}

// P_k of a cell [voxels].
glm::vec3 receiverIn(const CellOcclusion& occlusion, std::uint32_t cell, const glm::vec3& place) {
  if (!occlusion.places.empty()) return occlusion.places[cell];
  return glm::vec3(kBrickSide * occlusion.grid.cellAt(cell)) + kSide * place;
}

}  // namespace

void addSample(const RsmSample& sample, const glm::vec3& positionWorld, const CellOcclusion* occlusion, float jitter,
               const Bands& bands, std::span<float> numbers) {
  withCounts(bands, [&](auto luma, auto chroma) {
    addSampleOf<luma(), chroma()>(sample, positionWorld, occlusion, jitter, numbers.data());
  });
}

void gatherFirstBounce(std::span<const RsmSample> samples, const CellOcclusion& occlusion,
                       std::span<const std::uint32_t> cells, const ParallelFor& parallelFor, CellField& field) {
  const CellOcclusion* hides = occlusion.mode == CellVisibility::none ? nullptr : &occlusion;
  const std::size_t count = field.count();
  withCounts(field.bands, [&](auto luma, auto chroma) {
    forChunks(parallelFor, static_cast<std::uint32_t>(cells.size()), kBouncingCellsAtOnce,
              [&](std::uint32_t begin, std::uint32_t end) {
                for (std::uint32_t c = begin; c < end; ++c) {
                  FieldNumbers sum{};
                  for (std::uint32_t k = 0; k < samples.size(); ++k) {
                    const glm::vec3 place = receiverIn(occlusion, cells[c], samples[k].place);
                    addSampleOf<luma(), chroma()>(samples[k], occlusion.grid.toWorld(place), hides,
                                                  jitterOf(cells[c], k), sum.data());
                  }
                  std::copy_n(sum.begin(), count, field.at(cells[c]));
                }
              });
  });
}

void gatherNextBounce(const CellField& first, const CellField& in, const SecondaryRays& rays,
                      const CellOcclusion& occlusion, std::span<const std::uint32_t> cells,
                      const ParallelFor& parallelFor, CellField& out) {
  struct Ray {
    glm::vec3 direction;
    FieldLobe basis, lobe;  // of the direction, and of a surface that faces the other way
  };
  std::vector<Ray> ways;
  for (const glm::vec3& direction : raysOfSet(rays.count, rays.set)) {
    Ray& ray = ways.emplace_back(Ray{direction, {}, clampedLobe(-direction)});
    evaluateSh(kMaxFieldBands, direction, ray.basis);
  }
  const VolumeGrid& grid = occlusion.grid;
  const float weight = 4.0f * rays.averageAlbedo / static_cast<float>(rays.count);
  const bool isExact = occlusion.mode == CellVisibility::exact;
  withCounts(out.bands, [&](auto luma, auto chroma) {
    forChunks(parallelFor, static_cast<std::uint32_t>(cells.size()), kBouncingCellsAtOnce,
              [&](std::uint32_t begin, std::uint32_t end) {
                for (std::uint32_t c = begin; c < end; ++c) {
                  FieldNumbers sum{};
                  std::copy_n(first.at(cells[c]), first.count(), sum.begin());
                  const glm::vec3 from = receiverIn(occlusion, cells[c], glm::vec3(0.5f));
                  for (std::uint32_t k = 0; k < rays.count; ++k) {
                    const Ray& ray = ways[k];
                    glm::vec3 x;
                    if (!occlusion.first(from, ray.direction, rays.far, jitterOf(cells[c], k), x)) continue;
                    // With exact visibility half a cell before the surface, as receivers read: on this side of a wall.
                    if (isExact) x -= std::min(0.5f * kSide, glm::distance(x, from)) * ray.direction;
                    FieldNumbers read{};
                    if (!addField(in, grid, x / kSide, read)) continue;
                    addLight<luma(), chroma()>(weight * irradianceOf(in, read, ray.lobe), ray.basis.data(), sum.data());
                  }
                  std::copy_n(sum.begin(), out.count(), out.at(cells[c]));
                }
              });
  });
}

}  // namespace relume
