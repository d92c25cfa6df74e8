// SPDX-License-Identifier: MIT
// See refine_grid.h.
#include "bake/caches/grid/refine_grid.h"

#include "bake/base/memory_budget.h"
#include "formats/grid_depth.h"
#include "relume/caches.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

namespace relume {
namespace {

constexpr std::uint32_t kMaxAlong = 1024;
// If the box around all that is seen is more than this many times as long as the box around most of it, the latter is
// used: of a large triangle, only a corner may be seen.
constexpr float kMuchLonger = 4.0f;
constexpr double kOutermost = 0.01;  // receivers left out at each end

struct Box {
  glm::vec3 low{INFINITY}, high{-INFINITY};
  void add(const glm::vec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
};

constexpr std::uint32_t kTrianglesPerRun = 64;

// Neighbours in an instance of which at least one is seen, and the box around those that are.
struct Run {
  std::uint32_t instance = 0, begin = 0, end = 0;  // triangles of the instance
  Box box;
};

// Whether at least one side of a triangle is seen.
bool isSeen(const PlaySpace& playSpace, const Instance& instance, std::uint32_t t) {
  const std::uint32_t side = 2 * (instance.firstTriangle + t);
  if (playSpace.isFar(side) || playSpace.isFar(side + 1)) return false;
  return playSpace.isVisible(side) || playSpace.isVisible(side + 1);
}

// The triangles of which at least one side is seen. Their corners are found anew whenever they are visited: they would
// take more memory than all else in a level of many instances.
class SeenTriangles {
 public:
  SeenTriangles(const Scene& scene, const PlaySpace& playSpace) : scene_(scene), playSpace_(playSpace) {
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
      if (!scene.instances[i].baked()) continue;
      const auto count = static_cast<std::uint32_t>(scene.meshes[scene.instances[i].mesh].triangle.size());
      for (std::uint32_t t = 0; t < count; t += kTrianglesPerRun) {
        Run run{i, t, std::min(count, t + kTrianglesPerRun), {}};
        forEachOf(run, [&](const std::array<glm::vec3, 3>& corners, std::uint32_t) {
          for (const glm::vec3& p : corners) run.box.add(p);
        });
        if (run.box.low.x <= run.box.high.x) runs_.push_back(run);
      }
    }
  }

  const std::vector<Run>& runs() const { return runs_; }
  // Call visit(corners, side) for those of a run; side: of their front.
  template <class Visit>
  void forEachOf(const Run& run, const Visit& visit) const {
    const Instance& instance = scene_.instances[run.instance];
    for (std::uint32_t t = run.begin; t < run.end; ++t) {
      if (isSeen(playSpace_, instance, t)) visit(scene_.corners(instance, t), 2 * (instance.firstTriangle + t));
    }
  }

