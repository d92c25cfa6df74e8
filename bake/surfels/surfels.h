// SPDX-License-Identifier: MIT
// From surfaces to surfels (PIC 4.2), and from a hit on a surface to its surfel.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/surfels/block_palette.h"
#include "bake/surfels/tile_grid.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/emitters.h"
#include "relume/result.h"
#include "relume/surfels.h"

#include <glm/vec2.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace relume {

class SidesOnDemand;

// A surfel as it is placed, before its footprint is integrated.
struct SurfelSeed {
  glm::vec3 positionWorld{0.0f};
  glm::vec3 normal{0.0f};  // geometric, of the side it stands for
  SurfacePoint point;
  std::uint32_t side = 0;  // scene-wide 2 * triangle + back
};

// Answers which surfel stands for a point on a side of a triangle. Each side has a small grid of tiles over two of its
// edges, and each tile has the nearest surfel, where nearest means on the same plane or mesh first, then by distance.
// Emitting sides get emitting surfels only, other sides only surfels that do not emit. On a large side of which little
// is seen, a tile may hold a finer grid, and so on, down to the size that the surfels need. Immutable, thread-safe.
class SurfelMap {
 public:
  // The surfel of a hit; kNone when none is near, as on sides that the play space never sees.
  std::uint32_t at(std::uint32_t side, const glm::vec2& barycentric) const {
    const std::uint32_t c = tileOf(side, barycentric);
    if (c == kNone) return onDemandAt(side);
    return isInner(tile[c]) ? kNone : tile[c];
  }
  // The same for a hit without a tile, whose side may be one of those that are searched for.
  std::uint32_t onDemandAt(std::uint32_t side) const {
    return onDemand != nullptr && sides[side].isOnDemand() ? searchFor(side) : kNone;
  }
  // The tile of a hit; kNone when the side has no tiles. Inline, because every ray asks for it.
  std::uint32_t tileOf(std::uint32_t side, const glm::vec2& barycentric) const {
    const Side& s = sides[side];
    if (s.columns == 0) return kNone;
    const glm::vec2 g = toTileGrid(barycentric, s.corner);
    const std::uint32_t column = tileAlong(g.x, s.columns), row = tileAlong(g.y, s.rows);
    const std::uint32_t found = s.firstTile + row * s.columns + column;
    if (!s.nested) return found;
    return innerTile(found, {g.x * static_cast<float>(s.columns) - static_cast<float>(column),
                             g.y * static_cast<float>(s.rows) - static_cast<float>(row)});
  }
  // A tile that is a finer grid of kInnerAlong x kInnerAlong tiles holds the index of the first of them.
  static constexpr std::uint32_t kInnerAlong = 4;
  static bool isInner(std::uint32_t content) { return content >> 31 != 0 && content != kNone; }
  static std::uint32_t firstInner(std::uint32_t content) { return content & 0x7FFFFFFFu; }
  static std::uint32_t innerFrom(std::uint32_t first) { return first | 0x80000000u; }
  std::size_t sizeBytes() const;

  struct Side {
    std::uint32_t firstTile = 0;
    std::uint16_t columns : 15 = 0;  // tiles along the first edge, 0 = the side has no surfel
    std::uint16_t nested : 1 = 0;    // some tiles hold finer grids
    std::uint16_t rows : 14 = 0;     // along the other
    std::uint16_t corner : 2 = 0;    // where both edges start
    std::uint32_t tileCount() const { return std::uint32_t{columns} * rows; }
    // A side without tiles here, which SurfelMap::onDemand answers for.
    bool isOnDemand() const { return columns == 0 && rows != 0; }
    static Side onDemand() {
      Side side;
      side.rows = 1;
      return side;
    }
    bool operator==(const Side&) const = default;
  };
  BlockPalette<Side> sides;         // [Size 2 * triangles] neighbours of one tile each may share it
  std::vector<std::uint32_t> tile;  // surfel of each tile, kNone, or a finer grid: isInner()
  // Null where the map is whole. It refers to the scene.
  std::shared_ptr<const SidesOnDemand> onDemand;

 private:
  std::uint32_t searchFor(std::uint32_t side) const;
  // The finest tile within one, at a point given in widths of that one.
  std::uint32_t innerTile(std::uint32_t at, glm::vec2 inside) const {
    while (isInner(tile[at])) {
      inside = glm::vec2(std::max(inside.x, 0.0f), std::max(inside.y, 0.0f)) * static_cast<float>(kInnerAlong);
      const auto x = std::min(static_cast<std::uint32_t>(inside.x), kInnerAlong - 1),
                 y = std::min(static_cast<std::uint32_t>(inside.y), kInnerAlong - 1);
      inside -= glm::vec2(x, y);
      at = firstInner(tile[at]) + y * kInnerAlong + x;
    }
    return at;
  }
};

struct PlacedSurfels {
  Surfels surfels;  // receiver is kGridReceiver everywhere until caches are placed
  SurfelMap map;
  std::vector<SurfelSeed> seeds;  // [Size n_S]
  Emitters emitters;
  // Where materials are marked as drivable, surfels.emission of their surfels is what clusters and links are to reckon
  // with (shineMarked() in emitter_footprints.h), and this is what the bake is to say. [W/m²/sr] [Size 0 or n_S]
  std::vector<glm::vec3> bakedEmission;
  struct Statistics {
    double areaSeen = 0, areaTotal = 0;     // [m²]
    float spacingMin = 0, spacingMean = 0;  // [m] nearest-neighbour distance
    float spacingCv = 0;                    // coefficient of variation of that distance
    float spacingDensest = 0;               // [m] D: spacing of the densest packing of the same count on that area
    float areaError = 0;                    // |n_S areaEach - areaSeen| / areaSeen
  } statistics;
};

// Lookups of a map that is to be whole, as files need it.
inline constexpr double kManyLookups = std::numeric_limits<double>::infinity();

// Places n_S surfels of equal area over what the play space sees; both sides of a two-sided surface get their own where
// they are seen. Emitters too small for a share get surfels all the same, so that none is missed. Emission is the mean
// radiance over the surfel's footprint, so that rays find an emitter's whole power however few surfels it has. With
// placement `eliminated`, the order of the surfels is progressive: any prefix is well spread. There are fewer surfels
// than asked for only where alpha masks leave nothing to stand on. usage: options out of range; failed: nothing to
// place surfels on, or cancelled. The result is the same at any number of threads. Reports its statistics as figures.
// lookups: about how often later stages ask the map (buildSurfelMap() in surfel_map.h).
Result<PlacedSurfels> placeSurfels(const RayTracer& tracer, const PlaySpace& playSpace, const SurfelOptions& options,
                                   std::uint64_t seed, Context& context, double lookups = kManyLookups);

// The normals that surfels are lit by: shading normals where they stand, so that what is smooth is lit as it is drawn.
// What goes by planes, such as clusters and the points that surfels read, has the geometric normals of seeds.
// [Size of seeds]
std::vector<glm::vec3> litNormals(const Scene& scene, std::span<const SurfelSeed> seeds, Context& context);

}  // namespace relume
