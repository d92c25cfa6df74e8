// SPDX-License-Identifier: MIT
// Walks through the level from where receivers can be. A walker in the air looks in a random direction; from what it
// hits it goes on either through the air, to a random point on the way to the hit (a receiver may stand there, too), or
// from the surface, in a cosine-weighted direction (light that bounces there reaches the receiver). Drawing points on
// chords spreads the walkers evenly over the connected air (hit-and-run sampling). A ray that leaves the level carries
// nobody: the far side of a roof is not reached through the sky.
//
// Hits are counted per cell of surface; cells that are hardly ever hit are dropped (keep_cells.h).
#include "bake/visibility/play_space.h"

#include "bake/base/parallel.h"
#include "bake/base/printed.h"
#include "bake/base/random.h"
#include "bake/visibility/find_starts.h"
#include "bake/visibility/keep_cells.h"
#include "bake/visibility/seen_cells.h"
#include "bake/visibility/surface_parts.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

namespace relume {
namespace {

constexpr std::uint32_t kStage = 0x706C6179;  // the random streams' stage
constexpr std::uint32_t kRounds = 8;          // later rounds start where earlier walks came to
constexpr std::size_t kWalksPerChunk = 2048;
constexpr std::size_t kReceivers = 1u << 14;  // points handed over
constexpr float kFreshStarts = 0.25f;         // share of a later round that starts anew
constexpr double kHitsPerCell = 24.0;         // expected if all surface were seen alike
constexpr float kMaxCellShare = 0.1f;         // of the median distance to a hit
constexpr float kFarLooks = 64.0f;       // a hit beyond this multiple of that distance is far: no walk continues there
constexpr double kOutermostHits = 0.01;  // left out of the box around what is looked at, at each end
constexpr double kMinFarShare = 1e-4;    // of all hits, that make a far side matter

// One walk on its way.
struct Walker {
  RandomStream random{0, 0, 0};
  glm::vec3 air{0.0f};     // [m] the last point in free space
  glm::vec3 origin{0.0f};  // [m]
  glm::vec3 direction{0.0f};
  bool inAir = true;  // the origin is in free space, not on a surface
  bool known = true;  // see Start
  bool ended = false;
};

glm::vec3 cosineDirection(const glm::vec3& unitNormal, RandomStream& random) {
  const glm::vec3 d = unitNormal + 0.9999f * uniformDirection(random.uniform2());
  return glm::normalize(d);
}

// What hits are counted by.
struct Counts {
  Counts(const CellGrid& cellGrid, float farDistance, std::size_t sides)
      : grid(cellGrid), far(farDistance), farHits(sides) {}
  CellGrid grid;
  float far;                                        // [m] from here on
  CellCounter near;                                 // by cell
  std::vector<std::atomic<std::uint32_t>> farHits;  // [Size 2 * triangles] by side
};

// Let a walker go on from what it hit; count the hit.
void advance(const RayTracer& tracer, Counts& counts, const Hit& hit, Walker& w, std::vector<CellHits>& hits) {
  const Scene& scene = tracer.scene();
  const bool far = hit && hit.distance > counts.far;
  if (far) {
    const std::size_t side = 2 * (std::size_t{scene.instances[hit.instance].firstTriangle} + hit.triangle);
    counts.farHits[side + (hit.back ? 1 : 0)].fetch_add(1, std::memory_order_relaxed);
  }
  if (!hit || far) {
    // Nobody follows into the sky, or so far: look elsewhere from the last point in the air.
    w.origin = w.air;
    w.inAir = true;
    w.direction = uniformDirection(w.random.uniform2());
    return;
  }
  const Instance& instance = scene.instances[hit.instance];
  if (!w.known && hit.back && !scene.bothSides(instance, hit.triangle)) {
    w.ended = true;
    return;
  }
  w.known = true;

  const auto corners = scene.corners(instance, hit.triangle);
  const glm::vec3 position = pointOf(corners, hit.barycentric);
  const glm::vec3 cross = hit.back ? -crossOf(corners) : crossOf(corners);
  CellHits& cell = hits.emplace_back(counts.grid.cell(hit.instance, position, cross));
  (w.inAir ? cell.direct : cell.bounced) = 1;

  const float length = glm::length(cross);
  const glm::vec3 normal = length > 0.0f ? cross / length : -w.direction;
  const glm::vec3 off = normal * tracer.epsilonAt(position);
  if (w.random.uniform() < 0.5f) {
    // Off the surface also when the point is right at its end, where rounding could carry it through.
    w.air = glm::mix(w.origin, position, w.random.uniform()) + off;
    w.origin = w.air;
    w.inAir = true;
    w.direction = uniformDirection(w.random.uniform2());
  } else {
    w.origin = position + off;
    w.inAir = false;
    w.direction = cosineDirection(normal, w.random);
  }
}

// Walk one round. Walk i starts anew or, in later rounds, where a walk of an earlier round came to (pool); the points
// in the air where the walks end become the next pool.
void walkRound(const RayTracer& tracer, const PlaySpaceOptions& options, std::uint64_t seed, std::uint32_t round,
               const StartPlaces& places, std::vector<glm::vec3>& pool, Counts& counts, Context& context) {
  const std::size_t walks = std::max<std::size_t>(options.walks / kRounds, 1);
  std::vector<glm::vec3> reached(walks);
  std::vector<std::uint8_t> valid(walks, 0);

  parallelChunks(context, "play space", walks, kWalksPerChunk, [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    std::vector<Walker> walkers(count);
    std::vector<Ray> rays(count);
    std::vector<Hit> found(count);
    std::vector<CellHits> hits;
    hits.reserve(count * options.maxBounces);
    for (std::size_t i = 0; i < count; ++i) {
      Walker& w = walkers[i];
      w.random = RandomStream(seed, kStage + round, begin + i);
      const bool fresh = pool.empty() || w.random.uniform() < kFreshStarts;
      const Start start = fresh ? drawStart(places, w.random)
                                : Start{pool[w.random.below(static_cast<std::uint32_t>(pool.size()))],
                                        uniformDirection(w.random.uniform2())};
      w.origin = w.air = start.position;
      w.direction = start.direction;
      w.known = start.known;
    }

    // All walkers of the chunk take a step together, in packets of rays.
    for (std::uint32_t step = 0; step < options.maxBounces; ++step) {
      for (std::size_t i = 0; i < count; ++i) rays[i] = {walkers[i].origin, 0.0f, walkers[i].direction};
      tracer.trace(rays, found);
      for (std::size_t i = 0; i < count; ++i) {
        if (!walkers[i].ended) advance(tracer, counts, found[i], walkers[i], hits);
      }
    }
    counts.near.add(hits);
    for (std::size_t i = 0; i < count; ++i) {
      reached[begin + i] = walkers[i].air;
      valid[begin + i] = !walkers[i].ended && walkers[i].known ? 1 : 0;
    }
  });

  pool.clear();
  for (std::size_t i = 0; i < walks; ++i) {
    if (valid[i] != 0) pool.push_back(reached[i]);
  }
}

// What the starts see.
struct FirstLook {
  float distance = 0.0f;  // [m] median distance to a hit, of the near ones; 0 = nothing is hit
  float hitShare = 0.0f;  // of the rays
};

FirstLook lookAround(const RayTracer& tracer, std::uint64_t seed, const StartPlaces& places) {
  constexpr std::size_t kProbes = 4096;
  std::vector<Ray> rays(kProbes);
  std::vector<Hit> hits(kProbes);
  for (std::size_t i = 0; i < kProbes; ++i) {
    RandomStream random(seed, kStage + kRounds, i);
    const Start start = drawStart(places, random);
    rays[i] = {start.position, 0.0f, start.direction};
  }
  tracer.trace(rays, hits);
  std::vector<float> distances;
  for (std::size_t i = 0; i < kProbes; ++i) {
    // Cells are a share of this distance, and none may be finer than what rays can tell.
    if (hits[i] && hits[i].distance > tracer.epsilonAt(rays[i].origin)) distances.push_back(hits[i].distance);
  }
  if (distances.empty()) return {};
  std::sort(distances.begin(), distances.end());
  const float share = static_cast<float>(distances.size()) / static_cast<float>(kProbes);
  // Where most of it is a sky box, or other such scenery, it is not what is near.
  const float middle = distances[distances.size() / 2], quarter = distances[distances.size() / 4];
  return {middle > kFarLooks * quarter ? quarter : middle, share};
}

// What of each side lies in the kept cells.
void measureSides(const RayTracer& tracer, const CellGrid& grid, const std::vector<CellHits>& cells, bool hasLarge,
                  PlaySpace& space, Context& context) {
  const Scene& scene = tracer.scene();
  CellIndex cellIndex(cells);
  if (hasLarge) space.tree = CellTree(grid, cells, 0);
  space.partly.assign(space.seenArea.size(), 0);
  forEachTriangle(scene, context, [&](std::uint32_t i, std::uint32_t t, const auto& corners, float area) {
    const glm::vec3 normal = crossOf(corners);
    std::array<std::uint64_t, 2> seen{}, direct{};
    const double parts = forEachPart(corners, area, grid.size, space.tree, i, [&](const glm::vec3& p) {
      const std::array<std::uint64_t, 2> keys = grid.keys(i, p, normal);
      for (std::size_t side = 0; side < 2; ++side) {
        const std::size_t at = cellIndex.find(keys[side]);
        if (at == cells.size()) continue;
        ++seen[side];
        if (cells[at].direct > 0) ++direct[side];
      }
    });
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t index = 2 * (std::size_t{scene.instances[i].firstTriangle} + t) + side;
      space.seenArea[index] = area * static_cast<float>(seen[side]) / static_cast<float>(parts);
      space.visible[index] = direct[side] > 0 ? 1 : 0;
      space.partly[index] = seen[side] > 0 && static_cast<double>(seen[side]) < parts ? 1 : 0;
    }
  });
  space.cells = std::move(cellIndex);
}

// Every side of every triangle.
void seeAll(const Scene& scene, PlaySpace& space, Context& context) {
  forEachTriangle(scene, context, [&](std::uint32_t i, std::uint32_t t, const auto&, float area) {
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t index = 2 * (std::size_t{scene.instances[i].firstTriangle} + t) + side;
      space.seenArea[index] = area;
      space.visible[index] = 1;
    }
  });
}

