// SPDX-License-Identifier: MIT
// See lightmap_advice.h.
#include "bake/caches/lightmap/lightmap_advice.h"

#include "bake/base/parallel.h"
#include "bake/caches/lightmap/texel_units.h"
#include "bake/caches/receiver_sight.h"
#include "formats/decimal.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

// Most nodes named in each kind of warning, and the smallest share of all seen surface that is worth one: surface that
// reads the grid, and backs that have caches, which a game may still not draw.
constexpr std::size_t kMaxNamed = 10, kMaxSmooth = 5;
constexpr double kMinShare = 1e-3, kMinLitBacks = 1e-2;
// Spots at which it is asked whether receivers see a node's surface.
constexpr std::size_t kSpots = 32;
// The advised density gives caches to this share of a node's surface in small pieces.
constexpr double kMended = 0.9;
// A density that would take more than this share of the light map is no advice, for all else would get larger texels
// (fortitude at medium: those of two nodes' densities took 4.6 m to 14 m). Pieces without another remedy are told of
// from this share of all seen surface on.
constexpr double kAffordable = 0.25, kMinHopeless = 1e-2;
// The largest extras.relume.texelDensity.
constexpr double kMaxDensity = 100.0;
// Smooth parts that would need more than this factor of density are so small that no warning is given.
constexpr double kMaxFollowed = 16.0;
// A smooth part shows its texels when its normals turn by this multiple of kMaxTurn from texel to texel.
constexpr float kVisibleTurn = 1.5f;

// A density as a person would write it, rounded up to two digits.
std::string rounded(double density) {
  const double unit = std::pow(10.0, std::floor(std::log10(density)) - 1.0);
  return decimalGeneral(std::ceil(density / unit - 1e-6) * unit, 6);
}

// Three digits, and no exponent in areas of whole landscapes.
std::string number(double value) {
  if (value < 999.5) return decimalGeneral(value, 3);
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 2.0);
  return std::to_string(std::llround(std::round(value / unit) * unit));
}

// Surface of one kind.
struct Surface {
  double area = 0.0;                 // [m²] that is seen
  std::vector<std::uint32_t> texel;  // texels on it; then only those on which receivers were found to look, each for an
                                     // equal area
};

// The seen surface of a node that something is wrong with.
struct Faulty {
  Surface litBacks;   // backs of one-sided faces
  Surface backs;      // those that read the grid
  Surface buried;     // reads the grid: behind or inside something
  Surface small;      // reads the grid: too small for a cache
  double cost = 0.0;  // [m²] area by the density squared: in proportion to the texels of the whole node
};

class Adviser {
 public:
  Adviser(const PlaySpace& playSpace, const Prober& prober, const PatchSet& set, const PatchTexels& texels,
          const SharedCaches& shared, const CacheOptions& options, bool hasGrid, Context& context)
      : scene_(prober.tracer().scene()),
        playSpace_(playSpace),
        prober_(prober),
        set_(set),
        texels_(texels),
        shared_(shared),
        options_(options),
        hasGrid_(hasGrid),
        context_(context),
        isCoarse_(options.lightmapSize == 0 &&
                  options.lightmapCaches < presetOptions(Preset::medium).caches.lightmapCaches) {}

  void run() {
    std::vector<Faulty> faulty(scene_.instances.size());
    double total = 0.0;
    for (std::uint32_t p = 0; p < set_.patches.size(); ++p) {
      total += addPatch(p, faulty[set_.patches[p].instance]);
    }
    keepSeen(faulty);
    for (const Faulty& node : faulty) cost_ += node.cost;
    context_.figure("grid_lit_area_share", total / set_.areaSeen);
    if (!hasGrid_) warnDark(faulty);
    forLargest(
        kMaxNamed, [&](std::uint32_t i) { return smallToTellOf(i, faulty[i]); },
        [&](std::uint32_t i) { warnSmall(i, faulty[i]); });
    forLargest(
        kMaxNamed, [&](std::uint32_t i) { return faulty[i].buried.area; },
        [&](std::uint32_t i) { warnBuried(i, faulty[i]); });
    forLargest(
        kMaxNamed, [&](std::uint32_t i) { return backsToTellOf(faulty[i]); },
        [&](std::uint32_t i) { warnBacks(i, faulty[i]); });
    adviseSmooth();
  }

 private:
  std::string nameOf(std::uint32_t instance) const { return "node \"" + scene_.instances[instance].node + "\""; }

