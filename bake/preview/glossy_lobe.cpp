// SPDX-License-Identifier: MIT
// See glossy_lobe.h.
//
// Deviation: RCS tabulates over the cosine; near the normal coefficients change with the angle's sine, so that equal
// steps of the angle are closer there.
#include "bake/preview/glossy_lobe.h"

#include "bake/base/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

using std::numbers::pi;
constexpr std::size_t kLobeRows = 48, kLobeColumns = 48;  // nodes over the hemisphere, half of it in phi

struct Node {
  double x, z, weight;  // of the direction; y does not matter to an axis over +X
};

double exponentOf(std::size_t step) {
  return std::pow(static_cast<double>(kMaxRecordExponent),
                  static_cast<double>(step) / static_cast<double>(LobeTable::kExponents - 1));
}

double angleOf(std::size_t step) {
  return 0.5 * pi * static_cast<double>(step) / static_cast<double>(LobeTable::kAngles - 1);
}

// Where a value lies among `count` steps: the lower one, and the share of the next.
std::pair<std::size_t, float> stepOf(float value, std::size_t count) {
  const float at = std::clamp(value, 0.0f, 1.0f) * static_cast<float>(count - 1);
  const std::size_t low = std::min(static_cast<std::size_t>(at), count - 2);
  return {low, at - static_cast<float>(low)};
}

}  // namespace

LobeTable::LobeTable(int order, LobeKind kind, Context& context) : order_(order) {
  for (int l = 0; l < order; ++l) {
    for (int m = 0; m <= l; ++m) even_.push_back(l * l + l + m);
  }
  // 1. The functions at the nodes of a product rule
  std::vector<Node> nodes;
  std::vector<double> values, h(static_cast<std::size_t>(order * order));
  std::array<double, kLobeRows> u{}, uWeight{};
  gaussLegendre(0.0, 0.5 * pi, u, uWeight);
  for (std::size_t row = 0; row < kLobeRows; ++row) {
    const double z = std::sin(u[row]) * std::sin(u[row]), r = std::sqrt(1.0 - z * z);
    for (std::size_t column = 0; column < kLobeColumns; ++column) {
      const double phi = pi * (static_cast<double>(column) + 0.5) / kLobeColumns;
      nodes.push_back({r * std::cos(phi), z, uWeight[row] * std::sin(2.0 * u[row]) * 2.0 * pi / kLobeColumns});
      evaluateHsh(order, {r * std::cos(phi), r * std::sin(phi), z}, h);
      for (const int i : even_) values.push_back(h[static_cast<std::size_t>(i)]);
    }
  }

  // 2. Each lobe times each of them
  const std::size_t count = even_.size();
  coefficients_.assign(kExponents * kAngles * count, 0.0f);
  integral_.assign(kExponents * kAngles, 0.0f);
  parallelChunks(context, "", kAngles, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<double> sums(count);
    for (std::size_t angle = begin; angle < end; ++angle) {
      const double sine = std::sin(angleOf(angle)), cosine = std::cos(angleOf(angle));
      for (std::size_t step = 0; step < kExponents; ++step) {
        const double exponent = exponentOf(step);
        double total = 0.0;
        std::fill(sums.begin(), sums.end(), 0.0);
        for (std::size_t k = 0; k < nodes.size(); ++k) {
          const double toward = sine * nodes[k].x + cosine * nodes[k].z;
          if (toward <= 0.0) continue;
          double share = nodes[k].weight * std::pow(toward, exponent);
          total += share;
          if (kind == LobeKind::phong) share *= nodes[k].z * (exponent + 2.0) / (2.0 * pi);
          for (std::size_t i = 0; i < count; ++i) sums[i] += share * values[k * count + i];
        }
        const std::size_t entry = step * kAngles + angle;
        const double scale = kind == LobeKind::mean ? 1.0 / total : 1.0;
        for (std::size_t i = 0; i < count; ++i) coefficients_[entry * count + i] = static_cast<float>(scale * sums[i]);
        integral_[entry] = static_cast<float>(total);
      }
    }
  });
}

LobeTable::Place LobeTable::placeOf(float exponent, float cosine) const {
  const float ratio = exponent > 1.0f ? std::log(exponent) / std::log(kMaxRecordExponent) : 0.0f;
  const auto [e, next] = stepOf(ratio, kExponents);
  const auto [a, beyond] =
      stepOf(std::acos(std::clamp(cosine, 0.0f, 1.0f)) / (0.5f * std::numbers::pi_v<float>), kAngles);
  const std::size_t first = e * kAngles + a;
  return {{first, first + 1, first + kAngles, first + kAngles + 1},
          {(1.0f - next) * (1.0f - beyond), (1.0f - next) * beyond, next * (1.0f - beyond), next * beyond}};
}

void LobeTable::evaluate(float exponent, const glm::vec3& axis, std::span<float> c) const {
  const Place place = placeOf(exponent, axis.z);
  const std::size_t count = even_.size();
  std::fill_n(c.begin(), order_ * order_, 0.0f);
  for (int k = 0; k < 4; ++k) {
    const float* entry = &coefficients_[place.entry[k] * count];
    for (std::size_t i = 0; i < count; ++i) c[static_cast<std::size_t>(even_[i])] += place.share[k] * entry[i];
  }
  // +X of the surface lies at minus the axis' angle from where the lobe is.
  const float across = std::sqrt(axis.x * axis.x + axis.y * axis.y);
  if (across > 0.0f) turnHsh(order_, axis.x / across, -axis.y / across, c);
}

float LobeTable::integral(float exponent, float cosine) const {
  const Place place = placeOf(exponent, cosine);
  float sum = 0.0f;
  for (int k = 0; k < 4; ++k) sum += place.share[k] * integral_[place.entry[k]];
  return sum;
}

}  // namespace relume
