// SPDX-License-Identifier: MIT
// See synthetic_bake.h.
#include "tests/runtime/synthetic_bake.h"

#include "formats/compact_links.h"
#include "formats/grid_depth.h"
#include "formats/map_sight.h"
#include "formats/pack.h"
#include "formats/sh.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <queue>
#include <random>

namespace relume::test {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
const glm::vec3 kRoom(12.0f, 4.0f, 6.0f);  // [m] from the origin

float uniform(std::mt19937& random) { return static_cast<float>(random() >> 8) * 0x1p-24f; }

// Wall 0..5: axis wall / 2, at 0 or at the room's end, its normal inward. (s, t) in [0,1]².
struct Wall {
  glm::vec3 normal;
  int axis, u, v;
  float place;
};

Wall wallOf(int index) {
  const int axis = index / 2;
  Wall wall{glm::vec3(0.0f), axis, (axis + 1) % 3, (axis + 2) % 3, index % 2 ? kRoom[axis] : 0.0f};
  wall.normal[axis] = index % 2 ? -1.0f : 1.0f;
  return wall;
}

glm::vec3 pointOn(const Wall& wall, float s, float t) {
  glm::vec3 p(0.0f);
  p[wall.axis] = wall.place;
  p[wall.u] = s * kRoom[wall.u];
  p[wall.v] = t * kRoom[wall.v];
  return p;
}

float areaOf(const Wall& wall) { return kRoom[wall.u] * kRoom[wall.v]; }

// The texels of a wall: a cell of a 3 x 2 atlas with a gutter of one texel all round.
struct Cell {
  std::uint32_t x, y, width, height;
};

Cell cellOf(int wall, std::uint32_t size) {
  const std::uint32_t w = size / 3, h = size / 2;
  return {static_cast<std::uint32_t>(wall % 3) * w + 1, static_cast<std::uint32_t>(wall / 3) * h + 1, w - 2, h - 2};
}

glm::vec2 atlasUv(const Cell& cell, float s, float t, std::uint32_t size) {
  return glm::vec2(static_cast<float>(cell.x) + s * static_cast<float>(cell.width),
                   static_cast<float>(cell.y) + t * static_cast<float>(cell.height)) /
         static_cast<float>(size);
}

void placeCaches(const SyntheticOptions& options, Caches& caches) {
  std::vector<glm::vec3> position, normal;
  CacheGrid& grid = caches.grid;
  grid.resolution = options.grid;
  grid.spacing = kRoom / glm::vec3(glm::max(options.grid, glm::uvec3(1u)));
  grid.originWorld = 0.5f * grid.spacing;
  std::vector<std::uint32_t> points;
  for (std::uint32_t z = 0; z < options.grid.z; ++z) {
    for (std::uint32_t y = 0; y < options.grid.y; ++y) {
      for (std::uint32_t x = 0; x < options.grid.x; ++x) {
        points.push_back(static_cast<std::uint32_t>(position.size()));
        position.push_back(grid.originWorld + glm::vec3(x, y, z) * grid.spacing);
        normal.emplace_back(0.0f);
      }
    }
  }
  grid.cache = std::move(points);

  const std::uint32_t size = options.lightmapSize;
  std::vector<std::uint32_t> texels(std::size_t{size} * size, kNoCache);
  std::uint32_t left = options.lightmapCaches;
  for (int wall = 0; wall < 6; ++wall) {
    const Cell cell = cellOf(wall, size);
    // Spread what is left evenly over the walls to come, row by row.
    std::uint32_t here = left / static_cast<std::uint32_t>(6 - wall);
    for (std::uint32_t y = 0; y < cell.height; ++y) {
      for (std::uint32_t x = 0; x < cell.width && here > 0; ++x, --here, --left) {
        texels[std::size_t{cell.y + y} * size + cell.x + x] = static_cast<std::uint32_t>(position.size());
        const Wall at = wallOf(wall);
        position.push_back(pointOn(at, (static_cast<float>(x) + 0.5f) / static_cast<float>(cell.width),
                                   (static_cast<float>(y) + 0.5f) / static_cast<float>(cell.height)));
        normal.push_back(at.normal);
      }
    }
  }
  // Dilate by one texel.
  std::vector<std::uint32_t> dilated = texels;
  for (std::uint32_t i = 0; i < size * size; ++i) {
    const std::uint32_t x = i % size, y = i / size;
    for (std::uint32_t k = 0; k < 9 && dilated[i] == kNoCache; ++k) {
      const std::uint32_t nx = x + k % 3 - 1, ny = y + k / 3 - 1;
      if (nx < size && ny < size) dilated[i] = texels[std::size_t{ny} * size + nx];
    }
  }
  caches.lightmap.width = caches.lightmap.height = size;
  caches.lightmap.cache = std::move(dilated);
  caches.positionWorld = std::move(position);
  caches.normal = std::move(normal);
}

void placeSurfels(const SyntheticOptions& options, const Caches& caches, Surfels& surfels) {
  std::mt19937 random(options.seed);
  std::vector<glm::vec3> position, normal, albedo, emission;
  std::vector<std::uint32_t> receiver;
  float total = 0.0f, cumulative = 0.0f;
  for (int wall = 0; wall < 6; ++wall) total += areaOf(wallOf(wall));
  for (int wall = 0; wall < 6; ++wall) {
    const Wall at = wallOf(wall);
    const auto first = static_cast<std::uint32_t>(cumulative / total * static_cast<float>(options.surfels) + 0.5f);
    cumulative += areaOf(at);
    const auto last = static_cast<std::uint32_t>(cumulative / total * static_cast<float>(options.surfels) + 0.5f);
    const Cell cell = cellOf(wall, options.lightmapSize);
    for (std::uint32_t i = first; i < last; ++i) {
      const float s = uniform(random), t = uniform(random);
      position.push_back(pointOn(at, s, t));
      normal.push_back(at.normal);
      albedo.push_back(0.2f + 0.6f * glm::vec3(uniform(random), uniform(random), uniform(random)));
      emission.push_back(i % 97 == 0 ? glm::vec3(2.0f, 1.5f, 0.5f) : glm::vec3(0.0f));
      const glm::vec2 uv = atlasUv(cell, s, t, options.lightmapSize);
      const glm::uvec2 texel = glm::uvec2(uv * static_cast<float>(options.lightmapSize));
      const bool lit = caches.lightmap.cache[std::size_t{texel.y} * options.lightmapSize + texel.x] != kNoCache;
      receiver.push_back(lit ? packUnorm16x2(uv) : kGridReceiver);
    }
  }
  surfels.areaEach = total / static_cast<float>(options.surfels);
  surfels.instance = std::vector<std::uint32_t>(position.size(), 0u);
  surfels.positionWorld = std::move(position);
  surfels.normal = std::move(normal);
  surfels.albedo = std::move(albedo);
  surfels.emission = std::move(emission);
  surfels.receiver = std::move(receiver);
}

// A node while the tree is made: its senders are order[begin, end).
struct Cluster {
  glm::vec3 centre{0.0f}, normal{0.0f};
  float area = 0.0f;
  bool sky = false;
  std::uint32_t child = 0;
};

// A balanced tree: each range of senders is cut in the middle of its longest axis.
std::vector<Cluster> buildHierarchy(const Surfels& surfels, std::uint32_t skyPatches, Hierarchy& hierarchy) {
  const std::uint32_t surfelCount = surfels.count(), n = surfelCount + skyPatches;
  std::vector<glm::vec3> sky;
  for (std::uint32_t i = 0; i < skyPatches; ++i) {
    const float z = 1.0f - (2.0f * static_cast<float>(i) + 1.0f) / static_cast<float>(skyPatches);
    const float phi = static_cast<float>(i) * 2.39996323f, r = std::sqrt(1.0f - z * z);
    sky.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
  }
  const auto place = [&](std::uint32_t s) {
    return s < surfelCount ? surfels.positionWorld[s] : 1000.0f * sky[s - surfelCount];
  };
  std::vector<std::uint32_t> order(n), child(1), leafNode(n), levelBegin{0};
  for (std::uint32_t i = 0; i < n; ++i) order[i] = i;
  struct Range {
    std::uint32_t begin, end;
  };
  std::vector<Range> ranges{{0, n}};
  std::vector<Cluster> clusters(2 * std::size_t{n} - 1);
  std::vector<float> firstWeight(2 * std::size_t{n} - 1, 0.0f);
  child.resize(2 * std::size_t{n} - 1);
  // Breadth first: ranges grows while it is walked. The top cut parts surfels from sky.
  for (std::uint32_t i = 0, levelEnd = 1; i < ranges.size(); ++i) {
    if (i == levelEnd) {
      levelBegin.push_back(levelEnd);
      levelEnd = static_cast<std::uint32_t>(ranges.size());
    }
    const Range r = ranges[i];
    if (r.end - r.begin == 1) {
      child[i] = kLeafBit | order[r.begin];
      leafNode[order[r.begin]] = i;
      continue;
    }
    std::uint32_t middle = (r.begin + r.end) / 2;
    if (i == 0 && skyPatches > 0 && surfelCount > 0) {
      middle = surfelCount;
    } else {
      glm::vec3 low(1e30f), high(-1e30f);
      for (std::uint32_t k = r.begin; k < r.end; ++k) {
        low = glm::min(low, place(order[k]));
        high = glm::max(high, place(order[k]));
      }
      const glm::vec3 extent = high - low;
      const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : (extent.y >= extent.z ? 1 : 2);
      std::nth_element(order.begin() + r.begin, order.begin() + middle, order.begin() + r.end,
                       [&](std::uint32_t a, std::uint32_t b) {
                         const float pa = place(a)[axis], pb = place(b)[axis];
                         return pa != pb ? pa < pb : a < b;
                       });
    }
    child[i] = static_cast<std::uint32_t>(ranges.size());
    firstWeight[i] = static_cast<float>(middle - r.begin) / static_cast<float>(r.end - r.begin);
    ranges.push_back({r.begin, middle});
    ranges.push_back({middle, r.end});
  }
  levelBegin.push_back(static_cast<std::uint32_t>(ranges.size()));
  // Sum up what a cut needs to know.
  for (std::size_t i = clusters.size(); i-- > 0;) {
    Cluster& c = clusters[i];
    c.child = child[i];
    if (child[i] & kLeafBit) {
      const std::uint32_t s = child[i] & ~kLeafBit;
      c.sky = s >= surfelCount;
      c.centre = place(s);
      c.normal = c.sky ? glm::vec3(0.0f) : surfels.normal[s];
      c.area = c.sky ? 4.0f * kPi / static_cast<float>(skyPatches) : surfels.areaEach;
      continue;
    }
    const Cluster &a = clusters[c.child], &b = clusters[c.child + 1];
    c.sky = a.sky;
    c.area = a.area + b.area;
    c.centre = (a.area * a.centre + b.area * b.centre) / c.area;
    c.normal = (a.area * a.normal + b.area * b.normal) / c.area;
  }
  const bool grouped = skyPatches > 0 && surfelCount > 0;
  hierarchy.groupRoot = grouped ? std::vector<std::uint32_t>{1, 2} : std::vector<std::uint32_t>{0};
  hierarchy.child = std::move(child);
  hierarchy.firstWeight = std::move(firstWeight);
  hierarchy.levelBegin = std::move(levelBegin);
  hierarchy.leafNode = std::move(leafNode);
  hierarchy.skyDirection = std::move(sky);
  return clusters;
}

// Solid angle of a cluster from a point, roughly; only what lies above the cache's horizon.
float solidAngle(const Cluster& c, const glm::vec3& position, const glm::vec3& normal, glm::vec3& direction) {
  const glm::vec3 toward = c.centre - position;
  const float d2 = std::max(glm::dot(toward, toward), 1e-6f);
  direction = toward / std::sqrt(d2);
  if (normal != glm::vec3(0.0f) && glm::dot(direction, normal) <= 0.0f) return 0.0f;
  if (c.sky) return c.area;
  const float cosine = std::max(-glm::dot(c.normal, direction), 0.1f);
  return c.area * cosine / (d2 + c.area / kPi);
}

struct Candidate {
  float key;
  std::uint32_t node;
  bool operator<(const Candidate& other) const { return key != other.key ? key < other.key : node > other.node; }
};

void makeLinks(const SyntheticOptions& options, const std::vector<Cluster>& clusters, const Hierarchy& hierarchy,
               const Caches& caches, Links& links) {
  std::vector<std::uint32_t> rowBegin{0}, shNode;
  std::vector<std::uint16_t> sh;
  std::vector<ConeLink> cone;
  std::vector<float> irradiance;
  CompactLinkWriter writer(options.kind);
  const float y0 = 0.5f / std::sqrt(kPi);
  for (std::uint32_t cache = 0; cache < caches.count(); ++cache) {
    const glm::vec3 position = caches.positionWorld[cache], normal = caches.normal[cache];
    glm::vec3 direction;
    // Refine the largest until the row is full.
    std::priority_queue<Candidate> heap;
    std::vector<std::uint32_t> row;
    for (const std::uint32_t root : hierarchy.groupRoot)
      heap.push({solidAngle(clusters[root], position, normal, direction) + 1.0f, root});
    while (!heap.empty() && heap.size() + row.size() < options.linksPerCache) {
      const std::uint32_t node = heap.top().node;
      heap.pop();
      const std::uint32_t child = clusters[node].child;
      if (child & kLeafBit) {
        row.push_back(node);
        continue;
      }
      for (const std::uint32_t each : {child, child + 1}) {
        heap.push({solidAngle(clusters[each], position, normal, direction), each});
      }
    }
    for (; !heap.empty(); heap.pop()) row.push_back(heap.top().node);
    std::sort(row.begin(), row.end());

    double total = 0.0;
    for (const std::uint32_t node : row) total += solidAngle(clusters[node], position, normal, direction);
    const double all = normal == glm::vec3(0.0f) ? 4.0 * kPi : 2.0 * kPi;
    for (const std::uint32_t node : row) {
      const float omega =
          solidAngle(clusters[node], position, normal, direction) * static_cast<float>(all / std::max(total, 1e-6));
      const float f = y0 * omega / kPi, cosAlpha = std::max(1.0f - omega / (2.0f * kPi), -1.0f);
      if (options.kind == LinkKind::irradiance && normal != glm::vec3(0.0f)) {
        // The cosine of a cap, so that a white furnace gives one.
        irradiance.push_back(omega * std::max(glm::dot(direction, normal), 0.01f));
        continue;
      }
      if (options.kind != LinkKind::sh) {
        cone.push_back({node, packHalf(f), packHalf(cosAlpha), packOctahedral(direction)});
        continue;
      }
      std::array<float, kMaxCoefficients> y;
      std::array<float, kMaxBands> ratio;
      const int bands = static_cast<int>(options.bands);
      evaluateSh(bands, direction, y);
      coneBandRatios(bands, cosAlpha, ratio);
      shNode.push_back(node);
      for (int l = 0; l < bands; ++l) {
        for (int i = l * l; i < (l + 1) * (l + 1); ++i) {
          sh.push_back(packHalf(f * ratio[static_cast<std::size_t>(l)] * y[static_cast<std::size_t>(i)] / y0));
        }
      }
    }
    rowBegin.push_back(rowBegin.back() + static_cast<std::uint32_t>(row.size()));
    if (options.kind != LinkKind::irradiance) continue;
    writer.beginRow();
    float sum = 0.0f;
    for (const float each : irradiance) sum += each;
    for (std::size_t i = 0; i < irradiance.size(); ++i) writer.add(row[i], 2.0f * y0 * irradiance[i] / sum);
    for (const ConeLink& link : cone) {
      writer.add(link.node, unpackHalf(link.transfer), {unpackOctahedral(link.direction), unpackHalf(link.cosAlpha)});
    }
    irradiance.clear();
    cone.clear();
  }
  const bool sized = options.kind == LinkKind::sh;
  links.kind = sized ? LinkKind::sh : LinkKind::cone;
  links.bands = sized ? options.bands : 0;
  links.rowBegin = std::move(rowBegin);
  links.shNode = std::move(shNode);
  links.shCoefficients = std::move(sh);
  links.cone = std::move(cone);
  if (options.kind == LinkKind::irradiance) {
    links.kind = options.kind;
    links.head = std::move(writer.head);
    links.shape = std::move(writer.shape8);
  } else if (options.kind != links.kind) {
    links = *compactLinks(links);
  }
}

}  // namespace

