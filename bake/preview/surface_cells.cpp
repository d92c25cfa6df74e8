// SPDX-License-Identifier: MIT
// See surface_cells.h.
#include "bake/preview/surface_cells.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "formats/frame_about.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>
#include <numbers>
#include <utility>
#include <vector>

namespace relume {
namespace {

constexpr std::uint32_t kCellStage = 0x72637363;   // the random streams' stage
constexpr std::uint32_t kMaxTriangles = 1u << 22;  // of a level that has cells
constexpr double kFinestCells = 1e8;               // about as many there could be on all front sides
constexpr unsigned kMaxShift = 14;                 // log2 of the most cells along an edge
constexpr unsigned kSlots = 1u << 21;              // of cells that are kept; the others are looked up each time
constexpr unsigned kProbes = 8;                    // slots that a cell may lie in
constexpr float kWidest = 1.41421356f;             // of a cell, in widths of the ray
constexpr unsigned kLooks = 2;                     // rays up from a cell, to see whether anything stands close
constexpr unsigned kLookFrom[kLooks] = {0, 2};     // points: two that lie across from each other
constexpr unsigned kPointsAlong = 2;               // points of a cell along each of its sides
static_assert(kPointsAlong * kPointsAlong == kPatchPoints);
constexpr std::size_t kTrianglesPerChunk = 4096, kRaysAhead = 64;

// What a cell holds: nothing yet, that something stands close to it, or its light.
constexpr std::uint64_t kEmpty = 0, kCrowded = 1, kFilled = 1ull << 63;

// Light in 63 bits: floats without their sign and their last ten digits, which are rounded. Not finite: NaN.
std::uint64_t packLight(const glm::vec3& light) {
  const auto part = [](float value) -> std::uint64_t {
    if (!std::isfinite(value)) return 0x1FF000u;
    return (std::bit_cast<std::uint32_t>(std::max(value, 0.0f)) + 0x200u) >> 10;
  };
  return kFilled | part(light.x) | part(light.y) << 21 | part(light.z) << 42;
}

glm::vec3 unpackLight(std::uint64_t cell) {
  const auto part = [cell](unsigned shift) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(cell >> shift & 0x1FFFFFu) << 10);
  };
  return {part(0), part(21), part(42)};
}

// The grids of a triangle's sides, each with half the columns and rows of the one before.
struct Grid {
  std::uint16_t columnShift : 4 = 0, rowShift : 4 = 0, corner : 2 = 0;
  std::uint16_t widthBits = 0;  // of the finest: the upper half of a float

  float width() const { return std::bit_cast<float>(std::uint32_t{widthBits} << 16); }  // [m]
  unsigned levels() const { return std::max<unsigned>(columnShift, rowShift) + 1; }
  unsigned columnShiftAt(unsigned level) const { return columnShift > level ? columnShift - level : 0; }
  unsigned rowShiftAt(unsigned level) const { return rowShift > level ? rowShift - level : 0; }
};
static_assert(sizeof(Grid) == 4);

// A point's coordinates in the grid that starts at a corner, and the point's weights of the triangle's corners 1 and 2.
glm::vec2 toGrid(const glm::vec2& b, unsigned corner) {
  const float first = 1.0f - b.x - b.y;
  return corner == 0 ? b : (corner == 1 ? glm::vec2(b.y, first) : glm::vec2(first, b.x));
}
glm::vec2 fromGrid(const glm::vec2& g, unsigned corner) {
  const float first = 1.0f - g.x - g.y;
  return corner == 0 ? g : (corner == 1 ? glm::vec2(first, g.x) : glm::vec2(g.y, first));
}

// Cells about `width` [m] wide or narrower, from the corner that needs the fewest.
Grid gridOf(const std::array<glm::vec3, 3>& corners, float width) {
  Grid grid;
  float finest = 0.0f;
  unsigned fewest = 2 * kMaxShift + 1;
  for (unsigned k = 0; k < 3; ++k) {
    const float length[2] = {glm::distance(corners[k], corners[(k + 1) % 3]),
                             glm::distance(corners[k], corners[(k + 2) % 3])};
    unsigned shift[2];
    for (int i = 0; i < 2; ++i)
      shift[i] = static_cast<unsigned>(
          std::clamp(std::ceil(std::log2(length[i] / width)), 0.0f, static_cast<float>(kMaxShift)));
    if (shift[0] + shift[1] >= fewest) continue;
    fewest = shift[0] + shift[1];
    grid.columnShift = static_cast<std::uint16_t>(shift[0] & 15u);
    grid.rowShift = static_cast<std::uint16_t>(shift[1] & 15u);
    grid.corner = static_cast<std::uint16_t>(k & 3u);
    finest = std::max(std::ldexp(length[0], -static_cast<int>(shift[0])),
                      std::ldexp(length[1], -static_cast<int>(shift[1])));
  }
  grid.widthBits = static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(finest) >> 16);
  return grid;
}

