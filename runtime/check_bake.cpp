// SPDX-License-Identifier: MIT
// See check_bake.h. One pass over each array; formats/validate.h is the thorough check.
#include "runtime/check_bake.h"

#include "formats/compact_links.h"
#include "formats/grid_depth.h"
#include "formats/limits.h"
#include "formats/sh.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace relume {
namespace {

Error invalid(const std::string& what) { return Error{ErrorCode::invalidFile, "bake cannot be lit: " + what}; }

Error wrongSize(const char* array, std::size_t expected, std::size_t found) {
  return invalid(std::string(array) + " has " + std::to_string(found) + " elements, expected " +
                 std::to_string(expected));
}

Error wrongElement(const char* array, std::size_t index, const std::string& expected, std::uint64_t found) {
  return invalid(std::string(array) + "[" + std::to_string(index) + "] is " + std::to_string(found) + ", expected " +
                 expected);
}

std::string toText(const glm::vec3& v) {
  return "(" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) + ")";
}

bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Status checkFinite(const char* array, std::span<const glm::vec3> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!finite(values[i])) return invalid(std::string(array) + "[" + std::to_string(i) + "] is not finite");
  }
  return done();
}

Status checkCoordinates(const char* array, std::span<const glm::vec3> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!isWithin(values[i], kMaxCoordinate)) {
      return invalid(std::string(array) + "[" + std::to_string(i) + "] is " + toText(values[i]) +
                     ", expected coordinates within 1e9 m");
    }
  }
  return done();
}

// Of length 1, or 0 where `orZero`, but for what single precision and packing explain.
Status checkNormals(const char* array, std::span<const glm::vec3> values, bool orZero) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float length2 = glm::dot(values[i], values[i]);
    if (std::abs(length2 - 1.0f) < 0.01f || (orZero && length2 == 0.0f)) continue;
    return invalid(std::string(array) + "[" + std::to_string(i) + "] is " + toText(values[i]) +
                   ", expected a unit vector" + (orZero ? " or zero" : ""));
  }
  return done();
}

Status checkSurfels(const Surfels& s) {
  const std::size_t count = s.positionWorld.size();
  if (s.normal.size() != count) return wrongSize("surfels.normal", count, s.normal.size());
  if (s.albedo.size() != count) return wrongSize("surfels.albedo", count, s.albedo.size());
  if (s.emission.size() != count) return wrongSize("surfels.emission", count, s.emission.size());
  if (s.receiver.size() != count) return wrongSize("surfels.receiver", count, s.receiver.size());
  if (Status ok = checkCoordinates("surfels.positionWorld", s.positionWorld); !ok) return ok;
  if (Status ok = checkNormals("surfels.normal", s.normal, false); !ok) return ok;
  if (Status ok = checkFinite("surfels.albedo", s.albedo); !ok) return ok;
  if (Status ok = checkFinite("surfels.emission", s.emission); !ok) return ok;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 a = s.albedo[i], e = s.emission[i];
    if (!(a.r >= 0 && a.g >= 0 && a.b >= 0 && a.r <= 1 && a.g <= 1 && a.b <= 1)) {
      return invalid("surfels.albedo[" + std::to_string(i) + "] is outside [0,1]");
    }
    if (!(e.r >= 0 && e.g >= 0 && e.b >= 0)) return invalid("surfels.emission[" + std::to_string(i) + "] is negative");
    if (!isWithin(e, kMaxRadiance)) return invalid("surfels.emission[" + std::to_string(i) + "] is above 1e9 W/m²/sr");
  }
  return done();
}

Status checkLevels(const Hierarchy& h) {
  const std::size_t nodes = h.child.size();
  if (h.levelBegin.size() < 2) return wrongSize("hierarchy.levelBegin", 2, h.levelBegin.size());
  if (h.levelBegin.front() != 0) return wrongElement("hierarchy.levelBegin", 0, "0", h.levelBegin.front());
  if (h.levelBegin.back() != nodes) {
    return wrongElement("hierarchy.levelBegin", h.levelBegin.size() - 1, std::to_string(nodes), h.levelBegin.back());
  }
  for (std::size_t d = 1; d < h.levelBegin.size(); ++d) {
    if (h.levelBegin[d] < h.levelBegin[d - 1]) {
      return wrongElement("hierarchy.levelBegin", d, "no less than the one before", h.levelBegin[d]);
    }
  }
  return done();
}

