// SPDX-License-Identifier: MIT
// The smallest bake that has one of everything: reflectors, an emitter pair and sky in a tree of 15 nodes, a grid of
// two points and a brick, a light map of four caches, two parts of a scene. Valid: validateBake() finds nothing. Tests
// corrupt it.
//
//   level 0   0 -> 1 2
//   level 1   1 (reflectors) -> 3 4     2 (join) -> 5 6
//   level 2   3 -> 7 8   4 -> 9 10   5 (emitters) -> 11 12   6 (sky) -> 13 14
//   level 3   7..14: leaves of senders 0..7; 6 and 7 are sky patches
#pragma once

#include "formats/compact_links.h"
#include "formats/grid_depth.h"
#include "formats/map_sight.h"
#include "formats/pack.h"
#include "relume/bake_data.h"

#include <array>
#include <vector>

namespace relume {

inline Surfels makeSmallSurfels() {
  const std::uint32_t floorPoint = packUnorm16x2({0.3f, 0.6f});
  Surfels s;
  s.positionWorld =
      std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {1, 0, 1}, {0.4f, 2, 0.5f}, {0.6f, 2, 0.5f}};
  s.normal = std::vector<glm::vec3>{{0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {0, -1, 0}, {0, -1, 0}};
  s.albedo = std::vector<glm::vec3>(6, glm::vec3(0.5f, 0.25f, 1.0f));
  s.emission = std::vector<glm::vec3>{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {5, 5, 4}, {5, 5, 4}};
  s.receiver = std::vector<std::uint32_t>{floorPoint, floorPoint, floorPoint, floorPoint, kGridReceiver, kGridReceiver};
  s.instance = std::vector<std::uint32_t>{0, 0, 0, 0, 1, 1};
  s.areaEach = 1.0f;
  return s;
}

inline Hierarchy makeSmallHierarchy() {
  Hierarchy h;
  std::vector<std::uint32_t> child = {1, 3, 5, 7, 9, 11, 13}, leaf;
  for (std::uint32_t sender = 0; sender < 8; ++sender) {
    child.push_back(kLeafBit | sender);
    leaf.push_back(7 + sender);
  }
  h.child = child;
  h.firstWeight = std::vector<float>{0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0, 0, 0, 0, 0, 0, 0, 0};
  h.levelBegin = std::vector<std::uint32_t>{0, 1, 3, 7, 15};
  h.leafNode = leaf;
  h.groupRoot = std::vector<std::uint32_t>{1, 5, 6};
  h.skyDirection = std::vector<glm::vec3>{{0, 1, 0}, {0, -1, 0}};
  return h;
}

inline Caches makeSmallCaches() {
  Caches c;
  c.positionWorld = std::vector<glm::vec3>{{0.2f, 1, 0.5f},   {0.8f, 1, 0.5f},   {0.25f, 0, 0.25f},
                                           {0.75f, 0, 0.25f}, {0.25f, 0, 0.75f}, {0.75f, 0, 0.75f}};
  c.normal = std::vector<glm::vec3>{{0, 0, 0}, {0, 0, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
  c.grid.resolution = {2, 1, 1};
  c.grid.originWorld = {0.2f, 1.0f, 0.5f};
  c.grid.spacing = {0.6f, 1.0f, 1.0f};
  c.grid.cache = std::vector<std::uint32_t>{0, 1};
  // One cell, refined: between the two points one hangs. Cache 0 sees a wall at 2/3 of the way to cache 1.
  c.grid.brick = std::vector<std::uint32_t>{0};
  std::vector<std::uint32_t> fine(kBrickWords, kNoCache), depth(2 * kDepthWords, 0);
  fine[0] = 0;
  fine[1] = kHangingPoint;
  fine[2] = 1;
  depth[0] = 0x00339966;
  depth[kDepthWords + 20] = 0x7F;
  c.grid.fine = fine;
  c.grid.depth = depth;
  c.lightmap.width = c.lightmap.height = 4;
  c.lightmap.cache = std::vector<std::uint32_t>{2, 2, 3, 3, 2, 2, 3, 3, 4, 4, 5, 5, 4, 4, 5, 5};
  // The floor's two triangles are on the light map, the lamp's one is lit by the grid.
  c.lightmap.parts = std::vector<LightmapPart>{{0, 0, 0, 2, 0}, {0, 0, 0, 1, 6}};
  // (1, 1) itself is kGridLit.
  const std::uint32_t a = packUnorm16x2({0, 0}), b = packUnorm16x2({1, 0}), d = packUnorm16x2({0.99f, 0.99f}),
                      e = packUnorm16x2({0, 1});
  c.lightmap.cornerUv = std::vector<std::uint32_t>{a, b, d, a, d, e, kGridLit, kGridLit, kGridLit};
  c.lightmap.backCornerUv =
      std::vector<std::uint32_t>{kGridLit, kGridLit, kGridLit, kGridLit, kGridLit, kGridLit, a, b, d};
  return c;
}

inline ConeLink makeConeLink(std::uint32_t node, float transfer) {
  return {node, packHalf(transfer), packHalf(0.5f), packOctahedral({0.0f, 1.0f, 0.0f})};
}

// Rows of 4 or 5 links, each a cut. SH links have two bands.
inline Links makeSmallLinks(LinkKind kind) {
  const std::array<std::vector<std::uint32_t>, 2> cuts = {std::vector<std::uint32_t>{3, 4, 5, 6},
                                                          std::vector<std::uint32_t>{4, 6, 7, 8, 11}};
  std::vector<std::uint32_t> row = {0}, node;
  std::vector<ConeLink> cone;
  std::vector<std::uint16_t> coefficients;
  for (std::uint32_t cache = 0; cache < 6; ++cache) {
    for (const std::uint32_t n : cuts[cache % 2]) {
      node.push_back(n);
      cone.push_back(makeConeLink(n, 0.1f));
      for (const float c : {0.1f, 0.05f, -0.02f, 0.01f}) coefficients.push_back(packHalf(c));
    }
    row.push_back(static_cast<std::uint32_t>(node.size()));
  }
  Links l;
  l.kind = kind;
  l.rowBegin = row;
  if (kind == LinkKind::irradiance) {
    // Caches 0 and 1 are the grid's: their links come first and have shapes.
    CompactLinkWriter writer(kind);
    for (std::size_t i = 0; i < node.size(); ++i) {
      if (i < row[2]) {
        writer.add(node[i], 0.1f, {{0, 1, 0}, 0.5f});
      } else {
        writer.add(node[i], 0.1f);
      }
    }
    l.head = writer.head;
    l.shape = writer.shape8;
    return l;
  }
  if (kind == LinkKind::oct6) {
    l.kind = LinkKind::cone;
    l.cone = cone;
    return *compactLinks(l);
  }
  if (kind == LinkKind::cone) {
    l.cone = cone;
    return l;
  }
  l.bands = 2;
  l.shNode = node;
  l.shCoefficients = coefficients;
  return l;
}

inline Bake makeSmallBake(LinkKind kind = LinkKind::cone) {
  Bake bake;
  bake.surfels = makeSmallSurfels();
  bake.hierarchy = makeSmallHierarchy();
  bake.caches = makeSmallCaches();
  bake.links = makeSmallLinks(kind);
  bake.instances = std::vector<BakedInstance>{{"floor", "quad", "wood", 0x0123456789ABCDEFull, 11, 12, 13, 14, 0, 1},
                                              {"lamp", "panel", "", 42, 21, 22, 0, 23, 1, 1}};
  bake.shapes = std::vector<std::uint32_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  bake.provenance = {"0.1.0", 1, "{\"links\":{\"pull\":\"area\"},\"seed\":7}", 99, 7, "none", 2, 1, 77, 78};
  return bake;
}

// The same with its lamp drivable, as files of version 4 have it.
inline Bake makeSmallDrivableBake(LinkKind kind = LinkKind::cone) {
  Bake bake = makeSmallBake(kind);
  bake.emitters.materials =
      std::vector<DrivableMaterial>{{"glow", 0, 1, false, true, true, false}, {"screen", 1, 1, true}};
  bake.emitters.surfel = std::vector<std::uint32_t>{5, 4};
  const std::uint32_t a = packUnorm16x2({0.25f, 0.5f}), b = packUnorm16x2({1, 0});
  bake.emitters.tap = std::vector<std::uint32_t>{a, a, b, b, b, a, b, a};
  bake.emitters.tapWidth = std::vector<float>{0.125f, 0.5f};
  return bake;
}

// That with a certificate, as files of version 6 have it.
inline Bake makeSmallCertifiedBake(LinkKind kind = LinkKind::cone) {
  Bake bake = makeSmallDrivableBake(kind);
  bake.certificate.lightKind = std::vector<std::uint32_t>{0, 1, 2};
  bake.certificate.squaredError = std::vector<float>{0.25f, -0.0625f, 0.015625f};
  bake.certificate.standardError = std::vector<float>{0.125f, 0.0625f, 0.0f};
  bake.certificate.partReceivers = std::vector<std::uint32_t>{30, 2};
  bake.certificate.partError = std::vector<float>{0.0625f, 0.0f};
  return bake;
}

// That with sight on its light map, as files of version 8 have it.
inline Bake makeSmallSightedBake(LinkKind kind = LinkKind::cone) {
  Bake bake = makeSmallCertifiedBake(kind);
  std::vector<std::uint32_t> sight(16, 0);
  sight[5] = packMapSight(127, 0, -32, kSightLower, kSightUpper | kSightLower << 2);
  bake.caches.lightmap.sight = sight;
  return bake;
}

// Change one instance in place.
template <class Edit>
void editInstance(Bake& bake, std::size_t index, const Edit& edit) {
  std::vector<BakedInstance> instances = bake.instances.toVector();
  edit(instances.at(index));
  bake.instances = instances;
}

// A copy of an array with one element replaced.
template <class T>
Array<T> withElement(const Array<T>& array, std::size_t index, T value) {
  std::vector<T> copy = array.toVector();
  copy.at(index) = value;
  return copy;
}

}  // namespace relume
