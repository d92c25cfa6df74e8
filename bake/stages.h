// SPDX-License-Identifier: MIT
// The stages of a bake, each inside its entry of the report: what bake() and a plan of shards (bake/shards/plan.h) have
// in common. bake.cpp reads as their list.
#pragma once

#include "bake/caches/caches.h"
#include "bake/certificate/test_rays.h"
#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surfels.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"

#include <functional>
#include <new>
#include <optional>
#include <string>
#include <type_traits>

namespace relume {

// [MiB] What the process holds, noted as a figure of the stage that runs now.
void noteHeldMemory(Context& context);

// Run one stage inside its report entry.
template <class Work>
auto runStage(Context& context, const char* name, Work&& work) {
  const Context::Stage entry(context, name);
  context.progress(name, 0.0);
  auto result = work();
  noteHeldMemory(context);
  if (result) context.progress(name, 1.0);
  return result;
}

// Run the work if its memory was granted.
template <class Work>
std::invoke_result_t<Work> needs(const Status& reserved, Work&& work) {
  if (!reserved) return reserved.error();
  return work();
}

// Senders and receivers of a level, and its rays: all that links are traced with. And what its bake is to be held
// against.
struct PlacedLevel {
  RayTracer tracer;
  PlacedSurfels surfels;
  Hierarchy hierarchy;
  PlacedCaches caches;
  TestRays test;
};

// What every way to bake begins with, and how its errors end: options and scene checked, the scene named in messages,
// no exception. usage: options out of range; failed: as bake().
Status checkBakeable(const Scene& scene, const BakeOptions& options);
template <class Work>
std::invoke_result_t<Work> guardBake(const Scene& scene, const BakeOptions& options, Context& context, Work&& work);

// The ray tracer over the fixed part of the level.
Result<RayTracer> buildRays(const Scene& scene, const BakeOptions& options, Context& context);

// Two stages of placing, which depend on shapes and options alone: another bake may have kept what they made.
struct PlaceStages {
  // The surfaces that receivers can see; the caches.
  std::function<Result<PlaySpace>(const RayTracer&, Context&)> findSpace;
  std::function<Result<PlacedCaches>(const RayTracer&, const PlaySpace&, Context&)> placeCaches;
};
// They are made here.
PlaceStages placeStages(const BakeOptions& options);

// Rays, the surfaces that receivers can see, surfels, hierarchy, caches, test rays. The scene must outlive it.
// mapLookups: about how often the map of surfels will be asked for links; a file needs it whole. rays: of the fixed
// part of the level; built here where there are none.
Result<PlacedLevel> placeLevel(const Scene& scene, const BakeOptions& options, const PlaceStages& stages,
                               Context& context, double mapLookups = kManyLookups,
                               std::optional<RayTracer> rays = std::nullopt);

// About how often links ask for the surfel of a hit.
double linkLookups(const BakeOptions& options);

// Where each surfel reads its own irradiance, for the next bounce: fills in Surfels::receiver. Takes
// PlacedSurfels::seeds.
Status placeReceivers(PlacedLevel& placed, Context& context);

// The bake of a level whose links are traced. What Surfels::emission says was for the links; the bake says what is
// baked. rayTracer: its description, for the provenance.
Result<Bake> handOver(const Scene& scene, const BakeOptions& options, PlacedLevel placed, Links links,
                      const std::string& rayTracer, Context& context);

// A bake that a reader would refuse is an error here.
Status checkBaked(const Bake& bake, Context& context);

// What a valid bake says of its own error: Bake::certificate.
Result<Certificate> certifyBaked(const Bake& bake, const TestRays& test, Context& context);

// Of a bake that ended by it: of memory, or of threads (parallel.h).
Error outOfMemory(const Scene& scene, const std::bad_alloc& e);

template <class Work>
std::invoke_result_t<Work> guardBake(const Scene& scene, const BakeOptions& options, Context& context, Work&& work) {
  if (const Status status = checkBakeable(scene, options); !status) return status.error();
  try {
    auto baked = work();
    if (!baked && !context.cancelled())
      baked.error().message = "scene \"" + scene.name + "\": " + baked.error().message;
    return baked;
  } catch (const std::bad_alloc& e) {
    return outOfMemory(scene, e);
  }
}

}  // namespace relume
