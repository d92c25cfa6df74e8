// SPDX-License-Identifier: MIT
// See surfel_map.h. Taking the nearest surfel would cross the gaps between thin layers and cost 4 % of the energy
// (measured); map_cost.h has the cost that is minimised instead. It is never less than the squared distance, so that
// the best cost so far bounds how far away to search.
#include "bake/surfels/surfel_map.h"

#include "bake/base/parallel.h"
#include "bake/base/wide_clones.h"
#include "bake/surfels/nested_grid.h"
#include "bake/surfels/sides_on_demand.h"
#include "bake/surfels/sorted_surfels.h"
#include "bake/surfels/tile_grid.h"
#include "bake/visibility/surface_parts.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace relume {
namespace {

constexpr std::size_t kSidesPerChunk = 4096, kTilesPerChunk = 8192;
// Sides that are mapped before the next ones are laid out: the map shares what they have in common, and is far smaller
// than their tiles in a level of many instances.
constexpr std::size_t kSidesPerPart = 1u << 20;
static_assert(kSidesPerPart % BlockPalette<SurfelMap::Side>::kBlock == 0);
constexpr float kRounding = 1.0f + 1e-5f;  // keeps rounding errors from cutting a search's radius short
// To search for a side that is asked for costs more than to map it beside its neighbours.
constexpr double kMinSidesPerLookup = 4.0;

// The surfels in a cube of 2x2x2 buckets and in `depth` more buckets on all sides, one array per member: what searches
// for the points in the cube look through.
class Block {
 public:
  static PointGrid::Bucket cubeOf(const PointGrid::Bucket& c) { return {c.x >> 1, c.y >> 1, c.z >> 1}; }

  bool isOf(const PointGrid::Bucket& cube, int depth) const { return cube == cube_ && depth == depth_; }
  void fill(const SortedSurfels& all, const PointGrid::Bucket& cube, int depth) {
    cube_ = cube;
    depth_ = depth;
    index_.clear();
    const PointGrid::Box box{{2 * cube.x - depth, 2 * cube.y - depth, 2 * cube.z - depth},
                             {2 * cube.x + 1 + depth, 2 * cube.y + 1 + depth, 2 * cube.z + 1 + depth}};
    all.grid.forEachRunIn(box, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) index_.push_back(i);
    });
    const std::size_t count = index_.size();
    for (std::vector<float>& each : float_) each.resize(count);
    for (std::vector<std::uint32_t>& each : word_) each.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const MapPoint& surfel = all.surfel[index_[i]];
      for (int k = 0; k < 3; ++k) {
        float_[static_cast<std::size_t>(k)][i] = surfel.positionWorld[k];
        float_[static_cast<std::size_t>(3 + k)][i] = surfel.normal[k];
      }
      word_[0][i] = surfel.instance;
      word_[1][i] = surfel.emits;
    }
  }
  // Let `found` be the surfel of least cost for a point, as its index in the grid's order, if that cost is below
  // `bestCost`, or is the same and the surfel's own index is smaller.
  void improve(const SortedSurfels& all, const MapPoint& point, float reach, std::uint32_t& found, float& bestCost) {
    const std::array<const float*, 6> f{float_[0].data(), float_[1].data(), float_[2].data(),
                                        float_[3].data(), float_[4].data(), float_[5].data()};
    const std::uint32_t min =
        minCost(f, word_[0].data(), word_[1].data(), index_.size(), point, all.spacing, reach, word_[2].data());
    const auto cost = std::bit_cast<float>(min);
    if (!(cost <= bestCost) || cost == kNoMapping) return;
    if (cost < bestCost) found = kNone;
    bestCost = cost;
    constexpr std::size_t kRun = 64;
    for (std::size_t first = 0; first < index_.size(); first += kRun) {
      const std::size_t count = std::min(kRun, index_.size() - first);
      if (countOf(min, word_[2].data() + first, count) == 0) continue;
      for (std::size_t i = first; i < first + count; ++i) {
        if (word_[2][i] == min && (found == kNone || all.id[index_[i]] < all.id[found])) found = index_[i];
      }
    }
  }

 private:
  // The costs of all surfels as bits, which compare as the costs do; returns the least.
  RELUME_WIDE_CLONES static std::uint32_t minCost(std::array<const float*, 6> f, const std::uint32_t* instance,
                                                  const std::uint32_t* emits, std::size_t count, const MapPoint& point,
                                                  float spacing, float reach, std::uint32_t* __restrict__ cost) {
    const MapPoint p = point;
    std::uint32_t min = std::bit_cast<std::uint32_t>(kNoMapping);
    for (std::size_t i = 0; i < count; ++i) {
      const MapPoint surfel{{f[0][i], f[1][i], f[2][i]}, {f[3][i], f[4][i], f[5][i]}, instance[i], emits[i]};
      cost[i] = std::bit_cast<std::uint32_t>(mapCost(p, surfel, spacing, reach));
      min = std::min(min, cost[i]);
    }
    return min;
  }

  // How many of the costs are `min`.
  RELUME_WIDE_CLONES static std::uint32_t countOf(std::uint32_t min, const std::uint32_t* cost, std::size_t count) {
    std::uint32_t found = 0;
    for (std::size_t i = 0; i < count; ++i) found += cost[i] == min ? 1u : 0u;
    return found;
  }

  PointGrid::Bucket cube_{0, 0, 0};
  int depth_ = -1;
  std::vector<std::uint32_t> index_;                // in the grid's order
  std::array<std::vector<float>, 6> float_;         // position, normal
  std::array<std::vector<std::uint32_t>, 3> word_;  // instance, emits, cost
};