class SurfaceCells {
 public:
  SurfaceCells(const RayTracer& tracer, HitRadiance exact, PatchRadiance patch, std::uint64_t seed, Context& context)
      : tracer_(tracer), exact_(std::move(exact)), patch_(std::move(patch)), seed_(seed) {
    const Scene& scene = tracer.scene();
    grids_.resize(scene.triangleCount());
    // 1. The finest width
    std::vector<double> areas((grids_.size() + kTrianglesPerChunk - 1) / kTrianglesPerChunk, 0.0);
    eachTriangle(context, [&](std::size_t triangle, const std::array<glm::vec3, 3>& c) {
      areas[triangle / kTrianglesPerChunk] += 0.5 * glm::length(glm::cross(c[1] - c[0], c[2] - c[0]));
    });
    double area = 0.0;
    for (const double part : areas) area += part;
    const auto width = static_cast<float>(std::sqrt(area / kFinestCells));
    // 2. The grids
    if (width > 0.0f && std::isfinite(width))
      eachTriangle(context, [&](std::size_t triangle, const std::array<glm::vec3, 3>& c) {
        grids_[triangle] = gridOf(c, width);
      });
    // 3. Room for cells: zeros of which the system hands out those that are asked for
    slots_.reset(static_cast<Slot*>(std::calloc(kSlots, sizeof(Slot))));
    if (slots_ == nullptr) throw std::bad_alloc();
  }

  void read(std::uint64_t item, float spread, std::span<const Ray> rays, std::span<const Hit> hits,
            std::span<glm::vec3> radiance) const {
    std::vector<std::uint32_t> close;  // rays that no cell answers
    std::vector<Asked> asked, next;    // those that ask a cell of which nothing is known yet
    for (std::size_t begin = 0; begin < hits.size(); begin += kRaysAhead)
      readSome(begin, std::min(begin + kRaysAhead, hits.size()), spread, hits, radiance, asked, close);
    while (!asked.empty()) {
      lookUp(asked, hits);
      next.clear();
      for (Asked& a : asked) ask(a, hits, radiance, next, close);
      std::swap(asked, next);
    }
    if (close.empty()) return;
    // Ask in the order of the rays: these were found in one that depends on the cells that other threads have filled.
    std::sort(close.begin(), close.end());
    std::vector<Ray> closeRays;
    std::vector<Hit> closeHits;
    for (const std::uint32_t i : close) {
      closeRays.push_back(rays[i]);
      closeHits.push_back(hits[i]);
    }
    std::vector<glm::vec3> found(close.size(), glm::vec3(0.0f));
    exact_(item, spread, closeRays, closeHits, found);
    for (std::size_t k = 0; k < close.size(); ++k) radiance[close[k]] = found[k];
  }

 private:
  struct Cell {
    std::uint64_t key = 0;  // side, level, column and row; not 0
    std::uint32_t column = 0, row = 0;
    std::size_t slot = 0;  // the first that it may lie in
  };
  // Both are written once, the key first.
  struct Slot {
    std::uint64_t key, light;
  };

  template <class Visit>
  void eachTriangle(Context& context, const Visit& visit) const {
    const Scene& scene = tracer_.scene();
    parallelChunks(context, "", grids_.size(), kTrianglesPerChunk, [&](std::size_t begin, std::size_t end) {
      std::uint32_t at = scene.instanceOf(static_cast<std::uint32_t>(begin));
      for (std::size_t triangle = begin; triangle < end; ++triangle) {
        while (at + 1 < scene.instances.size() && scene.instances[at + 1].firstTriangle <= triangle) ++at;
        const Instance& instance = scene.instances[at];
        if (tracer_.geometry() == RayGeometry::fixed && !instance.baked()) continue;
        visit(triangle, scene.corners(instance, static_cast<std::uint32_t>(triangle - instance.firstTriangle)));
      }
    });
  }

  std::size_t triangleOf(const Hit& hit) const {
    return std::size_t{tracer_.scene().instances[hit.instance].firstTriangle} + hit.triangle;
  }

  Cell cellAt(const Grid& grid, unsigned level, const Hit& hit) const {
    const glm::vec2 g = toGrid(hit.barycentric, grid.corner);
    const auto along = [](float x, unsigned shift) {
      const std::uint32_t count = 1u << shift;
      return std::min(static_cast<std::uint32_t>(std::max(x, 0.0f) * static_cast<float>(count)), count - 1);
    };
    Cell cell;
    cell.column = along(g.x, grid.columnShiftAt(level));
    cell.row = along(g.y, grid.rowShiftAt(level));
    cell.key =
        (((2 * std::uint64_t{triangleOf(hit)} + (hit.back ? 1 : 0)) << 4 | (level + 1)) << kMaxShift | cell.column)
            << kMaxShift |
        cell.row;
    cell.slot = mix64(cell.key) % kSlots;
    return cell;
  }

