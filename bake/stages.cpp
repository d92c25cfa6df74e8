// SPDX-License-Identifier: MIT
// See stages.h.
#include "bake/stages.h"

#include "bake/base/memory_budget.h"
#include "bake/caches/caches.h"
#include "bake/caches/receivers_in_sight.h"
#include "bake/certificate/certify.h"
#include "bake/hierarchy/hierarchy.h"
#include "bake/scene/check_limits.h"
#include "bake/scene/check_triangles.h"
#include "bake/stage_memory.h"
#include "bake/visibility/play_space.h"
#include "formats/validate.h"
#include "relume/bake/provenance.h"

#include <cerrno>
#include <cstring>
#include <new>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {
namespace {

constexpr std::uint64_t kLinkRaysPerTestRay = 192;

// Most rays of a bake are traced for links. If a cache casts few, packets are faster (docs/notes/tracing.md).
RayStructure rayStructureFor(const BakeOptions& options) {
  constexpr double kMany = 1e7;
  constexpr std::uint32_t kMinBundleRays = 256;
  const double caches = static_cast<double>(options.caches.lightmapCaches) + options.caches.gridCaches;
  if (caches * options.links.raysPerCache < kMany) return RayStructure::quick;
  return options.links.raysPerCache < kMinBundleRays ? RayStructure::thorough : RayStructure::bundles;
}

}  // namespace

void noteHeldMemory(Context& context) { context.figure("memory_mib", static_cast<double>(heldMemory()) / 1048576.0); }

Error outOfMemory(const Scene& scene, const std::bad_alloc& e) {
  if (std::string_view(e.what()) != std::strerror(EAGAIN))  // as parallel.cpp throws it
    return {ErrorCode::failed, "out of memory while baking \"" + scene.name + "\""};
  return {
      ErrorCode::failed,
      "a thread cannot be started: the system's limit is reached (ulimit -u), or there is no memory for it; bake \"" +
          scene.name + "\" with fewer, or raise the limit"};
}

Status checkBakeable(const Scene& scene, const BakeOptions& options) {
  if (const Status status = checkOptions(options); !status) return status.error();
  if (const Status status = checkLimits(scene); !status) return status.error();
  return checkBakedTriangles(scene);
}

Result<RayTracer> buildRays(const Scene& scene, const BakeOptions& options, Context& context) {
  const RayStructure structure = rayStructureFor(options);
  return runStage(context, "rays", [&] {
    return needs(reserveRays(scene, structure, context),
                 [&] { return RayTracer::create(scene, options.embreeIsa, context, structure); });
  });
}

PlaceStages placeStages(const BakeOptions& options) {
  PlaceStages stages;
  stages.findSpace = [options](const RayTracer& tracer, Context& context) {
    return runStage(context, "play space", [&] {
      return needs(reservePlaySpace(tracer.scene(), options.playSpace, context),
                   [&] { return findPlaySpace(tracer, options.playSpace, options.seed, context); });
    });
  };
  stages.placeCaches = [options](const RayTracer& tracer, const PlaySpace& space, Context& context) {
    return runStage(context, "caches",
                    [&] { return relume::placeCaches(tracer, space, options.caches, options.seed, context); });
  };
  return stages;
}

double linkLookups(const BakeOptions& options) {
  const CacheOptions& caches = options.caches;
  if (caches.lightmapSize > 0 || caches.gridSpacing > 0.0f || caches.gridResolution != glm::uvec3(0))
    return kManyLookups;  // how many caches that makes is not known yet
  const double rays = (1.0 + static_cast<double>(options.links.emitterRays)) * options.links.raysPerCache;
  // Once for links, and before for their shares.
  return 2.0 * rays * (static_cast<double>(caches.lightmapCaches) + caches.gridCaches);
}