Bake makeSyntheticBake(const SyntheticOptions& options) {
  Bake bake;
  placeCaches(options, bake.caches);
  placeSurfels(options, bake.caches, bake.surfels);
  bake.instances = std::vector<BakedInstance>{{.node = "rooms", .mesh = "rooms", .material = ""}};
  bake.caches.lightmap.parts = std::vector<LightmapPart>(1);
  const std::vector<Cluster> clusters = buildHierarchy(bake.surfels, options.skyPatches, bake.hierarchy);
  makeLinks(options, clusters, bake.hierarchy, bake.caches, bake.links);
  bake.provenance.lumaBands = bake.provenance.chromaBands = options.bands;
  return bake;
}

void addSight(Bake& bake) {
  std::mt19937 random(9);
  const auto byte = [&random] { return static_cast<int>(random() % 255u) - 127; };
  const auto moves = [&random] {
    const auto x = static_cast<std::uint32_t>(random() % 3u);
    return x | static_cast<std::uint32_t>(random() % 3u) << 2;
  };
  std::vector<std::uint32_t> sight(bake.caches.lightmap.cache.size(), 0);
  for (std::uint32_t& word : sight) {
    const int x = byte(), y = byte(), line = byte() / 3;
    const int offset = line % 4 == 0 ? kSightQuarter : line;
    const std::uint32_t near = moves(), beyond = moves();
    if (random() % 3u == 0) word = packMapSight(x, y, offset, near, beyond);
  }
  bake.caches.lightmap.sight = std::move(sight);
}