Status checkHierarchy(const Hierarchy& h, std::size_t surfelCount) {
  const std::size_t senders = surfelCount + h.skyDirection.size();
  if (senders == 0) return invalid("it has no senders, neither surfels nor sky");
  if (senders >= kLeafBit / 2) return invalid("it has " + std::to_string(senders) + " senders, expected below 2^30");
  const std::size_t nodes = 2 * senders - 1;
  if (h.child.size() != nodes) return wrongSize("hierarchy.child", nodes, h.child.size());
  if (h.firstWeight.size() != nodes) return wrongSize("hierarchy.firstWeight", nodes, h.firstWeight.size());
  if (h.leafNode.size() != senders) return wrongSize("hierarchy.leafNode", senders, h.leafNode.size());
  if (Status ok = checkFinite("hierarchy.skyDirection", h.skyDirection); !ok) return ok;
  if (Status ok = checkLevels(h); !ok) return ok;
  std::uint32_t next = 1;
  for (std::size_t d = 0; d + 1 < h.levelBegin.size(); ++d) {
    for (std::uint32_t i = h.levelBegin[d]; i < h.levelBegin[d + 1]; ++i) {
      const std::uint32_t child = h.child[i];
      if (child & kLeafBit) {
        if ((child & ~kLeafBit) >= senders) {
          return wrongElement("hierarchy.child", i, "a sender below " + std::to_string(senders), child & ~kLeafBit);
        }
      } else if (child < h.levelBegin[d + 1] || child + 1 >= nodes) {
        return wrongElement("hierarchy.child", i, "two nodes of a deeper level", child);
      } else if (child != next) {
        return wrongElement("hierarchy.child", i, std::to_string(next) + ", behind the children of the nodes before",
                            child);
      } else {
        next += 2;
      }
      if (!(h.firstWeight[i] >= 0.0f && h.firstWeight[i] <= 1.0f)) {
        return invalid("hierarchy.firstWeight[" + std::to_string(i) + "] is outside [0,1]");
      }
    }
  }
  for (std::size_t s = 0; s < senders; ++s) {
    const std::uint32_t node = h.leafNode[s];
    if (node >= nodes || h.child[node] != (kLeafBit | static_cast<std::uint32_t>(s))) {
      return wrongElement("hierarchy.leafNode", s, "the leaf of that sender", node);
    }
  }
  return done();
}

Status checkIndexTexture(const char* array, const Array<std::uint32_t>& cache, std::uint64_t size,
                         std::uint32_t caches) {
  if (cache.size() != size) return wrongSize(array, size, cache.size());
  for (std::size_t i = 0; i < cache.size(); ++i) {
    if (cache[i] != kNoCache && cache[i] >= caches) {
      return wrongElement(array, i, "a cache below " + std::to_string(caches) + " or none", cache[i]);
    }
  }
  return done();
}

