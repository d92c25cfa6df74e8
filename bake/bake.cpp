// SPDX-License-Identifier: MIT
// The pipeline, as numbered steps: every stage takes what the ones before it made and hands a plain struct on.
#include "relume/bake/bake.h"

#include "bake/base/memory_budget.h"
#include "bake/caches/caches.h"
#include "bake/hierarchy/hierarchy.h"
#include "bake/links/links.h"
#include "bake/rays/ray_tracer.h"
#include "bake/scene/check_limits.h"
#include "bake/stage_memory.h"
#include "bake/surfels/surfels.h"
#include "bake/visibility/play_space.h"
#include "formats/validate.h"
#include "relume/bake/provenance.h"

#include <algorithm>
#include <new>
#include <type_traits>
#include <utility>

namespace relume {
namespace {

// Run one stage inside its report entry.
template <class Work>
auto stage(Context& context, const char* name, Work&& work) {
  const Context::Stage entry(context, name);
  context.progress(name, 0.0);
  auto result = work();
  context.figure("memory_mib", static_cast<double>(heldMemory()) / 1048576.0);
  if (result) context.progress(name, 1.0);
  return result;
}

// Run the work if its memory was granted.
template <class Work>
std::invoke_result_t<Work> needs(const Status& reserved, Work&& work) {
  if (!reserved) return reserved.error();
  return work();
}

bool hasFixedTriangles(const Scene& scene) {
  return std::any_of(scene.instances.begin(), scene.instances.end(), [&](const Instance& instance) {
    return instance.baked() && !scene.meshes[instance.mesh].triangle.empty();
  });
}

// Most rays of a bake are traced for links. If a cache casts few, packets are faster (docs/notes/tracing.md).
RayStructure rayStructureFor(const BakeOptions& options) {
  constexpr double kMany = 1e7;
  constexpr std::uint32_t kMinBundleRays = 256;
  const double caches = static_cast<double>(options.caches.lightmapCaches) + options.caches.gridCaches;
  if (caches * options.links.raysPerCache < kMany) return RayStructure::quick;
  return options.links.raysPerCache < kMinBundleRays ? RayStructure::thorough : RayStructure::bundles;
}

Status checkResult(const Bake& bake) {
  for (const Finding& finding : validateBake(bake)) {
    if (finding.severity == FindingSeverity::error)
      return Error{ErrorCode::failed, "the bake is not valid, a fault of the baker: " + toString(finding)};
  }
  return done();
}

Result<Bake> bakeStages(const Scene& scene, const BakeOptions& options, Context& context) {
  // 0. The ray tracer over the fixed part of the level, and the surfaces that receivers can see
  const RayStructure structure = rayStructureFor(options);
  auto tracer = stage(context, "rays", [&] {
    return needs(reserveRays(scene, structure, context),
                 [&] { return RayTracer::create(scene, options.embreeIsa, context, structure); });
  });
  if (!tracer) return tracer.error();
  auto space = stage(context, "play space", [&] {
    return needs(reservePlaySpace(scene, options.playSpace, context),
                 [&] { return findPlaySpace(*tracer, options.playSpace, options.seed, context); });
  });
  if (!space) return space.error();

  // 1. Senders: what gives light (PIC 4.2, 4.3). Surfels, then patches of the sky
  auto placed = stage(context, "surfels", [&] {
    return needs(reserveSurfels(scene, options.surfels, context),
                 [&] { return placeSurfels(*tracer, *space, options.surfels, options.seed, context); });
  });
  if (!placed) return placed.error();
  auto hierarchy = stage(context, "hierarchy", [&] {
    return needs(reserveHierarchy(placed->surfels, options, context), [&] {
      return clusterSurfels(*tracer, placed->surfels, options.links.skyPatches, options.clustering, context);
    });
  });
  if (!hierarchy) return hierarchy.error();

  // 2. Receivers: where light is gathered (PIC 4.4)
  auto caches =
      stage(context, "caches", [&] { return placeCaches(*tracer, *space, options.caches, options.seed, context); });
  if (!caches) return caches.error();

  // 3. Transport, cache by cache: nothing of size n_C x n_S is stored (PIC 3.1, 4.5, 4.6)
  auto traced = stage(context, "links", [&] {
    return needs(reserveLinks(*hierarchy, *caches, options.links, context), [&] {
      return traceLinks(*tracer, placed->surfels, placed->map, *hierarchy, *caches, options.links, options.seed,
                        context);
    });
  });
  if (!traced) return traced.error();
  hierarchy->firstWeight = std::move(traced->firstWeight);

  // 4. Where each surfel reads its own irradiance, for the next bounce
  auto receivers = stage(context, "receivers", [&]() -> Result<std::vector<std::uint32_t>> {
    auto found = findReceivers(*tracer, *caches, placed->seeds, context);
    if (context.cancelled()) return cancelledError();
    return found;
  });
  if (!receivers) return receivers.error();
  placed->surfels.receiver = std::move(*receivers);
  if (!placed->bakedEmission.empty()) placed->surfels.emission = std::move(placed->bakedEmission);

  // 5. Hand over
  auto bake = stage(context, "provenance", [&]() -> Result<Bake> {
    std::vector<BakedInstance> instances = describeInstances(scene);
    Provenance provenance = describeProvenance(scene, instances, options, tracer->description());
    return Bake{std::move(placed->surfels), std::move(*hierarchy), std::move(*caches),    std::move(traced->links),
                std::move(instances),       std::move(provenance), describeShapes(scene), std::move(placed->emitters)};
  });
  if (context.cancelled()) return cancelledError();
  if (!bake) return bake;

  // 6. Check: a bake that a reader would refuse is an error here
  const Status valid = stage(context, "validate", [&] { return checkResult(*bake); });
  if (!valid) return valid.error();
  return bake;
}

}  // namespace

Result<Bake> bake(const Scene& scene, const BakeOptions& options, Context& context) {
  if (const Status status = checkOptions(options); !status) return status.error();
  if (const Status status = checkLimits(scene); !status) return status.error();
  if (!hasFixedTriangles(scene))
    return Error{ErrorCode::failed, "scene \"" + scene.name +
                                        "\" has no triangle to bake: no mesh, or every node is "
                                        "\"dynamic\" or \"ignore\" in extras.relume"};
  try {
    Result<Bake> baked = bakeStages(scene, options, context);
    if (!baked && !context.cancelled())
      baked.error().message = "scene \"" + scene.name + "\": " + baked.error().message;
    return baked;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::failed, "out of memory while baking \"" + scene.name + "\""};
  }
}

}  // namespace relume
