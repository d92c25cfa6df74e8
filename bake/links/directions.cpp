// SPDX-License-Identifier: MIT
// See directions.h. The unit square is mapped to the disc concentrically (Shirley and Chiu 1997) and lifted to the
// hemisphere, or folded like an octahedron onto the sphere (Clarberg 2008); both keep areas and neighbourhoods.
#include "bake/links/directions.h"

#include "bake/base/wide_clones.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

struct SineCosine {
  float sine, cosine;
};

// sin and cos of pi/4 t for t in [-1, 1], error below 4e-7. A polynomial of our own: the same bits with any libm.
[[gnu::always_inline]] inline SineCosine sineCosineEighth(float t) {
  const float x = t * (kPi / 4), x2 = x * x;
  const float sine = x * (1.0f + x2 * (-1.0f / 6 + x2 * (1.0f / 120 - x2 * (1.0f / 5040))));
  const float cosine = 1.0f + x2 * (-0.5f + x2 * (1.0f / 24 + x2 * (-1.0f / 720 + x2 * (1.0f / 40320))));
  return {sine, cosine};
}

struct LocalSample {
  float x, y, z, weightTimesCount;
};

// Density over the hemisphere: p = (a + b z) / (2 pi) with a + b/2 = 1, where a is the share of even rays. The radius
// on the disc follows from r² = P(Z > z) = 1 - (a z + b z² / 2).
[[gnu::always_inline]] inline LocalSample hemisphereSample(float u, float v, float a) {
  const float s = 2.0f * u - 1.0f, t = 2.0f * v - 1.0f;
  const bool wide = std::abs(s) > std::abs(t);
  const float radius = wide ? s : t, across = wide ? t : s;
  const SineCosine angle = sineCosineEighth(radius != 0.0f ? across / radius : 0.0f);
  const float b = 2.0f - 2.0f * a;
  const float inside = 1.0f - radius * radius;
  const float z = std::min(2.0f * inside / (a + std::sqrt(a * a + 2.0f * b * inside)), 1.0f);
  const float sinTheta = std::sqrt(1.0f - z * z);
  const float across2 = radius < 0.0f ? -sinTheta : sinTheta;
  const float cx = wide ? angle.cosine : angle.sine, cy = wide ? angle.sine : angle.cosine;
  return {across2 * cx, across2 * cy, z, 2.0f / (a + b * z)};
}

// Density 1 / (4 pi).
[[gnu::always_inline]] inline LocalSample sphereSample(float u, float v) {
  const float s = 2.0f * u - 1.0f, t = 2.0f * v - 1.0f;
  const float fold = 1.0f - (std::abs(s) + std::abs(t));
  const float radius = 1.0f - std::abs(fold);
  const float turn = radius != 0.0f ? (std::abs(t) - std::abs(s)) / radius : 0.0f;
  const SineCosine angle = sineCosineEighth(turn);
  constexpr float kHalfRoot = std::numbers::sqrt2_v<float> / 2;
  const float z = std::copysign(1.0f - radius * radius, fold);
  const float sinTheta = radius * std::sqrt(2.0f - radius * radius);
  const float cosPhi = (angle.cosine - angle.sine) * kHalfRoot, sinPhi = (angle.cosine + angle.sine) * kHalfRoot;
  return {std::copysign(sinTheta * cosPhi, s), std::copysign(sinTheta * sinPhi, t), z, 4.0f};
}

constexpr std::size_t kBlock = DirectionStrata::kBlock;

struct LocalBlock {
  std::array<float, kBlock> x, y, z, weightTimesCount;
};

