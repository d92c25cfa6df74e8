// SPDX-License-Identifier: MIT
// See runtime_cost.h.
#include "bake/budget/runtime_cost.h"

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// Memory, by reading runtime/cpu: four words and two node indices a surfel, its two nodes of the tree with their
// colours.
constexpr double kSurfelBytes = 16.3, kTreeBytes = 10.3, kSkyBytes = 12.0;
// Surfels that read the grid, or caches of other normals, say what they read.
constexpr double kBounceBytes = 1.35;
// Position in the grid; normal on the light map, and colour for it; the coefficients, and what they are counted in.
constexpr double kGridCacheBytes = 12.0, kMapCacheBytes = 8.0, kCoefficientBytes = 2.0;
// Numbers of caches, in the light map and the grid: in two bytes while so many caches are on the map.
constexpr double kSightBytes = 4.0, kIndexBytes = 2.0, kWideIndexBytes = 4.0, kNarrowCaches = 65534.0;
// Of what depth maps take in the bake: triangles that hide nothing are left out.
constexpr double kSightShare = 0.65;
constexpr double kRowBytes = 2.1, kStepBytes = 1.0, kNodesOfStep = 65536.0;

// Times.
// A surfel reads its bounce from one colour of the light map, or from coefficients.
constexpr double kColorNs = 4.8, kCoefficientsNs = 8.4, kPullNs = 1.5;
constexpr double kNodesInCache = 65536.0;  // beyond, colours of nodes are fetched from farther away
constexpr double kFartherNs = 0.12;        // for each doubling

double coefficients(double luma, double chroma) { return luma * luma + 2.0 * chroma * chroma; }

// The bands that its caches hold.
double coefficients(const CostSizes& s) { return coefficients(s.lumaBands, s.chromaBands); }

// Bytes of a cache's coefficients: of a cache on the light map those that its receivers read (CacheBands::onMap()), in
// whole words.
double lightBytes(double count) { return kCoefficientBytes * 2.0 * std::ceil(0.5 * (1.0 + count)); }
double mapLightBytes(const CostSizes& s) {
  const auto onMap = [&](std::uint32_t bands) {
    if (s.linkKind == LinkKind::irradiance) return 1u;
    return bands > 2 && bands % 2 == 0 ? bands - 1 : bands;
  };
  return lightBytes(coefficients(onMap(s.lumaBands), onMap(s.chromaBands)));
}

double nodes(const CostSizes& s) { return 2.0 * (s.surfels + s.skyPatches); }

// The share of links whose caches are in the grid, as caches get the same on average.
double gridShare(const CostSizes& s) { return s.gridCaches / std::max(s.gridCaches + s.mapCaches, 1.0); }

// The counts of what is placed.
void count(const Surfels& surfels, const Hierarchy& hierarchy, const Caches& caches, CostSizes& sizes) {
  sizes.surfels = surfels.count();
  sizes.skyPatches = static_cast<double>(hierarchy.senderCount()) - sizes.surfels;
  const CacheGrid& grid = caches.grid;
  sizes.gridCaches = std::min(caches.firstMapCache(), caches.count());
  sizes.mapCaches = caches.count() - sizes.gridCaches;
  sizes.texels = static_cast<double>(caches.lightmap.cache.size());
  sizes.sightWords = static_cast<double>(caches.lightmap.sight.size());
  sizes.gridIndexBytes = kIndexBytes * static_cast<double>(grid.cache.size() + grid.brick.size() + grid.fine.size()) +
                         kSightShare * 4.0 * static_cast<double>(grid.depth.size());
}

}  // namespace

CostSizes costSizesOf(const Bake& bake) {
  CostSizes sizes;
  sizes.linkKind = bake.links.kind;
  sizes.linkBands = bake.links.bands;
  sizes.lumaBands = bake.provenance.lumaBands;
  sizes.chromaBands = bake.provenance.chromaBands;
  count(bake.surfels, bake.hierarchy, bake.caches, sizes);
  return sizes;
}

CostSizes costSizesOf(const BakeOptions& options) {
  CostSizes sizes;
  sizes.linkKind = options.links.kind;
  sizes.linkBands = options.links.bands;
  sizes.lumaBands = options.lumaBands;
  sizes.chromaBands = options.chromaBands;
  return sizes;
}

CostSizes costSizesOf(const Surfels& surfels, const Hierarchy& hierarchy, const Caches& caches,
                      const BakeOptions& options) {
  CostSizes sizes = costSizesOf(options);
  count(surfels, hierarchy, caches, sizes);
  return sizes;
}

RuntimeCost costWithoutLinks(const CostSizes& s) {
  const bool mapIrradiance = s.linkKind == LinkKind::irradiance;
  const double caches = s.gridCaches + s.mapCaches, k = coefficients(s);
  RuntimeCost cost;
  cost.bytes = (kSurfelBytes + kTreeBytes + kBounceBytes) * s.surfels + kSkyBytes * s.skyPatches + kRowBytes * caches +
               (kGridCacheBytes + lightBytes(k)) * s.gridCaches + (kMapCacheBytes + mapLightBytes(s)) * s.mapCaches +
               (s.mapCaches > kNarrowCaches ? kWideIndexBytes : kIndexBytes) * s.texels + kSightBytes * s.sightWords +
               s.gridIndexBytes;
  if (s.linkKind == LinkKind::oct6) cost.bytes += kStepBytes * caches * std::floor(nodes(s) / kNodesOfStep);
  // A nanosecond a coefficient: sums become coefficients, halves and texels.
  const double surfelNs = (mapIrradiance || s.lumaBands == 1 ? kColorNs : kCoefficientsNs) + kPullNs;
  cost.frameMs = 1e-6 * (surfelNs * s.surfels + k * s.gridCaches + (mapIrradiance ? 3.0 : k) * s.mapCaches);
  return cost;
}

RuntimeCost costOfLink(const CostSizes& s) {
  const double k = coefficients(s), grid = gridShare(s);
  const double far = kFartherNs * std::max(0.0, std::log2(nodes(s) / kNodesInCache));
  switch (s.linkKind) {
    case LinkKind::sh:
      return {4.0 + 2.0 * coefficients(s.linkBands, 0.0), 1e-6 * (3.0 + 0.06 * k + far)};
    case LinkKind::cone:
      return {12.0, 1e-6 * (1.6 + 0.012 * k + far)};
    case LinkKind::oct6:
      return {5.0, 1e-6 * (0.60 + 0.006 * k + far)};
    case LinkKind::irradiance:
      return {4.0 + 4.0 * grid, 1e-6 * (0.55 + 0.02 * k * grid + far)};
  }
  return {};
}

RuntimeCost runtimeCost(const Bake& bake) {
  const CostSizes sizes = costSizesOf(bake);
  const RuntimeCost fixed = costWithoutLinks(sizes), link = costOfLink(sizes);
  const double links = bake.links.count();
  return {fixed.bytes + links * link.bytes, fixed.frameMs + links * link.frameMs};
}

}  // namespace relume
