// SPDX-License-Identifier: MIT
// See place_lightmap.h.
#include "bake/caches/lightmap/place_lightmap.h"

#include "bake/base/ladder.h"
#include "bake/base/memory_budget.h"
#include "bake/base/morton.h"
#include "bake/caches/lightmap/atlas_texels.h"
#include "bake/caches/lightmap/lightmap_advice.h"
#include "formats/decimal.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <optional>
#include <string>

namespace relume {
namespace {

// Counts grow about like texelSize^-1.6: between lines and areas.
constexpr double kCountPower = 1.6;
// Bytes per patch: its resolution, and where its texels begin. Per texel of a patch: itself, and each spot for its
// cache; those are in parts first, which double as they grow and are joined one by one. Then per texel: what sharing
// caches needs. Per texel of the largest patch: its samples.
constexpr double kPatchBytes = sizeof(glm::uvec2) + 2 * sizeof(std::uint32_t), kMostSpots = 9.0, kGrowth = 1.5,
                 kSharedBytes = 130.0, kSampledBytes = 500.0;
constexpr double kBesideBytes = 1 << 20;  // small things, and what the allocator keeps
// Bytes per texel of the light map. Per triangle and side: which of its block's corners it has; per different corners,
// the three. And of the triangles that are written at a time, before equal ones are found.
constexpr double kAtlasBytes = 17.0, kWhichBytes = 1.1, kCornersPerTexel = 3.0, kWrittenAtOnce = 1u << 18;
// The search for the texel size gives up a trial that opens this many times the caches asked for. Levels as people make
// them stay below 3 from the first guess on (63 levels). Many full texels within one texel of each other may reach 300,
// and the time to count them grows with the square of the texels.
constexpr double kTooMany = 8.0;
constexpr double kTexelSizes = 32.0;     // in an octave, of the ladder that is searched
constexpr float kOftenMinTexels = 8.0f;  // with more, few caches pay, and texels shrink until enough do

struct Trial {
  PatchTexels texels;
  SharedCaches shared;
};

class Placer {
 public:
  Placer(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options, bool hasGrid,
         Context& context)
      : scene_(tracer.scene()),
        playSpace_(playSpace),
        options_(options),
        hasGrid_(hasGrid),
        context_(context),
        prober_(tracer, playSpace),
        gutter_(static_cast<std::uint32_t>(std::ceil(options.gutterTexels))) {}

  Result<PlacedLightmap> run() {
    // 1. Charts of all meshes, and a patch for each instance and side that is seen
    set_ = makePatches(scene_, playSpace_, options_, context_);
    if (context_.cancelled()) return cancelledError();
    if (set_.patches.empty() || !(set_.areaSeen > 0.0))
      return Error{
          ErrorCode::failed,
          "no surface for a light map is seen: put a camera, or a node with extras.relume.volume, where surfaces "
          "are in sight"};

    // 2. The texel size that makes as many unique caches as asked for, and the caches
    Trial trial;
    std::optional<AtlasPlan> plan;
    AtlasRequest request;
    if (options_.lightmapSize == 0) {
      trial = searchCount();
      if (context_.cancelled()) return cancelledError();
      sortCaches(trial.shared);
      request = requestAtlas(trial.texels, trial.shared);
      plan = packAtlas(request.rectangle, static_cast<std::uint32_t>(request.single.size()), gutter_, 0, &context_);
    } else {
      plan = searchSide(trial, request);
    }
    if (context_.cancelled()) return cancelledError();
    if (refused_) return *refused_;
    if (trial.shared.caches.empty()) return Error{ErrorCode::failed, whyNoCaches(trial)};
    if (!plan)
      return Error{ErrorCode::failed,
                   "the light map does not fit into " +
                       std::to_string(options_.lightmapSize ? options_.lightmapSize : kMaxAtlasSide) +
                       " texels a side"};

    // 3. The texture of indices, and where the triangles read it
    if (Status ok = reserveAtlas(*plan, request); !ok) return ok.error();
    PlacedLightmap result;
    Result<Lightmap> filled =
        fillAtlas(scene_, set_, trial.texels, trial.shared, request, *plan, gutter_, result.corners, seams_, context_);
    if (context_.cancelled()) return cancelledError();
    if (!filled) return refusedByMemory(filled.error()).error();
    result.lightmap = std::move(*filled);
    report(trial, *plan, request);
    warnAboutLightmap(playSpace_, prober_, set_, trial.texels, trial.shared, options_, hasGrid_, context_);
    result.caches = std::move(trial.shared.caches);
    return result;
  }

