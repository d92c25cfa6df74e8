// SPDX-License-Identifier: MIT
// See shape_links.h.
#include "formats/shape_links.h"

#include "formats/compact_links.h"
#include "formats/octahedron.h"
#include "formats/sh.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace relume {
namespace {

constexpr int kCones = 16, kMax = 31;
// Share of the error that is diffused to the next link: old errors belong to links far away.
constexpr float kDiffused = 0.9f;
// How many steps of the octahedral grid around a link's own direction are tried.
constexpr int kReach = 1;
// Band 1 alone decides the irradiance of a light map.
constexpr std::array<float, 4> kBandWeight = {0.0f, 3.0f, 1.0f, 0.5f};

constexpr std::array<std::size_t, LinkShaper::kBands + 1> kFirstFour = {0, 0, 1, 3, 5};  // of a band, when padded

}  // namespace

// What every shape stands for, for f = 1.
struct LinkShaper::Shapes {
  static float sum(const Four& a) { return (a[0] + a[1]) + (a[2] + a[3]); }
  static Four lesser(const Four& a, const Four& b) { return a < b ? a : b; }
  static float min(const std::array<Four, kCones / 4>& a) {
    const Four b = lesser(lesser(a[0], a[1]), lesser(a[2], a[3]));
    return std::min(std::min(b[0], b[1]), std::min(b[2], b[3]));
  }

  std::vector<Padded> direction = std::vector<Padded>(4096);  // coefficients of a single direction
  std::array<std::array<Four, kCones / 4>, kBands> ratio{};   // of each band and cone
  std::array<Four, kCones / 4> square{};                      // of a cone's coefficients, weighed

  Shapes() {
    for (std::uint32_t code = 0; code < 4096; ++code) {
      std::array<float, kCoefficients> y;
      evaluateSh(kBands, unpackShape6(code).direction, y);
      const float y0 = y[0];
      for (float& each : y) each /= y0;
      direction[code] = pad(y);
    }
    for (std::uint32_t cone = 0; cone < kCones; ++cone) {
      std::array<float, kBands> r;
      coneBandRatios(kBands, unpackShape6(cone << 12).cosAlpha, r);
      for (std::size_t l = 0; l < r.size(); ++l) {
        ratio[l][cone / 4][cone % 4] = r[l];
        // The squares of a band add up to 2 l + 1, whatever the direction.
        square[cone / 4][cone % 4] += kBandWeight[l] * r[l] * r[l] * static_cast<float>(2 * l + 1);
      }
    }
  }
};

const LinkShaper::Shapes& LinkShaper::shapes() {
  static const Shapes kShapes;
  return kShapes;
}

LinkShaper::Padded LinkShaper::pad(std::span<const float> c) {
  Padded padded{};
  for (std::size_t l = 1; l < kBands; ++l) {
    for (std::size_t i = 0; i < 2 * l + 1; ++i) padded[kFirstFour[l] + i / 4][i % 4] = c[l * l + i];
  }
  return padded;
}

std::uint32_t LinkShaper::choose(std::span<const float> c, float f) {
  const Shapes& table = shapes();
  Padded wanted = pad(c);
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = wanted[i] + error_[i];

  // Of |wanted - f shape|², weighed by bands, the part that depends on the shape:
  // f² square(cone) - 2 f sum_l ratio_l(cone) (wanted . y)_l.
  const glm::vec2 centre = toOctahedron(glm::vec3(c[3], c[1], c[2])) * static_cast<float>(kMax);
  const int u0 = static_cast<int>(std::lrint(centre.x)), v0 = static_cast<int>(std::lrint(centre.y));
  const auto costsOf = [&](std::uint32_t direction) {
    const Padded& y = table.direction[direction];
    const float along1 = 2.0f * kBandWeight[1] * Shapes::sum(wanted[0] * y[0]),
                along2 = 2.0f * kBandWeight[2] * Shapes::sum(wanted[1] * y[1] + wanted[2] * y[2]),
                along3 = 2.0f * kBandWeight[3] * Shapes::sum(wanted[3] * y[3] + wanted[4] * y[4]);
    std::array<Four, kCones / 4> costs;
    for (std::size_t k = 0; k < costs.size(); ++k) {
      costs[k] =
          f * table.square[k] - along1 * table.ratio[1][k] - along2 * table.ratio[2][k] - along3 * table.ratio[3][k];
    }
    return costs;
  };
  // The direction first, without unpredictable branches.
  std::uint32_t direction = 0;
  float bestCost = INFINITY;
  for (int v = std::max(v0 - kReach, -kMax); v <= std::min(v0 + kReach, kMax); ++v) {
    for (int u = std::max(u0 - kReach, -kMax); u <= std::min(u0 + kReach, kMax); ++u) {
      const std::uint32_t code = (static_cast<std::uint32_t>(u) & 63u) | (static_cast<std::uint32_t>(v) & 63u) << 6;
      const float cost = Shapes::min(costsOf(code));
      direction = cost < bestCost ? code : direction;
      bestCost = std::min(cost, bestCost);
    }
  }
  const std::array<Four, kCones / 4> costs = costsOf(direction);
  std::uint32_t cone = 0;
  while (cone + 1 < kCones && costs[cone / 4][cone % 4] != bestCost) ++cone;

  const Padded& y = table.direction[direction];
  for (std::size_t l = 1; l < kBands; ++l) {
    const float scale = f * table.ratio[l][cone / 4][cone % 4];
    for (std::size_t i = kFirstFour[l]; i < kFirstFour[l + 1]; ++i) error_[i] = kDiffused * (wanted[i] - scale * y[i]);
  }
  return direction | cone << 12;
}

}  // namespace relume
