// SPDX-License-Identifier: MIT
// See bake_to_error.h.
#include "bake/budget/bake_to_error.h"

#include "bake/base/printed.h"
#include "bake/budget/choose_sizes.h"
#include "bake/budget/error_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace relume {
namespace {

// The error that the noise of a certificate alone would look like: the root of the middle light's standard error.
double noiseOf(const Certificate& certificate) {
  std::vector<std::pair<float, float>> lights;  // squared error and its standard error
  for (std::size_t i = 0; i < certificate.squaredError.size(); ++i)
    lights.emplace_back(certificate.squaredError[i], certificate.standardError[i]);
  std::sort(lights.begin(), lights.end());
  return std::sqrt(0.5 * (lights[(lights.size() - 1) / 2].second + lights[lights.size() / 2].second));
}

// An error of which the certificate can only say that it is small meets any bound.
void warnOfNoise(const Certificate& certificate, double maxError, Context& context) {
  const double noise = noiseOf(certificate);
  if (maxError >= noise || static_cast<double>(certifiedError(certificate)) >= noise) return;
  context.message(Severity::warning,
                  printed("option budget.maxError (--max-error) is %g, and so small an error is below what the bake's "
                          "certificate can tell: its noise is as large as an error of %.1f %%",
                          maxError, 100.0 * noise));
}

}  // namespace

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
    return Error{ErrorCode::failed,
                 printed("option budget.maxError (--max-error) is %g, and of the sizes tried, up to %.1f MiB, the best "
                         "certifies %.3g; raise it, or the budget",
                         maxError, largestMiB, least)};
  warnOfNoise(found.certificate, maxError, context);
  found.provenance.optionsJson = optionsToJson(asked);
  return found;
}

}  // namespace relume