 private:
  // Lay texels of this size and give them caches. Empty when that needs more memory than there may be: refused_ says
  // so.
  Trial lay(double texelSize, std::size_t maxCaches = std::numeric_limits<std::size_t>::max()) {
    Trial trial;
    if (Status ok = reserveTexels(static_cast<float>(texelSize)); !ok) {
      refused_ = ok.error();
      return trial;
    }
    followCurvature(set_, static_cast<float>(texelSize));
    trial.texels = layTexels(scene_, playSpace_, set_, static_cast<float>(texelSize), context_);
    if (context_.cancelled()) return trial;
    trial.shared = shareCaches(scene_, set_, trial.texels, prober_, options_, maxCaches, context_);
    pairs_ += trial.shared.statistics.pairs;
    return trial;
  }

  // Why no texel of a trial has a cache, by what holds for most of the surface, and what users can do about it.
  std::string whyNoCaches(const Trial& trial) const {
    double buried = 0.0, small = 0.0;  // [m²]
    for (std::size_t c = 0; c < trial.texels.texels.size(); ++c)
      (trial.shared.buried[c] != 0 ? buried : small) += static_cast<double>(trial.texels.texels[c].area);
    if (buried >= small)
      return "every cache of the light map lies behind or inside geometry: turn faces to the side that is seen, or "
             "make their material doubleSided";
    return "no piece of surface is large enough for texels of " + decimalGeneral(double{trial.texels.texelSize}, 3) +
           " m: raise " + (options_.lightmapSize > 0 ? "--lightmap" : "--lightmap-caches") +
           " or extras.relume.texelDensity";
  }

  // What users can do about too many texels.
  std::string remedy() const {
    if (options_.lightmapSize > 0) return "lower --lightmap";
    return options_.minChartTexels > kOftenMinTexels ? "lower caches.minChartTexels or --lightmap-caches"
                                                     : "lower --lightmap-caches";
  }

  // Reserve memory before texels are laid, for all texels of all patches' rectangles. (The best trial before is held.)
  Status reserveTexels(float texelSize) {
    double texels = 0.0, spots = 0.0, largest = 0.0;
    for (const Patch& patch : set_.patches) {
      const glm::uvec2 size = resolutionOf(scene_, set_, patch, texelSize);
      const double count = static_cast<double>(size.x) * size.y;
      texels += count;
      if (size == glm::uvec2(1)) {
        spots += static_cast<double>(set_.meshes[scene_.instances[patch.instance].mesh].points[patch.chart].size());
      } else {
        spots += kMostSpots * count;
        largest = std::max(largest, count);
      }
    }
    std::array<char, 48> text;
    std::snprintf(text.data(), text.size(), "%.0f texels of %.3g m", texels, static_cast<double>(texelSize));
    const double kept = sizeof(PatchTexel) * texels + sizeof(ChartPoint) * spots;
    const double bytes = kBesideBytes + kPatchBytes * static_cast<double>(set_.patches.size()) + kept +
                         std::max(kGrowth * kept + kSampledBytes * largest, kSharedBytes * texels);
    return refusedByMemory(reserveMemory(context_, "light map", bytes, text.data(), remedy()));
  }

  // For the light map and where triangles read it, while caches are placed; and for the latter as the file has it.
  Status reserveAtlas(const AtlasPlan& plan, const AtlasRequest& request) {
    const glm::uvec2& size = plan.size;
    const double triangles = scene_.triangleCount();
    std::size_t largest = 0;
    for (const Mesh& mesh : scene_.meshes) largest = std::max(largest, mesh.triangle.size());
    double corners = 0.0;
    bool anyBack = false;
    for (std::size_t p = 0; p < set_.patches.size(); ++p) {
      const Patch& patch = set_.patches[p];
      const double own =
          static_cast<double>(set_.meshes[scene_.instances[patch.instance].mesh].charts[patch.chart].triangle.size());
      corners += request.rectangleOf[p] == kNone ? std::min(own, kCornersPerTexel) : own;
      anyBack = anyBack || patch.side == 1;
    }
    const double sides = anyBack ? 2.0 : 1.0;
    const double atOnce = std::min(triangles, kWrittenAtOnce + static_cast<double>(largest));
    const double bytes = kBesideBytes + kAtlasBytes * size.x * size.y + kWhichBytes * sides * triangles +
                         sizeof(TriangleCorners) * (corners + kGrowth * 2.0 * atOnce);
    const std::string what = std::to_string(size.x) + " x " + std::to_string(size.y) + " texels and " +
                             std::to_string(scene_.triangleCount()) + " triangles";
    if (Status ok = refusedByMemory(reserveMemory(context_, "light map", bytes, what, remedy())); !ok) return ok;
    return refusedByMemory(
        expectMemory(context_, "light map", sizeof(TriangleCorners) * sides * triangles,
                     "the coordinates of " + std::to_string(scene_.triangleCount()) + " triangles in the bake",
                     "leave far or small instances out of the level"));
  }