 private:
  const Scene& scene_;
  const PlaySpace& playSpace_;
  std::vector<Run> runs_;
};

// The box around most of what is looked at, and of the receivers.
Box lookedAtBounds(const PlaySpace& playSpace) {
  Box box;
  box.add(playSpace.lookedAtMin);
  box.add(playSpace.lookedAtMax);
  const std::size_t count = playSpace.receivers.size(),
                    skipped = static_cast<std::size_t>(kOutermost * static_cast<double>(count));
  for (int k = 0; k < 3 && count > 0; ++k) {
    std::vector<float> at;
    for (const glm::vec3& p : playSpace.receivers) at.push_back(p[k]);
    std::sort(at.begin(), at.end());
    box.low[k] = std::min(box.low[k], at[skipped]);
    box.high[k] = std::max(box.high[k], at[count - 1 - skipped]);
  }
  return box;
}

// The box around everything the play space sees, and the receivers themselves.
Box boundsOf(const RayTracer& tracer, const PlaySpace& playSpace, const SeenTriangles& triangles) {
  Box box;
  for (const Run& run : triangles.runs()) {
    box.add(run.box.low);
    box.add(run.box.high);
  }
  for (const glm::vec3& p : playSpace.receivers) box.add(glm::clamp(p, tracer.boundsMin(), tracer.boundsMax()));
  if (!(box.low.x <= box.high.x)) return {tracer.boundsMin(), tracer.boundsMax()};
  if (playSpace.tree.empty() && playSpace.farShare.empty()) return box;
  if (!(playSpace.lookedAtMin.x <= playSpace.lookedAtMax.x)) return box;
  const Box seen = lookedAtBounds(playSpace);
  const glm::vec3 length = box.high - box.low, seenLength = seen.high - seen.low;
  const float longest = std::max({length.x, length.y, length.z}),
              seenLongest = std::max({seenLength.x, seenLength.y, seenLength.z});
  return seenLongest >= 0.0f && longest > kMuchLonger * seenLongest ? seen : box;
}

// How far up, down and to each side surfaces go within a box that are seen from there, as the tops of roofs are from
// above: things may stand on them.
Box facedBounds(const PlaySpace& playSpace, const SeenTriangles& triangles, const Box& box) {
  constexpr float kTilt = 0.5f;  // cosine: each normal is that near to one axis at least
  Box faced{glm::vec3(INFINITY), glm::vec3(-INFINITY)};
  for (const Run& run : triangles.runs()) {
    triangles.forEachOf(run, [&](const std::array<glm::vec3, 3>& corners, std::uint32_t front) {
      const glm::vec3 cross = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
      const float tilt = kTilt * glm::length(cross);
      const glm::vec3 low = glm::min(glm::min(corners[0], corners[1]), corners[2]),
                      high = glm::max(glm::max(corners[0], corners[1]), corners[2]);
      for (int k = 0; k < 3; ++k) {
        if (std::abs(cross[k]) <= tilt) continue;
        const bool isFrontUp = cross[k] > 0.0f;
        if (high[k] <= box.high[k] && playSpace.isVisible(isFrontUp ? front : front + 1))
          faced.high[k] = std::max(faced.high[k], high[k]);
        if (low[k] >= box.low[k] && playSpace.isVisible(isFrontUp ? front + 1 : front))
          faced.low[k] = std::min(faced.low[k], low[k]);
      }
    });
  }
  return faced;
}

// A box with room for points before what is faced (facedBounds()) and ends it, beyond which there would be none.
Box withRoom(const Box& box, const Box& faced, const glm::vec3& spacing) {
  constexpr float kRoom = 1.25f, kAtEnd = 0.05f;  // [spacing] points are in the middle of cells
  Box wide = box;
  for (int k = 0; k < 3; ++k) {
    if (faced.high[k] > box.high[k] - kAtEnd * spacing[k]) wide.high[k] = faced.high[k] + kRoom * spacing[k];
    if (faced.low[k] < box.low[k] + kAtEnd * spacing[k]) wide.low[k] = faced.low[k] - kRoom * spacing[k];
  }
  return wide;
}

// A convex polygon cut by slabs: a triangle has at most nine corners in a box.
struct Polygon {
  std::array<glm::vec3, 12> corner;
  std::size_t count = 0;
  void add(const glm::vec3& p) {
    if (count < corner.size()) corner[count++] = p;
  }
};

// Split at coordinate `at` of an axis.
void split(const Polygon& whole, int axis, float at, Polygon& below, Polygon& above) {
  below.count = above.count = 0;
  for (std::size_t i = 0; i < whole.count; ++i) {
    const glm::vec3 &p = whole.corner[i], &q = whole.corner[(i + 1) % whole.count];
    const float dp = p[axis] - at, dq = q[axis] - at;
    if (dp <= 0.0f) below.add(p);
    if (dp >= 0.0f) above.add(p);
    if ((dp < 0.0f && dq > 0.0f) || (dp > 0.0f && dq < 0.0f)) {
      const glm::vec3 cut = p + (q - p) * (dp / (dp - dq));
      below.add(cut);
      above.add(cut);
    }
  }
}

// Number of the cell along an axis. The outermost cells reach to infinity: receivers out there read them.
std::uint32_t cellAlong(float v, std::uint32_t cells) {
  return static_cast<std::uint32_t>(std::clamp(v, 0.0f, static_cast<float>(cells - 1)));
}

// Call visit(cell) for the cells of a lattice that a polygon in lattice coordinates passes, one axis after the other.
template <class Visit>
void forEachCell(Polygon polygon, const glm::uvec3& cells, int axis, glm::uvec3 cell, const Visit& visit) {
  if (polygon.count == 0) return;
  if (axis == 3) return visit(cell);
  float low = INFINITY, high = -INFINITY;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    low = std::min(low, polygon.corner[i][axis]);
    high = std::max(high, polygon.corner[i][axis]);
  }
  const std::uint32_t last = cellAlong(high, cells[axis]);
  for (std::uint32_t i = cellAlong(low, cells[axis]); i <= last; ++i) {
    cell[axis] = i;
    if (i == last) return forEachCell(polygon, cells, axis + 1, cell, visit);
    Polygon below, above;
    split(polygon, axis, static_cast<float>(i + 1), below, above);
    forEachCell(below, cells, axis + 1, cell, visit);
    polygon = above;
  }
}

// Number the cells through which a seen triangle passes.
void markBricks(const SeenTriangles& triangles, GridLayout& layout) {
  const glm::uvec3 cells = layout.cells();
  layout.brick.assign(std::size_t{cells.x} * cells.y * cells.z, kNoBrick);
  const auto brickAt = [&](const glm::uvec3& c) -> std::uint32_t& {
    return layout.brick[(std::size_t{c.z} * cells.y + c.y) * cells.x + c.x];
  };
  const glm::vec3 perSpacing = 1.0f / layout.spacing;
  // Mark the cell that a box in lattice coordinates lies in. Whether nothing is left to do: it lies in one, or all its
  // cells are marked already.
  const auto markBox = [&](const Box& box) {
    glm::uvec3 low, high;
    for (int k = 0; k < 3; ++k) {
      low[k] = cellAlong(box.low[k], cells[k]);
      high[k] = cellAlong(box.high[k], cells[k]);
    }
    if (low == high) {
      brickAt(low) = 0;
      return true;
    }
    bool marked = true;
    for (std::uint32_t z = low.z; z <= high.z && marked; ++z) {
      for (std::uint32_t y = low.y; y <= high.y && marked; ++y) {
        for (std::uint32_t x = low.x; x <= high.x && marked; ++x) marked = brickAt({x, y, z}) == 0;
      }
    }
    return marked;
  };
  for (const Run& run : triangles.runs()) {
    if (markBox({(run.box.low - layout.originWorld) * perSpacing, (run.box.high - layout.originWorld) * perSpacing}))
      continue;
    triangles.forEachOf(run, [&](const std::array<glm::vec3, 3>& corners, std::uint32_t) {
      Polygon polygon;
      Box box;
      for (const glm::vec3& p : corners) {
        polygon.add((p - layout.originWorld) * perSpacing);
        box.add(polygon.corner[polygon.count - 1]);
      }
      if (!markBox(box)) forEachCell(polygon, cells, 0, glm::uvec3(0), [&](const glm::uvec3& c) { brickAt(c) = 0; });
    });
  }
  layout.brickCount = 0;
  for (std::uint32_t& brick : layout.brick) {
    if (brick != kNoBrick) brick = layout.brickCount++;
  }
  if (layout.brickCount == 0) layout.brick.clear();
}

// Points of one level in the middle of their cells, so that none lies on the walls.
GridLayout uniform(const Box& box, const glm::uvec3& resolution) {
  GridLayout layout;
  layout.resolution = resolution;
  layout.spacing = glm::max(box.high - box.low, glm::vec3(1e-4f)) / glm::vec3(resolution);
  layout.originWorld = box.low + 0.5f * layout.spacing;
  return layout;
}

// Points of the coarse level of two along each axis.
glm::uvec3 coarseResolution(const Box& box, double spacing) {
  glm::uvec3 coarse;
  for (int k = 0; k < 3; ++k) {
    const double half = 0.5 * (static_cast<double>(box.high[k] - box.low[k]) / spacing - 1.0);
    coarse[k] = static_cast<std::uint32_t>(std::clamp(std::round(half), 0.0, 0.5 * kMaxAlong)) + 1;
  }
  return coarse;
}

// Two levels, of which the finer one has its points in the middle of its cells, an odd number along each axis.
GridLayout twoLevels(const Box& box, const SeenTriangles& triangles, const glm::uvec3& coarse) {
  GridLayout layout = uniform(box, 2u * coarse - 1u);
  layout.resolution = coarse;
  layout.spacing *= 2.0f;
  markBricks(triangles, layout);
  return layout;
}

double latticeCount(const GridLayout& layout) {
  return static_cast<double>(layout.resolution.x) * layout.resolution.y * layout.resolution.z;
}

// Call visit(brick, cell, local) for the points of each brick that it owns and that do not hang. A brick owns the
// points of its lower half, and the last one of a row also those of its upper border.
template <class Visit>
void forEachFinePoint(const GridLayout& layout, const Visit& visit) {
  const glm::uvec3 cells = layout.cells();
  const auto refined = [&](const glm::ivec3& c) {
    for (int k = 0; k < 3; ++k) {
      if (c[k] < 0 || c[k] >= static_cast<int>(cells[k])) return true;
    }
    return layout.brick[(static_cast<std::size_t>(c.z) * cells.y + static_cast<std::size_t>(c.y)) * cells.x +
                        static_cast<std::size_t>(c.x)] != kNoBrick;
  };
  for (std::uint32_t cell = 0; cell < layout.brick.size(); ++cell) {
    if (layout.brick[cell] == kNoBrick) continue;
    const glm::uvec3 at(cell % cells.x, cell / cells.x % cells.y, cell / cells.x / cells.y);
    for (std::uint32_t p = 0; p < kBrickWords; ++p) {
      const glm::uvec3 local(p % 3, p / 3 % 3, p / 9);
      bool own = local.x % 2 + local.y % 2 + local.z % 2 > 0;
      glm::ivec3 low(0), high(0);  // cells around the point, relative
      for (int k = 0; k < 3; ++k) {
        own = own && (local[k] == 0 || layout.resolution[k] > 1) && (local[k] < 2 || at[k] + 1 == cells[k]);
        low[k] = local[k] == 0 ? -1 : 0;
        high[k] = local[k] == 2 ? 1 : 0;
      }
      bool hangs = false;
      for (int z = low.z; z <= high.z && own; ++z) {
        for (int y = low.y; y <= high.y; ++y) {
          for (int x = low.x; x <= high.x; ++x) hangs = hangs || !refined(glm::ivec3(at) + glm::ivec3(x, y, z));
        }
      }
      if (own && !hangs) visit(layout.brick[cell], at, local);
    }
  }
}

double countOf(const GridLayout& layout) {
  double count = latticeCount(layout);
  forEachFinePoint(layout, [&](std::uint32_t, const glm::uvec3&, const glm::uvec3&) { count += 1.0; });
  return count;
}

// Find the spacing whose number of points is nearest to what is wanted, by steps in logarithms.
GridLayout layoutByCount(const Box& box, const Box& faced, const SeenTriangles& triangles, double wanted,
                         const Context& context) {
  constexpr int kSteps = 10;
  const glm::vec3 extent = glm::max(box.high - box.low, glm::vec3(1e-4f));
  double spacing =
      std::cbrt(static_cast<double>(extent.x) * static_cast<double>(extent.y) * static_cast<double>(extent.z) / wanted);
  double fine = 0.0, coarse = INFINITY, bestOff = INFINITY;
  GridLayout best;
  std::vector<std::pair<glm::uvec3, double>> tried;  // resolutions and their counts: many spacings have the same
  for (int i = 0; i < kSteps && !context.cancelled(); ++i) {
    const Box wide = withRoom(box, faced, glm::vec3(static_cast<float>(spacing)));
    const glm::uvec3 resolution = coarseResolution(wide, spacing);
    auto known = std::find_if(tried.begin(), tried.end(), [&](const auto& t) { return t.first == resolution; });
    if (known == tried.end()) {
      GridLayout layout = twoLevels(wide, triangles, resolution);
      known = tried.insert(tried.end(), {resolution, countOf(layout)});
      const double off = std::abs(std::log(known->second / wanted));
      if (off < bestOff) {
        bestOff = off;
        best = std::move(layout);
      }
    }
    const double count = known->second;
    if (bestOff < 0.02) break;
    (count > wanted ? fine : coarse) = spacing;
    double next = spacing * std::cbrt(count / wanted);
    if (!(next > fine && next < coarse)) next = fine > 0.0 && coarse < INFINITY ? std::sqrt(fine * coarse) : next;
    spacing = next;
  }
  return best;
}

// Bytes of a point: its position, verdict and cache, and its depth map.
constexpr double kPointBytes = 32.0 + sizeof(std::uint32_t) * kDepthSide * kDepthSide / 2.0;
constexpr double kCellBytes = 2.0 * sizeof(std::uint32_t);

std::string countText(double count) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.0f", count);
  return text.data();
}

