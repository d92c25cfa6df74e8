// SPDX-License-Identifier: MIT
// See grid_sight.h.
#include "runtime/shared/grid_sight.h"

#include "runtime/shared/stencil.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <bitset>
#include <cstring>
#include <limits>

namespace relume {
namespace {

constexpr int kNodes = kDepthSide * kDepthSide;
// [spacings] how far beyond the grid receivers see as they would by the whole map.
constexpr float kBeyond = 0.5f;
constexpr float kAnywhere = 1e15f;  // [m]
// Of distances: rounding errors of positions hide nothing.
constexpr float kSightRoom = 1.001f;

// Where the receivers of a cache may be.
struct Box {
  glm::vec3 low{std::numeric_limits<float>::max()}, high{std::numeric_limits<float>::lowest()};

  void add(const Box& other) {
    low = glm::min(low, other.low);
    high = glm::max(high, other.high);
  }
};

// The boxes of the caches that the grid's cells read. [Size caches of the grid]
std::pmr::vector<Box> findReceivers(const CacheGrid& grid, std::size_t caches, std::pmr::memory_resource* memory) {
  std::pmr::vector<Box> boxes(caches, memory);
  const auto add = [&](std::uint32_t cache, const Box& box) {
    if (cache < boxes.size()) boxes[cache].add(box);
  };
  const glm::uvec3 cells = grid.cells(), r = grid.resolution;
  for (std::size_t i = 0; i < std::size_t{cells.x} * cells.y * cells.z; ++i) {
    const glm::uvec3 cell(i % cells.x, i / cells.x % cells.y, i / cells.x / cells.y);
    const auto latticeCache = [&](std::uint32_t corner) {
      const glm::uvec3 at = glm::min(cell + cornerOffset(corner), r - 1u);
      return grid.cache[(std::size_t{at.z} * r.y + at.y) * r.x + at.x];
    };
    Box whole{grid.originWorld + grid.spacing * glm::vec3(cell),
              grid.originWorld + grid.spacing * glm::vec3(cell + 1u)};
    const glm::vec3 middle = 0.5f * (whole.low + whole.high);
    for (int k = 0; k < 3; ++k) {
      // All receivers along an axis that has one point.
      const float beyond = r[k] < 2 ? kAnywhere : kBeyond * grid.spacing[k];
      if (cell[k] == 0) whole.low[k] -= beyond;
      if (cell[k] + 1 == cells[k]) whole.high[k] += beyond;
    }
    const std::uint32_t brick = grid.brick.empty() ? kNoBrick : grid.brick[i];
    if (brick == kNoBrick) {
      for (std::uint32_t corner = 0; corner < 8; ++corner) add(latticeCache(corner), whole);
      continue;
    }
    const std::uint32_t* points = grid.fine.data() + std::size_t{kBrickWords} * brick;
    for (std::uint32_t part = 0; part < 8; ++part) {
      const glm::uvec3 half = cornerOffset(part);
      Box box = whole;
      for (int k = 0; k < 3; ++k) (half[k] == 0 ? box.high : box.low)[k] = middle[k];
      for (std::uint32_t corner = 0; corner < 8; ++corner) {
        const glm::uvec3 at = half + cornerOffset(corner);
        const std::uint32_t cache = points[(at.z * 3 + at.y) * 3 + at.x];
        if (cache != kHangingPoint) {
          add(cache, box);
          continue;
        }
        const std::array<float, 8> share = trilinear(0.5f * glm::vec3(at));
        for (std::uint32_t k = 0; k < 8; ++k) {
          if (share[k] > 0.0f) add(latticeCache(k), box);
        }
      }
    }
  }
  return boxes;
}

// The point of the octahedron |x| + |y| + |z| = 1 that a node stands for.
glm::vec3 pointOf(int node) {
  constexpr float kHalf = kDepthHalf;
  const int x = node % kDepthSide - kDepthHalf, y = node / kDepthSide - kDepthHalf;
  const glm::vec2 a = glm::abs(glm::vec2(x, y)) / kHalf;
  const bool above = a.x + a.y <= 1.0f;
  const glm::vec2 p = above ? a : glm::vec2(1.0f - a.y, 1.0f - a.x);
  return {x < 0 ? -p.x : p.x, y < 0 ? -p.y : p.y, above ? 1.0f - p.x - p.y : p.x + p.y - 1.0f};
}

// visit(three nodes) for each triangle of the lattice, as depthNodesAround() cuts it.
template <class Visit>
void visitTriangles(const Visit& visit) {
  for (const int signY : {-1, 1}) {
    for (const int signX : {-1, 1}) {
      const auto node = [&](int x, int y) { return (kDepthHalf + signY * y) * kDepthSide + kDepthHalf + signX * x; };
      for (int y = 0; y < kDepthHalf; ++y) {
        for (int x = 0; x < kDepthHalf; ++x) {
          visit(std::array{node(x, y), node(x + 1, y), node(x, y + 1)});
          visit(std::array{node(x + 1, y + 1), node(x, y + 1), node(x + 1, y)});
        }
      }
    }
  }
}

std::uint32_t nodeByte(std::span<const std::uint32_t> words, int node) {
  return words[static_cast<std::size_t>(node) >> 2] >> (8 * (node & 3)) & 0xFFu;
}

// Nodes of the triangles that hide some place of the box, which is about the cache. A receiver at distance l1 toward p
// is hidden if t l1 > unit, and l1 |p_k| is at most the box's side along each axis k: where t <= unit |p_k| / side for
// one axis at all three nodes, it is all over the triangle, as both are linear there.
std::bitset<kNodes> findNodes(std::span<const std::uint32_t> words, const Box& box, float unit) {
  std::bitset<kNodes> kept;
  const glm::vec3 low = glm::max(-box.low, 0.0f) * kSightRoom, high = glm::max(box.high, 0.0f) * kSightRoom;
  visitTriangles([&](const std::array<int, 3>& nodes) {
    std::array<glm::vec3, 3> point;
    std::array<float, 3> t;
    for (std::size_t i = 0; i < 3; ++i) {
      point[i] = pointOf(nodes[i]);
      t[i] = unpackDepth(nodeByte(words, nodes[i]));
    }
    const glm::vec3 middle = point[0] + point[1] + point[2];
    bool hides = true;
    for (int k = 0; k < 3 && hides; ++k) {
      const float side = middle[k] < 0.0f ? low[k] : high[k];
      hides = false;
      for (std::size_t i = 0; i < 3; ++i) hides = hides || t[i] * side > unit * std::abs(point[i][k]);
    }
    if (!hides) return;
    for (const int node : nodes) kept.set(static_cast<std::size_t>(node));
  });
  return kept;
}

}  // namespace

GridSight::GridSight(const Caches& caches, std::pmr::memory_resource* memory)
    : unit_(caches.grid.depthUnit()), spacing_(caches.grid.finestSpacing()), begin_(memory), byte_(memory) {
  const CacheGrid& grid = caches.grid;
  if (grid.depth.empty()) return;
  const std::size_t count = grid.depth.size() / kDepthWords;
  const std::pmr::vector<Box> boxes = findReceivers(grid, count, memory);
  begin_.reserve(count + 1);
  for (std::uint32_t cache = 0; cache < count; ++cache) {
    begin_.push_back(static_cast<std::uint32_t>(byte_.size()));
    const auto words = grid.depth.span().subspan(std::size_t{kDepthWords} * cache, kDepthWords);
    const glm::vec3 place = caches.positionWorld[cache];
    const std::bitset<kNodes> kept = findNodes(words, {boxes[cache].low - place, boxes[cache].high - place}, unit_);
    if (kept.none()) continue;
    std::array<Row, kDepthSide + 1> rows{};
    std::array<std::uint8_t, kNodes> bytes;
    std::size_t size = 0;
    for (int row = 0; row <= kDepthSide; ++row) {
      int first = 0, end = row < kDepthSide ? kDepthSide : 0;
      const auto isKept = [&](int x) { return kept[static_cast<std::size_t>(row * kDepthSide + x)]; };
      while (first < end && !isKept(first)) ++first;
      while (end > first && !isKept(end - 1)) --end;
      rows[static_cast<std::size_t>(row)] = static_cast<Row>(size << kFirstBits | static_cast<std::size_t>(first));
      for (int x = first; x < end; ++x)
        bytes[size++] = static_cast<std::uint8_t>(nodeByte(words, row * kDepthSide + x));
    }
    const auto* const from = reinterpret_cast<const std::uint8_t*>(rows.data());
    byte_.insert(byte_.end(), from, from + kRowBytes);
    byte_.insert(byte_.end(), bytes.data(), bytes.data() + size);
  }
  begin_.push_back(static_cast<std::uint32_t>(byte_.size()));
  byte_.shrink_to_fit();
}

void GridSight::read(std::uint32_t cache, std::span<std::uint32_t> words) const {
  std::fill(words.begin(), words.end(), 0u);
  if (begin_[cache] == begin_[cache + 1]) return;
  const std::uint8_t* const map = byte_.data() + begin_[cache];
  for (int node = 0; node < kNodes; ++node)
    words[static_cast<std::size_t>(node) >> 2] |= byteAt(map, node) << (8 * (node & 3));
}

std::size_t GridSight::bytes() const { return sizeof(std::uint32_t) * begin_.size() + byte_.size(); }

}  // namespace relume
