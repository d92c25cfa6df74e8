// SPDX-License-Identifier: MIT
// The 1xx checks: what a reader of the bake may rely upon without looking. Each function may rely on the ones before it
// having found nothing.
#include "formats/compact_links.h"
#include "formats/findings.h"
#include "formats/grid_depth.h"
#include "formats/limits.h"
#include "formats/map_sight.h"

#include <algorithm>
#include <cmath>
#include <memory_resource>
#include <vector>

namespace relume {
namespace {

std::string range(std::uint64_t low, std::uint64_t high) { return std::to_string(low) + ".." + std::to_string(high); }

void checkSurfelArrays(const Bake& bake, Findings& findings) {
  const Surfels& s = bake.surfels;
  const auto sized = [&](const char* name, std::size_t size) {
    if (size != s.positionWorld.size()) findings.add(Check::surfelArraySize, name, s.positionWorld.size(), size);
  };
  sized("surfel.normal", s.normal.size());
  sized("surfel.albedo", s.albedo.size());
  sized("surfel.emission", s.emission.size());
  sized("surfel.receiver", s.receiver.size());
  sized("surfel.instance", s.instance.size());
  for (std::size_t i = 0; i < s.instance.size(); ++i) {
    if (s.instance[i] >= bake.instances.size())
      findings.add(Check::surfelInstance, At{"surfel.instance", i}, "below " + std::to_string(bake.instances.size()),
                   s.instance[i]);
  }
}

// Readers turn positions into cells and directions: whole numbers and quotients that a huge one would overflow.
void checkCoordinates(const Array<glm::vec3>& positions, const char* name, Findings& findings) {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!isWithin(positions[i], kMaxCoordinate))
      findings.add(Check::coordinate, At{name, i}, "within 1e9 m", positions[i]);
  }
}

// Entries of the materials one after the other, and no surfel twice: each is lit by one material.
void checkEmitters(const Bake& bake, Findings& findings, std::pmr::memory_resource* memory) {
  const Emitters& e = bake.emitters;
  if (e.tap.size() != std::size_t{kFootprintTaps} * e.count())
    findings.add(Check::emitterArraySize, "emit.tap", std::size_t{kFootprintTaps} * e.count(), e.tap.size());
  if (e.tapWidth.size() != e.count()) findings.add(Check::emitterArraySize, "emit.width", e.count(), e.tapWidth.size());
  std::uint64_t next = 0;
  for (std::size_t i = 0; i < e.materials.size(); ++i) {
    if (e.materials[i].firstEntry != next)
      findings.add(Check::emitterEntries, At{"emit.material", i}, "a first entry of " + std::to_string(next),
                   e.materials[i].firstEntry);
    next += e.materials[i].entryCount;
  }
  if (next != e.count())
    findings.add(Check::emitterEntries, "emit.material", std::to_string(e.count()) + " entries in all", next);
  if (e.surfel.empty()) return;
  std::pmr::vector<bool> named(bake.surfels.positionWorld.size(), false, memory);
  for (std::size_t i = 0; i < e.surfel.size(); ++i) {
    const std::uint32_t surfel = e.surfel[i];
    if (surfel >= named.size()) {
      findings.add(Check::emitterSurfel, At{"emit.surfel", i}, "below " + std::to_string(named.size()), surfel);
      continue;
    }
    if (named[surfel]) findings.add(Check::emitterSurfel, At{"emit.surfel", i}, "a surfel of no other entry", surfel);
    named[surfel] = true;
  }
}

void checkHierarchyArrays(const Bake& bake, Findings& findings) {
  const Hierarchy& h = bake.hierarchy;
  const std::uint64_t senders = bake.surfels.positionWorld.size() + h.skyDirection.size();
  if (senders < 1 || senders > (std::uint64_t{1} << 30))
    return findings.add(Check::noSenders, "surfel.position and sky.direction", range(1, 1u << 30), senders);
  const auto sized = [&](const char* name, std::uint64_t expected, std::size_t size) {
    if (size != expected) findings.add(Check::hierarchyArraySize, name, expected, size);
  };
  sized("node.child", 2 * senders - 1, h.child.size());
  sized("node.weight", 2 * senders - 1, h.firstWeight.size());
  sized("node.leaf", senders, h.leafNode.size());
}