// Mark sides that are seen only from far away as seen whole: no receiver comes near enough to tell their parts apart.
void addFarSides(const std::vector<float>& area, const Counts& counts, double nearHits, PlaySpace& space) {
  double all = nearHits;
  for (const auto& hits : counts.farHits) all += hits.load();
  for (std::size_t side = 0; side < counts.farHits.size(); ++side) {
    const double share = counts.farHits[side].load() / std::max(all, 1.0);
    if (share < kMinFarShare || space.seenArea[side] > 0.0f || !(area[side] > 0.0f)) continue;
    if (space.farShare.empty()) space.farShare.assign(area.size(), 0.0f);
    space.farShare[side] = static_cast<float>(share);
  }
}

// The box of the cells without the outermost hits along each axis.
void boundHits(const CellGrid& grid, const std::vector<CellHits>& cells, PlaySpace& space) {
  for (int k = 0; k < 3; ++k) {
    std::vector<std::pair<int, double>> hits;
    double all = 0.0;
    for (const CellHits& c : cells) {
      hits.emplace_back(c.voxel[k], static_cast<double>(c.direct) + c.bounced);
      all += hits.back().second;
    }
    std::sort(hits.begin(), hits.end());
    double below = 0.0;
    for (const auto& [voxel, count] : hits) {
      const float low = grid.origin[k] + static_cast<float>(voxel) * grid.size;
      if (below <= kOutermostHits * all) space.lookedAtMin[k] = low;
      if (below < (1.0 - kOutermostHits) * all) space.lookedAtMax[k] = low + grid.size;
      below += count;
    }
  }
}