// Reserve memory for the points of a lattice. If cells are refined, about an eighth of the fine points exist: those
// near surfaces.
Status reserveGrid(const glm::uvec3& resolution, bool isRefined, const char* remedy, Context& context) {
  constexpr double kRefinedShare = 1.0 / 8.0, kFinePoints = 7.0;
  const double lattice = static_cast<double>(resolution.x) * resolution.y * resolution.z;
  const double points = lattice * (isRefined ? 1.0 + kRefinedShare * kFinePoints : 1.0);
  return reserveMemory(context, "grid", points * kPointBytes + lattice * kCellBytes,
                       countText(resolution.x) + " x " + countText(resolution.y) + " x " + countText(resolution.z) +
                           " points" + (isRefined ? ", twice as dense along each axis at surfaces" : ""),
                       remedy);
}

// Reserve memory for the points that a layout has: in a thicket, all cells are refined.
Status reserveLayout(const GridLayout& layout, const char* remedy, Context& context) {
  const double points = countOf(layout);
  return reserveMemory(
      context, "grid", points * kPointBytes + sizeof(std::uint32_t) * double{kBrickWords} * layout.brickCount,
      countText(points) + " points, of which " + countText(latticeCount(layout)) + " are of its coarse level", remedy);
}

}  // namespace