void checkLevels(const Hierarchy& h, Findings& findings) {
  if (h.levelBegin.size() < 2)
    return findings.add(Check::levelRange, "node.level", "at least 2 entries", h.levelBegin.size());
  if (h.levelBegin.front() != 0) findings.add(Check::levelRange, At{"node.level", 0}, 0, h.levelBegin.front());
  for (std::size_t d = 1; d < h.levelBegin.size(); ++d) {
    if (h.levelBegin[d] <= h.levelBegin[d - 1])
      findings.add(Check::levelRange, At{"node.level", d}, "above " + std::to_string(h.levelBegin[d - 1]),
                   h.levelBegin[d]);
  }
  if (h.levelBegin.back() != h.nodeCount())
    findings.add(Check::levelRange, At{"node.level", h.levelBegin.size() - 1}, h.nodeCount(), h.levelBegin.back());
}

// Every inner node has two adjacent children in the next level, behind those of the nodes before it, every node but the
// root one parent, every sender one leaf: then the whole is a tree, whose children the runtime finds by counting, and
// pull, deepest level first, reads nothing that is not written.
void checkTree(const Hierarchy& h, Findings& findings, std::pmr::memory_resource* memory) {
  std::pmr::vector<bool> hasParent(h.child.size(), false, memory);
  std::uint32_t next = 1;
  for (std::uint32_t d = 0; d < h.levelCount(); ++d) {
    const bool last = d + 1 == h.levelCount();
    const std::uint32_t low = h.levelBegin[d + 1], high = last ? low : h.levelBegin[d + 2];
    for (std::uint32_t node = h.levelBegin[d]; node < h.levelBegin[d + 1]; ++node) {
      if (h.isLeaf(node)) {
        const std::uint32_t sender = h.sender(node);
        if (sender >= h.leafNode.size())
          findings.add(Check::leafSender, At{"node.child", node}, "below " + std::to_string(h.leafNode.size()), sender);
        else if (h.leafNode[sender] != node)
          findings.add(Check::leafNodeMismatch, At{"node.leaf", sender}, node, h.leafNode[sender]);
        continue;
      }
      const std::uint32_t child = h.child[node], expected = next;
      next += 2;
      if (child < low || child + 1 >= high) {
        findings.add(Check::childLevel, At{"node.child", node},
                     last ? std::string("a leaf, in the last level") : "two nodes of " + range(low, high - 1), child);
        continue;
      }
      if (hasParent[child] || hasParent[child + 1])
        findings.add(Check::childShared, At{"node.child", node}, "children of no other node", child);
      else if (child != expected)
        findings.add(Check::childOrder, At{"node.child", node}, expected, child);
      hasParent[child] = hasParent[child + 1] = true;
    }
  }
  for (std::size_t node = 1; node < hasParent.size() && findings.empty(); ++node) {
    if (!hasParent[node]) findings.add(Check::childShared, "node " + std::to_string(node), "a parent", "none");
  }
  for (std::size_t sender = 0; sender < h.leafNode.size(); ++sender) {
    const std::uint32_t node = h.leafNode[sender];
    if (node >= h.child.size() || h.child[node] != (kLeafBit | static_cast<std::uint32_t>(sender)))
      findings.add(Check::leafNodeMismatch, At{"node.leaf", sender}, "the leaf of that sender", node);
  }
}

void checkGroupRoots(const Hierarchy& h, Findings& findings) {
  const std::size_t groups = h.groupRoot.size();
  if (groups < 1 || groups > 3) return findings.add(Check::groupRootRange, "node.group", "1..3 entries", groups);
  for (std::size_t i = 0; i < groups; ++i) {
    if (h.groupRoot[i] >= h.nodeCount() || (i > 0 && h.groupRoot[i] <= h.groupRoot[i - 1]))
      findings.add(Check::groupRootRange, At{"node.group", i}, "ascending, below " + std::to_string(h.nodeCount()),
                   h.groupRoot[i]);
  }
}

void checkIndices(const Array<std::uint32_t>& cache, const char* name, std::size_t count, Check check,
                  Findings& findings) {
  for (std::size_t i = 0; i < cache.size(); ++i) {
    if (cache[i] >= count && cache[i] != kNoCache)
      findings.add(check, At{name, i}, "below " + std::to_string(count) + ", or none", cache[i]);
  }
}

