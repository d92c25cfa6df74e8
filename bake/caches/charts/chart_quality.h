// SPDX-License-Identifier: MIT
// How much charts stretch what they flatten. Charts are in metres of the surface: a texel should stand for as much of
// it everywhere, and be square there.
#pragma once

#include "bake/caches/caches.h"

#include <array>
#include <span>

namespace relume {

// Sums over triangles, each weighted by its area on the surface. s1 >= s2: the singular values of the map from chart to
// surface; 1 = a metre stays a metre.
struct ChartQuality {
  double surface = 0.0;     // [m²]
  double squares = 0.0;     // (s1² + s2²) / 2: L2 stretch (Sander et al. 2001)
  double anisotropy = 0.0;  // s1 / s2, at most kMaxAnisotropy: quasi-conformal error
  double areaRatio = 0.0;   // max(s1 s2, 1 / (s1 s2))
  double folded = 0.0;      // 1 for triangles turned over or without area in the chart, which are in no other sum
  std::array<double, 256> stretch{};  // histogram of s1, 16 bins an octave from 1/256 on

  void add(const ChartQuality& other);
  double stretchRms() const;      // >= 1 for charts that keep area
  double stretchP99() const;      // L-infinity stretch, but for the worst 1 % of the area
  double anisotropyMean() const;  // >= 1
  double areaRatioMean() const;   // >= 1
};

inline constexpr double kMaxAnisotropy = 100.0;

// scale [m per object unit]: what the charts were made for.
ChartQuality measureCharts(const Mesh& mesh, std::span<const Chart> charts, float scale);

}  // namespace relume
