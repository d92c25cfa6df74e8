// SPDX-License-Identifier: MIT
// See overall_progress.h. The weights are seconds: fitted to the stages of the presets draft, medium and high on the
// sample level, two cores. Other levels and machines shift the shares; the time that is left corrects itself as it
// goes.
#include "tools/base/overall_progress.h"

#include "bake/budget/choose_sizes.h"

#include <algorithm>

namespace relume {
namespace {

double cachesOf(const CacheOptions& o) {
  const double lattice = static_cast<double>(o.gridResolution.x) * o.gridResolution.y * o.gridResolution.z;
  const double grid = lattice > 0.0 ? lattice : o.gridCaches;
  // About half of a light map's texels hold a cache.
  const double map = o.lightmapSize > 0 ? 0.5 * o.lightmapSize * o.lightmapSize : o.lightmapCaches;
  return grid + map;
}

}  // namespace

ProgressPlan planBake(const BakeOptions& asked, bool verify) {
  // How many bakes it takes to an error, and of what sizes, nobody knows.
  if (asked.budget.maxError > 0.0f) return {};
  const BakeOptions o = chooseSizes(asked);
  const double caches = cachesOf(o.caches);
  const double rays = caches * o.links.raysPerCache * (1.0 + o.links.emitterRays);
  const double walks = o.playSpace.mode == PlaySpaceOptions::Mode::all ? 0.0 : o.playSpace.walks;
  const std::vector<ProgressPlan::Part> bake = {{"rays", 0.02},
                                                {"play space", 0.01 + 6e-6 * walks},
                                                {"surfels", 4e-5 * o.surfels.count},
                                                {"hierarchy", 1e-5 * o.surfels.count},
                                                {"caches", 0.1 + 1e-4 * caches},
                                                {"test rays", 0.02 + 1.5e-6 * o.surfels.count + 1e-8 * rays},
                                                {"links", 0.05 + 4e-7 * rays},
                                                {"receivers", 1e-7 * o.surfels.count},
                                                {"provenance", 0.001},
                                                {"certificate", 0.02 + 2e-6 * o.surfels.count + 5e-6 * caches}};
  ProgressPlan plan{{{"import", 0.05}}};
  plan.parts.insert(plan.parts.end(), bake.begin(), bake.end());
  for (const ProgressPlan::Part& part : bake) {
    if (verify) plan.parts.push_back({"verify: " + part.stage, part.weight});
  }
  return plan;
}

double OverallProgress::update(std::string_view stage, double fraction) {
  const auto& parts = plan_.parts;
  const auto found = std::find_if(parts.begin() + static_cast<std::ptrdiff_t>(std::min(current_, parts.size())),
                                  parts.end(), [&](const ProgressPlan::Part& part) { return part.stage == stage; });
  if (found == parts.end()) return overall_;
  current_ = static_cast<std::size_t>(found - parts.begin());
  double done = 0.0, all = 0.0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    all += parts[i].weight;
    if (i < current_) done += parts[i].weight;
  }
  done += std::clamp(fraction, 0.0, 1.0) * found->weight;
  if (all > 0.0) overall_ = std::max(overall_, done / all);
  return overall_;
}

double OverallProgress::secondsLeft(double elapsed) const {
  constexpr double kMin = 0.02;  // of the whole, before a guess is worth telling
  return overall_ >= kMin && overall_ < 1.0 ? elapsed * (1.0 - overall_) / overall_ : 0.0;
}

}  // namespace relume