// Bricks, and depths of every cache that the grid reads.
void checkBricks(const Caches& c, Findings& findings) {
  const CacheGrid& g = c.grid;
  const glm::uvec3 cells = g.cells();
  const std::uint64_t count = std::uint64_t{cells.x} * cells.y * cells.z;
  if (g.fine.size() % kBrickWords != 0)
    findings.add(Check::gridBrickSize, "grid.fine", "a multiple of " + std::to_string(kBrickWords), g.fine.size());
  if (g.brick.empty() ? !g.fine.empty() : (g.cache.empty() || g.brick.size() != count))
    findings.add(Check::gridBrickSize, "grid.brick", g.cache.empty() ? 0 : count, g.brick.size());
  for (std::size_t i = 0; i < g.brick.size(); ++i) {
    if (g.brick[i] >= g.brickCount() && g.brick[i] != kNoBrick)
      findings.add(Check::gridBrickIndex, At{"grid.brick", i}, "below " + std::to_string(g.brickCount()) + ", or none",
                   g.brick[i]);
  }
  for (std::size_t i = 0; i < g.fine.size(); ++i) {
    if (g.fine[i] >= c.positionWorld.size() && g.fine[i] < kHangingPoint)
      findings.add(Check::gridFineIndex, At{"grid.fine", i},
                   "below " + std::to_string(c.positionWorld.size()) + ", none or hanging", g.fine[i]);
  }
  if (g.depth.empty()) return;
  const std::uint64_t mapped = g.depth.size() / kDepthWords;
  const auto beyond = [&](std::uint32_t cache) { return cache < kHangingPoint && cache >= mapped; };
  if (g.depth.size() % kDepthWords != 0 || mapped > c.positionWorld.size() ||
      std::any_of(g.fine.begin(), g.fine.end(), beyond) || std::any_of(g.cache.begin(), g.cache.end(), beyond))
    findings.add(Check::gridDepthSize, "grid.depth", std::to_string(kDepthWords) + " words for each cache of the grid",
                 g.depth.size());
}

void checkGrid(const Caches& c, Findings& findings) {
  const CacheGrid& g = c.grid;
  const glm::uvec3 r = g.resolution;
  constexpr std::uint32_t kMax = 65535;
  const bool overflows = r.x > kMax || r.y > kMax || r.z > kMax;
  if (overflows || std::uint64_t{r.x} * r.y * r.z != g.cache.size())
    findings.add(Check::gridSize, "grid.cache",
                 std::to_string(r.x) + " x " + std::to_string(r.y) + " x " + std::to_string(r.z), g.cache.size());
  const bool spaced = g.spacing.x > 0.0f && g.spacing.y > 0.0f && g.spacing.z > 0.0f;
  const glm::vec3 end = g.originWorld + g.spacing * glm::vec3(glm::max(r, glm::uvec3(1)) - 1u);
  if (!isWithin(g.originWorld, kMaxCoordinate))
    findings.add(Check::gridPlacement, "scalars, grid origin", "within 1e9 m", g.originWorld);
  if (!isWithin(g.spacing, kMaxCoordinate) || (!g.cache.empty() && !spaced))
    findings.add(Check::gridPlacement, "scalars, grid spacing", "above 0, at most 1e9 m", g.spacing);
  if (!isWithin(end, kMaxCoordinate))
    findings.add(Check::gridPlacement, "scalars, end of the grid", "within 1e9 m", end);
  checkIndices(g.cache, "grid.cache", c.positionWorld.size(), Check::gridCacheIndex, findings);
  checkBricks(c, findings);
}

// The runtime keeps the caches of the grid apart from those of the light map.
void checkGridComesFirst(const Caches& c, Findings& findings) {
  const std::uint32_t first = c.firstMapCache();
  const auto check = [&](const char* name, const Array<std::uint32_t>& cache) {
    for (std::size_t i = 0; i < cache.size(); ++i) {
      if (cache[i] >= first && cache[i] < c.count())
        findings.add(Check::gridAfterLightmap, At{name, i}, "below " + std::to_string(first), cache[i]);
    }
  };
  check("grid.cache", c.grid.cache);
  check("grid.fine", c.grid.fine);
}

void checkCertificate(const Bake& bake, Findings& findings) {
  const Certificate& c = bake.certificate;
  const std::size_t lights = c.lightKind.size(), parts = c.empty() ? 0 : bake.instances.size();
  const auto sized = [&](const char* name, std::size_t expected, std::size_t size) {
    if (size != expected) findings.add(Check::certificateArraySize, name, expected, size);
  };
  sized("cert.error", lights, c.squaredError.size());
  sized("cert.deviation", lights, c.standardError.size());
  sized("cert.receivers", parts, c.partReceivers.size());
  sized("cert.part", parts, c.partError.size());
}