std::vector<GridPoint> pointsOf(const GridLayout& layout) {
  std::vector<GridPoint> points;
  const glm::uvec3 r = layout.resolution, cells = layout.cells();
  for (std::uint32_t z = 0; z < r.z; ++z) {
    for (std::uint32_t y = 0; y < r.y; ++y) {
      for (std::uint32_t x = 0; x < r.x; ++x) points.push_back({2u * glm::uvec3(x, y, z), false});
    }
  }
  // The lattice's points at bricks.
  for (std::uint32_t cell = 0; cell < layout.brick.size(); ++cell) {
    if (layout.brick[cell] == kNoBrick) continue;
    const glm::uvec3 at(cell % cells.x, cell / cells.x % cells.y, cell / cells.x / cells.y);
    for (std::uint32_t c = 0; c < 8; ++c) {
      const glm::uvec3 p = glm::min(at + glm::uvec3(c & 1u, (c >> 1) & 1u, c >> 2), r - 1u);
      points[(std::size_t{p.z} * r.y + p.y) * r.x + p.x].refined = true;
    }
  }
  forEachFinePoint(layout, [&](std::uint32_t, const glm::uvec3& cell, const glm::uvec3& local) {
    points.push_back({2u * cell + local, true});
  });
  return points;
}

std::vector<std::uint32_t> brickPoints(const GridLayout& layout) {
  const glm::uvec3 r = layout.resolution, cells = layout.cells();
  std::vector<std::uint32_t> words(std::size_t{kBrickWords} * layout.brickCount, kHangingPoint);
  auto next = static_cast<std::uint32_t>(latticeCount(layout));
  forEachFinePoint(layout, [&](std::uint32_t brick, const glm::uvec3&, const glm::uvec3& local) {
    words[std::size_t{kBrickWords} * brick + (local.z * 3 + local.y) * 3 + local.x] = next++;
  });
  // Points of the lattice, and those that other bricks own.
  for (std::uint32_t cell = 0; cell < layout.brick.size(); ++cell) {
    if (layout.brick[cell] == kNoBrick) continue;
    const glm::uvec3 at(cell % cells.x, cell / cells.x % cells.y, cell / cells.x / cells.y);
    for (std::uint32_t p = 0; p < kBrickWords; ++p) {
      const glm::uvec3 local(p % 3, p / 3 % 3, p / 9), fine = 2u * at + local;
      std::uint32_t& word = words[std::size_t{kBrickWords} * layout.brick[cell] + p];
      if ((local.x > 0 && r.x == 1) || (local.y > 0 && r.y == 1) || (local.z > 0 && r.z == 1)) {
        word = kNoCache;  // outside of the lattice, which has one point along this axis
      } else if (local.x % 2 + local.y % 2 + local.z % 2 == 0) {
        word = ((fine.z / 2) * r.y + fine.y / 2) * r.x + fine.x / 2;
      } else if (const glm::uvec3 owner = glm::min(fine / 2u, cells - 1u); owner != at) {
        const std::uint32_t brick = layout.brick[(std::size_t{owner.z} * cells.y + owner.y) * cells.x + owner.x];
        const glm::uvec3 there = fine - 2u * owner;
        if (brick != kNoBrick) word = words[std::size_t{kBrickWords} * brick + (there.z * 3 + there.y) * 3 + there.x];
      }
    }
  }
  return words;
}

