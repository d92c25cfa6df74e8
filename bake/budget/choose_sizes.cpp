// SPDX-License-Identifier: MIT
// See choose_sizes.h.
#include "bake/budget/choose_sizes.h"

#include "bake/base/printed.h"

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// Sizes at scale 1, those of preset `high`, and how they grow with it. Caches grow with the memory; surfels, whose
// count matters less the more there are, more slowly. With fewer links than these, neighbouring caches disagree; with
// many caches, what is left to gain is in links to far and half lit clusters (docs/notes/budgets.md).
constexpr double kSurfels = 131072.0, kMapCaches = 16384.0, kGridCaches = 2304.0, kLinksPerCache = 128.0;
constexpr double kSurfelGrowth = 0.8, kSurfelGrowthBeyond = 0.6, kGridGrowth = 0.75, kLinkGrowthBeyond = 0.25;
constexpr double kMinScale = 1.0 / 64.0, kMaxScale = 128.0;
constexpr double kMinSurfels = 2048.0, kMinGridCaches = 64.0;
constexpr double kMaxCompactSenders = 524288.0, kMaxSurfels = 4194304.0;

// More links than these are worth less than what they cost: levels whose light map is small leave budgets unused.
constexpr double kMostLinksPerCache = 512.0;
constexpr double kLeastLinksPerCache = 16.0;
// Links are shared out to about 1 % of their sum.
constexpr double kMargin = 0.975;
constexpr double kMostMemoryMiB = 1024.0;  // where an error that cannot be had is given up
constexpr double kMaxLinks = 4294967295.0;

// What a light map has more than its caches: texels that copy, and caches beside those that were wished.
constexpr double kTexelsPerCache = 2.4, kCachesPerWish = 1.08, kIndexBytesPerGridCache = 205.0;

BakeOptions atScale(const BakeOptions& options, double scale) {
  BakeOptions sized = options;
  const double most = linkHasHead(options.links.kind) ? kMaxCompactSenders - options.links.skyPatches : kMaxSurfels;
  const auto whole = [](double count) { return static_cast<std::uint32_t>(std::lround(count)); };
  sized.surfels.count = whole(
      std::clamp(kSurfels * std::pow(scale, scale < 1.0 ? kSurfelGrowth : kSurfelGrowthBeyond), kMinSurfels, most));
  if (options.caches.lightmapCaches > 0) sized.caches.lightmapCaches = whole(kMapCaches * scale);
  if (options.caches.gridCaches > 0)
    sized.caches.gridCaches = whole(std::max(kGridCaches * std::pow(scale, kGridGrowth), kMinGridCaches));
  sized.links.linksPerCache = whole(kLinksPerCache * std::max(1.0, std::pow(scale, kLinkGrowthBeyond)));
  sized.links.maxLinksPerCache = 0;
  return sized;
}

// Of a level whose counts are those that are wished.
CostSizes expectedSizes(const BakeOptions& o) {
  CostSizes sizes = costSizesOf(o);
  sizes.surfels = o.surfels.count;
  sizes.skyPatches = o.links.skyPatches;
  sizes.gridCaches = o.caches.gridCaches;
  sizes.mapCaches = kCachesPerWish * o.caches.lightmapCaches;
  sizes.texels = kTexelsPerCache * o.caches.lightmapCaches;
  sizes.gridIndexBytes = kIndexBytesPerGridCache * sizes.gridCaches;
  return sizes;
}

// How many links a budget has room for beside what costs `fixed`; negative where that alone is beyond it.
double linksWithin(const BudgetOptions& budget, const RuntimeCost& fixed, const RuntimeCost& link) {
  double links = kMaxLinks;
  if (budget.memoryMiB > 0.0f)
    links = std::min(links, (kMargin * 1048576.0 * static_cast<double>(budget.memoryMiB) - fixed.bytes) / link.bytes);
  if (budget.frameMs > 0.0f)
    links = std::min(links, (kMargin * static_cast<double>(budget.frameMs) - fixed.frameMs) / link.frameMs);
  return links;
}

bool fits(const BakeOptions& options) {
  const CostSizes sizes = expectedSizes(options);
  return linksWithin(options.budget, costWithoutLinks(sizes), costOfLink(sizes)) >=
         options.links.linksPerCache * (sizes.gridCaches + sizes.mapCaches);
}

}  // namespace

BakeOptions chooseSizes(const BakeOptions& options) {
  if (!options.budget.limitsCost()) return options;
  double low = kMinScale, high = kMaxScale;
  if (!fits(atScale(options, low))) return atScale(options, low);
  constexpr int kSteps = 40;
  for (int i = 0; i < kSteps; ++i) {
    const double middle = std::sqrt(low * high);
    (fits(atScale(options, middle)) ? low : high) = middle;
  }
  return atScale(options, low);
}

Result<BakeOptions> chooseLinks(const BakeOptions& options, const Surfels& surfels, const Hierarchy& hierarchy,
                                const Caches& cachesPlaced) {
  if (!options.budget.limitsCost()) return options;
  BakeOptions sized = chooseSizes(options);
  const CostSizes placed = costSizesOf(surfels, hierarchy, cachesPlaced, sized);
  const RuntimeCost fixed = costWithoutLinks(placed), link = costOfLink(placed);
  const double caches = placed.gridCaches + placed.mapCaches;
  const double links = linksWithin(options.budget, fixed, link), least = kLeastLinksPerCache * caches;
  if (links < least) {
    return Error{
        ErrorCode::usage,
        printed("the budget is too small for this level: %.0f surfels and %.0f caches need %.2f MiB (--budget-mb) and "
                "%.2f ms (--budget-ms)",
                placed.surfels, caches, (fixed.bytes + least * link.bytes) / kMargin / 1048576.0 + 0.005,
                (fixed.frameMs + least * link.frameMs) / kMargin + 0.005)};
  }
  sized.links.linksTotal = static_cast<std::uint32_t>(std::min(links, kMostLinksPerCache * caches));
  return sized;
}

double largestMemoryMiB(const BakeOptions& options) {
  BakeOptions unbound = options;
  if (!(unbound.budget.memoryMiB > 0.0f)) unbound.budget.memoryMiB = kMostMemoryMiB;
  if (!(options.budget.frameMs > 0.0f)) return static_cast<double>(unbound.budget.memoryMiB);
  const CostSizes sizes = expectedSizes(chooseSizes(unbound));
  const double caches = sizes.gridCaches + sizes.mapCaches;
  return std::min((costWithoutLinks(sizes).bytes + kMostLinksPerCache * caches * costOfLink(sizes).bytes) / 1048576.0,
                  static_cast<double>(unbound.budget.memoryMiB));
}

}  // namespace relume