Result<PlacedLevel> placeLevel(const Scene& scene, const BakeOptions& options, const PlaceStages& stages,
                               Context& context, double mapLookups, std::optional<RayTracer> rays) {
  // 0. The ray tracer over the fixed part of the level, and the surfaces that receivers can see
  auto tracer = rays ? Result<RayTracer>(std::move(*rays)) : buildRays(scene, options, context);
  if (!tracer) return tracer.error();
  auto space = stages.findSpace(*tracer, context);
  if (!space) return space.error();

  // 1. Senders: what gives light (PIC 4.2, 4.3). Surfels, then patches of the sky
  auto placed = runStage(context, "surfels", [&] {
    return needs(reserveSurfels(scene, *space, options.surfels, context),
                 [&] { return placeSurfels(*tracer, *space, options.surfels, options.seed, context, mapLookups); });
  });
  if (!placed) return placed.error();
  auto hierarchy = runStage(context, "hierarchy", [&] {
    return needs(reserveHierarchy(placed->surfels, options, context), [&] {
      return clusterSurfels(*tracer, placed->surfels, options.links.skyPatches, options.clustering, context);
    });
  });
  if (!hierarchy) return hierarchy.error();
  placed->surfels.normal = litNormals(scene, placed->seeds, context);
  if (context.cancelled()) return cancelledError();

  // 2. Receivers: where light is gathered (PIC 4.4)
  auto caches = stages.placeCaches(*tracer, *space, context);
  if (!caches) return caches.error();

  // 3. What rays find, for the certificate: one for every so many that links are traced with
  auto test = runStage(context, "test rays", [&] {
    return needs(reserveTestRays(placed->surfels, context), [&] {
      return traceTestRays(*tracer, *space, *placed, *hierarchy, *caches,
                           std::uint64_t{caches->count()} * options.links.raysPerCache / kLinkRaysPerTestRay,
                           options.seed, context);
    });
  });
  if (!test) return test.error();
  return PlacedLevel{std::move(*tracer), std::move(*placed), std::move(*hierarchy), std::move(*caches),
                     std::move(*test)};
}

Status placeReceivers(PlacedLevel& placed, Context& context) {
  auto receivers = runStage(context, "receivers", [&]() -> Result<std::vector<std::uint32_t>> {
    auto found = findReceivers(placed.tracer, placed.caches, placed.surfels.seeds, context);
    keepReceiversInSight(placed.tracer, placed.caches, placed.surfels.seeds, found, context);
    if (context.cancelled()) return cancelledError();
    return found;
  });
  if (!receivers) return receivers.error();
  placed.surfels.surfels.receiver = std::move(*receivers);
  placed.surfels.seeds = {};
  return done();
}

Result<Bake> handOver(const Scene& scene, const BakeOptions& options, PlacedLevel placed, Links links,
                      const std::string& rayTracer, Context& context) {
  Surfels surfels = std::move(placed.surfels.surfels);
  if (!placed.surfels.bakedEmission.empty()) surfels.emission = std::move(placed.surfels.bakedEmission);
  Emitters emitters = std::move(placed.surfels.emitters);
  Hierarchy hierarchy = std::move(placed.hierarchy);
  PlacedCaches caches = std::move(placed.caches);
  // Rays and maps go first: the corners of the light map need the memory.
  { const PlacedLevel rest = std::move(placed); }
  Result<Bake> bake = runStage(context, "provenance", [&]() -> Result<Bake> {
    if (const Status reserved = reserveCorners(caches, context); !reserved) return reserved.error();
    std::vector<BakedInstance> instances = describeInstances(scene);
    Provenance provenance = describeProvenance(scene, instances, options, rayTracer);
    return Bake{std::move(surfels),    std::move(hierarchy), unpack(std::move(caches)),
                std::move(links),      std::move(instances), std::move(provenance),
                describeShapes(scene), std::move(emitters),  Certificate{}};
  });
  if (context.cancelled()) return cancelledError();
  return bake;
}

Status checkBaked(const Bake& bake, Context& context) {
  return runStage(context, "validate", [&]() -> Status {
    for (const Finding& finding : validateBake(bake)) {
      if (finding.severity == FindingSeverity::error)
        return Error{ErrorCode::failed, "the bake is not valid, a fault of the baker: " + toString(finding)};
    }
    return done();
  });
}

Result<Certificate> certifyBaked(const Bake& bake, const TestRays& test, Context& context) {
  return runStage(context, "certificate", [&] {
    return needs(reserveCertificate(bake, context), [&] {
      Result<Certificate> certificate = certify(bake, test, context);
      if (certificate) context.figure("certified_error", static_cast<double>(certifiedError(*certificate)));
      return certificate;
    });
  });
}

}  // namespace relume
