// SPDX-License-Identifier: MIT
// The distance between clusters (PIC 4.3, and a term of ours):
//   d(a, b) = |x_a - x_b|² / extent² + C_n (1 - <m_a, m_b>) + C_b |A_a - A_b| / max(A_a, A_b)
//             + C_o |o_a - o_b|² / extent².
// Unit normals make it a squared distance in nine dimensions, which boxes bound: 1 - <n, m> = |n - m|² / 2, so with
//   p = (x / extent, sqrt(C_n / 2) m, sqrt(C_o) o / extent):
//   d(a, b) = |p_a - p_b|² + C_b (1 - min(A_a / A_b, A_b / A_a)).
// Area is counted in leaves, which are all of one size.
//
// Deviation: o, the visible centroid, is the middle of what a surfel sees (visible_centroid.h). PIC's metric merges
// surfels which cannot see each other, and light bleeds (PIC Fig. 9c); surfels on two sides of a wall have their
// visible centroids on two sides too.
#pragma once

#include "relume/bake/options.h"
#include "relume/result.h"
#include "relume/surfels.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

namespace relume {

// Scales a cluster's center and normal into the metric's space.
struct ClusterMetric {
  glm::vec3 origin{0.0f};      // [m] middle of the bounds
  float inverseExtent = 0.0f;  // [1/m] 1 / diagonal of the bounds
  float normalScale = 0.0f;    // sqrt(C_n / 2)
  float centroidScale = 0.0f;  // sqrt(C_o)
  float balanceWeight = 0.0f;  // C_b
};

inline constexpr int kClusterDimensions = 9;

// A cluster as the metric sees it.
struct ClusterPoint {
  // center / extent, sqrt(C_n / 2) * unit normal, sqrt(C_o) * visible centroid / extent
  std::array<float, kClusterDimensions> p{};
  float area = 1.0f;         // [leaves]
  float inverseArea = 1.0f;  // 1 / area
};

// The summed leaves of a cluster.
struct alignas(64) ClusterSum {
  glm::vec3 center{0.0f};     // mean of the leaves, in units of the extent around the origin
  glm::vec3 normalSum{0.0f};  // sum of the leaves' unit normals
  glm::vec3 normal{0.0f};     // unit; a child's where the leaves' normals cancel
  std::uint32_t leaves = 1;
  glm::vec3 visibleCentroid{0.0f};  // mean of the leaves, in units of the extent around the origin
};

// Center and visible centroid: area-weighted mean; normal: direction of the area-weighted sum.
inline ClusterSum mergeClusters(const ClusterSum& a, const ClusterSum& b) {
  ClusterSum c;
  c.leaves = a.leaves + b.leaves;
  const float share = static_cast<float>(a.leaves) / static_cast<float>(c.leaves);
  c.center = b.center + share * (a.center - b.center);
  c.visibleCentroid = b.visibleCentroid + share * (a.visibleCentroid - b.visibleCentroid);
  c.normalSum = a.normalSum + b.normalSum;
  const float length = glm::length(c.normalSum);
  const bool cancelled = !(length > 1e-5f * static_cast<float>(c.leaves));
  c.normal = cancelled ? (a.leaves >= b.leaves ? a.normal : b.normal) : c.normalSum / length;
  return c;
}

inline ClusterPoint clusterPoint(const ClusterSum& sum, const ClusterMetric& metric) {
  const glm::vec3 m = metric.normalScale * sum.normal;
  const glm::vec3 o = metric.centroidScale * sum.visibleCentroid;
  const float area = static_cast<float>(sum.leaves);
  return {{sum.center.x, sum.center.y, sum.center.z, m.x, m.y, m.z, o.x, o.y, o.z}, area, 1.0f / area};
}

// The metric. Symmetric to the last bit.
inline float clusterDistance(const ClusterPoint& a, const ClusterPoint& b, float balanceWeight) {
  float d = 0.0f;
  for (int k = 0; k < kClusterDimensions; ++k) d += (a.p[k] - b.p[k]) * (a.p[k] - b.p[k]);
  return d + balanceWeight * (1.0f - std::min(1.0f, std::min(a.area * b.inverseArea, b.area * a.inverseArea)));
}

// usage: weights out of range; failed: no members, or one that is no surfel.
Status checkClusterInput(const Surfels& surfels, std::span<const std::uint32_t> members,
                         const ClusteringOptions& options);
// For clusters of these surfels.
ClusterMetric metricOf(const Surfels& surfels, const ClusteringOptions& options);
// A surfel as a cluster. centroids: of all surfels, or empty.
ClusterSum leafOf(const Surfels& surfels, std::uint32_t surfel, std::span<const glm::vec3> centroids,
                  const ClusterMetric& metric);

}  // namespace relume
