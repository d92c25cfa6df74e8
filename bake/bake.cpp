// SPDX-License-Identifier: MIT
// The pipeline, as numbered steps: every stage takes what the ones before it made and hands a plain struct on.
#include "relume/bake/bake.h"

#include "bake/base/printed.h"
#include "bake/budget/choose_sizes.h"
#include "bake/budget/error_search.h"
#include "bake/links/links.h"
#include "bake/stage_memory.h"
#include "bake/stages.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

namespace relume {
namespace {

Result<Bake> bakeStages(const Scene& scene, const BakeOptions& asked, BudgetIs budgetIs, Context& context) {
  // 1. Senders: what gives light, and 2. receivers: where it is gathered (PIC 4.2, 4.3, 4.4)
  Result<PlacedLevel> placed = placeLevel(scene, chooseSizes(asked), context);
  if (!placed) return placed.error();
  const Result<BakeOptions> chosen = chooseLinksOf(*placed, asked, budgetIs);
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

// Bakes, larger each time, until one certifies the error that was asked for.
Result<Bake> bakeToError(const Scene& scene, const BakeOptions& asked, Context& context) {
  const double maxError = static_cast<double>(asked.budget.maxError);
  ErrorSearch search(maxError, largestMemoryMiB(asked));
  Bake found;
  double least = std::numeric_limits<double>::infinity();  // error so far
  while (!search.isOver()) {
    BakeOptions trial = asked;
    const double memoryMiB = search.memoryMiB();
    trial.budget.memoryMiB = static_cast<float>(memoryMiB);
    const bool isLimit = trial.budget.memoryMiB == asked.budget.memoryMiB || asked.budget.frameMs > 0.0f;
    Result<Bake> baked = bakeStages(scene, trial, isLimit ? BudgetIs::limit : BudgetIs::wish, context);
    if (!baked) return baked;
    if (baked->certificate.empty())
      return Error{ErrorCode::failed,
                   "option budget.maxError (--max-error): there is no error to hold it against, as no "
                   "light reaches what players see"};
    const double error = static_cast<double>(certifiedError(baked->certificate));
    least = std::min(least, error);
    context.message(Severity::info, printed("%.1f MiB: certified error %.1f %%", memoryMiB, 100.0 * error));
    search.note(error);
    if (search.foundMiB() == memoryMiB) found = std::move(*baked);
  }
  if (search.foundMiB() == 0.0)
    return Error{
        ErrorCode::failed,
        printed("option budget.maxError (--max-error) is %g, and bakes of up to %.1f MiB certify %g at best; raise "
                "it, or the budget",
                maxError, search.memoryMiB(), least)};
  found.provenance.optionsJson = optionsToJson(asked);
  return found;
}

}  // namespace

Result<Bake> bake(const Scene& scene, const BakeOptions& options, Context& context) {
  return guardBake(scene, options, context, [&] {
    return options.budget.maxError > 0.0f ? bakeToError(scene, options, context)
                                          : bakeStages(scene, options, BudgetIs::limit, context);
  });
}

}  // namespace relume
