// SPDX-License-Identifier: MIT
// Walks through the level (walks.h) hit what matters: voxels that are hardly ever hit are dropped (keep_voxels.h), and
// what is left says how much of each triangle's sides is seen.
#include "bake/visibility/play_space.h"

#include "bake/base/ladder.h"
#include "bake/base/parallel.h"
#include "bake/base/printed.h"
#include "bake/base/random.h"
#include "bake/visibility/find_starts.h"
#include "bake/visibility/keep_voxels.h"
#include "bake/visibility/seen_voxels.h"
#include "bake/visibility/surface_parts.h"
#include "bake/visibility/walks.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kReceivers = 1u << 14;  // most points handed over as PlaySpace::receivers
constexpr double kHitsPerVoxel = 24.0;        // expected if all surfaces were seen equally
constexpr float kMaxVoxelShare = 0.1f;        // largest width of a voxel, in median distances to a hit
constexpr double kLeastHitsPerVoxel =
    2.0;                                 // in the mean: in finer voxels, hits say nothing of how often a place is seen
constexpr double kVoxelSizes = 64.0;     // in an octave
constexpr float kCoarser = 4.0f;         // by which voxels grow that have fewer
constexpr float kFarLooks = 64.0f;       // a hit beyond this multiple of that distance is far: no walk continues there
constexpr double kOutermostHits = 0.01;  // share left out at each end of the box around what is looked at
constexpr double kMinFarShare = 1e-4;    // smallest share of all hits that makes a far side matter

// The width of voxels that are to be tried in place of those of the walks, which few hits share, as between two faces a
// hair apart or along a strip of kilometres; 0 = these will do.
float coarserSize(const Walks& walks, const RayTracer& tracer) {
  const glm::vec3 extent = tracer.boundsMax() - tracer.boundsMin();
  const bool fine = walks.nearHits < kLeastHitsPerVoxel * static_cast<double>(walks.voxels.size());
  const bool small = walks.grid.size < std::max({extent.x, extent.y, extent.z});
  return fine && small ? kCoarser * walks.grid.size : 0.0f;
}

// What is seen from where walks start.
struct FirstLook {
  float distance = 0.0f;  // [m] median distance to a hit, of near hits only; 0 = nothing is hit
  float hitShare = 0.0f;  // of the rays that hit something
};

FirstLook lookAround(const RayTracer& tracer, std::uint64_t seed, const StartSources& sources) {
  constexpr std::size_t kProbes = 4096;
  std::vector<Ray> rays(kProbes);
  std::vector<Hit> hits(kProbes);
  for (std::size_t i = 0; i < kProbes; ++i) {
    RandomStream random(seed, kWalkStage + kWalkRounds, i);
    const Start start = drawStart(sources, random);
    rays[i] = {start.position, 0.0f, start.direction};
  }
  tracer.trace(rays, hits);
  std::vector<float> distances;
  for (std::size_t i = 0; i < kProbes; ++i) {
    // Voxels become a share of this distance, and must not be finer than the precision of rays.
    if (hits[i] && hits[i].distance > tracer.epsilonAt(rays[i].origin)) distances.push_back(hits[i].distance);
  }
  if (distances.empty()) return {};
  std::sort(distances.begin(), distances.end());
  const float share = static_cast<float>(distances.size()) / static_cast<float>(kProbes);
  // A median that is far beyond the lower quartile is the distance to a sky box or the like: take the quartile instead.
  const float middle = distances[distances.size() / 2], quarter = distances[distances.size() / 4];
  return {middle > kFarLooks * quarter ? quarter : middle, share};
}

// Fill arrays by side in the order of the triangles, a part at a time, so that what takes no memory in them takes none
// before: measure(instance, corners, area, seenArea, flags, memo) sets the values of both sides, in parallel; those of
// instances that are not `wanted` are 0. Memo: as forEachTriangle() has it.
template <class Memo, class Wanted, class Measure>
void fillSides(const Scene& scene, PlaySpace& space, Context& context, const Wanted& wanted, const Measure& measure) {
  constexpr std::size_t kTrianglesPerPart = 1u << 20;
  const std::size_t triangles = scene.triangleCount();
  std::vector<float> seenArea;
  std::vector<std::uint8_t> flags;
  space.seenArea = SideArray<float>();
  space.flags = SideArray<std::uint8_t>();
  for (std::size_t first = 0; first < triangles; first += kTrianglesPerPart) {
    const std::size_t last = std::min(triangles, first + kTrianglesPerPart);
    seenArea.assign(2 * (last - first), 0.0f);
    flags.assign(2 * (last - first), 0);
    forEachTriangle<Memo>(scene, first, last, context, wanted,
                          [&](std::uint32_t i, std::uint32_t t, const auto& corners, float area, Memo& memo) {
                            const std::size_t at = 2 * (scene.instances[i].firstTriangle + std::size_t{t} - first);
                            measure(i, corners, area, &seenArea[at], &flags[at], memo);
                          });
    space.seenArea.append(seenArea);
    space.flags.append(flags);
  }
  space.seenArea.shrinkToFit();
  space.flags.shrinkToFit();
}