// Map one block at a time, in loops without branches that compilers turn into vectors.
RELUME_WIDE_CLONES void sampleBlock(const std::array<float, kBlock>& u, const std::array<float, kBlock>& v,
                                    bool hemisphere, float evenShare, LocalBlock& block) {
  const auto put = [&](std::size_t i, const LocalSample& local) {
    block.x[i] = local.x, block.y[i] = local.y, block.z[i] = local.z,
    block.weightTimesCount[i] = local.weightTimesCount;
  };
  if (hemisphere) {
    for (std::size_t i = 0; i < kBlock; ++i) put(i, hemisphereSample(u[i], v[i], evenShare));
  } else {
    for (std::size_t i = 0; i < kBlock; ++i) put(i, sphereSample(u[i], v[i]));
  }
}

}  // namespace

glm::vec3 hemisphereDirection(float u, float v, float evenShare) {
  constexpr float kInside = 1.0f - 1e-6f;  // at the very edge, without even rays, z is 0 / 0
  const LocalSample local = hemisphereSample(0.5f + kInside * (u - 0.5f), 0.5f + kInside * (v - 0.5f), evenShare);
  return {local.x, local.y, local.z};
}

DirectionStrata::DirectionStrata(std::uint32_t rays, float evenShare) : evenShare_(evenShare) {
  const double side = std::sqrt(static_cast<double>(rays));
  columns_ = 4 * std::max(1u, static_cast<std::uint32_t>(std::lround(side / 4)));
  rows_ = 4 * std::max(1u, rays / columns_ / 4);
}

DirectionStrata::Sequence::Sequence(const DirectionStrata& strata, const glm::vec3& normal, RandomStream random)
    : strata_(strata), random_(random), hemisphere_(glm::dot(normal, normal) > 0.0f) {
  // Choose a random axis for the sphere and turn the strata around the axis by a random angle, so that no two caches
  // have the same pattern.
  const auto [s, c] = sineCosineEighth(random_.uniform());
  const bool swap = random_.bits() & 1u, mirror = random_.bits() & 1u;
  const float turnCos = swap ? s : c, turnSin = mirror ? -(swap ? c : s) : (swap ? c : s);
  const float
      v = random_.uniform(),
      u = random_.uniform();  // in a statement of its own: the order in which arguments are evaluated is unspecified
  const LocalSample any = sphereSample(u, v);
  axis_ = hemisphere_ ? normal : glm::normalize(glm::vec3(any.x, any.y, any.z));
  const glm::vec3 helper = std::abs(axis_.x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  const glm::vec3 t = glm::normalize(glm::cross(helper, axis_)), b = glm::cross(axis_, t);
  tangent_ = t * turnCos + b * turnSin;
  bitangent_ = b * turnCos - t * turnSin;
}

void DirectionStrata::Sequence::next(std::span<Sample, kBlock> block) {
  const std::uint32_t blocksAlong = strata_.columns_ / 4;
  const auto column = static_cast<float>(block_ % blocksAlong * 4), row = static_cast<float>(block_ / blocksAlong * 4);
  ++block_;

  // Jitter each stratum with 16 bits per axis.
  const auto columns = static_cast<float>(strata_.columns_), rows = static_cast<float>(strata_.rows_);
  std::array<float, kBlock> u, v;
  for (std::size_t i = 0; i < kBlock; ++i) {
    const std::uint32_t bits = random_.bits();
    u[i] = (column + static_cast<float>(i % 4) + (static_cast<float>(bits & 0xFFFFu) + 0.5f) * 0x1p-16f) / columns;
    v[i] = (row + static_cast<float>(i / 4) + (static_cast<float>(bits >> 16) + 0.5f) * 0x1p-16f) / rows;
  }

  LocalBlock local;
  sampleBlock(u, v, hemisphere_, strata_.evenShare_, local);
  const auto count = static_cast<float>(strata_.count());
  for (std::size_t i = 0; i < kBlock; ++i) {
    block[i] = {tangent_ * local.x[i] + bitangent_ * local.y[i] + axis_ * local.z[i], local.weightTimesCount[i] / count,
                hemisphere_ ? local.z[i] : 1.0f};
  }
}

}  // namespace relume