// Searches for the surfels of points that mostly lie near each other.
class Search {
 public:
  explicit Search(const SortedSurfels& all) : all_(all), blocks_(kBlocks) {}

  const SortedSurfels& all() const { return all_; }
  // The surfel of least cost within reach [m], as its index in the grid's order; kNone when there is none. Among
  // equals, the one with the smallest own index. guess: a surfel to try first, or kNone; a good one saves time.
  std::uint32_t best(const MapPoint& point, float reach, std::uint32_t guess) {
    float bestCost = guess != kNone ? mapCost(point, all_.surfel[guess], all_.spacing, reach) : kNoMapping;
    std::uint32_t found = bestCost < kNoMapping ? guess : kNone;
    const PointGrid::Bucket cube = Block::cubeOf(all_.grid.bucketOf(point.positionWorld));
    // The cost is never less than the squared distance, so nothing beyond the root of the best cost so far matters.
    const auto depth = [&] {
      return static_cast<int>(
          std::ceil(std::sqrt(std::min(bestCost, reach * reach)) * kRounding / all_.grid.bucketSize()));
    };
    block(cube, 1).improve(all_, point, reach, found, bestCost);
    if (const int wanted = depth(); wanted > 1) block(cube, wanted).improve(all_, point, reach, found, bestCost);
    return found;
  }

 private:
  static constexpr std::size_t kBlocks = 512;
  Block& block(const PointGrid::Bucket& cube, int depth) {
    const auto key = static_cast<std::uint64_t>(cube.x * 73856093 ^ cube.y * 19349663 ^ cube.z * 83492791 ^ depth);
    Block& found = blocks_[key % kBlocks];
    if (!found.isOf(cube, depth)) found.fill(all_, cube, depth);
    return found;
  }

  const SortedSurfels& all_;
  std::vector<Block> blocks_;  // by a hash of their cube and depth
};

// Finds shapes, once for sides that follow one another.
class TriangleShapes {
 public:
  explicit TriangleShapes(const Scene& scene) : scene_(scene), instances_(scene) {}
  std::uint32_t instanceOf(std::uint32_t triangle) { return instances_.of(triangle); }
  const TriangleShape& of(std::uint32_t triangle) {
    if (triangle != last_.index) last_ = TriangleShape::of(scene_, instanceOf(triangle), triangle);
    return last_;
  }

 private:
  const Scene& scene_;
  InstanceFinder instances_;
  TriangleShape last_;
};

// Give every side of [first, last) its grid of tiles, one grid after the other. Sides of instances that are not baked,
// and those without area, get none. onDemand: sides to leave to it, or null.
std::vector<SurfelMap::Side> layOutSides(const Scene& scene, const PlaySpace& playSpace, const SidesOnDemand* onDemand,
                                         std::size_t first, std::size_t last, float spacing, float farSpacing,
                                         Context& context) {
  std::vector<SurfelMap::Side> sides(last - first);
  parallelChunks(context, "", sides.size(), kSidesPerChunk, [&](std::size_t begin, std::size_t end) {
    TriangleShapes triangles(scene);
    for (std::size_t s = first + begin; s < first + end; ++s) {
      SurfelMap::Side& side = sides[s - first];
      const std::uint32_t instance = triangles.instanceOf(static_cast<std::uint32_t>(s / 2));
      if (!scene.instances[instance].baked()) continue;
      if (onDemand != nullptr && onDemand->isSearched(instance)) {
        side = SurfelMap::Side::onDemand();
        continue;
      }
      const TriangleShape& triangle = triangles.of(static_cast<std::uint32_t>(s / 2));
      if (triangle.normal == glm::vec3(0.0f)) continue;
      const float seenArea = playSpace.seenArea[s],
                  width = (playSpace.isFar(static_cast<std::uint32_t>(s)) ? farSpacing : spacing) *
                          (seenArea > 0.0f ? kTileSpacings : kUnseenTileSpacings);
      const TileGrid grid = tileGridOf(triangle.corner, width, seenArea);
      if (grid.nested && !playSpace.tree.empty() && playSpace.isPartly(static_cast<std::uint32_t>(s))) {
        side.nested = 1;  // addNestedGrids() lays it out
        continue;
      }
      side.columns = grid.columns & 0x7FFFu;
      side.rows = grid.rows & kMaxTilesAlong;
      side.corner = grid.corner & 3u;
    }
  });
  std::uint32_t tiles = 0;
  for (SurfelMap::Side& side : sides) {
    side.firstTile = tiles;
    tiles += side.tileCount();
  }
  return sides;
}