// Measure how much of each side lies in kept voxels.
void measureSides(const RayTracer& tracer, const VoxelGrid& grid, const std::vector<VoxelHits>& voxels, bool hasLarge,
                  PlaySpace& space, Context& context) {
  VoxelIndex voxelIndex(voxels);
  if (hasLarge) space.tree = VoxelTree(grid, voxels, 0);
  const SeenFacings seenFacings(tracer.scene().instances.size(), voxels);
  using Memo = VoxelMemo<std::size_t>;
  fillSides<Memo>(
      tracer.scene(), space, context, [&](std::uint32_t i) { return seenFacings.hasAny(i); },
      [&](std::uint32_t i, const auto& corners, float area, float* seenArea, std::uint8_t* flags, Memo& memo) {
        const std::array<std::uint32_t, 2> facings = VoxelGrid::facingsOf(i, crossOf(corners));
        if (!seenFacings.has(facings[0]) && !seenFacings.has(facings[1])) return;
        std::array<double, 2> seen{};  // weights of parts
        std::array<bool, 2> direct{};
        const double all =
            forEachPart(corners, area, grid.size, space.tree, i, context, [&](const glm::vec3& p, double weight) {
              const glm::ivec3 cube = grid.cubeOf(p);
              for (std::size_t side = 0; side < 2; ++side) {
                const std::uint32_t facing = facings[side];
                if (!seenFacings.has(facing)) continue;
                const std::size_t at = memo.of(facing, cube, [&] { return voxelIndex.find(voxelKey(facing, cube)); });
                if (at == voxels.size()) continue;
                seen[side] += weight;
                if (voxels[at].direct > 0) direct[side] = true;
              }
            });
        for (std::size_t side = 0; side < 2; ++side) {
          seenArea[side] = area * static_cast<float>(seen[side]) / static_cast<float>(all);
          flags[side] = direct[side] ? PlaySpace::kVisible : 0;
          if (seen[side] > 0.0 && seen[side] < all) flags[side] |= PlaySpace::kPartly;
        }
      });
  space.voxels = std::move(voxelIndex);
}

// Mark every side of every triangle as seen.
void seeAll(const Scene& scene, PlaySpace& space, Context& context) {
  struct None {};
  fillSides<None>(
      scene, space, context, [](std::uint32_t) { return true; },
      [](std::uint32_t, const auto&, float area, float* seenArea, std::uint8_t* flags, None&) {
        for (std::size_t side = 0; side < 2; ++side) {
          seenArea[side] = area;
          flags[side] = PlaySpace::kVisible;
        }
      });
}

// The area of all sides, and of the largest. [m²]
struct Areas {
  double total = 0.0;
  float largest = 0.0f;
};

Areas measureAll(const Scene& scene, Context& context) {
  constexpr std::size_t kTrianglesPerPart = 1u << 20;
  const std::size_t triangles = scene.triangleCount();
  Areas areas;
  std::vector<float> part;
  for (std::size_t first = 0; first < triangles; first += kTrianglesPerPart) {
    const std::size_t last = std::min(triangles, first + kTrianglesPerPart);
    part.assign(last - first, 0.0f);
    forEachTriangle(scene, first, last, context, [&](std::uint32_t i, std::uint32_t t, const auto&, float area) {
      part[scene.instances[i].firstTriangle + std::size_t{t} - first] = area;
    });
    for (const float area : part) {
      areas.total += area;
      areas.total += area;
      areas.largest = std::max(areas.largest, area);
    }
  }
  return areas;
}

// The area of a side that can be baked, as forEachTriangle() has it; else 0. [m²]
float areaOfSide(const Scene& scene, std::uint32_t side) {
  const Instance& instance = scene.instances[scene.instanceOf(side / 2)];
  const float area = areaOf(scene.corners(instance, side / 2 - instance.firstTriangle));
  return instance.baked() && area > 0.0f && std::isfinite(area) ? area : 0.0f;
}

