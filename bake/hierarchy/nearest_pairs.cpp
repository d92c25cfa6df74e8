// SPDX-License-Identifier: MIT
// See nearest_pairs.h. A cluster keeps its nearest neighbour until that is merged, and looks for another only when it
// comes up as the nearest pair. What was merged may be nearer than the neighbour was, as the metric is not reducible
// (ERRATA of PIC 4.3); but then it has found that itself, so that no pair is missed.
#include "bake/hierarchy/nearest_pairs.h"

#include "bake/base/wide_clones.h"

#include <algorithm>
#include <limits>

namespace relume {
namespace {

// The metric from one point to each of `count`, summed as clusterDistance() does.
RELUME_WIDE_CLONES
void distancesFrom(const ClusterPoint& from, std::size_t count, const std::array<const float*, kClusterDimensions>& to,
                   const float* area, const float* inverseArea, float balanceWeight, float* distance) {
  const float* const* p = to.data();
  const float *p0 = p[0], *p1 = p[1], *p2 = p[2], *p3 = p[3], *p4 = p[4], *p5 = p[5], *p6 = p[6], *p7 = p[7],
              *p8 = p[8];
  const ClusterPoint q = from;
  static_assert(kClusterDimensions == 9);
  for (std::size_t i = 0; i < count; ++i) {
    float d = (q.p[0] - p0[i]) * (q.p[0] - p0[i]);
    d += (q.p[1] - p1[i]) * (q.p[1] - p1[i]);
    d += (q.p[2] - p2[i]) * (q.p[2] - p2[i]);
    d += (q.p[3] - p3[i]) * (q.p[3] - p3[i]);
    d += (q.p[4] - p4[i]) * (q.p[4] - p4[i]);
    d += (q.p[5] - p5[i]) * (q.p[5] - p5[i]);
    d += (q.p[6] - p6[i]) * (q.p[6] - p6[i]);
    d += (q.p[7] - p7[i]) * (q.p[7] - p7[i]);
    d += (q.p[8] - p8[i]) * (q.p[8] - p8[i]);
    const float up = q.area * inverseArea[i], down = area[i] * q.inverseArea;
    const float ratio = up < down ? up : down;
    distance[i] = d + balanceWeight * (1.0f - (ratio < 1.0f ? ratio : 1.0f));
  }
}

}  // namespace

void NearestPairs::begin(std::span<const std::uint32_t> clusters, std::span<const ClusterSum> sums,
                         const ClusterMetric& metric) {
  count_ = clusters.size();
  balanceWeight_ = metric.balanceWeight;
  if (area_.size() < count_) {
    for (std::vector<float>& p : p_) p.resize(count_);
    for (std::vector<float>* values : {&area_, &inverseArea_, &distance_, &toEach_}) values->resize(count_);
    nearest_.resize(count_);
  }
  for (std::size_t i = 0; i < count_; ++i) set(i, clusterPoint(sums[clusters[i]], metric));
  for (std::size_t i = 0; i < count_; ++i) findNearest(i);
}

std::pair<std::size_t, std::size_t> NearestPairs::nearestPair() {
  for (;;) {
    const auto end = distance_.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto at = static_cast<std::size_t>(std::min_element(distance_.begin(), end) - distance_.begin());
    if (nearest_[at] != kGone) return std::minmax(at, std::size_t{nearest_[at]});
    findNearest(at);
  }
}

void NearestPairs::replace(std::size_t a, std::size_t b, const ClusterPoint& point) {
  const std::size_t last = --count_;
  for (std::vector<float>& p : p_) p[b] = p[last];
  for (std::vector<float>* values : {&area_, &inverseArea_, &distance_}) (*values)[b] = (*values)[last];
  nearest_[b] = nearest_[last];
  set(a, point);
  for (std::size_t i = 0; i < count_; ++i) {
    if (nearest_[i] == a || nearest_[i] == b) {
      nearest_[i] = kGone;
    } else if (nearest_[i] == last) {
      nearest_[i] = static_cast<std::uint32_t>(b);
    }
  }
  if (count_ > 1) findNearest(a);
}

void NearestPairs::set(std::size_t at, const ClusterPoint& point) {
  for (std::size_t k = 0; k < p_.size(); ++k) p_[k][at] = point.p[k];
  area_[at] = point.area;
  inverseArea_[at] = point.inverseArea;
}

// Among others as near, the next one after it in the circle of all: coincident clusters pair off.
void NearestPairs::findNearest(std::size_t at) {
  ClusterPoint from;
  std::array<const float*, kClusterDimensions> to;
  for (std::size_t k = 0; k < p_.size(); ++k) {
    from.p[k] = p_[k][at];
    to[k] = p_[k].data();
  }
  from.area = area_[at];
  from.inverseArea = inverseArea_[at];
  distancesFrom(from, count_, to, area_.data(), inverseArea_.data(), balanceWeight_, toEach_.data());
  toEach_[at] = std::numeric_limits<float>::infinity();
  const auto begin = toEach_.begin(), own = begin + static_cast<std::ptrdiff_t>(at);
  const auto before = std::min_element(begin, own + 1);
  const auto after = std::min_element(own, begin + static_cast<std::ptrdiff_t>(count_));
  const auto nearest = *before < *after ? before : after;
  distance_[at] = *nearest;
  nearest_[at] = static_cast<std::uint32_t>(nearest - begin);
}

}  // namespace relume