  // The slot of a cell, which may have taken it just now; null where all that it may lie in are others'.
  Slot* slotOf(const Cell& cell) const {
    for (unsigned probe = 0; probe < kProbes; ++probe) {
      Slot& slot = slots_[(cell.slot + probe) % kSlots];
      const std::atomic_ref<std::uint64_t> key(slot.key);
      std::uint64_t found = key.load(std::memory_order_relaxed);
      if (found == 0 && key.compare_exchange_strong(found, cell.key, std::memory_order_relaxed)) return &slot;
      if (found == cell.key) return &slot;
    }
    return nullptr;
  }

  // A ray on its way to an answer.
  struct Asked {
    std::uint32_t ray = 0;
    int level = -1;  // of the cell; -1: none will do
    Cell cell;
    Slot* slot = nullptr;
    std::uint64_t found = kEmpty;
  };

  void readSome(std::size_t begin, std::size_t end, float spread, std::span<const Hit> hits,
                std::span<glm::vec3> radiance, std::vector<Asked>& unknown, std::vector<std::uint32_t>& close) const {
    // Grids, then slots, lie all over memory: ask for all of them before the first is read.
    std::array<const Grid*, kRaysAhead> grids;
    std::array<Asked, kRaysAhead> asked;
    for (std::size_t i = begin; i < end; ++i) {
      grids[i - begin] = hits[i] ? &grids_[triangleOf(hits[i])] : nullptr;
      if (hits[i]) __builtin_prefetch(grids[i - begin]);
    }
    for (std::size_t i = begin; i < end; ++i) {
      if (!hits[i]) continue;
      const Grid& grid = *grids[i - begin];
      const float ratio = kWidest * spread * hits[i].distance / grid.width();
      Asked& a = asked[i - begin];
      a.ray = static_cast<std::uint32_t>(i);
      a.level = ratio >= 1.0f ? std::min<int>(std::ilogb(ratio), static_cast<int>(grid.levels()) - 1) : -1;
      if (a.level < 0) continue;
      a.cell = cellAt(grid, static_cast<unsigned>(a.level), hits[i]);
      __builtin_prefetch(&slots_[a.cell.slot]);
    }
    for (std::size_t i = begin; i < end; ++i) {
      Asked& a = asked[i - begin];
      if (!hits[i]) continue;
      if (a.level < 0) {
        close.push_back(a.ray);
        continue;
      }
      readSlot(a);
      if (a.found == kEmpty)
        unknown.push_back(a);
      else
        ask(a, hits, radiance, unknown, close);
    }
  }

  void readSlot(Asked& a) const {
    a.slot = slotOf(a.cell);
    a.found = a.slot != nullptr ? std::atomic_ref(a.slot->light).load(std::memory_order_relaxed) : kEmpty;
  }

  // Take what was found, or ask finer cells.
  void ask(Asked& a, std::span<const Hit> hits, std::span<glm::vec3> radiance, std::vector<Asked>& unknown,
           std::vector<std::uint32_t>& close) const {
    while (a.found == kCrowded && --a.level >= 0) {
      a.cell = cellAt(grids_[triangleOf(hits[a.ray])], static_cast<unsigned>(a.level), hits[a.ray]);
      readSlot(a);
    }
    if (a.found == kEmpty)
      unknown.push_back(a);
    else if (a.found == kCrowded)
      close.push_back(a.ray);
    else
      radiance[a.ray] = unpackLight(a.found);
  }