// Note the sides that are seen from far away only, and return them. They count as seen as a whole: no receiver comes
// near enough to tell their parts apart.
std::vector<std::uint32_t> addFarSides(const Scene& scene, const Walks& walks, PlaySpace& space) {
  double all = walks.nearHits;
  for (const auto& [side, hits] : walks.farHits) all += hits;
  std::vector<std::uint32_t> sides;
  for (const auto& [side, hits] : walks.farHits) {
    const double share = hits / std::max(all, 1.0);
    if (share < kMinFarShare || space.seenArea[side] > 0.0f || !(areaOfSide(scene, side) > 0.0f)) continue;
    if (space.farShare.empty()) space.farShare = SideArray<float>(space.seenArea.size());
    space.farShare.set(side, static_cast<float>(share));
    sides.push_back(side);
  }
  return sides;
}

// Find the box of the voxels without the outermost hits along each axis.
void boundHits(const VoxelGrid& grid, const std::vector<VoxelHits>& voxels, PlaySpace& space) {
  for (int k = 0; k < 3; ++k) {
    std::vector<std::pair<int, double>> hits;
    double all = 0.0;
    for (const VoxelHits& c : voxels) {
      hits.emplace_back(c.cube[k], static_cast<double>(c.direct) + c.bounced);
      all += hits.back().second;
    }
    std::sort(hits.begin(), hits.end());
    double below = 0.0;
    for (const auto& [cube, count] : hits) {
      const float low = grid.origin[k] + static_cast<float>(cube) * grid.size;
      if (below <= kOutermostHits * all) space.lookedAtMin[k] = low;
      if (below < (1.0 - kOutermostHits) * all) space.lookedAtMax[k] = low + grid.size;
      below += count;
    }
  }
}

double sum(const SideArray<float>& values) {
  double total = 0.0;
  for (std::size_t side = 0; side < values.size(); ++side) total += values[side];
  return total;
}

void thin(std::vector<glm::vec3>& points) {
  if (points.size() <= kReceivers) return;
  for (std::size_t i = 0; i < kReceivers; ++i) points[i] = points[i * points.size() / kReceivers];
  points.resize(kReceivers);
}

void report(const PlaySpace& space, const char* from, Context& context) {
  context.figure("seen_area_m2", space.seenTotal);
  context.figure("culled_share", space.total > 0.0 ? 1.0 - space.seenTotal / space.total : 0.0);
  context.message(Severity::info, printed("play space, from %s: %.6g m² of %.6g m² (both sides) matter, %.1f %% culled",
                                          from, space.seenTotal, space.total,
                                          100.0 * (1.0 - space.seenTotal / std::max(space.total, 1e-300))));
}

// "play volume \"stage\"", "play volumes \"a\", \"b\" and 3 more"; of cameras the same.
template <class Source>
std::string namesOf(const std::vector<Source>& sources, const std::string& kind) {
  constexpr std::size_t kMaxNamed = 4;
  std::string text = kind + (sources.size() > 1 ? "s" : "");
  for (std::size_t i = 0; i < std::min(kMaxNamed, sources.size()); ++i)
    text += (i > 0 ? ", \"" : " \"") + sources[i].name + "\"";
  return text + (sources.size() > kMaxNamed ? " and " + std::to_string(sources.size() - kMaxNamed) + " more" : "");
}

// Of a level whose author said where receivers are, and where there is nothing.
void warnOfEmptySources(const StartSources& sources, Context& context) {
  if (sources.empty()) return;
  const bool cameras = sources.volumes.empty();
  context.message(Severity::warning,
                  "play space: nothing can be seen from " +
                      (cameras ? namesOf(sources.cameras, "camera") : namesOf(sources.volumes, "play volume")) +
                      ", so all free space of the level is taken instead, as without any; put one where receivers "
                      "can be");
}

}  // namespace

bool PlaySpace::seenAt(std::uint32_t side, const glm::vec2& barycentric) const {
  if (!(seenArea[side] > 0.0f)) return false;
  if (!isPartly(side)) return true;
  const std::uint32_t i = scene->instanceOf(side / 2);
  const Instance& instance = scene->instances[i];
  const auto corners = scene->corners(instance, side / 2 - instance.firstTriangle);
  const glm::vec3 normal = side % 2 == 0 ? crossOf(corners) : -crossOf(corners);
  const VoxelGrid grid{voxelOrigin, voxelSize};
  return voxels.contains(grid.key(i, pointOf(corners, barycentric), normal));
}

