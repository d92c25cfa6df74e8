// SPDX-License-Identifier: MIT
// Skies and convergence: see relighter.h.
#include "formats/decimal.h"
#include "formats/equirectangular.h"
#include "formats/memory.h"
#include "formats/sh.h"
#include "relume/relighter.h"
#include "runtime/shared/usage_error.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <numbers>
#include <string>

namespace relume {
namespace {

std::uint32_t nearestPatch(std::span<const glm::vec3> centre, const glm::vec3& d) {
  std::uint32_t best = 0;
  float largest = -2.0f;
  for (std::uint32_t p = 0; p < centre.size(); ++p) {
    const float cosine = glm::dot(centre[p], d);
    if (cosine > largest) {
      largest = cosine;
      best = p;
    }
  }
  return best;
}

// The texel a direction falls into.
std::size_t texelAt(const glm::vec3& d, std::uint32_t width, std::uint32_t height) {
  const glm::dvec2 uv = toEquirectangular(d);
  const auto column = std::min(static_cast<std::uint32_t>(std::max(uv.x * width, 0.0)), width - 1);
  const auto row = std::min(static_cast<std::uint32_t>(uv.y * height), height - 1);
  return std::size_t{row} * width + column;
}

}  // namespace

std::vector<glm::vec3> projectEnvironment(std::span<const glm::vec3> skyDirection, std::span<const glm::vec3> texels,
                                          std::uint32_t width, std::uint32_t height) {
  if (width == 0 || height == 0 || texels.size() != std::size_t{width} * height || skyDirection.empty()) return {};
  std::vector<glm::dvec3> sum(skyDirection.size(), glm::dvec3(0.0));
  std::vector<double> weight(skyDirection.size(), 0.0);
  for (std::uint32_t row = 0; row < height; ++row) {
    // A row's texels cover equal solid angles: the difference of the cosines of its borders.
    const double solidAngle =
        std::cos(std::numbers::pi * row / height) - std::cos(std::numbers::pi * (row + 1) / height);
    for (std::uint32_t column = 0; column < width; ++column) {
      const glm::dvec2 uv((column + 0.5) / width, (row + 0.5) / height);
      const std::uint32_t patch = nearestPatch(skyDirection, fromEquirectangular(uv));
      sum[patch] += solidAngle * glm::dvec3(texels[std::size_t{row} * width + column]);
      weight[patch] += solidAngle;
    }
  }
  std::vector<glm::vec3> radiance(skyDirection.size());
  for (std::size_t p = 0; p < radiance.size(); ++p) {
    radiance[p] = weight[p] > 0.0 ? glm::vec3(sum[p] / weight[p]) : texels[texelAt(skyDirection[p], width, height)];
  }
  return radiance;
}

std::vector<glm::vec3> twoColorSky(std::span<const glm::vec3> skyDirection, const glm::vec3& overhead,
                                   const glm::vec3& underfoot) {
  std::vector<glm::vec3> radiance;
  radiance.reserve(skyDirection.size());
  for (const glm::vec3& d : skyDirection) radiance.push_back(glm::mix(underfoot, overhead, 0.5f + 0.5f * d.y));
  return radiance;
}

std::vector<glm::vec3> shSky(std::span<const glm::vec3> skyDirection, std::span<const glm::vec3> coefficients) {
  int bands = 1;
  while (bands <= kMaxBands && static_cast<std::size_t>(bands * bands) != coefficients.size()) ++bands;
  if (bands > kMaxBands) return {};
  std::vector<glm::vec3> radiance;
  radiance.reserve(skyDirection.size());
  for (const glm::vec3& d : skyDirection) {
    std::array<float, kMaxCoefficients> y;
    evaluateSh(bands, d, y);
    glm::vec3 sum(0.0f);
    for (std::size_t i = 0; i < coefficients.size(); ++i) sum += y[i] * coefficients[i];
    radiance.push_back(glm::max(sum, glm::vec3(0.0f)));
  }
  return radiance;
}

Result<int> relightUntilConverged(Relighter& relighter, const LightSetup& setup, float tolerance, int maxFrames) try {
  if (!(tolerance >= 0.0f)) return usageError("tolerance is " + decimal(tolerance) + ", expected 0 or more");
  if (maxFrames < 0) return usageError("maxFrames is " + std::to_string(maxFrames) + ", expected 0 or more");
  std::vector<float> last;
  for (int frame = 1; frame <= maxFrames; ++frame) {
    if (Status ok = relighter.relight(setup); !ok) return ok.error();
    std::vector<float> now = relighter.cacheCoefficients();
    double change = 0.0, total = 0.0;
    for (std::size_t i = 0; i < now.size(); ++i) {
      total += std::abs(now[i]);
      change += std::abs(now[i] - (last.empty() ? 0.0f : last[i]));
    }
    if (!last.empty() && change <= tolerance * total) return frame;
    last = std::move(now);
  }
  return maxFrames;
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

}  // namespace relume