void checkShapes(const Bake& bake, Findings& findings) {
  const std::uint64_t blocks = bake.shapes.size() / kShapeWords;
  for (std::size_t i = 0; i < bake.instances.size(); ++i) {
    const BakedInstance& part = bake.instances[i];
    if (std::uint64_t{part.firstShape} + part.shapeCount > blocks)
      findings.add(Check::shapeRange, At{"instances", i}, "an end within " + std::to_string(blocks),
                   std::to_string(part.shapeCount) + " blocks from " + std::to_string(part.firstShape));
  }
}

void checkLightmap(const Bake& bake, Findings& findings) {
  const Lightmap& m = bake.caches.lightmap;
  constexpr std::uint32_t kMax = 65535;
  if (m.width > kMax || m.height > kMax || (m.width == 0) != (m.height == 0) ||
      std::uint64_t{m.width} * m.height != m.cache.size())
    findings.add(Check::lightmapSize, "map.cache", std::to_string(m.width) + " x " + std::to_string(m.height),
                 m.cache.size());
  checkIndices(m.cache, "map.cache", bake.caches.positionWorld.size(), Check::lightmapCacheIndex, findings);
  if (!m.sight.empty() && m.sight.size() != m.cache.size())
    findings.add(Check::lightmapSightSize, "map.sight", "0 or " + std::to_string(m.cache.size()), m.sight.size());
  for (std::size_t i = 0; i < m.sight.size(); ++i) {
    if (!isMapSight(m.sight[i]))
      findings.add(Check::lightmapSightMove, At{"map.sight", i}, "moves of 0, 1 or 2", m.sight[i] >> 24);
  }
  if (m.parts.size() != bake.instances.size() && !(m.parts.empty() && m.cache.empty()))
    findings.add(Check::lightmapPartCount, "map.part", bake.instances.size(), m.parts.size());
  for (std::size_t i = 0; i < m.parts.size(); ++i) {
    const std::uint64_t corners = std::uint64_t{3} * m.parts[i].triangleCount;
    if (m.parts[i].firstCorner > m.cornerUv.size() || corners > m.cornerUv.size() - m.parts[i].firstCorner)
      findings.add(Check::lightmapPartRange, At{"map.part", i}, "an end within " + std::to_string(m.cornerUv.size()),
                   std::to_string(corners) + " corners from " + std::to_string(m.parts[i].firstCorner));
  }
  if (!m.backCornerUv.empty() && m.backCornerUv.size() != m.cornerUv.size())
    findings.add(Check::backCornerSize, "map.back", "0 or " + std::to_string(m.cornerUv.size()), m.backCornerUv.size());
  for (std::size_t i = 0; i < bake.surfels.receiver.size() && m.cache.empty(); ++i) {
    if (bake.surfels.receiver[i] != kGridReceiver)
      findings.add(Check::receiverWithoutLightmap, At{"surfel.receiver", i}, "the grid", bake.surfels.receiver[i]);
  }
}

void checkCacheArrays(const Bake& bake, Findings& findings) {
  const Caches& c = bake.caches;
  if (c.positionWorld.size() > kMaxCaches)
    findings.add(Check::cacheArraySize, "cache.position", "at most " + std::to_string(kMaxCaches),
                 c.positionWorld.size());
  if (c.normal.size() != c.positionWorld.size())
    findings.add(Check::cacheArraySize, "cache.normal", c.positionWorld.size(), c.normal.size());
  checkGrid(c, findings);
  checkLightmap(bake, findings);
  checkShapes(bake, findings);
  checkGridComesFirst(bake.caches, findings);
}

// Irradiance links: the links of grid caches have a shape each, from the first on.
void checkGridFirst(const Bake& bake, Findings& findings) {
  const std::uint64_t gridLinks = countGridLinks(bake.caches, bake.links);
  for (std::uint32_t c = 0; c < bake.links.cacheCount() && c < bake.caches.normal.size(); ++c) {
    if (bake.caches.normal[c] == glm::vec3(0.0f) && bake.links.rowBegin[c + 1] > gridLinks) {
      findings.add(Check::linkGridFirst, At{"cache.normal", c}, "no grid cache after one on a surface", c);
    }
  }
}

