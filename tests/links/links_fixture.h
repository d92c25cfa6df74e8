// SPDX-License-Identifier: MIT
// Small scenes and hierarchies made by hand, for the tests of the links.
#pragma once

#include "bake/base/random.h"
#include "bake/hierarchy/hierarchy.h"
#include "bake/links/gather.h"
#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surfels.h"
#include "formats/pack.h"
#include "relume/caches.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <numbers>
#include <string>
#include <vector>

namespace relume::test {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kY0 = 0.28209479177387814;  // 1 / sqrt(4 pi)

// A level made of rectangles, each cut into tiles; a tile is two triangles and has a surfel on each side.
class TileScene {
 public:
  TileScene() {
    scene_.meshes.push_back({});
    scene_.instances.push_back({});
  }

  // The rectangle corner + s edgeU + t edgeV; its front is the side of cross(edgeU, edgeV). back: that side reflects
  // too. mapped = false: it only stands in the way.
  void addRectangle(const glm::vec3& corner, const glm::vec3& edgeU, const glm::vec3& edgeV, std::uint32_t tiles,
                    bool back = false, bool mapped = true, const glm::vec3& emission = glm::vec3(0.0f)) {
    const glm::vec3 u = edgeU / static_cast<float>(tiles), v = edgeV / static_cast<float>(tiles);
    const glm::vec3 normal = glm::normalize(glm::cross(u, v));
    areaEach_ = glm::length(glm::cross(u, v));
    Mesh& mesh = scene_.meshes[0];
    for (std::uint32_t y = 0; y < tiles; ++y) {
      for (std::uint32_t x = 0; x < tiles; ++x) {
        const glm::vec3 at = corner + static_cast<float>(x) * u + static_cast<float>(y) * v;
        const auto first = static_cast<std::uint32_t>(mesh.position.size());
        for (const glm::vec3& p : {at, at + u, at + u + v, at + v}) mesh.position.push_back(p);
        mesh.triangle.push_back({first, first + 1, first + 2});
        mesh.triangle.push_back({first, first + 2, first + 3});
        std::uint32_t sides[2] = {kNone, kNone};
        if (mapped) sides[0] = addSurfel(at + (u + v) * 0.5f, normal, emission);
        if (mapped && back) sides[1] = addSurfel(at + (u + v) * 0.5f, -normal, emission);
        for (int triangle = 0; triangle < 2; ++triangle) {
          for (const std::uint32_t surfel : sides) surfelOfSide_.push_back(surfel);
        }
      }
    }
  }

  void addCache(const glm::vec3& position, const glm::vec3& normal) {
    cachePosition_.push_back(position);
    cacheNormal_.push_back(normal);
  }

  // Six inward-facing walls of the box [-half, half]³.
  void addBox(float half, std::uint32_t tiles) {
    const float s = 2 * half;
    addRectangle({-half, -half, -half}, {0, s, 0}, {0, 0, s}, tiles);
    addRectangle({half, -half, -half}, {0, 0, s}, {0, s, 0}, tiles);
    addRectangle({-half, -half, -half}, {0, 0, s}, {s, 0, 0}, tiles);
    addRectangle({-half, half, -half}, {s, 0, 0}, {0, 0, s}, tiles);
    addRectangle({-half, -half, -half}, {s, 0, 0}, {0, s, 0}, tiles);
    addRectangle({-half, -half, half}, {0, s, 0}, {s, 0, 0}, tiles);
  }

  const Scene& scene() const { return scene_; }

  Surfels surfels() const {
    Surfels s;
    const std::size_t n = position_.size();
    s.positionWorld = position_;
    s.normal = normal_;
    s.albedo = std::vector<glm::vec3>(n, glm::vec3(0.5f));
    s.emission = emission_;
    s.receiver = std::vector<std::uint32_t>(n, kGridReceiver);
    s.instance = std::vector<std::uint32_t>(n, 0);
    s.areaEach = areaEach_;
    return s;
  }

