// SPDX-License-Identifier: MIT
// See shape_links.h.
#include "formats/shape_links.h"

#include "formats/compact_links.h"
#include "formats/sh.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace relume {
namespace {

constexpr int kCones = 16, kMost = 31;
// Share of a debt that is handed on: old ones belong to links far away.
constexpr float kHandedOn = 0.9f;
// How many steps of the octahedral grid around a link's own direction are tried.
constexpr int kReach = 1;
// Band 1 alone decides the irradiance of a light map.
constexpr std::array<float, 4> kBandWeight = {0.0f, 3.0f, 1.0f, 0.5f};

// What every shape stands for, for f = 1.
struct Shapes {
  struct alignas(64) Row {
    std::array<float, LinkShaper::kCoefficients> c{};
  };
  std::vector<Row> direction = std::vector<Row>(4096);       // coefficients of a single direction
  std::array<std::array<float, kCones>, 4> ratio{};          // of each band and cone
  std::array<float, kCones> square{};                        // of a cone's coefficients, weighed

  Shapes() {
    for (std::uint32_t code = 0; code < 4096; ++code) {
      std::array<float, LinkShaper::kCoefficients>& y = direction[code].c;
      evaluateSh(LinkShaper::kBands, unpackShape6(code).direction, y);
      const float y0 = y[0];
      for (float& each : y) each /= y0;
    }
    for (std::uint32_t cone = 0; cone < kCones; ++cone) {
      std::array<float, LinkShaper::kBands> r;
      coneBandRatios(LinkShaper::kBands, unpackShape6(cone << 12).cosAlpha, r);
      for (std::size_t l = 0; l < r.size(); ++l) {
        ratio[l][cone] = r[l];
        // The squares of a band add up to 2 l + 1, whatever the direction.
        square[cone] += kBandWeight[l] * r[l] * r[l] * static_cast<float>(2 * l + 1);
      }
    }
  }
};

const Shapes& shapes() {
  static const Shapes kShapes;
  return kShapes;
}

// Steps of the octahedral grid of a direction's nearest code.
std::array<int, 2> gridOf(std::uint32_t code) {
  return {static_cast<std::int32_t>(code << 26) >> 26, static_cast<std::int32_t>(code << 20) >> 26};
}

}  // namespace

std::uint32_t LinkShaper::choose(std::span<const float> c, float f) {
  const Shapes& table = shapes();
  std::array<float, kCoefficients> wanted;
  for (std::size_t i = 0; i < kCoefficients; ++i) wanted[i] = c[i] + owed_[i];

  // Of |wanted - f shape|², weighed by bands, the part that depends on the shape:
  // f² square(cone) - 2 f sum_l ratio_l(cone) (wanted . y)_l.
  const glm::vec3 mean(c[3], c[1], c[2]);
  const float length = glm::length(mean);
  const auto [u0, v0] = gridOf(packShape6({length > 0.0f ? mean / length : glm::vec3(0, 0, 1), 1.0f}));
  std::uint32_t best = 0;
  float bestCost = INFINITY;
  for (int v = std::max(v0 - kReach, -kMost); v <= std::min(v0 + kReach, kMost); ++v) {
    for (int u = std::max(u0 - kReach, -kMost); u <= std::min(u0 + kReach, kMost); ++u) {
      const std::uint32_t code = (static_cast<std::uint32_t>(u) & 63u) | (static_cast<std::uint32_t>(v) & 63u) << 6;
      const std::array<float, kCoefficients>& y = table.direction[code].c;
      std::array<float, 4> along{};
      for (std::size_t i = 1; i < 4; ++i) along[1] += wanted[i] * y[i];
      for (std::size_t i = 4; i < 9; ++i) along[2] += wanted[i] * y[i];
      for (std::size_t i = 9; i < 16; ++i) along[3] += wanted[i] * y[i];
      for (std::size_t l = 1; l < 4; ++l) along[l] *= 2.0f * kBandWeight[l];
      std::array<float, kCones> cost;
      for (std::size_t cone = 0; cone < kCones; ++cone) {
        cost[cone] = f * table.square[cone] - along[1] * table.ratio[1][cone] - along[2] * table.ratio[2][cone] -
                     along[3] * table.ratio[3][cone];
      }
      const auto least = std::min_element(cost.begin(), cost.end());
      if (*least < bestCost) {
        bestCost = *least;
        best = code | static_cast<std::uint32_t>(least - cost.begin()) << 12;
      }
    }
  }

  const std::array<float, kCoefficients>& y = table.direction[best & 0xFFFu].c;
  for (std::size_t l = 1; l < 4; ++l) {
    const float scale = f * table.ratio[l][best >> 12];
    for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i) owed_[i] = kHandedOn * (wanted[i] - scale * y[i]);
  }
  return best;
}

}  // namespace relume
