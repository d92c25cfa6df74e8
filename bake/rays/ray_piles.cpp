// SPDX-License-Identifier: MIT
// See ray_piles.h.
#include "bake/rays/ray_piles.h"

#include "bake/base/parallel_sort.h"
#include "bake/base/random.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <map>
#include <utility>

namespace relume {
namespace {

using Point = std::array<std::uint32_t, 3>;  // bits of the coordinates; negative zero counts as zero
using CornerBits = std::array<Point, 3>;

// A triangle, and a hash of its corners that does not depend on their order.
struct Hashed {
  std::uint64_t hash = 0;
  std::uint32_t index = 0;  // into `instances`
  std::uint32_t triangle = 0;
};

bool isOpaque(const Scene& scene, const Instance& instance) {
  return scene.meshes[instance.mesh].material == kNone || scene.material(instance).alphaMode != AlphaMode::mask;
}

CornerBits cornersOf(const Scene& scene, const Instance& instance, std::uint32_t triangle) {
  CornerBits bits;
  const std::array<glm::vec3, 3> corners = scene.corners(instance, triangle);
  for (std::size_t c = 0; c < 3; ++c) {
    for (int k = 0; k < 3; ++k)
      bits[c][static_cast<std::size_t>(k)] = std::bit_cast<std::uint32_t>(corners[c][k] + 0.0f);
  }
  return bits;
}

std::uint64_t hashOf(const CornerBits& corners) {
  std::uint64_t sum = 0;  // of the corners' hashes: the same in any order
  for (const Point& p : corners) sum += mix64(mix64(std::uint64_t{p[0]} << 32 | p[1]) ^ p[2]);
  return sum;
}

// The corners from the smallest on, in their cyclic order: equal for triangles whose fronts look the same way.
CornerBits wound(CornerBits corners) {
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

// The opaque triangles whose corners are three, in any order.
std::vector<Hashed> hashTriangles(const Scene& scene, std::span<const std::uint32_t> instances, Context& context) {
  constexpr std::size_t kGrain = 4096;  // [triangles]
  std::vector<std::size_t> first{0};    // of each instance's triangles
  for (const std::uint32_t i : instances) {
    const Instance& instance = scene.instances[i];
    first.push_back(first.back() + (isOpaque(scene, instance) ? scene.meshes[instance.mesh].triangle.size() : 0));
  }
  std::vector<Hashed> hashed(first.back());
  parallelChunks(context, "", hashed.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    auto i = static_cast<std::uint32_t>(std::upper_bound(first.begin(), first.end(), begin) - first.begin()) - 1;
    for (std::size_t at = begin; at < end; ++at) {
      while (at >= first[i + 1]) ++i;
      const auto t = static_cast<std::uint32_t>(at - first[i]);
      const CornerBits corners = cornersOf(scene, scene.instances[instances[i]], t);
      const bool isTriangle = corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0];
      hashed[at] = {hashOf(corners), isTriangle ? i : kNone, t};
    }
  });
  std::erase_if(hashed, [](const Hashed& each) { return each.index == kNone; });
  return hashed;
}

}  // namespace

std::vector<std::vector<std::uint8_t>> findBuried(const Scene& scene, std::span<const std::uint32_t> instances,
                                                  Context& context) {
  std::vector<std::vector<std::uint8_t>> buried(instances.size());
  std::vector<Hashed> hashed = hashTriangles(scene, instances, context);
  sortByThreads(context, hashed, [](const Hashed& a, const Hashed& b) {
    if (a.hash != b.hash) return a.hash < b.hash;
    return a.index != b.index ? a.index < b.index : a.triangle < b.triangle;
  });
  if (context.cancelled()) return buried;
  std::vector<CornerBits> shown;  // fronts of the pile at hand that are in the tree
  for (std::size_t begin = 0, end = 0; begin < hashed.size(); begin = end) {
    while (end < hashed.size() && hashed[end].hash == hashed[begin].hash) ++end;
    if (end - begin < kPile) continue;
    shown.clear();
    for (std::size_t i = begin; i < end; ++i) {
      const Hashed& each = hashed[i];
      const Instance& instance = scene.instances[instances[each.index]];
      const CornerBits front = wound(cornersOf(scene, instance, each.triangle));
      if (std::find(shown.begin(), shown.end(), front) == shown.end()) {
        shown.push_back(front);
        continue;
      }
      std::vector<std::uint8_t>& ofInstance = buried[each.index];
      ofInstance.resize(scene.meshes[instance.mesh].triangle.size(), 0);
      ofInstance[each.triangle] = 1;
    }
  }
  return buried;
}

std::vector<std::uint8_t> findBuriedInstances(const Scene& scene, std::span<const std::uint32_t> instances) {
  using Key = std::pair<std::uint32_t, std::array<std::uint32_t, 16>>;  // mesh, transform
  std::map<Key, std::vector<std::uint32_t>> alike;
  for (std::uint32_t i = 0; i < instances.size(); ++i) {
    const Instance& instance = scene.instances[instances[i]];
    if (!isOpaque(scene, instance)) continue;
    Key key{instance.mesh, {}};
    std::memcpy(key.second.data(), &instance.toWorld, sizeof key.second);
    alike[key].push_back(i);
  }
  std::vector<std::uint8_t> buried(instances.size(), 0);
  for (const auto& [key, members] : alike) {
    if (members.size() < kPile) continue;
    for (std::size_t m = 1; m < members.size(); ++m) buried[members[m]] = 1;
  }
  return buried;
}

}  // namespace relume
