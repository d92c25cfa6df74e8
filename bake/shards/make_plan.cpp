// SPDX-License-Identifier: MIT
// See plan.h.
#include "bake/budget/choose_sizes.h"
#include "bake/links/link_tracer.h"
#include "bake/rays/ray_tracer_name.h"
#include "bake/shards/plan.h"
#include "bake/shards/shard.h"
#include "bake/stage_memory.h"
#include "bake/stages.h"
#include "relume/bake/provenance.h"

#include <string>
#include <utility>

namespace relume {
namespace {

Result<PlannedLevel> planStages(const Scene& scene, const BakeOptions& options, const PlaceStages& stages,
                                Context& context) {
  if (options.budget.maxError > 0.0f)
    return Error{ErrorCode::usage,
                 "option budget.maxError (--max-error): not for a plan, as it takes whole bakes; give --budget-mb"};
  Result<PlacedLevel> placed = placeLevel(scene, chooseSizes(options), stages, context);
  if (!placed) return placed.error();
  BakePlan plan;
  plan.options = options;
  const Result<BakeOptions> chosen = chooseLinks(options, placed->surfels.surfels, placed->hierarchy, placed->caches);
  if (!chosen) return chosen.error();
  plan.chosen = *chosen;
  const LinkOptions& chosenLinks = plan.chosen.links;
  if (const Status status = LinkTracer::check(placed->surfels.surfels, placed->hierarchy, placed->caches, chosenLinks);
      !status)
    return status.error();
  if (const Status status = placeReceivers(*placed, context); !status) return status.error();
  plan.test = std::move(placed->test);
  plan.map = std::move(placed->surfels.map);
  if (!placed->surfels.bakedEmission.empty()) plan.tracedEmission = placed->surfels.surfels.emission.toVector();
  Links links = noLinks(placed->caches, chosenLinks);
  RayTracer tracer = std::move(placed->tracer);
  Result<Bake> bake = handOver(scene, options, std::move(*placed), std::move(links), tracer.description(), context);
  if (!bake) return bake.error();
  plan.bake = std::move(*bake);
  return PlannedLevel{std::move(plan), std::move(tracer)};
}

Error otherProgram(const std::string& what, const std::string& made, const std::string& mine) {
  return {ErrorCode::unsupported, "the plan was made by " + what + " " + made + ", this program has " + mine +
                                      "; make the plan again, or use that program for all shards"};
}

}  // namespace

Links noLinks(const Caches& caches, const LinkOptions& options) {
  Links links;
  links.kind = options.kind;
  links.bands = options.kind == LinkKind::sh ? options.bands : 0;
  links.rowBegin = std::vector<std::uint32_t>(std::size_t{caches.count()} + 1, 0);
  return links;
}

Result<PlannedLevel> planLevel(const Scene& scene, const BakeOptions& options, const PlaceStages& stages,
                               Context& context) {
  return guardBake(scene, options, context, [&] { return planStages(scene, options, stages, context); });
}

// The one number that the caches share: how far links are refined.
Result<float> findThreshold(const RayTracer& tracer, const BakePlan& plan, Context& context) {
  return runStage(context, "link shares", [&] {
    return needs(reserveLinks(plan.bake.hierarchy, plan.bake.caches, plan.chosen.links, context, 0.0),
                 [&] { return ShardTracer(tracer, plan).findMinKey(context); });
  });
}

Result<BakePlan> makePlan(const Scene& scene, const BakeOptions& options, Context& context) {
  return guardBake(scene, options, context, [&]() -> Result<BakePlan> {
    Result<PlannedLevel> planned = planStages(scene, options, placeStages(chooseSizes(options)), context);
    if (!planned) return planned.error();
    const Result<float> minKey = findThreshold(planned->tracer, planned->plan, context);
    if (!minKey) return minKey.error();
    planned->plan.minKey = *minKey;
    return std::move(planned->plan);
  });
}

Status checkPlanVersion(const BakePlan& plan) {
  const Provenance& then = plan.bake.provenance;
  const Provenance now = describeProvenance(Scene{}, {}, plan.options, "");
  if (then.algorithmVersion != now.algorithmVersion)
    return otherProgram("algorithm version", std::to_string(then.algorithmVersion),
                        std::to_string(now.algorithmVersion));
  if (then.toolVersion != now.toolVersion) return otherProgram("version", then.toolVersion, now.toolVersion);
  return done();
}

Status checkPlanTracer(const BakePlan& plan) {
  const std::string then = plan.bake.provenance.rayTracer, now = rayTracerName(plan.options.embreeIsa);
  return then == now ? done() : Status(otherProgram("the ray tracer", then, now));
}

Status checkPlanLevel(const BakePlan& plan, const Scene& scene) {
  if (hashScene(scene, describeInstances(scene)) == plan.bake.provenance.sceneHash) return done();
  return Error{ErrorCode::invalidFile, "scene \"" + scene.name +
                                           "\" is not the one of the plan: shapes, places, materials or play volumes "
                                           "differ; make the plan again, or give the level it was made of"};
}

}  // namespace relume
