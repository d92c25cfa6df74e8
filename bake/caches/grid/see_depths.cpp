// SPDX-License-Identifier: MIT
// See see_depths.h. Rays in evenly spread directions meet the first surface at t_i (formats/grid_depth.h). The values x
// at the map's nodes are those whose interpolation A x is nearest to t in the least-squares sense. That is exact for a
// wall, and the best ramp between a pillar and what lies behind it. All caches use the same directions, so that (A^T
// A)^-1 A^T is computed once.
#include "bake/caches/grid/see_depths.h"

#include "bake/base/morton.h"
#include "bake/base/parallel.h"
#include "bake/rays/bundle/ray_bundle.h"
#include "formats/grid_depth.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr std::size_t kDepthRays = 2048;
constexpr int kNodes = kDepthSide * kDepthSide;
// Largest t, for surfaces that touch the cache: a byte cannot tell larger ones apart.
constexpr float kMaxT = 254.0f;

// A node of the border stands for the same direction as its mirror image. The lower of the two represents both.
int uniqueNode(int node) {
  const int last = kDepthSide - 1;
  int x = node % kDepthSide, y = node / kDepthSide;
  if (x == 0 || x == last) y = std::min(y, last - y);
  if (y == 0 || y == last) x = std::min(x, last - x);
  return y * kDepthSide + x;
}

// A direction, and the nodes of the map that it reads.
struct DepthSample {
  glm::vec3 unit;
  float l1 = 1.0f;
  std::array<int, 3> unknown;
  std::array<float, 3> weight;
};

// The normal equations of the fit, inverted.
class Fit {
 public:
  Fit() {
    std::array<int, kNodes> index;
    index.fill(-1);
    for (int node = 0; node < kNodes; ++node) {
      int& unknown = index[static_cast<std::size_t>(uniqueNode(node))];
      if (unknown < 0) unknown = static_cast<int>(unknowns_++);
      unknownOf_[static_cast<std::size_t>(node)] = unknown;
    }
    const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
    for (std::size_t i = 0; i < kDepthRays; ++i) {
      const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / kDepthRays, r = std::sqrt(1.0 - z * z);
      DepthSample d;
      d.unit =
          glm::vec3(r * std::cos(golden * static_cast<double>(i)), r * std::sin(golden * static_cast<double>(i)), z);
      d.l1 = std::abs(d.unit.x) + std::abs(d.unit.y) + std::abs(d.unit.z);
      const DepthNodes nodes = depthNodesAround(d.unit, d.l1);
      for (std::size_t k = 0; k < 3; ++k) d.unknown[k] = unknownOf_[static_cast<std::size_t>(nodes.node[k])];
      d.weight = nodes.weight;
      sample_.push_back(d);
    }
    // Order the samples so that neighbours follow each other: rays that are traced together then stay together.
    std::sort(sample_.begin(), sample_.end(), [](const DepthSample& a, const DepthSample& b) {
      return mortonOf(1024.0f * (a.unit + 1.0f)) < mortonOf(1024.0f * (b.unit + 1.0f));
    });
    for (const DepthSample& sample : sample_) direction_.push_back(sample.unit);
    invert();
  }

  std::span<const DepthSample> samples() const { return sample_; }
  std::span<const glm::vec3> directions() const { return direction_; }  // of the samples
  std::size_t unknowns() const { return unknowns_; }

  // Words of the map from sum_i weight_i t_i of each unknown.
  void solve(std::span<const double> right, std::uint32_t* map) const {
    std::array<double, kNodes> t{};
    for (std::size_t k = 0; k < unknowns_; ++k) {
      const double* row = inverse_.data() + k * unknowns_;  // and column
      for (std::size_t u = 0; u < unknowns_; ++u) t[u] += row[u] * right[k];
    }
    std::array<std::uint32_t, kNodes> byte{};
    for (std::size_t u = 0; u < unknowns_; ++u) {
      byte[u] = packDepth(std::clamp(static_cast<float>(t[u]), 0.0f, kMaxT));
    }
    for (int node = 0; node < kNodes; ++node) {
      map[node / 4] |= byte[static_cast<std::size_t>(unknownOf_[static_cast<std::size_t>(node)])] << (8 * (node % 4));
    }
  }

 private:
  // Gauss-Jordan; the matrix is symmetric and positive definite.
  void invert() {
    const std::size_t n = unknowns_;
    std::vector<double> a(n * n, 0.0);
    inverse_.assign(n * n, 0.0);
    for (const DepthSample& d : sample_) {
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          a[static_cast<std::size_t>(d.unknown[i]) * n + static_cast<std::size_t>(d.unknown[k])] +=
              static_cast<double>(d.weight[i]) * static_cast<double>(d.weight[k]);
        }
      }
    }
    for (std::size_t i = 0; i < n; ++i) inverse_[i * n + i] = 1.0;
    for (std::size_t i = 0; i < n; ++i) {
      const double pivot = 1.0 / a[i * n + i];
      for (std::size_t k = 0; k < n; ++k) {
        a[i * n + k] *= pivot;
        inverse_[i * n + k] *= pivot;
      }
      for (std::size_t row = 0; row < n; ++row) {
        const double factor = a[row * n + i];
        if (row == i || factor == 0.0) continue;
        for (std::size_t k = 0; k < n; ++k) {
          a[row * n + k] -= factor * a[i * n + k];
          inverse_[row * n + k] -= factor * inverse_[i * n + k];
        }
      }
    }
  }

  std::size_t unknowns_ = 0;
  std::array<int, kNodes> unknownOf_{};
  std::vector<DepthSample> sample_;
  std::vector<glm::vec3> direction_;
  std::vector<double> inverse_;
};

}  // namespace

std::vector<std::uint32_t> seeDepths(const RayTracer& tracer, std::span<const glm::vec3> positionWorld, float unit,
                                     Context& context) {
  std::vector<std::uint32_t> maps(kDepthWords * positionWorld.size(), 0);
  if (positionWorld.empty()) return maps;
  const Fit fit;
  parallelChunks(context, "grid depths", positionWorld.size(), 8, [&](std::size_t begin, std::size_t end) {
    RayBundle bundle;
    std::vector<Hit> hits(kDepthRays);
    std::vector<double> right(fit.unknowns());
    for (std::size_t i = begin; i < end; ++i) {
      bundle.trace(tracer, positionWorld[i], glm::vec3(0.0f), fit.directions(), hits);
      std::fill(right.begin(), right.end(), 0.0);
      for (std::size_t k = 0; k < kDepthRays; ++k) {
        if (!hits[k]) continue;
        const DepthSample& d = fit.samples()[k];
        const double t = std::min(unit / std::max(hits[k].distance * d.l1, 1e-20f), kMaxT);
        for (std::size_t c = 0; c < 3; ++c)
          right[static_cast<std::size_t>(d.unknown[c])] += static_cast<double>(d.weight[c]) * t;
      }
      fit.solve(right, maps.data() + kDepthWords * i);
    }
  });
  return maps;
}

}  // namespace relume