  SurfelMap map() const {
    SurfelMap m;
    std::vector<SurfelMap::Side> sides;
    for (const std::uint32_t surfel : surfelOfSide_) {
      SurfelMap::Side& side = sides.emplace_back();
      if (surfel == kNone) continue;
      side.firstTile = static_cast<std::uint32_t>(m.tile.size());
      side.columns = side.rows = 1;
      m.tile.push_back(surfel);
    }
    m.sides = BlockPalette<SurfelMap::Side>(sides);
    return m;
  }

  Caches caches() const {
    Caches c;
    c.positionWorld = cachePosition_;
    c.normal = cacheNormal_;
    return c;
  }

 private:
  std::uint32_t addSurfel(const glm::vec3& position, const glm::vec3& normal, const glm::vec3& emission) {
    position_.push_back(position);
    normal_.push_back(normal);
    emission_.push_back(emission);
    return static_cast<std::uint32_t>(position_.size() - 1);
  }

  Scene scene_;
  std::vector<glm::vec3> position_, normal_, emission_, cachePosition_, cacheNormal_;
  std::vector<std::uint32_t> surfelOfSide_;
  float areaEach_ = 0.0f;
};

// A random binary tree over n senders: breadth first, siblings adjacent, weights random.
inline Hierarchy randomHierarchy(std::uint32_t n, std::uint64_t seed) {
  RandomStream random(seed, 1, 0);
  std::vector<std::uint32_t> child, leafNode(n), levelBegin{0}, size{n}, sender(n);
  std::vector<float> firstWeight;
  std::uint32_t nextSender = 0, nextNode = 1;
  for (std::uint32_t level = 0; level < size.size();) {
    const auto levelEnd = static_cast<std::uint32_t>(size.size());
    for (; level < levelEnd; ++level) {
      if (size[level] == 1) {
        leafNode[nextSender] = level;
        child.push_back(kLeafBit | nextSender++);
        firstWeight.push_back(0.0f);
      } else {
        const std::uint32_t first = 1 + random.below(size[level] - 1);
        child.push_back(nextNode);
        firstWeight.push_back(0.1f + 0.8f * random.uniform());
        size.push_back(first);
        size.push_back(size[level] - first);
        nextNode += 2;
      }
    }
    levelBegin.push_back(levelEnd);
  }
  Hierarchy h;
  h.child = child;
  h.firstWeight = firstWeight;
  h.levelBegin = levelBegin;
  h.leafNode = leafNode;
  h.groupRoot = std::vector<std::uint32_t>{0};
  return h;
}

// Parent of every node; the root's is 0.
inline std::vector<std::uint32_t> parentsOf(const Hierarchy& h) {
  std::vector<std::uint32_t> parent(h.nodeCount(), 0);
  for (std::uint32_t node = 0; node < h.nodeCount(); ++node) {
    if (!h.isLeaf(node)) parent[h.child[node]] = parent[h.child[node] + 1] = node;
  }
  return parent;
}

// Rays that end in random leaves, in random directions.
inline std::vector<Arrival> randomArrivals(const Hierarchy& hierarchy, std::uint32_t count, std::uint64_t seed) {
  RandomStream random(seed, 2, 0);
  std::vector<Arrival> arrivals;
  for (std::uint32_t i = 0; i < count; ++i) {
    glm::vec3 d(random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.4f);
    const std::uint32_t leaf = hierarchy.leafNode[random.below(hierarchy.senderCount())];
    arrivals.push_back({leaf, 0.5f + random.uniform(), random.uniform(), glm::normalize(d)});
  }
  return arrivals;
}

// Radiosity of every node from that of the senders.
inline std::vector<double> pullRadiosity(const Hierarchy& h, std::span<const float> firstWeight,
                                         std::span<const double> senderRadiosity) {
  std::vector<double> b(h.nodeCount());
  for (std::uint32_t node = h.nodeCount(); node-- > 0;) {
    if (h.isLeaf(node)) {
      b[node] = senderRadiosity[h.sender(node)];
    } else {
      const double w = firstWeight[node];
      b[node] = w * b[h.child[node]] + (1.0 - w) * b[h.child[node] + 1];
    }
  }
  return b;
}

}  // namespace relume::test