  // Told from what else fails, with which the light map is left out.
  static Status refusedByMemory(Status status) {
    if (!status) status.error().code = ErrorCode::memory;
    return status;
  }

  double firstGuess(double target) const {
    double texelArea = 0.0;  // [m²] at density 1
    for (const Patch& patch : set_.patches)
      texelArea += double{patch.area} * double{patch.levelDensity} * double{patch.levelDensity};
    return std::sqrt(texelArea / std::max(1.0, target));
  }

  // Search the ladder for the texel size whose number of unique caches is nearest to the target, by secant steps in
  // logarithms. After a trial that was given up, take the geometric mean of its size and the last one that was not.
  Trial searchCount() {
    constexpr int kSteps = 7;
    constexpr double kCloseCount = 0.03;
    const double target = options_.lightmapCaches;
    const auto maxCaches = static_cast<std::size_t>(kTooMany * target);
    Trial best;
    double size = onLadder(firstGuess(target), kTexelSizes), bestOff = INFINITY, power = kCountPower, lastSize = 0.0,
           lastCount = 0.0;
    double tooFine = 0.0;  // the largest size that was given up
    for (int i = 0; i < kSteps && !context_.cancelled(); ++i) {
      ++steps_;
      Trial trial = lay(size, maxCaches);
      if (refused_) return best;
      if (trial.shared.tooMany) {
        tooFine = size;
        size = onLadder(lastSize > size ? std::sqrt(size * lastSize) : size * std::pow(kTooMany, 1.0 / power),
                        kTexelSizes);
        continue;
      }
      const double count = std::max(1.0, static_cast<double>(trial.shared.caches.size()));
      const double off = std::abs(std::log(count / target));
      if (lastSize > 0.0 && lastSize != size)
        power = std::clamp(-std::log(count / lastCount) / std::log(size / lastSize), 0.7, 3.0);
      if (off < bestOff) {
        bestOff = off;
        best = std::move(trial);
      }
      if (bestOff < kCloseCount) break;
      lastSize = size;
      lastCount = count;
      size *= std::pow(count / target, 1.0 / power);
      if (size <= tooFine) size = std::sqrt(tooFine * lastSize);
      size = onLadder(size, kTexelSizes);
      if (size == lastSize || size <= tooFine) break;
    }
    if (bestOff == INFINITY) best = lay(size);
    followCurvature(set_, best.texels.texelSize);
    return best;
  }

  // Search for the smallest texels whose patches fit into the light map that was asked for.
  std::optional<AtlasPlan> searchSide(Trial& trial, AtlasRequest& request) {
    constexpr int kSteps = 6, kTries = 24;
    const double capacity = static_cast<double>(options_.lightmapSize) * options_.lightmapSize;
    double size = firstGuess(capacity);
    for (int i = 0; i < kSteps && !context_.cancelled(); ++i) {
      const Trial tried = lay(onLadder(size, kTexelSizes));
      if (refused_) return std::nullopt;
      const AtlasRequest wish = requestAtlas(tried.texels, tried.shared);
      double area = static_cast<double>(wish.single.size());
      for (const glm::uvec2& r : wish.rectangle) area += static_cast<double>(r.x + gutter_) * (r.y + gutter_);
      const double ratio = area / (0.93 * capacity);
      if (std::abs(ratio - 1.0) < 0.02) break;
      size *= std::pow(std::max(ratio, 1e-3), 1.0 / kCountPower);
    }
    for (int i = 0; i < kTries && !context_.cancelled(); ++i, size *= 1.0 + 0.03 * (1 + i / 4)) {
      trial = lay(onLadder(size, kTexelSizes));
      if (refused_) return std::nullopt;
      sortCaches(trial.shared);
      request = requestAtlas(trial.texels, trial.shared);
      if (auto plan = packAtlas(request.rectangle, static_cast<std::uint32_t>(request.single.size()), gutter_,
                                options_.lightmapSize, &context_))
        return plan;
    }
    return std::nullopt;
  }

