// SPDX-License-Identifier: MIT
// See stage_memory.h. The bytes per item are sums of the sizes of what is kept for each; those of Embree's trees and of
// the clustering are estimates.
#include "bake/stage_memory.h"

#include "bake/base/memory_budget.h"
#include "bake/base/parallel.h"
#include "bake/certificate/test_lights.h"
#include "bake/links/share_links.h"
#include "bake/rays/built_triangles.h"
#include "bake/surfels/surface_sampler.h"

#include <algorithm>
#include <string>

namespace relume {
namespace {

// Rays, per triangle: corners and indices, Embree's tree and what it is built from, and the tree for ray bundles.
constexpr double kTriangleBytes = 9 * 4 + 3 * 4 + 1, kTreeBytes = 130.0, kThoroughBytes = 260.0, kBundleBytes = 200.0;
constexpr double kInstanceBytes = 1200.0;  // an Embree geometry of its own
// Play space, per side: its area and flags, half as much again while they grow. Per voxel that was hit: in the counter,
// twice while it grows, and sorted.
constexpr double kWalkBytes = 8 << 20;  // rays and hits of the walks that run at a time
constexpr double kSideBytes = 8, kHitBytes = 16.0 * 4, kHitsPerVoxel = 12.0;
// Surfels, per candidate: the sample, the point of the elimination, and what that is sorted by; per neighbour, which is
// listed twice. A disc of the surfels' spacing holds 2 pi / sqrt(3) times as many candidates as there are to a surfel,
// and up to a half more where candidates lie closer.
constexpr double kCandidateBytes = sizeof(SurfaceSample) + 32 + 28 + 24 + 16 + 12, kNeighbourBytes = 2 * 4;
constexpr double kNeighbours = 1.5 * 3.6276;     // per candidate, times candidates per surfel
constexpr double kSampledSideBytes = 4 + 4 + 2;  // a side that is seen, in the sampler, while it grows
constexpr double kMappedSideBytes = 2;           // a side of the surfel map, which its neighbours share
constexpr double kPartSides = 1u << 20, kPartSideBytes = 8 + 4 + 4;  // and while its part of the map is made
constexpr double kSurfelBytes = 8 * 48 + 8 * 16 + 400;               // sights, footprints, tiles of the map
constexpr double kClusterBytes = 420.0;                              // a surfel, clustered
constexpr double kTestSurfelBytes = 8.0 * (kTestSuns + kTestLamps);
// A relighter, by surfel, node, link and cache: docs/PERFORMANCE.md.
constexpr double kReadSurfelBytes = 64.0, kReadNodeBytes = 24.0, kReadLinkBytes = 8.0, kReadCacheBytes = 512.0;
constexpr double kBesideBytes = 1 << 20;   // names and sums, and what the allocator keeps
constexpr double kWorkerNodeBytes = 48.0;  // a node, in each thread that links

std::string number(double count) { return std::to_string(static_cast<std::uint64_t>(count)); }

double sendersOf(const Surfels& surfels, const BakeOptions& options) {
  return static_cast<double>(surfels.count()) + options.links.skyPatches;
}

double linkBytes(const LinkOptions& options) {
  switch (options.kind) {
    case LinkKind::sh:
      return 4.0 + 2.0 * options.bands * options.bands;
    case LinkKind::cone:
      return 12.0;
    default:
      return 8.0;
  }
}

}  // namespace

Status reserveRays(const Scene& scene, RayStructure structure, Context& context, RayGeometry geometry) {
  const BuiltTriangles count = builtTriangles(scene, geometry);
  const auto triangles = static_cast<double>(count.triangles), instances = static_cast<double>(count.instances);
  double each = kTriangleBytes + (isQuick(structure) ? kTreeBytes : kThoroughBytes);
  if (isForBundles(structure)) each += kBundleBytes;
  return reserveMemory(context, "rays", static_cast<double>(count.built()) * each + instances * kInstanceBytes,
                       number(triangles) + " triangles in " + number(instances) + " instances",
                       "mark far or small instances \"dynamic\" or \"ignore\" in extras.relume");
}

Status reservePlaySpace(const Scene& scene, const PlaySpaceOptions& options, Context& context) {
  const double hits = static_cast<double>(options.walks) * options.maxBounces;
  return reserveMemory(
      context, "play space", kWalkBytes + 2.0 * kSideBytes * scene.triangleCount() + kHitBytes * hits / kHitsPerVoxel,
      number(scene.triangleCount()) + " triangles and " + number(hits) + " steps of walks", "lower --walks");
}

Status reserveSurfels(const Scene& scene, const PlaySpace& space, const SurfelOptions& options, Context& context) {
  const bool isEliminated = options.placement == SurfelOptions::Placement::eliminated;
  const double count = options.count;
  // Beyond 2^25, fewer candidates a surfel are drawn.
  const double candidates =
      isEliminated ? std::min(double{options.candidateFactor} * count, std::max(0x1p25, 1.5 * count)) : count;
  const double neighbours = isEliminated && count > 0.0 ? kNeighbours * candidates / count : 0.0;
  // Candidates go before footprints come.
  const double most = std::max((kCandidateBytes + kNeighbourBytes * neighbours) * candidates, kSurfelBytes * count);
  const double sides = 2.0 * scene.triangleCount();
  double seen = 0.0;
  for (std::size_t side = 0; side < space.seenArea.size(); ++side) seen += space.seenArea[side] > 0.0f ? 1.0 : 0.0;
  return reserveMemory(context, "surfels",
                       most + sizeof(SurfaceSample) * count + kSampledSideBytes * seen + kMappedSideBytes * sides +
                           kPartSideBytes * std::min(sides, kPartSides),
                       number(candidates) + " candidates on " + number(scene.triangleCount()) + " triangles",
                       isEliminated ? "lower --surfels or surfels.candidateFactor" : "lower --surfels");
}

Status reserveHierarchy(const Surfels& surfels, const BakeOptions& options, Context& context) {
  return reserveMemory(context, "hierarchy", kClusterBytes * sendersOf(surfels, options),
                       number(sendersOf(surfels, options)) + " senders", "lower --surfels");
}

Status reserveLinks(const Hierarchy& hierarchy, const Caches& caches, const LinkOptions& options, Context& context,
                    double share) {
  const LinkBudget budget(options, caches.count(), hierarchy.groupRoot.size());
  const double links =
      share * std::min(budget.total, static_cast<double>(caches.count()) *
                                         std::min<double>(budget.maxPerCache, hierarchy.senderCount()));
  const double threads = context.threads > 0 ? context.threads : coresOfProcess();
  return reserveMemory(context, "links",
                       // Rows of all chunks, and once more as they are joined
                       2.0 * linkBytes(options) * links + kWorkerNodeBytes * threads * hierarchy.nodeCount(),
                       number(links) + " links of " + number(share * caches.count()) + " caches",
                       options.linksTotal > 0 ? "lower --links-total, or the budget of the bake"
                                              : "lower --links, --lightmap-caches or --grid-caches");
}

Status reserveCorners(const PlacedCaches& caches, Context& context) {
  const double triangles =
      static_cast<double>(caches.corners.front.size()) + static_cast<double>(caches.corners.back.size());
  return reserveMemory(context, "bake", kBesideBytes + sizeof(TriangleCorners) * triangles,
                       "the light-map coordinates of " + number(triangles) + " sides of triangles",
                       "leave far or small instances out of the level");
}

Status reserveTestRays(const Surfels& surfels, Context& context) {
  return reserveMemory(context, "test rays", kTestSurfelBytes * surfels.count(),
                       number(surfels.count()) + " surfels under each light", "lower --surfels");
}

Status reserveCertificate(const Bake& bake, Context& context) {
  const double links = bake.links.count(), caches = bake.caches.count();
  return reserveMemory(context, "certificate",
                       kReadSurfelBytes * bake.surfels.count() + kReadNodeBytes * bake.hierarchy.nodeCount() +
                           kReadLinkBytes * links + kReadCacheBytes * caches,
                       number(links) + " links of " + number(caches) + " caches, read as a game does",
                       "lower --links, --lightmap-caches or --grid-caches");
}

}  // namespace relume
