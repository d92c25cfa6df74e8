// SPDX-License-Identifier: MIT
// The surfels' stage (PIC 4.2): candidates spread by area, one of three placements, the map from hits to surfels, and
// albedo and emission integrated over what each surfel stands for.
#include "bake/base/ladder.h"
#include "bake/base/parallel.h"
#include "bake/surfels/eliminate.h"
#include "bake/surfels/emitter_footprints.h"
#include "bake/surfels/footprint.h"
#include "bake/surfels/move_to_visible.h"
#include "bake/surfels/relax.h"
#include "bake/surfels/spacing.h"
#include "bake/surfels/surface_sampler.h"
#include "bake/surfels/surfel_map.h"
#include "bake/surfels/surfels.h"
#include "formats/decimal.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace relume {
namespace {

constexpr std::uint32_t kMaxSurfels = 1u << 24;
constexpr std::uint32_t kEmitterSurfels = 16;      // each emitter gets at least so many, where the count allows
constexpr std::size_t kManyCandidates = 1u << 25;  // with more, fewer candidates per surfel are enough
constexpr std::size_t kFootprintSamples = 8;       // per surfel
constexpr std::size_t kSeedsPerChunk = 4096;
constexpr int kMaxRedraws = 4;
constexpr double kSpacings = 16.0;  // in an octave
constexpr std::size_t kMaxRedrawn =
    16;  // most points drawn, in multiples of those wanted: if masks leave less, there are fewer surfels

Status checkOptions(const SurfelOptions& options) {
  if (options.count < 2 || options.count > kMaxSurfels) {
    return Error{ErrorCode::usage, "surfel count must be in [2, 16777216], found " + std::to_string(options.count)};
  }
  if (!(options.candidateFactor >= 1.5f && options.candidateFactor <= 20.0f)) {
    return Error{ErrorCode::usage,
                 "candidate factor of surfels must be in [1.5, 20], found " + decimal(options.candidateFactor)};
  }
  if (options.relaxIterations > 1000) {
    return Error{ErrorCode::usage,
                 "relaxation rounds of surfels must be in [0, 1000], found " + std::to_string(options.relaxIterations)};
  }
  return done();
}

// Points drawn, and the share of the drawn area that they stand for: below one where alpha masks cut some out.
struct Drawn {
  std::vector<SurfaceSample> samples;
  double share = 1.0;
};

Drawn drawPoints(const SurfaceSampler& sampler, std::size_t count, std::uint64_t seed, std::uint32_t salt,
                 Context& context) {
  Drawn drawn;
  std::size_t laid = 0;
  drawn.samples = sampler.draw(count, seed, salt, context, &laid);
  drawn.share = laid > 0 ? static_cast<double>(drawn.samples.size()) / static_cast<double>(laid) : 0.0;
  return drawn;
}

// Draw at least `count` points if there are so many: again, and more, where alpha masks cut points out.
Drawn drawAtLeast(const SurfaceSampler& sampler, std::size_t wanted, std::size_t count, std::uint64_t seed,
                  std::uint32_t salt, Context& context) {
  const std::size_t max = kMaxRedrawn * wanted;
  Drawn drawn = drawPoints(sampler, wanted, seed, salt, context);
  for (int i = 0; i < kMaxRedraws && drawn.samples.size() < count && wanted < max && !context.cancelled(); ++i) {
    if (drawn.samples.empty()) break;
    const double grown =
        1.02 * static_cast<double>(wanted) * static_cast<double>(count) / static_cast<double>(drawn.samples.size());
    wanted = std::min(max, static_cast<std::size_t>(std::ceil(std::min(grown, static_cast<double>(max)))) + 1);
    drawn = drawPoints(sampler, wanted, seed, salt, context);
  }
  return drawn;
}

// Keep `count` of the samples, evenly spaced in their order.
void thinOut(std::vector<SurfaceSample>& samples, std::size_t count) {
  if (samples.size() <= count) return;
  for (std::size_t i = 0; i < count; ++i) samples[i] = samples[i * samples.size() / count];
  samples.resize(count);
}

// Spacing [m] of the densest, that is hexagonal, packing of n discs on an area [m²], to the next step of the ladder.
float densestSpacing(double area, std::size_t n) {
  return static_cast<float>(onLadder(std::sqrt(2.0 / std::sqrt(3.0) * area / static_cast<double>(n)), kSpacings));
}

struct Placement {
  std::vector<SurfaceSample> samples;
  double share = 1.0;  // of the seen area that masks leave
};

Result<Placement> placeSamples(const RayTracer& tracer, const PlaySpace& playSpace, const SurfaceSampler& sampler,
                               const SurfelOptions& options, std::uint64_t seed, Context& context) {
  using Kind = SurfelOptions::Placement;
  const std::size_t count = options.count;
  std::size_t wanted = count;
  if (options.placement == Kind::eliminated) {
    const auto many = static_cast<std::size_t>(std::ceil(options.candidateFactor * static_cast<double>(count)));
    wanted = std::min(many, std::max(kManyCandidates, 3 * count / 2));
  }
  Drawn drawn = drawAtLeast(sampler, wanted, count, seed, 0, context);
  if (context.cancelled()) return cancelledError();
  if (drawn.samples.size() < 2) {
    return Error{ErrorCode::failed, "surfels: alpha masks cut out every point of the surfaces that are seen"};
  }
  Placement placement;
  placement.share = drawn.share;

  if (options.placement == Kind::eliminated) {
    const auto kept = static_cast<std::uint32_t>(std::min(count, drawn.samples.size()));
    const float spacing = densestSpacing(sampler.measure() * drawn.share, kept);
    const Result<std::vector<std::uint32_t>> order = eliminateSamples(drawn.samples, kept, spacing, context);
    if (!order) return order.error();
    placement.samples.reserve(order->size());
    for (const std::uint32_t i : *order) placement.samples.push_back(drawn.samples[i]);
    return placement;
  }
  placement.samples = std::move(drawn.samples);
  thinOut(placement.samples, count);
  if (options.placement == Kind::relaxed) {
    const float spacing = densestSpacing(sampler.measure() * drawn.share, placement.samples.size());
    const Status ok = relaxSamples(tracer, playSpace, options.relaxIterations, spacing, placement.samples, context);
    if (!ok) return ok.error();
  }
  return placement;
}

PlacedSurfels::Statistics measure(const Placement& placement, const SurfaceSampler& sampler, double areaTotal,
                                  float areaEach, float spacing, Context& context) {
  PlacedSurfels::Statistics s;
  s.areaSeen = sampler.seenArea() * placement.share;
  s.areaTotal = areaTotal;
  const Spacing measured = measureSpacing(placement.samples, spacing, context);
  s.spacingMin = measured.min;
  s.spacingMean = measured.mean;
  s.spacingCv = measured.cv;
  s.spacingDensest = spacing;
  s.areaError =
      static_cast<float>(std::fabs(static_cast<double>(placement.samples.size()) * areaEach - s.areaSeen) / s.areaSeen);
  context.figure("surfels", static_cast<double>(placement.samples.size()));
  context.figure("area_seen_m2", s.areaSeen);
  context.figure("area_total_m2", s.areaTotal);
  context.figure("area_error", s.areaError);
  context.figure("spacing_min_m", s.spacingMin);
  context.figure("spacing_mean_m", s.spacingMean);
  context.figure("spacing_densest_m", s.spacingDensest);
  context.figure("spacing_cv", s.spacingCv);
  return s;
}

}  // namespace