double sum(const std::vector<float>& values) {
  double total = 0.0;
  for (const float v : values) total += v;
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

}  // namespace

bool PlaySpace::seenAt(std::uint32_t side, const glm::vec2& barycentric) const {
  if (!(seenArea[side] > 0.0f)) return false;
  if (scene == nullptr || partly.empty() || partly[side] == 0) return true;
  const std::uint32_t i = scene->instanceOf(side / 2);
  const Instance& instance = scene->instances[i];
  const auto corners = scene->corners(instance, side / 2 - instance.firstTriangle);
  const glm::vec3 normal = side % 2 == 0 ? crossOf(corners) : -crossOf(corners);
  const CellGrid grid{cellOrigin, cellSize};
  return cells.contains(grid.key(i, pointOf(corners, barycentric), normal));
}

bool PlaySpace::mayBeSeenIn(std::uint32_t side, const glm::vec3& low, const glm::vec3& high) const {
  if (!(seenArea[side] > 0.0f)) return false;
  if (scene == nullptr || partly.empty() || partly[side] == 0 || tree.empty()) return true;
  const std::uint32_t i = scene->instanceOf(side / 2);
  const Instance& instance = scene->instances[i];
  return tree.meets(i, crossOf(scene->corners(instance, side / 2 - instance.firstTriangle)), low, high);
}