  // Add a patch that is at fault to its node's surface. Returns the area [m²] of a patch without any cache, or 0.
  double addPatch(std::uint32_t p, Faulty& faulty) const {
    const Patch& patch = set_.patches[p];
    const Instance& instance = scene_.instances[patch.instance];
    const Chart& chart = set_.meshes[instance.mesh].charts[patch.chart];
    const bool isBack = patch.side == 1 && !scene_.bothSides(instance, chart.triangle[0]);
    faulty.cost += static_cast<double>(patch.area) * patch.density * patch.density;
    bool isLit = false, buried = false;
    for (std::uint32_t c = texels_.firstTexel[p]; c < texels_.firstTexel[p + 1]; ++c) {
      isLit = isLit || shared_.cacheOfTexel[c] != kNoCache;
      buried = buried || shared_.buried[c] != 0;
    }
    if (isLit && !isBack) return 0.0;
    const bool isSmall = !buried && wantedDensity(patch) > static_cast<double>(patch.density);
    Surface& surface = isLit ? faulty.litBacks : isSmall ? faulty.small : isBack ? faulty.backs : faulty.buried;
    surface.area += static_cast<double>(patch.area);
    for (std::uint32_t c = texels_.firstTexel[p]; c < texels_.firstTexel[p + 1]; ++c) surface.texel.push_back(c);
    return isLit ? 0.0 : static_cast<double>(patch.area);
  }

  // The density of texels at which a patch gets a cache of its own. A texel gets one from minTexels full texels of
  // surface on: area (density / texel size)² = minTexels.
  double wantedDensity(const Patch& patch) const {
    const double minTexels = ownCacheTexels(options_), texel = texels_.texelSize;
    return std::sqrt(minTexels * texel * texel / std::max(static_cast<double>(patch.area), 1e-30));
  }

  // The extras.relume.texelDensity at which most of a node's surface in small pieces gets caches.
  double mendingDensity(const Surface& small) const {
    std::vector<double> wanted;
    for (const std::uint32_t texel : small.texel) {
      // Keep the part of the density that does not come from the level.
      const Patch& patch = set_.patches[texels_.texels[texel].patch];
      const double others = patch.density / scene_.instances[patch.instance].texelDensity;
      wanted.push_back(wantedDensity(patch) / others);
    }
    if (wanted.empty()) return 1.0;
    std::sort(wanted.begin(), wanted.end());
    const double last = std::ceil(kMended * static_cast<double>(wanted.size())) - 1.0;
    return wanted[static_cast<std::size_t>(std::max(last, 0.0))];
  }

  bool isWorthAWarning(double area, double share = kMinShare) const { return area > share * set_.areaSeen; }

  // Whether a density leaves the others nearly all of their texels.
  bool isAffordable(std::uint32_t instance, const Faulty& faulty, double density) const {
    const double factor = density / scene_.instances[instance].texelDensity;
    return faulty.cost * (factor * factor - 1.0) <= kAffordable * cost_;
  }

  // The area [m²] of small pieces, or 0 where they are not worth a warning.
  double smallToTellOf(std::uint32_t instance, const Faulty& faulty) const {
    if (isCoarse_ || !isWorthAWarning(faulty.small.area)) return 0.0;
    const double density = mendingDensity(faulty.small);
    const bool mends = density <= kMaxDensity && isAffordable(instance, faulty, density);
    return mends || isWorthAWarning(faulty.small.area, kMinHopeless) ? faulty.small.area : 0.0;
  }

  // The area [m²] of all backs, or 0 where they are not worth a warning.
  double backsToTellOf(const Faulty& faulty) const {
    const double all = faulty.backs.area + faulty.litBacks.area;
    return isWorthAWarning(faulty.backs.area) || isWorthAWarning(all, kMinLitBacks) ? all : 0.0;
  }