Status checkCaches(const Caches& c) {
  if (c.positionWorld.size() > kMaxCaches) {
    return invalid("it has " + std::to_string(c.positionWorld.size()) + " caches, expected at most " +
                   std::to_string(kMaxCaches));
  }
  if (c.normal.size() != c.positionWorld.size())
    return wrongSize("caches.normal", c.positionWorld.size(), c.normal.size());
  if (Status ok = checkCoordinates("caches.positionWorld", c.positionWorld); !ok) return ok;
  if (Status ok = checkNormals("caches.normal", c.normal, true); !ok) return ok;
  const CacheGrid& g = c.grid;
  const glm::uvec3 r = g.resolution;
  const glm::vec3 end = g.originWorld + g.spacing * glm::vec3(glm::max(r, glm::uvec3(1)) - 1u);
  for (const glm::vec3& corner : {g.originWorld, g.spacing, end}) {
    if (!isWithin(corner, kMaxCoordinate))
      return invalid("caches.grid reaches " + toText(corner) + ", expected coordinates within 1e9 m");
  }
  if (!g.cache.empty() && !(g.spacing.x > 0.0f && g.spacing.y > 0.0f && g.spacing.z > 0.0f))
    return invalid("caches.grid.spacing is " + toText(g.spacing) + ", expected three lengths above 0");
  if (r.x > 65535 || r.y > 65535 || r.z > 65535) return invalid("caches.grid has more than 65535 points on an axis");
  if (Status ok = checkIndexTexture("caches.grid.cache", g.cache, std::uint64_t{r.x} * r.y * r.z, c.count()); !ok)
    return ok;
  const glm::uvec3 cells = g.cells();
  if (!g.brick.empty() && g.cache.empty()) return wrongSize("caches.grid.brick", 0, g.brick.size());
  if (!g.brick.empty() && g.brick.size() != std::uint64_t{cells.x} * cells.y * cells.z)
    return wrongSize("caches.grid.brick", std::uint64_t{cells.x} * cells.y * cells.z, g.brick.size());
  if (g.fine.size() % kBrickWords != 0)
    return wrongSize("caches.grid.fine", g.fine.size() / kBrickWords * kBrickWords, g.fine.size());
  for (std::size_t i = 0; i < g.brick.size(); ++i) {
    if (g.brick[i] != kNoBrick && g.brick[i] >= g.brickCount()) {
      return wrongElement("caches.grid.brick", i, "a brick below " + std::to_string(g.brickCount()) + " or none",
                          g.brick[i]);
    }
  }
  std::uint32_t max = 0;
  for (const std::uint32_t cache : g.cache) max = cache == kNoCache ? max : std::max(max, cache + 1);
  for (std::size_t i = 0; i < g.fine.size(); ++i) {
    if (g.fine[i] >= kHangingPoint) continue;
    if (g.fine[i] >= c.count())
      return wrongElement("caches.grid.fine", i, "a cache below " + std::to_string(c.count()) + " or none", g.fine[i]);
    max = std::max(max, g.fine[i] + 1);
  }
  if (!g.depth.empty() && (g.depth.size() % kDepthWords != 0 || g.depth.size() / kDepthWords < max ||
                           g.depth.size() / kDepthWords > c.count())) {
    return wrongSize("caches.grid.depth", std::uint64_t{kDepthWords} * max, g.depth.size());
  }
  const Lightmap& m = c.lightmap;
  if (m.width > 65535 || m.height > 65535) return invalid("caches.lightmap is wider or higher than 65535 texels");
  if (Status ok = checkIndexTexture("caches.lightmap.cache", m.cache, std::uint64_t{m.width} * m.height, c.count());
      !ok)
    return ok;
  if (max > c.firstMapCache()) {
    return invalid("the grid reads cache " + std::to_string(max - 1) + ", expected those of the light map, from " +
                   std::to_string(c.firstMapCache()) + " on, to come after those of the grid");
  }
  return done();
}

Status checkLinks(const Links& l, const Caches& all, std::size_t nodes) {
  const std::size_t caches = all.positionWorld.size();
  if (l.rowBegin.size() != caches + 1) return wrongSize("links.rowBegin", caches + 1, l.rowBegin.size());
  if (l.rowBegin.front() != 0) return wrongElement("links.rowBegin", 0, "0", l.rowBegin.front());
  for (std::size_t c = 0; c < caches; ++c) {
    if (l.rowBegin[c + 1] < l.rowBegin[c]) {
      return wrongElement("links.rowBegin", c + 1, "no less than the one before", l.rowBegin[c + 1]);
    }
  }
  const std::size_t count = l.count();
  const bool sh = l.kind == LinkKind::sh, head = linkHasHead(l.kind);
  if (linkKindName(l.kind).empty()) {
    return wrongElement("links.kind", 0, "0, 1, 3 or 5", static_cast<std::uint32_t>(l.kind));
  }
  if (sh && (l.bands < 1 || l.bands > kMaxBands)) return wrongElement("links.bands", 0, "1 to 8", l.bands);
  if (sh && l.shNode.size() != count) return wrongSize("links.shNode", count, l.shNode.size());
  const std::size_t halves = count * l.bands * l.bands;
  if (sh && l.shCoefficients.size() != halves)
    return wrongSize("links.shCoefficients", halves, l.shCoefficients.size());
  if (head && l.head.size() != count) return wrongSize("links.head", count, l.head.size());
  const std::uint64_t shape = shapeWords(l.kind, count, countGridLinks(all, l));
  if (head && l.shape.size() != shape) return wrongSize("links.shape", static_cast<std::size_t>(shape), l.shape.size());
  if (l.kind == LinkKind::cone && l.cone.size() != count) return wrongSize("links.cone", count, l.cone.size());
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t node = l.node(static_cast<std::uint32_t>(i));
    if (node >= nodes) return wrongElement("links.node", i, "a node below " + std::to_string(nodes), node);
  }
  return done();
}

}  // namespace

Status checkBake(const Bake& bake) {
  if (Status ok = checkSurfels(bake.surfels); !ok) return ok;
  if (Status ok = checkHierarchy(bake.hierarchy, bake.surfels.positionWorld.size()); !ok) return ok;
  if (Status ok = checkCaches(bake.caches); !ok) return ok;
  return checkLinks(bake.links, bake.caches, bake.hierarchy.child.size());
}

}  // namespace relume