Result<PlaySpace> findPlaySpace(const RayTracer& tracer, const PlaySpaceOptions& options, std::uint64_t seed,
                                Context& context) {
  const Scene& scene = tracer.scene();
  PlaySpace space;
  const std::size_t sides = 2 * std::size_t{scene.triangleCount()};
  space.seenArea.assign(sides, 0.0f);
  space.visible.assign(sides, 0);
  seeAll(scene, space, context);
  space.total = space.seenTotal = sum(space.seenArea);
  if (context.cancelled()) return cancelledError();
  if (!(space.total > 0.0)) return Error{ErrorCode::failed, "play space: the level has no triangle with an area"};

  // Find where receivers can be.
  StartPlaces places(scene);
  const char* from = places.volumes.empty() ? "cameras" : "play volumes";
  FirstLook look;
  if (!places.empty()) look = lookAround(tracer, seed, places);
  if (!(look.distance > 0.0f)) {
    from = "free space";
    places.freePoints = findFreePoints(tracer, seed, context);
    if (!places.freePoints.empty()) look = lookAround(tracer, seed, places);
  }
  if (context.cancelled()) return cancelledError();
  if (options.mode == PlaySpaceOptions::Mode::all || !(look.distance > 0.0f)) {
    if (!(look.distance > 0.0f))
      context.message(
          Severity::warning,
          "play space: no free space found, so every surface is kept, seen or not; put a camera, or a node with "
          "extras.relume.volume, where receivers can be");
    space.receivers = places.freePoints.empty() ? findFreePoints(tracer, seed, context) : std::move(places.freePoints);
    thin(space.receivers);
    report(space, "everywhere", context);
    return space;
  }

  // Walk. Cells are as fine as the number of hits allows, and finer where the level is much larger than what is near.
  const double expected = double{look.hitShare} * options.walks * options.maxBounces;
  CellGrid grid;
  grid.size = std::min(static_cast<float>(std::sqrt(0.5 * space.total * kHitsPerCell / expected)),
                       kMaxCellShare * look.distance);
  grid.origin = tracer.boundsMin() - 0.3719f * grid.size;  // off the planes that levels are built on
  Counts counts(grid, kFarLooks * look.distance, sides);
  std::vector<glm::vec3> pool;
  for (std::uint32_t round = 0; round < kRounds; ++round) {
    walkRound(tracer, options, seed, round, places, pool, counts, context);
    if (context.cancelled()) return cancelledError();
  }

  // Keep what matters.
  const float largest = *std::max_element(space.seenArea.begin(), space.seenArea.end());
  const bool hasLarge = TriangleParts(largest, grid.size).along >= TriangleParts::kFew;
  const std::vector<float> area = space.seenArea;
  std::vector<CellHits> hitCells = counts.near.sorted();
  double nearHits = 0.0;
  for (const CellHits& c : hitCells) nearHits += static_cast<double>(c.direct) + c.bounced;
  const std::vector<CellHits> cells = keepCells(scene, grid, std::move(hitCells), space.total, hasLarge, context);
  if (context.cancelled()) return cancelledError();
  measureSides(tracer, grid, cells, hasLarge, space, context);
  addFarSides(area, counts, nearHits, space);
  boundHits(grid, cells, space);
  space.scene = &scene;
  space.cellOrigin = grid.origin;
  space.cellSize = grid.size;
  space.seenTotal = sum(space.seenArea);
  for (std::size_t side = 0; side < space.farShare.size(); ++side) {
    if (!(space.farShare[side] > 0.0f)) continue;
    space.seenArea[side] = area[side];
    space.partly[side] = 0;
  }
  space.receivers = std::move(pool);
  thin(space.receivers);
  if (context.cancelled()) return cancelledError();
  if (!(space.seenTotal > 0.0))
    return Error{ErrorCode::failed, "play space: no surface can be seen from the " + std::string(from)};
  report(space, from, context);
  return space;
}

}  // namespace relume