// Sizes of rows and of the arrays of one kind of links; false when links cannot be walked.
bool checkLinkArrays(const Bake& bake, Findings& findings) {
  const Links& l = bake.links;
  if (linkKindName(l.kind).empty()) {
    findings.add(Check::linkKind, "scalars, link kind", "0, 1, 3 or 5", static_cast<std::uint32_t>(l.kind));
    return false;
  }
  const bool sh = l.kind == LinkKind::sh, head = linkHasHead(l.kind), cone = l.kind == LinkKind::cone;
  if (sh ? (l.bands < 1 || l.bands > 8) : l.bands != 0) {
    findings.add(Check::linkBands, "scalars, link bands", sh ? "1..8" : "0", l.bands);
    return false;
  }
  const std::size_t count = head ? l.head.size() : (sh ? l.shNode.size() : l.cone.size());
  const auto sized = [&](const char* name, std::uint64_t expected, std::size_t size) {
    if (size != expected) findings.add(Check::linkArraySize, name, expected, size);
    return size == expected;
  };
  const std::size_t before = findings.list().size();
  sized("link.row", bake.caches.positionWorld.size() + 1, l.rowBegin.size());
  sized("link.node", sh ? count : 0, l.shNode.size());
  sized("link.sh", sh ? std::uint64_t{count} * l.bands * l.bands : 0, l.shCoefficients.size());
  sized("link.cone", cone ? count : 0, l.cone.size());
  sized("link.head", head ? count : 0, l.head.size());
  if (findings.list().size() != before) return false;

  if (l.rowBegin.front() != 0) findings.add(Check::linkRows, At{"link.row", 0}, 0, l.rowBegin.front());
  for (std::size_t i = 1; i < l.rowBegin.size(); ++i) {
    if (l.rowBegin[i] < l.rowBegin[i - 1] || l.rowBegin[i] > count)
      findings.add(Check::linkRows, At{"link.row", i}, range(l.rowBegin[i - 1], count), l.rowBegin[i]);
  }
  if (l.rowBegin.back() != count)
    findings.add(Check::linkRows, At{"link.row", l.rowBegin.size() - 1}, count, l.rowBegin.back());
  if (findings.list().size() != before) return false;
  sized("link.shape", shapeWords(l.kind, count, countGridLinks(bake.caches, l)), l.shape.size());
  if (l.kind == LinkKind::irradiance) checkGridFirst(bake, findings);
  return findings.list().size() == before;
}

void checkLinkNodes(const Bake& bake, Findings& findings) {
  const Links& l = bake.links;
  const std::uint32_t nodes = bake.hierarchy.nodeCount();
  const char* name = linkHasHead(l.kind) ? "link.head" : (l.kind == LinkKind::sh ? "link.node" : "link.cone");
  for (std::uint32_t cache = 0; cache < l.cacheCount(); ++cache) {
    for (std::uint32_t i = l.rowBegin[cache]; i < l.rowBegin[cache + 1]; ++i) {
      const std::uint32_t node = l.node(i);
      if (node >= nodes) findings.add(Check::linkNode, At{name, i}, "below " + std::to_string(nodes), node);
      if (i == l.rowBegin[cache]) continue;
      const std::uint32_t previous = l.node(i - 1);
      if (node <= previous) findings.add(Check::linkOrder, At{name, i}, "above " + std::to_string(previous), node);
    }
  }
}

void checkBands(const Bake& bake, Findings& findings) {
  const std::uint32_t luma = bake.provenance.lumaBands, chroma = bake.provenance.chromaBands;
  const std::uint32_t max = bake.links.kind == LinkKind::sh ? bake.links.bands : 8;
  if (luma < 1 || luma > max) findings.add(Check::recommendedBands, "provenance, luma bands", range(1, max), luma);
  if (chroma < 1 || chroma > luma)
    findings.add(Check::recommendedBands, "provenance, chroma bands", range(1, luma), chroma);
}

}  // namespace

void checkStructureInto(const Bake& bake, Findings& findings, std::pmr::memory_resource* memory) {
  checkSurfelArrays(bake, findings);
  checkCoordinates(bake.surfels.positionWorld, "surfel.position", findings);
  checkCoordinates(bake.caches.positionWorld, "cache.position", findings);
  checkHierarchyArrays(bake, findings);
  if (!findings.empty()) return;
  checkLevels(bake.hierarchy, findings);
  if (!findings.empty()) return;
  checkTree(bake.hierarchy, findings, memory);
  checkGroupRoots(bake.hierarchy, findings);
  checkCacheArrays(bake, findings);
  if (checkLinkArrays(bake, findings)) checkLinkNodes(bake, findings);
  checkEmitters(bake, findings, memory);
  checkCertificate(bake, findings);
  checkBands(bake, findings);
}

}  // namespace relume