// Map tiles [begin, end) of a side, counted from its first. guess: a surfel that may be near, replaced by one that is.
void mapTiles(const Scene& scene, const TriangleShape& triangle, Search& search, std::uint32_t side,
              const SurfelMap::Side& grid, float reach, std::uint32_t begin, std::uint32_t end, std::uint32_t& guess,
              std::uint32_t* tile) {
  const TileGrid tiles{grid.corner, grid.columns, grid.rows};
  std::uint32_t atRowBegin = guess;
  for (std::uint32_t i = begin; i < end; ++i) {
    const std::uint32_t column = i % grid.columns, row = i / grid.columns;
    if (!tiles.isWithin(column, row)) continue;  // it is never looked up
    const MapPoint point = triangle.pointOn(scene, side, tiles.middleOf(column, row));
    const std::uint32_t found = search.best(point, reach, column == 0 ? atRowBegin : guess);
    if (found == kNone) continue;
    guess = found;
    if (column == 0) atRowBegin = found;
    tile[i - begin] = search.all().id[found];
  }
}

// Append grids within grids to the map's tiles, as those of a side.
void addNestedGrid(const Scene& scene, const PlaySpace& playSpace, const SortedSurfels& sorted, float spacing,
                   std::uint32_t s, SurfelMap& map, SurfelMap::Side& side, Context& context) {
  const std::uint32_t index = scene.instanceOf(s / 2);
  const std::array<glm::vec3, 3> corner =
      scene.corners(scene.instances[index], s / 2 - scene.instances[index].firstTriangle);
  NestedGrid grid(playSpace, s, corner, kTileSpacings * spacing, static_cast<float>(kSeenReach) * spacing);
  const MapPoint anyPoint = mapPoint(sampleAt(scene, index, s, glm::vec2(1.0f / 3.0f)));
  parallelChunks(context, "", grid.leaves().size(), kTilesPerChunk, [&](std::size_t begin, std::size_t end) {
    Search search(sorted);
    MapPoint point = anyPoint;
    std::uint32_t guess = kNone;
    for (const NestedGrid::Leaf& leaf : grid.leaves().subspan(begin, end - begin)) {
      point.positionWorld =
          corner[0] + leaf.middle.x * (corner[1] - corner[0]) + leaf.middle.y * (corner[2] - corner[0]);
      const std::uint32_t found = search.best(point, static_cast<float>(kSeenReach) * spacing, guess);
      if (found == kNone) continue;
      guess = found;
      grid.set(leaf.tile, sorted.id[found]);
    }
  });
  grid.append(map, side);
}

// Append sides and their tiles to the map, without the tiles of sides that no surfel stands for. Neighbours that have
// one tile each share it where it is the same. first: the scene-wide number of the first side.
void appendSides(const Scene& scene, const PlaySpace& playSpace, const SortedSurfels& sorted, float spacing,
                 std::size_t first, std::vector<SurfelMap::Side>& sides, std::span<const std::uint32_t> tile,
                 SurfelMap& map, Context& context) {
  std::vector<std::uint32_t> single;  // tiles of the block that are all that a side has
  for (std::size_t i = 0; i < sides.size() && !context.cancelled(); ++i) {
    SurfelMap::Side& side = sides[i];
    if (i % BlockPalette<SurfelMap::Side>::kBlock == 0) single.clear();
    if (side.isOnDemand()) continue;
    if (side.nested) {
      addNestedGrid(scene, playSpace, sorted, spacing, static_cast<std::uint32_t>(first + i), map, side, context);
      continue;
    }
    const std::span<const std::uint32_t> own = tile.subspan(side.firstTile, side.tileCount());
    if (std::all_of(own.begin(), own.end(), [](std::uint32_t surfel) { return surfel == kNone; })) {
      side = {};
      continue;
    }
    side.firstTile = static_cast<std::uint32_t>(map.tile.size());
    if (own.size() == 1) {
      side.corner = 0;  // a grid of one tile is the same from any corner
      const auto same =
          std::find_if(single.rbegin(), single.rend(), [&](std::uint32_t known) { return map.tile[known] == own[0]; });
      if (same != single.rend()) {
        side.firstTile = *same;
        continue;
      }
      single.push_back(side.firstTile);
    }
    map.tile.insert(map.tile.end(), own.begin(), own.end());
  }
  map.sides.append(sides);
}