Result<PlacedSurfels> placeSurfels(const RayTracer& tracer, const PlaySpace& playSpace, const SurfelOptions& options,
                                   std::uint64_t seed, Context& context, double lookups) {
  if (const Status ok = checkOptions(options); !ok) return ok.error();
  const Scene& scene = tracer.scene();
  if (playSpace.seenArea.size() != 2 * std::size_t{scene.triangleCount()}) {
    return Error{ErrorCode::failed, "surfels: the play space is of another scene"};
  }

  // Spread candidates over what is seen, and choose among them.
  const SurfaceSampler sampler(tracer, playSpace, options.count, kEmitterSurfels, context);
  if (context.cancelled()) return cancelledError();
  if (sampler.empty()) return Error{ErrorCode::failed, "surfels: the play space sees no surface to place them on"};
  Result<Placement> placed = placeSamples(tracer, playSpace, sampler, options, seed, context);
  if (!placed) return placed.error();
  const std::vector<SurfaceSample>& samples = placed->samples;
  const std::size_t count = samples.size();
  const float spacing = densestSpacing(sampler.measure() * placed->share, count);

  // Find out which surfel stands for which part of the surfaces, and what that part looks like.
  PlacedSurfels result;
  const std::size_t footprintSamples = kFootprintSamples * count;
  const double ownLookups = static_cast<double>(footprintSamples + kMoveRaysPerSurfel * count);
  result.map = buildSurfelMap(scene, playSpace, samples, spacing, context, lookups + ownLookups);
  if (context.cancelled()) return cancelledError();
  const Drawn inside = drawPoints(sampler, footprintSamples, seed, 1, context);
  const auto width =
      static_cast<float>(onLadder(std::sqrt(sampler.measure() / static_cast<double>(footprintSamples)), kSpacings));
  Footprints footprints = integrateFootprints(scene, result.map, samples, inside.samples, width, context);
  if (context.cancelled()) return cancelledError();
  result.emitters = findEmitterFootprints(scene, result.map, samples, sampler, spacing, seed, context);
  if (context.cancelled()) return cancelledError();
  result.bakedEmission = shineMarked(scene, samples, footprints.emission);

  // Move each surfel to where it is lit.
  result.seeds = moveToVisible(tracer, playSpace, result.map, samples, seed, context);
  if (context.cancelled()) return cancelledError();

  // Hand over.
  std::vector<glm::vec3> position(count), normal(count);
  std::vector<std::uint32_t> instance(count);
  for (std::size_t i = 0; i < count; ++i) {
    position[i] = result.seeds[i].positionWorld;
    normal[i] = result.seeds[i].normal;
    instance[i] = result.seeds[i].point.instance;
  }
  Surfels& surfels = result.surfels;
  surfels.positionWorld = std::move(position);
  surfels.normal = std::move(normal);
  surfels.albedo = std::move(footprints.albedo);
  surfels.emission = std::move(footprints.emission);
  surfels.receiver = std::vector<std::uint32_t>(count, kGridReceiver);
  surfels.instance = std::move(instance);
  surfels.areaEach = static_cast<float>(sampler.seenArea() * placed->share / static_cast<double>(count));
  result.statistics = measure(*placed, sampler, playSpace.total, surfels.areaEach, spacing, context);
  if (context.cancelled()) return cancelledError();
  return result;
}

std::vector<glm::vec3> litNormals(const Scene& scene, std::span<const SurfelSeed> seeds, Context& context) {
  std::vector<glm::vec3> normals(seeds.size());
  parallelChunks(context, "", seeds.size(), kSeedsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::vec3 front = shadingNormal(scene, seeds[i].point);
      normals[i] = seeds[i].side % 2 == 0 ? front : -front;
    }
  });
  return normals;
}

}  // namespace relume
