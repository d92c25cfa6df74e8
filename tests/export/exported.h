// SPDX-License-Identifier: MIT
// A level baked, exported and read again, and what must be true of all of them.
#pragma once

#include "bake/export/export_level.h"
#include "bake/import/gltf_file.h"
#include "bake/import/gltf_import.h"
#include "bake/scene/surface_hash.h"
#include "formats/pack.h"
#include "relume/bake/bake.h"
#include "relume/bake/load_scene.h"
#include "relume/bake/provenance.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume::test {

struct Exported {
  Scene scene, again;  // of the level, of the exported one
  Bake bake;
  ExportedLevel level;
  std::filesystem::path path;
  nlohmann::json before, after;  // the JSON of both
  std::vector<std::string> messages;
};

inline nlohmann::json jsonOf(const std::filesystem::path& path) {
  const auto container = splitContainer(*readSceneBytes(path, "level"), "level");
  return nlohmann::json::parse(container->json);
}

inline Exported exportOf(const std::filesystem::path& path, BakeOptions options) {
  Exported out;
  Context context;
  context.onMessage = [&](Severity, std::string_view text) { out.messages.emplace_back(text); };
  auto scene = loadScene(path.string(), context);
  EXPECT_TRUE(scene) << scene.error().message;
  auto baked = bake(*scene, options, context);
  EXPECT_TRUE(baked) << baked.error().message;
  auto level = exportLevel(path, *scene, *baked, 0x0123456789abcdefull, context);
  EXPECT_TRUE(level) << level.error().message;
  out.path = testing::testFolder() / "exported.glb";
  const Status written = level->document.write(out.path);
  EXPECT_TRUE(written) << written.error().message;
  auto again = loadScene(out.path.string(), context);
  EXPECT_TRUE(again) << again.error().message;
  out.before = jsonOf(path);
  out.after = jsonOf(out.path);
  out.scene = std::move(*scene);
  out.again = std::move(*again);
  out.bake = std::move(*baked);
  out.level = std::move(*level);
  return out;
}

// A TEXCOORD set of each triangle corner of an exported instance, in glTF order; nothing without that set.
inline std::optional<std::vector<glm::vec2>> cornerSet(const GltfDocument& document, const Instance& instance,
                                                       int set) {
  const int mesh = document.model.nodes[instance.nodeIndex].mesh;
  const tinygltf::Primitive& p = document.model.meshes[static_cast<std::size_t>(mesh)].primitives[instance.primitive];
  const auto accessor = p.attributes.find("TEXCOORD_" + std::to_string(set));
  if (accessor == p.attributes.end()) return std::nullopt;
  AccessorReader reader(document);
  const auto values = reader.floats(accessor->second, 2, 2, "test");
  EXPECT_TRUE(values) << values.error().message;
  std::vector<std::uint32_t> indices;
  if (p.indices >= 0) {
    indices = *reader.indices(p.indices, "test");
  } else {
    for (std::uint32_t i = 0; i < (*values)->count; ++i) indices.push_back(i);
  }
  std::vector<glm::vec2> out;
  for (const std::uint32_t v : unrollTriangles(indices, p.mode))
    out.emplace_back((*values)->values.at(2 * v), (*values)->values.at(2 * v + 1));
  return out;
}

// Every corner has the bake's coordinate, bit for bit.
inline void expectCoordinates(const Exported& e) {
  Context context;
  const auto document = loadGltfDocument(e.path, context);
  ASSERT_TRUE(document) << document.error().message;
  ASSERT_EQ(e.scene.instances.size(), e.again.instances.size());
  const Lightmap& map = e.bake.caches.lightmap;
  std::size_t onMap = 0;
  for (std::uint32_t i = 0; i < e.scene.instances.size(); ++i) {
    const Instance &instance = e.scene.instances[i], &exported = e.again.instances[i];
    const Mesh& mesh = e.scene.meshes[instance.mesh];
    for (int side = 0; side < 2; ++side) {
      const auto uv = side == 1 && e.level.backTexcoord < 0
                          ? std::nullopt
                          : cornerSet(*document, exported, side == 0 ? e.level.texcoord : e.level.backTexcoord);
      const Array<std::uint32_t>& corners = side == 0 ? map.cornerUv : map.backCornerUv;
      for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
        const auto at = e.scene.corners(instance, t);
        if (glm::cross(at[1] - at[0], at[2] - at[0]) == glm::vec3(0.0f)) continue;
        for (std::uint32_t k = 0; k < 3; ++k) {
          const std::uint64_t c = map.parts[i].firstCorner + 3ull * t + k;
          const std::uint32_t packed =
              instance.charted() && t < map.parts[i].triangleCount && c < corners.size() ? corners[c] : kGridLit;
          if (!uv) {
            ASSERT_EQ(packed, kGridLit) << instance.node << " triangle " << t << " side " << side;
            continue;
          }
          ASSERT_EQ(uv->at(3 * t + k), unpackUnorm16x2(packed)) << instance.node << " triangle " << t;
          onMap += packed != kGridLit;
        }
      }
    }
  }
  EXPECT_GT(onMap, 0u);
}

// The exported level has the same surfaces in the same order.
inline void expectSameSurfaces(const Scene& a, const Scene& b) {
  ASSERT_EQ(a.instances.size(), b.instances.size());
  ASSERT_EQ(a.materials.size(), b.materials.size());
  const std::vector<BakedInstance> described = describeInstances(a);
  for (std::size_t i = 0; i < a.instances.size(); ++i) {
    const Instance &p = a.instances[i], &q = b.instances[i];
    EXPECT_EQ(p.mode, q.mode) << p.node;
    EXPECT_EQ(p.flipped, q.flipped) << p.node;
    EXPECT_EQ(p.firstTriangle, q.firstTriangle) << p.node;
    for (int c = 0; c < 4; ++c) EXPECT_LT(glm::distance(p.toWorld[c], q.toWorld[c]), 1e-6f) << p.node;
    const Mesh &m = a.meshes[p.mesh], &n = b.meshes[q.mesh];
    EXPECT_EQ(m.material, n.material);
    // What relume status goes by.
    EXPECT_EQ(hashSurface(m), hashSurface(n)) << p.node;
    EXPECT_EQ(b.exportedSurfaces.at(described[i].geometryHash), hashSurface(n)) << p.node;
    ASSERT_EQ(m.triangle.size(), n.triangle.size()) << p.node;
    for (std::size_t t = 0; t < m.triangle.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t v = m.triangle[t][k], w = n.triangle[t][k];
        ASSERT_EQ(m.position[v], n.position[w]) << p.node << " triangle " << t;
        ASSERT_EQ(m.normal.empty(), n.normal.empty());
        if (!m.normal.empty()) {
          ASSERT_EQ(m.normal[v], n.normal[w]) << p.node;
        }
        ASSERT_EQ(m.color.empty(), n.color.empty());
        if (!m.color.empty()) {
          ASSERT_LT(glm::distance(m.color[v], n.color[w]), 1e-6f) << p.node;  // Draco's rounding
        }
        if (!m.uv[0].empty()) {
          ASSERT_EQ(m.uv[0][v], n.uv[0][w]) << p.node;
        }
      }
    }
  }
}

}  // namespace relume::test