// The sides that are searched for when a hit asks for them, where that leaves most sides out; null otherwise.
std::shared_ptr<const SidesOnDemand> leaveToDemand(const Scene& scene, const PlaySpace& playSpace,
                                                   const SortedSurfels& near, const SortedSurfels& far,
                                                   double lookups) {
  const double enough = kMinSidesPerLookup * lookups;
  if (2.0 * scene.triangleCount() < enough) return nullptr;
  std::vector<bool> isSearched = instancesOfOneTile(scene, kTileSpacings * std::min(near.spacing, far.spacing));
  double sides = 0.0;
  for (std::size_t i = 0; i < isSearched.size(); ++i) {
    if (isSearched[i]) sides += 2.0 * static_cast<double>(scene.meshes[scene.instances[i].mesh].triangle.size());
  }
  if (sides < enough) return nullptr;
  return std::make_shared<const SidesOnDemand>(scene, playSpace, near, far, std::move(isSearched), lookups);
}

}  // namespace

std::uint32_t SurfelMap::searchFor(std::uint32_t side) const { return onDemand->at(side); }

std::size_t SurfelMap::sizeBytes() const { return sides.sizeBytes() + tile.size() * sizeof(std::uint32_t); }

SurfelMap buildSurfelMap(const Scene& scene, const PlaySpace& playSpace, std::span<const SurfaceSample> surfels,
                         float spacing, Context& context, double lookups) {
  const SortedSurfels near = sortSurfels(playSpace, surfels, spacing, false, context),
                      far = sortSurfels(playSpace, surfels, spacing, true, context);
  SurfelMap map;
  map.onDemand = leaveToDemand(scene, playSpace, near, far, lookups);
  const std::size_t count = 2 * std::size_t{scene.triangleCount()};
  const bool isOnePart = count <= kSidesPerPart;
  for (std::size_t first = 0; first < count; first += kSidesPerPart) {
    const std::size_t last = std::min(count, first + kSidesPerPart);
    std::vector<SurfelMap::Side> sides =
        layOutSides(scene, playSpace, map.onDemand.get(), first, last, spacing, far.spacing, context);
    if (context.cancelled()) return {};
    std::vector<std::uint32_t> tiles;
    reserveByThreads(context, tiles, sides.back().firstTile + sides.back().tileCount());
    tiles.assign(sides.back().firstTile + sides.back().tileCount(), kNone);
    parallelChunks(
        context, isOnePart ? "surfel map" : "", tiles.size(), kTilesPerChunk, [&](std::size_t begin, std::size_t end) {
          Search search(near), farSearch(far);
          TriangleShapes triangles(scene);
          // Guesses for the front and the back of sides that are not seen, that are seen, and that are far.
          std::array<std::uint32_t, 6> guess{kNone, kNone, kNone, kNone, kNone, kNone};
          // The side of the first tile is the last side that does not begin after it.
          auto side = std::upper_bound(sides.begin(), sides.end(), begin,
                                       [](std::size_t tile, const SurfelMap::Side& s) { return tile < s.firstTile; }) -
                      1;
          for (std::size_t at = begin; at < end; ++side) {
            const auto s = static_cast<std::uint32_t>(first + static_cast<std::size_t>(side - sides.begin()));
            const std::size_t lastTile = std::min<std::size_t>(end, side->firstTile + side->tileCount());
            if (lastTile <= at) continue;
            const bool seen = playSpace.seenArea[s] > 0.0f, isFar = playSpace.isFar(s);
            mapTiles(scene, triangles.of(s / 2), isFar ? farSearch : search, s, *side,
                     static_cast<float>(seen ? kSeenReach : kUnseenReach) * (isFar ? far : near).spacing,
                     static_cast<std::uint32_t>(at) - side->firstTile,
                     static_cast<std::uint32_t>(lastTile) - side->firstTile, guess[(isFar ? 4 : 2 * seen) + s % 2],
                     tiles.data() + at);
            at = lastTile;
          }
        });
    if (context.cancelled()) return {};
    if (isOnePart) map.tile.reserve(tiles.size());  // what is left over is never touched
    appendSides(scene, playSpace, near, spacing, first, sides, tiles, map, context);
    if (context.cancelled()) return {};
    if (!isOnePart) context.progress("surfel map", static_cast<double>(last) / static_cast<double>(count));
  }
  map.sides.shrinkToFit();
  if (!isOnePart) map.tile.shrink_to_fit();
  return map;
}

}  // namespace relume