Result<GridLayout> layoutGrid(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                              double count, Context& context) {
  const SeenTriangles triangles(tracer.scene(), playSpace);
  const Box box = boundsOf(tracer, playSpace, triangles), faced = facedBounds(playSpace, triangles, box);
  if (options.gridResolution != glm::uvec3(0)) {
    const glm::uvec3 resolution = glm::max(options.gridResolution, glm::uvec3(1));
    if (Status ok = reserveGrid(resolution, false, "lower --grid", context); !ok) return ok.error();
    // Of the cells along an axis two may become room, at most half.
    const glm::vec3 cells = glm::max(glm::vec3(resolution) - 2.5f, 0.5f * glm::vec3(resolution));
    return uniform(withRoom(box, faced, glm::max(box.high - box.low, glm::vec3(1e-4f)) / cells), resolution);
  }
  if (options.gridSpacing > 0.0f) {
    const Box wide = withRoom(box, faced, glm::vec3(options.gridSpacing));
    const glm::uvec3 coarse = coarseResolution(wide, static_cast<double>(options.gridSpacing));
    if (Status ok = reserveGrid(coarse, true, "raise --grid-spacing", context); !ok) return ok.error();
    GridLayout layout = twoLevels(wide, triangles, coarse);
    if (Status ok = reserveLayout(layout, "raise --grid-spacing", context); !ok) return ok.error();
    return layout;
  }
  if (options.gridCaches == 0) return GridLayout{};
  const double points = 2.0 * count;  // a lattice that is refined nowhere, and what it is searched with
  if (Status ok =
          reserveMemory(context, "grid", kPointBytes * points, countText(points) + " points", "lower --grid-caches");
      !ok)
    return ok.error();
  return layoutByCount(box, faced, triangles, count, context);
}

}  // namespace relume