  // Sort the caches along a Morton curve, so that neighbours in space lie near each other in memory, as do their links.
  void sortCaches(SharedCaches& shared) const {
    const std::size_t count = shared.caches.size();
    if (count == 0) return;
    glm::vec3 low = shared.caches[0].positionWorld, high = low;
    for (const SurfaceCache& c : shared.caches) {
      low = glm::min(low, c.positionWorld);
      high = glm::max(high, c.positionWorld);
    }
    const glm::vec3 extent = glm::max(high - low, glm::vec3(1e-20f));
    const float scale = 1048575.0f / std::max({extent.x, extent.y, extent.z});
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order(count);
    for (std::uint32_t c = 0; c < count; ++c) {
      order[c] = {mortonOf((shared.caches[c].positionWorld - low) * scale), c};
    }
    std::sort(order.begin(), order.end());
    std::vector<SurfaceCache> sorted(count);
    std::vector<std::uint32_t> renamed(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      sorted[i] = shared.caches[order[i].second];
      renamed[order[i].second] = i;
    }
    shared.caches = std::move(sorted);
    for (std::uint32_t& c : shared.cacheOfTexel) {
      if (c != kNoCache) c = renamed[c];
    }
  }

  void report(const Trial& trial, const AtlasPlan& plan, const AtlasRequest& request) {
    double charts = 0.0, uvArea = 0.0, surfaceArea = 0.0;
    ChartQuality quality;
    for (const MeshCharts& mesh : set_.meshes) {
      quality.add(mesh.quality);
      charts += static_cast<double>(mesh.charts.size());
      for (const Chart& chart : mesh.charts) {
        uvArea += chart.areaUv;
        surfaceArea += chart.areaSurface;
      }
    }
    context_.figure("charts", charts);
    context_.figure("chart_area_kept_share", surfaceArea > 0.0 ? uvArea / surfaceArea : 1.0);
    context_.figure("chart_stretch_rms", quality.stretchRms());
    context_.figure("chart_stretch_p99", quality.stretchP99());
    context_.figure("chart_anisotropy", quality.anisotropyMean());
    context_.figure("chart_area_ratio", quality.areaRatioMean());
    context_.figure("chart_folded_m2", quality.folded);
    context_.figure("search_steps", steps_);
    context_.figure("search_texel_pairs", static_cast<double>(pairs_));
    context_.figure("patches", static_cast<double>(set_.patches.size()));
    context_.figure("texel_m", trial.texels.texelSize);
    context_.figure("lightmap_caches", static_cast<double>(trial.shared.caches.size()));
    context_.figure("lightmap_width", plan.size.x);
    context_.figure("lightmap_height", plan.size.y);
    context_.figure("packing_share", plan.used);
    context_.figure("seams_m", seams_.length);
    context_.figure("seam_jump_unstitched_texels", seams_.before);
    context_.figure("seam_jump_texels", seams_.after);
    context_.figure("rectangles", static_cast<double>(request.rectangle.size()));
    context_.figure("texels_shared", trial.shared.statistics.shared);
    context_.figure("caches_moved", trial.shared.statistics.moved);
    context_.figure("texels_without_cache", trial.shared.statistics.dropped);
    warnWide();
  }

  void warnWide() {
    if (set_.wide.empty()) return;
    std::string names;
    for (std::size_t i = 0; i < std::min<std::size_t>(set_.wide.size(), 5); ++i)
      names += (i > 0 ? ", \"" : "\"") + scene_.instances[set_.wide[i]].node + "\"";
    if (set_.wide.size() > 5) names += " and " + std::to_string(set_.wide.size() - 5) + " more";
    context_.message(Severity::warning, "node " + names + ": far larger than what is seen of it, " +
                                            (hasGrid_ ? "reads the grid" : "stays dark, as there is no grid") +
                                            ". For a light map, split its triangles where receivers come near");
  }

  const Scene& scene_;
  const PlaySpace& playSpace_;
  const CacheOptions& options_;
  const bool hasGrid_;
  Context& context_;
  const Prober prober_;
  const std::uint32_t gutter_;
  PatchSet set_;
  std::optional<Error> refused_;
  int steps_ = 0;            // of the search for the texel size
  std::uint64_t pairs_ = 0;  // SharedCaches::Statistics::pairs of all trials
  SeamJump seams_;
};

}  // namespace

Result<PlacedLightmap> placeLightmap(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                                     bool hasGrid, Context& context) {
  return Placer(tracer, playSpace, options, hasGrid, context).run();
}

}  // namespace relume
