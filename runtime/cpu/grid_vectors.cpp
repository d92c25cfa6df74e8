// SPDX-License-Identifier: MIT
// See grid_vectors.h.
#include "runtime/cpu/grid_vectors.h"

#include "formats/sh.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/interpolate.h"
#include "runtime/shared/receivers.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace relume::cpu {
namespace {

// Vectors of the zonal band that zonalIrradiance() guesses, half +a; half -a has the opposite. Of zonal coefficient z
// about d, Int over w_a > 0 of z y_2(w . d) w dw = z sqrt(5 / 16 pi) (3 pi / 2 d_a d - pi / 4 (3 d_a² + 1) e_a).
glm::vec3 zonalVector(float c0, const glm::vec3& linear, int a) {
  // Squares of bright light would overflow: the vector is measured in its largest component.
  const float largest = std::max({std::abs(linear.x), std::abs(linear.y), std::abs(linear.z)});
  if (!(c0 > 0.0f) || !(largest > 0.0f)) return glm::vec3(0.0f);
  const glm::vec3 axis = linear / largest;
  const float length = glm::length(axis), ratio = std::min(length * (largest / c0), 1.7320508f);
  // zonalIrradiance()'s 0.24770796 is pi / 4 times the root.
  const float scale = 0.24770796f * c0 * (0.9474243f * ratio - 0.35f) * ratio;
  const glm::vec3 d = axis / length;
  glm::vec3 v = 6.0f * d[a] * d;
  v[a] -= 3.0f * d[a] * d[a] + 1.0f;
  return scale * v;
}

}  // namespace

void makeCacheVectors(const CacheBands& bands, std::span<const float> c, CacheVectors& vectors) {
  const std::span<const float> factors = vectorFactors();
  const std::array<const float*, 3> channel{c.data(), c.data() + bands.lumaCount(),
                                            c.data() + bands.lumaCount() + bands.chromaCount()};
  const auto linearOf = [](const float* x) { return glm::vec3(x[3], x[1], x[2]); };
  const auto bandsOf = [&](std::size_t k) { return k == 0 ? bands.lumaBands : bands.chromaBands; };
  // What chroma lacks of luma's bands 2 and up follows it, as coefficients 0 to 3 do; all of it where it has one band.
  glm::vec2 follow(0.0f);
  const float* y = channel[0];
  if (bands.lumaBands > 1 && bands.chromaBands == 1) {
    if (y[0] > 0.0f) follow = glm::vec2(channel[1][0], channel[2][0]) / y[0];
  } else if (bands.lumaBands > 1 && bands.chromaBands == 2) {
    FirstBands first;
    first.add(bands, c.data(), 1.0f);
    follow = chromaOverLuma(first);
  }
  // Int of y_0 w_a is y_0 pi; of band 1, half of sqrt(4 pi / 3) times the vector.
  constexpr float kConstant = 0.28209479177387814f * std::numbers::pi_v<float>, kLinear = 0.5f * 2.0466534f;
  for (int a = 0; a < 3; ++a) {
    std::array<glm::vec3, 3> even{}, odd{};
    for (std::size_t k = 0; k < 3; ++k) {
      even[k][a] = kConstant * channel[k][0];
      if (bandsOf(k) > 1) odd[k] = kLinear * linearOf(channel[k]);
    }
    std::array<glm::vec3, 3> upper{};
    for (std::size_t k = 0; k < 3; ++k) {
      for (int b = 0; b < 3; ++b) {
        const float* row = factors.data() + static_cast<std::size_t>(3 * a + b) * kMaxCoefficients;
        for (int l = 2; l < bandsOf(k); l += 2) {
          for (int i = l * l; i < (l + 1) * (l + 1); ++i) upper[k][b] += row[i] * channel[k][i];
        }
      }
    }
    if (bands.lumaBands == 2) upper[0] = zonalVector(y[0], linearOf(y), a);
    for (std::size_t k = 1; k < 3 && bands.chromaBands <= 2; ++k) {
      const float share = follow[static_cast<int>(k) - 1];
      upper[k] = share * upper[0];
      if (bands.chromaBands == 1 && bands.lumaBands > 1) {
        even[k] = share * even[0];
        odd[k] = share * odd[0];
      }
    }
    for (std::size_t side = 0; side < 2; ++side) {
      float* to = &vectors[kVectorFloats * (2 * static_cast<std::size_t>(a) + side)];
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::vec3 v = side == 0 ? odd[k] + (even[k] + upper[k]) : odd[k] - (even[k] + upper[k]);
        to[3 * k] = v.x, to[3 * k + 1] = v.y, to[3 * k + 2] = v.z;
      }
      to[9] = to[10] = to[11] = 0.0f;
    }
  }
}

GridVectors::GridVectors(GridTexture texture, std::pmr::memory_resource* memory)
    : texture_(std::move(texture)),
      vectors_(texture_.cacheCount, memory),
      texels_(kTexelFloats * 6 * texture_.points(), 0.0f, memory) {}

void GridVectors::fill(const CacheLight& light, const ParallelFor& parallelFor) {
  if (texture_.empty()) return;
  forChunks(parallelFor, texture_.cacheCount, 64, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t cache = begin; cache < end; ++cache) {
      CacheLight::Row row;
      makeCacheVectors(light, {light.of(cache, row), light.stride()}, vectors_[cache]);
    }
  });
  constexpr float kShare = 1.0f / static_cast<float>(kMaxShare);
  forChunks(parallelFor, 6 * texture_.points(), 1536, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t texel = begin; texel < end; ++texel) {
      // A texel without shares stays zero.
      if (texture_.begin[texel] == texture_.begin[texel + 1]) continue;
      const std::size_t half = texel % 6;
      std::array<float, kVectorFloats> sum{};
      float known = 0.0f;
      for (std::uint32_t k = texture_.begin[texel]; k < texture_.begin[texel + 1]; ++k) {
        const std::uint32_t share = texture_.shares[k];
        const float w = kShare * static_cast<float>(share >> kCacheBits);
        const float* from = &vectors_[share & ((1u << kCacheBits) - 1)][kVectorFloats * half];
        for (std::size_t i = 0; i < kVectorFloats; ++i) sum[i] += w * from[i];
        known += w;
      }
      const ColorVector color =
          makeColorVector(half, {sum[0], sum[1], sum[2]}, {sum[3], sum[4], sum[5]}, {sum[6], sum[7], sum[8]});
      float* to = &texels_[kTexelFloats * texel];
      to[0] = color.luma.x, to[1] = color.luma.y, to[2] = color.luma.z, to[3] = known;
      to[4] = color.axisCo, to[5] = color.axisCg;
    }
  });
}

std::size_t GridVectors::bytes() const {
  return texture_.bytes() + sizeof(CacheVectors) * vectors_.size() + sizeof(float) * texels_.size();
}

}  // namespace relume::cpu