Bake makeBakeWithBricks(const glm::uvec3& resolution, bool bricks, bool depths) {
  Bake bake = makeSyntheticBake({.surfels = 200, .grid = resolution, .lightmapCaches = 12, .linksPerCache = 16});
  CacheGrid& grid = bake.caches.grid;
  const auto caches = static_cast<std::uint32_t>(grid.cache.size());
  std::mt19937 random(5);
  if (bricks) {
    const glm::uvec3 cells = grid.cells();
    std::vector<std::uint32_t> brick(cells.x * cells.y * cells.z), fine;
    std::uint32_t count = 0;
    for (std::uint32_t& b : brick) b = random() % 3 == 0 ? kNoBrick : count++;
    for (std::uint32_t i = 0; i < kBrickWords * count; ++i) {
      const std::uint32_t pick = random() % 5;
      fine.push_back(pick == 0 ? kNoCache : pick == 1 ? kHangingPoint : static_cast<std::uint32_t>(random() % caches));
    }
    grid.brick = brick;
    grid.fine = fine;
  }
  if (depths) {
    std::vector<std::uint32_t> depth(std::size_t{kDepthWords} * caches, 0);
    for (std::uint32_t c = 0; c < caches; ++c) {
      for (std::uint32_t n = 0; n < kDepthSide * kDepthSide; ++n)
        depth[kDepthWords * c + n / 4] |= (random() % 140u) << (8 * (n % 4));
    }
    grid.depth = depth;
  }
  return bake;
}

bool WeirdReceiver::canShade() const {
  return std::isfinite(normal.x) && std::isfinite(normal.y) && std::isfinite(normal.z) &&
         glm::length(glm::dvec3(normal)) <= 2.0;
}

bool WeirdReceiver::isInGrid() const {
  return canShade() && std::isfinite(position.x) && std::isfinite(position.y) && std::isfinite(position.z);
}

bool WeirdReceiver::isOnMap() const { return canShade() && std::isfinite(position.x) && std::isfinite(position.y); }

std::vector<WeirdReceiver> weirdReceivers() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  const std::array<float, 9> values = {0.3f, 0.0f, -1e10f, 3e38f, -3e38f, kInfinity, -kInfinity, kNan, -kNan};
  std::vector<WeirdReceiver> receivers;
  for (const float x : values) {
    for (const float y : values) {
      for (const float z : values) {
        receivers.push_back({{x, y, z}, {0, 1, 0}});
        receivers.push_back({{0.3f, 0.6f, 0.2f}, {x, y, z}});
      }
    }
  }
  return receivers;
}

}  // namespace relume::test