  // Find what cells hold, each a function of itself alone.
  void lookUp(std::span<Asked> asked, std::span<const Hit> hits) const {
    std::vector<Ray> rays, clear;
    std::vector<Hit> ends;
    for (const Asked& a : asked) addPatch(a, hits[a.ray], rays, ends, clear);
    std::vector<Hit> around(clear.size());
    tracer_.trace(clear, around);
    // Keep those that nothing stands close to. A ray from within something solid meets the back of it.
    std::size_t kept = 0;
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const std::span<const Hit> looks = std::span(around).subspan(k * kLooks, kLooks);
      const float width = ends[k * kPatchPoints].distance;
      const bool crowded =
          std::any_of(looks.begin(), looks.end(), [width](const Hit& h) { return h.distance < width || h.back; });
      asked[k].found = crowded ? kCrowded : kEmpty;
      if (crowded) continue;
      std::copy_n(rays.begin() + static_cast<std::ptrdiff_t>(k * kPatchPoints), kPatchPoints,
                  rays.begin() + static_cast<std::ptrdiff_t>(kept * kPatchPoints));
      std::copy_n(ends.begin() + static_cast<std::ptrdiff_t>(k * kPatchPoints), kPatchPoints,
                  ends.begin() + static_cast<std::ptrdiff_t>(kept * kPatchPoints));
      ++kept;
    }
    std::vector<glm::vec3> light(kept, glm::vec3(0.0f));
    patch_(std::span(rays).first(kept * kPatchPoints), std::span(ends).first(kept * kPatchPoints), light);
    std::size_t next = 0;
    for (Asked& a : asked) {
      if (a.found == kEmpty) a.found = packLight(light[next++]);
      if (a.slot != nullptr) std::atomic_ref(a.slot->light).store(a.found, std::memory_order_relaxed);
    }
  }

  // Add the points of a cell, as rays from above that end on them, and rays up from some. Of `hit`, only the side of
  // the triangle counts.
  void addPatch(const Asked& a, const Hit& hit, std::vector<Ray>& rays, std::vector<Hit>& ends,
                std::vector<Ray>& clear) const {
    const Scene& scene = tracer_.scene();
    const Grid& grid = grids_[triangleOf(hit)];
    const auto level = static_cast<unsigned>(a.level);
    const std::array<glm::vec3, 3> corners = scene.corners(scene.instances[hit.instance], hit.triangle);
    const glm::vec3 across = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    const float twice = glm::length(across);
    const glm::vec3 normal = twice > 0.0f ? across * ((hit.back ? -1.0f : 1.0f) / twice) : glm::vec3(0, 0, 1);
    const float width = std::ldexp(grid.width(), a.level);
    RandomStream random(seed_, kCellStage, a.cell.key);
    // Once around the cell, from any of its quarters.
    constexpr unsigned kAround[kPatchPoints] = {0, 1, 3, 2};
    const unsigned turn = random.below(kPatchPoints);
    for (unsigned s = 0; s < kPatchPoints; ++s) {
      const glm::vec2 jitter = random.uniform2(),
                      b = fromGrid(pointIn(grid, level, a.cell, kAround[(s + turn) % kPatchPoints], jitter),
                                   grid.corner);
      const glm::vec3 position = corners[0] + b.x * (corners[1] - corners[0]) + b.y * (corners[2] - corners[0]);
      rays.push_back({position + width * normal, 0.0f, -normal});
      ends.push_back({width, hit.instance, hit.triangle, b, hit.back});
    }
    const glm::mat3 frame = frameAbout(normal);
    float angle = 2.0f * std::numbers::pi_v<float> * random.uniform();
    for (unsigned k = 0; k < kLooks; ++k, angle += 2.0f * std::numbers::pi_v<float> / kLooks) {
      const Ray& from = rays[rays.size() - kPatchPoints + kLookFrom[k]];
      const glm::vec3 position = from.origin + width * from.direction;
      clear.push_back({position + normal * tracer_.epsilonAt(position), 0.0f,
                       glm::normalize(normal + std::cos(angle) * frame[0] + std::sin(angle) * frame[1])});
    }
  }

  // A point of a cell and of the triangle, in coordinates of the grid: cells on the diagonal lie in it in part.
  static glm::vec2 pointIn(const Grid& grid, unsigned level, const Cell& cell, unsigned sample,
                           const glm::vec2& jitter) {
    const glm::vec2 size(std::ldexp(1.0f, -static_cast<int>(grid.columnShiftAt(level))),
                         std::ldexp(1.0f, -static_cast<int>(grid.rowShiftAt(level))));
    const glm::vec2 from = glm::vec2(cell.column, cell.row) * size;
    glm::vec2 inside =
        (glm::vec2(sample % kPointsAlong, sample / kPointsAlong) + jitter) / static_cast<float>(kPointsAlong) * size;
    while (from.x + inside.x + from.y + inside.y > 1.0f && inside.x + inside.y > 1e-6f) inside *= 0.5f;
    return from + inside;
  }

  struct Free {
    void operator()(Slot* memory) const { std::free(memory); }
  };

  const RayTracer& tracer_;
  HitRadiance exact_;
  PatchRadiance patch_;
  std::uint64_t seed_;
  std::vector<Grid> grids_;  // [Size triangles]
  std::unique_ptr<Slot[], Free> slots_;
};

}  // namespace

HitRadiance cellRadiance(const RayTracer& tracer, HitRadiance exact, PatchRadiance patch, std::uint64_t seed,
                         Context& context) {
  if (tracer.scene().triangleCount() > kMaxTriangles) return exact;
  auto cells = std::make_shared<const SurfaceCells>(tracer, std::move(exact), std::move(patch), seed, context);
  return [cells](std::uint64_t item, float spread, std::span<const Ray> rays, std::span<const Hit> hits,
                 std::span<glm::vec3> radiance) { cells->read(item, spread, rays, hits, radiance); };
}

}  // namespace relume
