// SPDX-License-Identifier: MIT
// Makes a record: rays over the hemisphere of a point, and the sums over what they find (RCS 3, Krivanek et al. 2005).
#pragma once

#include "bake/links/directions.h"
#include "bake/preview/hemisphere_cells.h"
#include "bake/preview/hit_radiance.h"
#include "bake/preview/receiver.h"
#include "bake/preview/record.h"
#include "bake/preview/weights.h"
#include "bake/rays/bundle/ray_bundle.h"
#include "bake/rays/ray_tracer.h"
#include "bake/scene/sky.h"

#include <atomic>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace relume {

// The vector and the gradient of one kind of light in the frame (tangent, bitangent, normal) of the cells:
//   I = sum of L_i Int omega d omega
//   gradient = sum over borders a|b of (L_b - L_a) / min(r_a, r_b) Int cos theta m ds
// distance [m]: infinite where nothing is met; negative below the surface, where borders have no term.
// [Size radiance = distance = cells]
RecordLight sumCells(const HemisphereCells& cells, std::span<const glm::vec3> radiance, std::span<const float> distance,
                     const glm::mat3& frame);

// Squared error of E that the cells' single rays leave: neighbours are taken for two samples of one stratum. Luminance.
// Cells that are `fine` have their own estimate, and count as exact here. [Size radiance = fine = cells]
double varianceOf(const HemisphereCells& cells, std::span<const glm::vec3> radiance,
                  std::span<const std::uint8_t> fine);

// Where the light changes faster than the surroundings' distances tell: R_k <= |E| / |gradient|. What noise alone makes
// of a gradient, about that of E over R_k, neither limits the record nor is extrapolated.
void limitBySlope(Record& record);
// Luminance does not tell where channels change against each other, as beside something small and close: over R_k, no
// channel changes by more than the brightest has.
void limitChannels(Record& record);

// Immutable but for its counts, shared by all threads. Keeps references to what it is made from.
class RecordGatherer {
 public:
  struct Options {
    Hemisphere hemisphere = Hemisphere::fan;
    std::uint32_t rays = 1024;       // [16..65536] of a fan
    std::uint32_t planeSide = 64;    // [2..256] pixels
    float planeFovRad = 2.2142974f;  // of the plane: 126.87 degrees, half a side is twice the distance
    std::uint64_t seed = 1;
    bool secondLook = true;  // more rays where light is uneven; without it rays do not depend on the light
    RecordReach reach = RecordReach::guarded;  // printed: R_k is the harmonic mean of distances and nothing else
  };
  RecordGatherer(const RayTracer& tracer, const HitRadiance& reflected, const Sky& sky, const Options& options);

  // Memory of one thread, kept from record to record.
  struct Scratch {
    RayBundle bundle;
    std::vector<DirectionStrata::Sample> samples;
    std::vector<glm::vec3> directions, reflected, sky;
    std::vector<Hit> hits;
    std::vector<Ray> rays;
    std::vector<float> distance;
    std::vector<std::pair<float, std::uint32_t>> uneven;  // contrast with neighbours, cell
    std::vector<float> contrast;                          // [Size cells] of each with a neighbour
    std::vector<std::uint8_t> fine;                       // [Size cells] 1 = the cell was looked at again
    std::vector<Ray> fineRays;
    std::vector<Hit> fineHits;
    std::vector<glm::vec3> fineDirections, fineReflected;
    glm::mat3 frame{1.0f};      // of the last record's cells: tangent, bitangent, normal
    float seenDistance = 0.0f;  // [m] R_k of the last record, by distances alone: before limitBySlope()
  };

  // Gather at a receiver by rays. The result depends on the options, the receiver and `item` alone.
  Record gather(const PixelReceiver& receiver, std::uint64_t item, Scratch& scratch) const;

  // Where a rasteriser looks from in place of gather()'s rays (draw_hemispheres.h), and the record of what it draws.
  // Only of a plane. [Size radiance = distance = cells]
  glm::mat4 poseOf(const PixelReceiver& receiver) const;
  Record gatherDrawn(const PixelReceiver& receiver, std::span<const glm::vec3> radiance,
                     std::span<const float> distance, Scratch& scratch) const;

  const HemisphereCells& cells() const { return cells_; }
  std::uint64_t raysTraced() const { return rays_; }  // pixels of those that were drawn included
  // Rays whose light was not finite, which count as 0; and the least index of an instance that they hit, or kNone.
  std::uint64_t notFinite() const { return notFinite_; }
  std::uint32_t notFiniteInstance() const { return instance_; }

 private:
  glm::mat3 aim(const PixelReceiver& receiver, std::uint64_t item, Scratch& scratch) const;
  void look(const PixelReceiver& receiver, std::uint64_t item, Scratch& scratch) const;
  void addSky(Scratch& scratch) const;
  Record sum(const PixelReceiver& receiver, double unevenVariance, Scratch& scratch) const;
  void findUneven(Scratch& scratch) const;
  double lookAgain(const PixelReceiver& receiver, std::uint64_t item, const glm::mat3& frame, Scratch& scratch) const;
  glm::vec3 startOf(const PixelReceiver& receiver) const;
  void keepFinite(const Hit& hit, glm::vec3& radiance) const;

  const RayTracer& tracer_;
  const HitRadiance& reflected_;
  const Sky& sky_;
  std::uint64_t seed_;
  bool secondLook_;
  RecordReach reach_;
  HemisphereCells cells_;
  DirectionStrata strata_;
  float spread_;  // width of a ray, or a pixel, over its distance
  mutable std::atomic<std::uint64_t> rays_{0}, notFinite_{0};
  mutable std::atomic<std::uint32_t> instance_{kNone};
};

}  // namespace relume
