// SPDX-License-Identifier: MIT
// See plain_results.h.
#include "runtime/shared/plain_results.h"

#include "formats/pack.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/half_scale.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>

namespace relume {
namespace {

void putHalves(std::span<std::uint16_t> to, const glm::vec3& color, float alpha) {
  for (int k = 0; k < 3; ++k) to[static_cast<std::size_t>(k)] = packHalf(color[k]);
  to[3] = packHalf(alpha);
}

// visit(texel, uv of its centre, normal of its cache) for texels that hold a cache; empty(texel) for the others.
template <class Visit, class Empty>
void forTexels(const PackedCaches& caches, const ParallelFor& parallelFor, const Visit& visit, const Empty& empty) {
  const PackedMap& map = caches.map();
  const auto row = [&](std::uint32_t y, std::uint32_t) {
    for (std::uint32_t x = 0; x < map.width; ++x) {
      const std::size_t texel = std::size_t{y} * map.width + x;
      const std::uint32_t cache = map.cache[texel];
      if (cache == kNoCache) {
        empty(texel);
        continue;
      }
      const glm::vec2 uv((static_cast<float>(x) + 0.5f) / static_cast<float>(map.width),
                         (static_cast<float>(y) + 0.5f) / static_cast<float>(map.height));
      visit(texel, uv, map.normalOf(cache));
    }
  };
  forChunks(parallelFor, map.height, 1, row);
}

}  // namespace

void irradianceMap(const PackedCaches& caches, const CacheLight& light, std::span<std::uint16_t> texels,
                   const ParallelFor& parallelFor) {
  forTexels(
      caches, parallelFor,
      [&](std::size_t texel, const glm::vec2& uv, const glm::vec3& normal) {
        const glm::vec3 e = irradianceOnLightmap(caches, light, uv, normal);
        putHalves(texels.subspan(4 * texel, 4), halfScale(largestOf({&e.x, 3})) * e, 1.0f);
      },
      [&](std::size_t texel) { putHalves(texels.subspan(4 * texel, 4), glm::vec3(0.0f), 0.0f); });
}

// E(n) = c_0 + c_x n_x + c_y n_y + c_z n_z, fitted to the receiver's own answers: exact for the texel's normal and for
// the mean of a ring of six normals that lean 60 degrees from it, least squares for the ring's slopes. In the frame
// (t, b, N) with E_0 on the axis and E_k on the ring at azimuth a_k, whose axial part is 1/2 and radial part s = sin
// 60:
//   c_N = 2 (E_0 - mean E_k),  c_0 = 2 mean E_k - E_0,  c_t = sum E_k cos a_k / (3 s),  c_b likewise with sin a_k.
void irradianceMapL1(const PackedCaches& caches, const CacheLight& light, std::span<std::uint16_t> texels,
                     const ParallelFor& parallelFor) {
  constexpr int kRing = 6;
  constexpr float kSin60 = 0.866025404f;
  const std::array<glm::vec2, kRing> ring = {glm::vec2{1, 0},  {0.5f, kSin60},   {-0.5f, kSin60},
                                             glm::vec2{-1, 0}, {-0.5f, -kSin60}, {0.5f, -kSin60}};
  const std::size_t layer = texels.size() / 4;
  forTexels(
      caches, parallelFor,
      [&](std::size_t texel, const glm::vec2& uv, const glm::vec3& n) {
        const glm::vec3 aside = std::abs(n.x) < 0.7f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
        // A cache without a normal has no sides.
        const glm::vec3 across = glm::cross(aside, n);
        const float sine = glm::length(across);
        const glm::vec3 t = sine > 0.0f ? across / sine : across, b = glm::cross(n, t);
        const glm::vec3 onAxis = irradianceOnLightmap(caches, light, uv, n, n);
        glm::vec3 mean(0.0f), slopeT(0.0f), slopeB(0.0f);
        for (const glm::vec2& a : ring) {
          const glm::vec3 lean = 0.5f * n + kSin60 * (a.x * t + a.y * b);
          const glm::vec3 e = irradianceOnLightmap(caches, light, uv, lean, n);
          mean += e / static_cast<float>(kRing);
          slopeT += e * (a.x / (3.0f * kSin60));
          slopeB += e * (a.y / (3.0f * kSin60));
        }
        const glm::vec3 slopeN = 2.0f * (onAxis - mean);
        std::array<glm::vec3, 4> terms{2.0f * mean - onAxis};
        for (int axis = 0; axis < 3; ++axis)
          terms[static_cast<std::size_t>(axis + 1)] = slopeT * t[axis] + slopeB * b[axis] + slopeN * n[axis];
        float largest = 0.0f;
        for (const glm::vec3& term : terms) largest = largestOf({&term.x, 3}, largest);
        const float scale = halfScale(largest);
        for (std::size_t k = 0; k < 4; ++k) putHalves(texels.subspan(k * layer + 4 * texel, 4), scale * terms[k], 1.0f);
      },
      [&](std::size_t texel) {
        for (std::size_t k = 0; k < 4; ++k) putHalves(texels.subspan(k * layer + 4 * texel, 4), glm::vec3(0.0f), 0.0f);
      });
}

void ambientVolume(const PackedCaches& caches, const CacheLight& light, const AmbientVolume& volume,
                   std::span<glm::vec3> cubes, const ParallelFor& parallelFor) {
  const std::array<glm::vec3, 6> normals = {glm::vec3{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                            glm::vec3{0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  const glm::uvec3 n = volume.resolution;
  const auto slice = [&](std::uint32_t z, std::uint32_t) {
    std::size_t at = std::size_t{6} * n.x * n.y * z;
    for (std::uint32_t y = 0; y < n.y; ++y) {
      for (std::uint32_t x = 0; x < n.x; ++x) {
        const glm::vec3 position = volume.originWorld + volume.spacing * glm::vec3(x, y, z);
        for (const glm::vec3& normal : normals) cubes[at++] = irradianceInGrid(caches, light, position, normal);
      }
    }
  };
  forChunks(parallelFor, n.z, 1, slice);
}

}  // namespace relume