  // Leave out what no receiver sees, though the play space counts it as seen.
  void keepSeen(std::vector<Faulty>& faulty) const {
    std::vector<Surface*> asked;
    const auto ask = [&](Surface& surface) {
      if (!surface.texel.empty()) asked.push_back(&surface);
    };
    for (Faulty& node : faulty) {
      if (!isCoarse_ && isWorthAWarning(node.small.area)) ask(node.small);
      if (isWorthAWarning(node.buried.area)) ask(node.buried);
      if (backsToTellOf(node) > 0.0) {
        ask(node.backs);
        ask(node.litBacks);
      }
    }
    if (asked.empty()) return;
    const ReceiverSight sight(playSpace_, prober_, context_);
    parallelChunks(context_, "", asked.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) keepSeen(*asked[i], sight);
    });
  }

  // Ask at spots that stand for equal areas, each at another point of its texel.
  void keepSeen(Surface& surface, const ReceiverSight& sight) const {
    std::vector<double> upTo;  // [m²] of the texels up to each
    double area = 0.0;
    for (const std::uint32_t texel : surface.texel)
      upTo.push_back(area += static_cast<double>(texels_.texels[texel].area));
    std::vector<std::uint32_t> seen;
    for (std::size_t k = 0; k < kSpots; ++k) {
      const double at = area * (static_cast<double>(k) + 0.5) / kSpots;
      const auto found = std::upper_bound(upTo.begin(), upTo.end() - 1, at) - upTo.begin();
      const std::uint32_t number = surface.texel[static_cast<std::size_t>(found)];
      const PatchTexel& texel = texels_.texels[number];
      SurfaceSpot spot =
          spotOf(scene_, set_.patches[texel.patch], texels_.points[texel.firstPoint + k % texel.pointCount]);
      spot.positionWorld += spot.normal * prober_.liftAt(spot.positionWorld, texelSizeOf(set_, texels_, number));
      if (sight.sees(spot)) seen.push_back(number);
    }
    surface.area *= static_cast<double>(seen.size()) / kSpots;
    surface.texel = std::move(seen);
  }

  // Visit the nodes with the most of some kind of surface, as far as that is worth a warning.
  void forLargest(std::size_t maxCount, const std::function<double(std::uint32_t)>& area,
                  const std::function<void(std::uint32_t)>& warn) const {
    std::vector<std::uint32_t> order(scene_.instances.size());
    std::iota(order.begin(), order.end(), 0u);
    std::vector<double> areas(order.size());
    for (const std::uint32_t i : order) areas[i] = area(i);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return areas[a] > areas[b]; });
    for (std::size_t i = 0; i < std::min(maxCount, order.size()); ++i) {
      if (!isWorthAWarning(areas[order[i]])) break;
      warn(order[i]);
    }
  }

  // Backs are left out, for a game that draws none shows nothing there.
  void warnDark(const std::vector<Faulty>& faulty) const {
    double area = 0.0;
    for (const Faulty& node : faulty) area += node.small.area + node.buried.area;
    if (!isWorthAWarning(area, kMinHopeless)) return;
    const bool asked = options_.gridCaches > 0 || options_.gridSpacing > 0.0f || options_.gridResolution.x > 0;
    context_.message(Severity::warning,
                     number(area) + " m² of seen surface have no cache of the light map and read the grid, which has " +
                         "none: they stay dark; " +
                         (asked ? "make the grid finer (--grid-caches or --grid-spacing)" : "give --grid-caches") +
                         ", or ask for more light-map caches (" + lightmapOption() + ")");
  }

  std::string lightmapOption() const {
    return options_.lightmapSize != 0 ? "--lightmap, now " + std::to_string(options_.lightmapSize)
                                      : "--lightmap-caches, now " + std::to_string(options_.lightmapCaches);
  }

  const char* gridLight() const { return hasGrid_ ? "read the grid" : "stay dark"; }

  void warnSmall(std::uint32_t instance, const Faulty& faulty) const {
    const double density = mendingDensity(faulty.small);
    const std::string node = nameOf(instance), now = number(scene_.instances[instance].texelDensity);
    const std::string what = node + ": " + number(faulty.small.area) +
                             " m² of seen surface are in pieces too small for texels of " + number(texels_.texelSize) +
                             " m and " + gridLight() + "; ";
    const std::string gridLit =
        hasGrid_ ? ", or mark it extras.relume.bake: \"gridLit\" if the grid's light will do for all of it" : "";
    if (density > kMaxDensity)
      context_.message(Severity::warning,
                       what + "join the pieces of " + node + gridLit + ": no texelDensity up to 100 gives them caches");
    else if (isAffordable(instance, faulty, density))
      context_.message(Severity::warning, what + "raise extras.relume.texelDensity of " + node + " from " + now +
                                              " to " + rounded(density) + gridLit);
    else
      context_.message(Severity::warning, what + "join the pieces of " + node + ", ask for more light-map caches (" +
                                              lightmapOption() + ")" + gridLit +
                                              ": a texelDensity that gives them caches, " + rounded(density) +
                                              ", takes texels from all else");
  }

  void warnBacks(std::uint32_t instance, const Faulty& faulty) const {
    const double all = faulty.backs.area + faulty.litBacks.area;
    const std::string onGrid = !(faulty.backs.area > 0.0) ? ""
                               : !(faulty.litBacks.area > 0.0)
                                   ? std::string(", which ") + gridLight()
                                   : ", of which " + number(faulty.backs.area) + " m² " + gridLight();
    context_.message(Severity::warning, nameOf(instance) + ": " + number(all) +
                                            " m² of what is seen of it are backs of its one-sided faces" + onGrid +
                                            "; a game that draws no backs shows nothing there. If they are not the "
                                            "inside of something, turn the faces of " +
                                            nameOf(instance) + " over or make their material doubleSided");
  }

  void warnBuried(std::uint32_t instance, const Faulty& faulty) const {
    context_.message(Severity::warning,
                     nameOf(instance) + ": " + number(faulty.buried.area) + " m² of seen surface " + gridLight() +
                         ", for from every place on them one sees mostly backs of "
                         "one-sided faces, or touches others; move " +
                         nameOf(instance) +
                         " out of what it lies in, delete its hidden faces, or make the material of the faces around "
                         "it doubleSided");
  }

  // Warn of small smooth parts to which followCurvature() could not give enough texels. Nodes that share a mesh and its
  // density, as kit pieces do, are told of in one line.
  void adviseSmooth() const {
    std::vector<double> area(scene_.instances.size(), 0.0), density(scene_.instances.size(), 0.0);
    for (const SmoothPart& part : set_.parts) {
      const float texel = texels_.texelSize / part.density, turn = part.curvature * texel;
      if (!isFollowed(part, texels_.texelSize) || turn / part.factor < kVisibleTurn * kMaxTurn) continue;
      const double factor = turn / kMaxTurn;
      if (factor > kMaxFollowed) continue;
      area[part.instance] += part.area;
      density[part.instance] += factor * scene_.instances[part.instance].texelDensity * part.area;
    }
    std::vector<std::uint32_t> others(scene_.instances.size(), 0);  // that are told of with a node
    std::map<std::pair<std::uint32_t, float>, std::uint32_t> firstOf;
    for (std::uint32_t i = 0; i < scene_.instances.size(); ++i) {
      if (!(area[i] > 0.0)) continue;
      const Instance& instance = scene_.instances[i];
      const auto [first, isNew] = firstOf.try_emplace({instance.mesh, instance.texelDensity}, i);
      if (isNew) continue;
      ++others[first->second];
      area[first->second] += std::exchange(area[i], 0.0);
      density[first->second] += density[i];
    }
    forLargest(
        kMaxSmooth, [&](std::uint32_t i) { return area[i]; },
        [&](std::uint32_t i) {
          const double wanted = std::min(density[i] / area[i], kMaxDensity);
          const std::string alike = others[i] > 0 ? " and " + std::to_string(others[i]) + " more of its mesh" : "";
          context_.message(Severity::info,
                           nameOf(i) + alike + ": " + number(area[i]) +
                               " m² of smooth surface are curved too tightly " + "for texels of " +
                               number(texels_.texelSize) +
                               " m, which may show as facets and seams; extras.relume.texelDensity of " +
                               rounded(wanted) + " follows it (now " + number(scene_.instances[i].texelDensity) + ")");
        });
  }

  const Scene& scene_;
  const PlaySpace& playSpace_;
  const Prober& prober_;
  const PatchSet& set_;
  const PatchTexels& texels_;
  const SharedCaches& shared_;
  const CacheOptions& options_;
  const bool hasGrid_;
  Context& context_;
  // With fewer caches than those of preset medium a bake is a draft or a small budget's: that its texels are larger
  // than pieces is no fault of the level, and a density that mends it would be wrong in a finer bake.
  bool isCoarse_;      // small pieces are not told of
  double cost_ = 0.0;  // of all nodes
};

}  // namespace

void warnAboutLightmap(const PlaySpace& playSpace, const Prober& prober, const PatchSet& set, const PatchTexels& texels,
                       const SharedCaches& shared, const CacheOptions& options, bool hasGrid, Context& context) {
  Adviser(playSpace, prober, set, texels, shared, options, hasGrid, context).run();
}

}  // namespace relume