bool PlaySpace::mayBeSeenIn(std::uint32_t side, const glm::vec3& low, const glm::vec3& high) const {
  if (!(seenArea[side] > 0.0f)) return false;
  if (!isPartly(side) || tree.empty()) return true;
  const std::uint32_t i = scene->instanceOf(side / 2);
  const Instance& instance = scene->instances[i];
  return tree.meets(i, crossOf(scene->corners(instance, side / 2 - instance.firstTriangle)), low, high);
}

Result<PlaySpace> findPlaySpace(const RayTracer& tracer, const PlaySpaceOptions& options, std::uint64_t seed,
                                Context& context) {
  const Scene& scene = tracer.scene();
  PlaySpace space;
  const Areas areas = measureAll(scene, context);
  space.total = areas.total;
  if (context.cancelled()) return cancelledError();
  if (!(space.total > 0.0)) return Error{ErrorCode::failed, "play space: the level has no triangle with an area"};

  // Find where receivers can be.
  StartSources sources(scene);
  sources.findHidden(tracer, seed, context);
  const char* from = sources.volumes.empty() ? "cameras" : "play volumes";
  FirstLook look;
  if (!sources.empty()) look = lookAround(tracer, seed, sources);
  if (!(look.distance > 0.0f)) {
    from = "free space";
    if (options.mode != PlaySpaceOptions::Mode::all) warnOfEmptySources(sources, context);
    sources.freePoints = findFreePoints(tracer, seed, context);
    if (!sources.freePoints.empty()) look = lookAround(tracer, seed, sources);
  }
  if (context.cancelled()) return cancelledError();
  if (options.mode == PlaySpaceOptions::Mode::all || !(look.distance > 0.0f)) {
    if (!(look.distance > 0.0f))
      context.message(
          Severity::warning,
          "play space: no free space found, so every surface is kept, seen or not; put a camera, or a node with "
          "extras.relume.volume, where receivers can be");
    space.receivers =
        sources.freePoints.empty() ? findFreePoints(tracer, seed, context) : std::move(sources.freePoints);
    thin(space.receivers);
    seeAll(scene, space, context);
    space.seenTotal = space.total;
    if (context.cancelled()) return cancelledError();
    report(space, "everywhere", context);
    return space;
  }

  // Walk. Voxels are as fine as the number of hits allows, or finer where the level is much larger than what is near
  // the sources.
  const double expected = double{look.hitShare} * options.walks * options.maxBounces;
  const float coarse = static_cast<float>(std::sqrt(0.5 * space.total * kHitsPerVoxel / expected));
  Walks walks;
  const auto first = static_cast<float>(onLadder(std::min(coarse, kMaxVoxelShare * look.distance), kVoxelSizes));
  for (float size = first; size > 0.0f; size = coarserSize(walks, tracer)) {
    walks = walkThrough(tracer, options, seed, sources, size, kFarLooks * look.distance, context);
    if (context.cancelled()) return cancelledError();
  }

  // Keep what matters.
  const VoxelGrid& grid = walks.grid;
  const bool hasLarge = TriangleParts(areas.largest, grid.size).along >= TriangleParts::kFew;
  const std::vector<VoxelHits> voxels =
      keepVoxels(scene, grid, std::move(walks.voxels), space.total, hasLarge, context);
  if (context.cancelled()) return cancelledError();
  measureSides(tracer, grid, voxels, hasLarge, space, context);
  const std::vector<std::uint32_t> farSides = addFarSides(scene, walks, space);
  boundHits(grid, voxels, space);
  space.scene = &scene;
  space.voxelOrigin = grid.origin;
  space.voxelSize = grid.size;
  space.seenTotal = sum(space.seenArea);
  for (const std::uint32_t side : farSides) {
    space.seenArea.set(side, areaOfSide(scene, side));
    space.flags.set(side, space.flags[side] & PlaySpace::kVisible);
  }
  space.receivers = walks.ends.some(kReceivers);
  if (context.cancelled()) return cancelledError();
  if (!(space.seenTotal > 0.0))
    return Error{ErrorCode::failed, "play space: no surface can be seen from the " + std::string(from)};
  report(space, from, context);
  return space;
}

}  // namespace relume
