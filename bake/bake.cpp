// SPDX-License-Identifier: MIT
// The pipeline, as numbered steps: every stage takes what the ones before it made and hands a plain struct on.
#include "relume/bake/bake.h"

#include "bake/bake_over_rays.h"
#include "bake/budget/bake_to_error.h"
#include "bake/budget/choose_sizes.h"
#include "bake/links/links.h"
#include "bake/stage_memory.h"
#include "bake/stages.h"

#include <optional>
#include <string>
#include <utility>

namespace relume {
namespace {

// rays: to bake with, if there are any, and to leave there; null: built here, and gone before the memory is needed.
Result<Bake> bakeStages(const Scene& scene, const BakeOptions& asked, Context& context,
                        std::optional<RayTracer>* rays) {
  // 1. Senders: what gives light, and 2. receivers: where it is gathered (PIC 4.2, 4.3, 4.4)
  const BakeOptions sized = chooseSizes(asked);
  Result<PlacedLevel> placed =
      placeLevel(scene, sized, placeStages(sized), context, linkLookups(sized),
                 rays != nullptr ? std::exchange(*rays, std::nullopt) : std::optional<RayTracer>());
  if (!placed) return placed.error();
  const Result<BakeOptions> chosen = chooseLinks(asked, placed->surfels.surfels, placed->hierarchy, placed->caches);
  if (!chosen) return chosen.error();
  const LinkOptions& links = chosen->links;

  // 3. Transport, cache by cache: nothing of size n_C x n_S is stored (PIC 3.1, 4.5, 4.6)
  auto traced = runStage(context, "links", [&] {
    return needs(reserveLinks(placed->hierarchy, placed->caches, links, context), [&] {
      return traceLinks(placed->tracer, placed->surfels.surfels, placed->surfels.map, placed->hierarchy, placed->caches,
                        links, asked.seed, context);
    });
  });
  if (!traced) return traced.error();
  placed->hierarchy.firstWeight = std::move(traced->firstWeight);

  // 4. Where each surfel reads its own irradiance, for the next bounce
  if (const Status status = placeReceivers(*placed, context); !status) return status.error();

  // 5. Hand over
  const TestRays test = std::move(placed->test);
  const std::string rayTracer = placed->tracer.description();
  if (rays != nullptr) rays->emplace(std::move(placed->tracer));
  Result<Bake> bake = handOver(scene, asked, std::move(*placed), std::move(traced->links), rayTracer, context);
  if (!bake) return bake;

  // 6. Check: a bake that a reader would refuse is an error here
  if (const Status valid = checkBaked(*bake, context); !valid) return valid.error();

  // 7. Certify: how far what a game reads is from what rays have found
  auto certificate = certifyBaked(*bake, test, context);
  if (!certificate) return certificate.error();
  bake->certificate = std::move(*certificate);
  return bake;
}

Result<Bake> bakeBy(const Scene& scene, const BakeOptions& options, Context& context, std::optional<RayTracer>* rays) {
  return guardBake(scene, options, context, [&] {
    return bakeToError(options, context,
                       [&](const BakeOptions& sized) { return bakeStages(scene, sized, context, rays); });
  });
}

}  // namespace

Result<Bake> bake(const Scene& scene, const BakeOptions& options, Context& context) {
  return bakeBy(scene, options, context, nullptr);
}

Result<Bake> bakeOverRays(const Scene& scene, const BakeOptions& options, std::optional<RayTracer>& rays,
                          Context& context) {
  return bakeBy(scene, options, context, &rays);
}

}  // namespace relume
