// SPDX-License-Identifier: MIT
// A bake as the lists that src/webgl_tables.js puts into textures, and the shaders of its passes (shaders/webgl). Lists
// that the bake has as they are wanted are lent; the others are made here and live until relume_web_free_tables().
#include "formats/compact_links.h"
#include "runtime/c_handles.h"
#include "runtime/shared/bands.h"
#include "runtime/shared/link_set.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/pack_surfel.h"
#include "runtime/shared/shader_text.h"

#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <new>
#include <string>
#include <vector>

namespace {

struct Tables {
  std::vector<relume::SurfelWords> surfels;
  std::vector<glm::vec4> emission;  // few surfels emit, so that rounding would show
  std::vector<std::array<std::uint32_t, 4>> tree, cones;
  std::vector<std::uint32_t> heads;  // of links whose f the CPU backend rounds
  std::vector<std::uint32_t> words;  // of relume_web_tables()
};

// First child, second child, weight, parity of the level; a child is a node, or a leaf's bit and sender. A leaf has
// itself as both children.
std::vector<std::array<std::uint32_t, 4>> treeOf(const relume::Hierarchy& h) {
  std::vector<std::array<std::uint32_t, 4>> tree(h.nodeCount());
  const auto ref = [&h](std::uint32_t node) { return h.isLeaf(node) ? h.child[node] : node; };
  for (std::uint32_t level = 0; level < h.levelCount(); ++level) {
    for (std::uint32_t i = h.levelBegin[level]; i < h.levelBegin[level + 1]; ++i) {
      if (h.isLeaf(i)) {
        tree[i] = {h.child[i], h.child[i], 0, level % 2};
      } else {
        tree[i] = {ref(h.child[i]), ref(h.child[i] + 1), std::bit_cast<std::uint32_t>(h.firstWeight[i]), level % 2};
      }
    }
  }
  return tree;
}

// Heads of links with the f that the CPU backend reads; none where that is the bake's own.
std::vector<std::uint32_t> roundedHeads(const relume::Links& links) {
  const relume::LinkSet set(links, std::pmr::new_delete_resource());
  const relume::LinkRows rows = set.rows();
  if (rows.kind != relume::kRepackedLinks) return {};
  std::vector<std::uint32_t> heads(links.count());
  // A head is the node's 20 bits and 12 of f, of which the CPU keeps the high eight.
  for (std::uint32_t i = 0; i < links.count(); ++i) heads[i] = links.node(i) | std::uint32_t{rows.transfer[i]} << 24;
  return heads;
}

std::uint32_t addressOf(const void* data) { return reinterpret_cast<std::uint32_t>(data); }

}  // namespace

extern "C" {

void relume_web_free_tables(Tables* tables) { delete tables; }

// Null where memory runs out. relume_web_tables() gives what there is.
Tables* relume_web_make_tables(const relume_bake* handle) try {
  const relume::Bake& bake = handle->bake;
  const relume::Surfels& surfels = bake.surfels;
  auto tables = std::make_unique<Tables>();
  const relume::SurfelBox box = relume::boxOf(surfels.positionWorld);
  // Albedo has the CPU backend's dithers: by the order of the surfels' nodes.
  const relume::Hierarchy& hierarchy = bake.hierarchy;
  tables->surfels.resize(surfels.count());
  std::uint32_t leaf = 0;
  for (std::uint32_t node = 0; node < hierarchy.nodeCount(); ++node) {
    if (!hierarchy.isLeaf(node) || hierarchy.sender(node) >= surfels.count()) continue;
    const std::uint32_t s = hierarchy.sender(node);
    tables->surfels[s] = relume::packSurfel(box, surfels.positionWorld[s], surfels.normal[s], surfels.albedo[s],
                                            surfels.receiver[s], relume::ditherOf(leaf++));
  }
  const bool emits = std::any_of(surfels.emission.begin(), surfels.emission.end(),
                                 [](const glm::vec3& e) { return e != glm::vec3(0.0f); });
  for (std::uint32_t s = 0; emits && s < surfels.count(); ++s)
    tables->emission.push_back(glm::vec4(surfels.emission[s], 0.0f));
  tables->tree = treeOf(hierarchy);
  const relume::Links& links = bake.links;
  tables->heads = roundedHeads(links);
  for (const relume::ConeLink& cone : links.cone)
    tables->cones.push_back({cone.node, cone.transfer | std::uint32_t{cone.cosAlpha} << 16, cone.direction, 0});

  const auto gridLinks = static_cast<std::uint32_t>(relume::countGridLinks(bake.caches, links));
  auto& w = tables->words;
  const auto add = [&w](const void* data, std::size_t count) {
    w.push_back(addressOf(data));
    w.push_back(static_cast<std::uint32_t>(count));
  };
  add(tables->surfels.data(), tables->surfels.size());
  add(tables->emission.data(), tables->emission.size());
  add(tables->tree.data(), tables->tree.size());
  add(hierarchy.levelBegin.data(), hierarchy.levelBegin.size());
  add(links.rowBegin.data(), links.rowBegin.size());
  const std::uint32_t* heads = tables->heads.empty() ? links.head.data() : tables->heads.data();
  add(heads, links.head.size());
  add(links.shape.data(), links.shape.size());
  add(tables->cones.data(), tables->cones.size());
  add(links.shNode.data(), links.shNode.size());
  add(links.shCoefficients.data(), links.shCoefficients.size());
  add(bake.caches.lightmap.cache.data(), bake.caches.lightmap.cache.size());
  add(hierarchy.leafNode.data(), hierarchy.leafNode.size());
  for (const std::uint32_t each : {static_cast<std::uint32_t>(links.kind), links.bands, gridLinks,
                                   bake.caches.firstMapCache(), hierarchy.senderCount()})
    w.push_back(each);
  for (const glm::vec3& v : {box.origin, box.step}) {
    for (int k = 0; k < 3; ++k) w.push_back(std::bit_cast<std::uint32_t>(v[k]));
  }
  w.push_back(std::bit_cast<std::uint32_t>(relume::discRadius(surfels.areaEach)));
  return tables.release();
} catch (const std::bad_alloc&) {
  return nullptr;
}

// Address and count of: surfels (16 bytes each), emission (16, floats; 0 without), tree (16), first node of each level
// (4), first link of each cache (4), heads (4), shapes (4), cones (16), nodes of SH links (4), their coefficients (2),
// caches of the light map's texels (4), node of each sender (4); then link kind, bands of SH links, links of the grid,
// first cache of the light map, senders; then the surfels' box as floats: origin, step; and their radius.
const std::uint32_t* relume_web_tables(const Tables* tables) { return tables->words.data(); }

// Bands of luma and of chroma that the light map's caches have, of a relighter with these.
int relume_web_bands_on_map(int bands, int irradianceOnMap) {
  relume::CacheBands held;
  held.irradianceOnMap = irradianceOnMap != 0;
  return held.onMap(bands);
}

// Text of a file of shaders/ with its includes, until the next call; without definitions and #version. "" where there
// is none.
const char* relume_web_shader(const char* path, const char* visibilityGlsl) {
  static std::string text;
  relume::Result<std::string> expanded = relume::expandShader(path, {}, visibilityGlsl);
  text = expanded ? std::move(*expanded) : std::string();
  return text.c_str();
}

}  // extern "C"
