// SPDX-License-Identifier: MIT
// See bake_to_error.h.
#include "bake/budget/bake_to_error.h"

#include "bake/base/printed.h"
#include "bake/budget/choose_sizes.h"
#include "bake/budget/error_search.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace relume {

Result<Bake> bakeToError(const BakeOptions& asked, Context& context, const BakeOnce& bakeOnce) {
  if (!(asked.budget.maxError > 0.0f)) return bakeOnce(asked);
  constexpr double kTooSmall = std::numeric_limits<double>::infinity();
  const double maxError = static_cast<double>(asked.budget.maxError), largestMiB = largestMemoryMiB(asked);
  ErrorSearch search(maxError, largestMiB);
  Bake found;
  double least = kTooSmall;  // error so far
  while (!search.isOver()) {
    const double memoryMiB = search.memoryMiB();
    BakeOptions sized = asked;
    sized.budget.maxError = 0.0f;
    sized.budget.memoryMiB = static_cast<float>(memoryMiB);
    Result<Bake> baked = bakeOnce(sized);
    if (!baked && baked.error().code == ErrorCode::usage && memoryMiB < largestMiB) {
      search.note(kTooSmall);
      continue;
    }
    if (!baked) return baked;
    if (baked->certificate.empty())
      return Error{ErrorCode::failed,
                   "option budget.maxError (--max-error): there is no error to hold it against, as no light reaches "
                   "what players see"};
    const double error = static_cast<double>(certifiedError(baked->certificate));
    least = std::min(least, error);
    context.message(Severity::info, printed("%.1f MiB: certified error %.1f %%", memoryMiB, 100.0 * error));
    search.note(error);
    if (search.foundMiB() == memoryMiB) found = std::move(*baked);
  }
  if (search.foundMiB() == 0.0)
    return Error{
        ErrorCode::failed,
        printed("option budget.maxError (--max-error) is %g, and bakes of up to %.1f MiB certify %.3g at best; "
                "raise it, or the budget",
                maxError, largestMiB, least)};
  found.provenance.optionsJson = optionsToJson(asked);
  return found;
}

}  // namespace relume
