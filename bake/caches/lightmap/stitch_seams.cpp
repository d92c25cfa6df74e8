// SPDX-License-Identifier: MIT
// See stitch_seams.h. To first order, the light that the two sides of a seam read differs by the gradient of light
// times the distance between the positions that they read it from. With P_A, P_B the bilinear means of the caches'
// positions on the two sides of a seam point x, the cost is
//   sum over seam points  length (|P_A - P_B|² + kStray (|P_A - x|² + |P_B - x|²))
//   + sum over texels     share texelSize |p - p_0|²
// where p_0 is the position of the cache that the texel had. Texel after texel chooses the cache that costs least among
// those that the seam points around it read. Most of these texels are dilated: no surface of their own chart needs the
// cache that they had.
#include "bake/caches/lightmap/stitch_seams.h"

#include "bake/base/memory_budget.h"
#include "bake/base/parallel.h"
#include "formats/pack.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace relume {
namespace {

// Below this cosine an edge is a crease, where light may jump.
constexpr float kMinCosine = 0.8f;
constexpr double kStray = 0.25;
// Seam points per texel, and the most per edge.
constexpr float kPointsPerTexel = 2.0f;
constexpr int kMaxPoints = 64;
constexpr int kSweeps = 4;

// An edge that two triangles of different charts share. In each it goes from the given corner to the next; `turned` if
// the two run in opposite directions.
struct SeamEdge {
  std::array<std::uint32_t, 2> triangle;
  std::array<std::uint8_t, 2> corner;
  bool turned = false;
};

struct SeamPoint {
  std::array<std::uint32_t, 8> texel;  // four of side A, four of side B
  std::array<float, 8> weight;         // bilinear, those of B negative
  glm::vec3 position;                  // [m]
  float length;                        // [m] of edge it stands for
};

std::vector<std::uint32_t> weldByPosition(const Mesh& mesh) {
  std::vector<std::uint32_t> order(mesh.position.size()), id(mesh.position.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t v) {
    return std::tuple(mesh.position[v].x, mesh.position[v].y, mesh.position[v].z);
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  for (std::size_t i = 0; i < order.size(); ++i)
    id[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? id[order[i - 1]] : order[i];
  return id;
}

std::vector<SeamEdge> seamEdges(const Mesh& mesh, const MeshCharts& charts) {
  std::vector<std::uint32_t> chartOf(mesh.triangle.size(), kNone);
  for (std::uint32_t c = 0; c < charts.charts.size(); ++c) {
    for (const std::uint32_t t : charts.charts[c].triangle) chartOf[t] = c;
  }
  const std::vector<std::uint32_t> id = weldByPosition(mesh);
  struct Half {
    std::uint32_t low, high, triangle;
    std::uint8_t corner;
  };
  std::vector<Half> halves;
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    if (chartOf[t] == kNone) continue;
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint32_t a = id[mesh.triangle[t][k]], b = id[mesh.triangle[t][(k + 1) % 3]];
      if (a != b) halves.push_back({std::min(a, b), std::max(a, b), t, k});
    }
  }
  std::sort(halves.begin(), halves.end(), [](const Half& a, const Half& b) {
    return std::tie(a.low, a.high, a.triangle, a.corner) < std::tie(b.low, b.high, b.triangle, b.corner);
  });
  const auto normal = [&](std::uint32_t t) {
    const glm::uvec3& v = mesh.triangle[t];
    const glm::vec3 n = glm::cross(mesh.position[v.y] - mesh.position[v.x], mesh.position[v.z] - mesh.position[v.x]);
    const float length = glm::length(n);
    return length > 0.0f ? n / length : glm::vec3(0.0f);
  };
  std::vector<SeamEdge> edges;
  for (std::size_t begin = 0, end = 0; begin < halves.size(); begin = end) {
    while (end < halves.size() && halves[end].low == halves[begin].low && halves[end].high == halves[begin].high) ++end;
    if (end - begin != 2) continue;
    const Half &a = halves[begin], &b = halves[begin + 1];
    if (chartOf[a.triangle] == chartOf[b.triangle] || glm::dot(normal(a.triangle), normal(b.triangle)) < kMinCosine)
      continue;
    const bool turned = id[mesh.triangle[a.triangle][a.corner]] != id[mesh.triangle[b.triangle][b.corner]];
    edges.push_back({{a.triangle, b.triangle}, {a.corner, b.corner}, turned});
  }
  return edges;
}

// A sum of terms scale |w x + v|².
struct Quadratic {
  double square = 0.0, constant = 0.0;
  glm::dvec3 linear{0.0};
  void add(double scale, double w, const glm::dvec3& v) {
    square += scale * w * w;
    linear += 2.0 * scale * w * v;
    constant += scale * glm::dot(v, v);
  }
  double operator()(const glm::dvec3& x) const { return square * glm::dot(x, x) + glm::dot(linear, x) + constant; }
};

class Stitcher {
 public:
  Stitcher(const Scene& scene, const SharedCaches& shared, float texelSize, const SeamTexels& texels)
      : scene_(scene), shared_(shared), texelSize_(texelSize), texels_(texels) {}

  Result<SeamJump> run(const PatchSet& set, Context& context) {
    collect(set, context);
    if (!status_) return status_.error();
    if (!reserveIndex(context)) return status_.error();
    SeamJump jump;
    jump.before = rootMeanSquare();
    for (const SeamPoint& p : points_) jump.length += static_cast<double>(p.length);
    index();
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      bool changed = false;
      for (const std::uint32_t texel : touched_) changed = choose(texel) || changed;
      if (!changed) break;
    }
    jump.after = rootMeanSquare();
    return jump;
  }

 private:
  using Read = std::pair<std::uint32_t, std::uint32_t>;  // of a texel, by a point

  const glm::vec3& positionAt(std::uint32_t texel) const { return shared_.caches[texels_.cache[texel]].positionWorld; }

  // The four texels of a coordinate; weights of side B are negative. False where one of them is empty.
  bool addQuad(const glm::vec2& uv, float sign, std::size_t slot, SeamPoint& point) const {
    const glm::vec2 size(texels_.size);
    const glm::vec2 p = glm::clamp(uv * size - 0.5f, glm::vec2(0.0f), size - 1.0f);
    const glm::uvec2 base(p);
    const glm::vec2 f = p - glm::vec2(base);
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t x = std::min(base.x + (k & 1), texels_.size.x - 1),
                          y = std::min(base.y + (k >> 1), texels_.size.y - 1);
      const std::uint32_t texel = y * texels_.size.x + x;
      if (texels_.cache[texel] == kNoCache) return false;
      point.texel[slot + k] = texel;
      point.weight[slot + k] = sign * (k & 1 ? f.x : 1.0f - f.x) * (k & 2 ? f.y : 1.0f - f.y);
    }
    return true;
  }

  // Grow the array of points, if that much may be held.
  bool makeRoom(Context& context) {
    constexpr std::size_t kFirst = 1024;
    const std::size_t room = std::max(kFirst, 2 * points_.size());
    status_ = reserve(static_cast<double>(room * sizeof(SeamPoint)), context);
    if (status_) points_.reserve(room);
    return static_cast<bool>(status_);
  }

  Status reserve(double bytes, Context& context) const {
    return reserveMemory(context, "light map", bytes, std::to_string(points_.size()) + " and more points of its seams",
                         "lower --lightmap-caches, or mark small instances \"gridLit\" in extras.relume");
  }

  void addEdge(const Instance& instance, const LightmapPart& part, const MapCorners::Side& corners,
               const SeamEdge& edge, Context& context) {
    const Mesh& mesh = scene_.meshes[instance.mesh];
    std::array<std::array<glm::vec2, 2>, 2> uv;
    for (std::size_t s = 0; s < 2; ++s) {
      const TriangleCorners& corner = corners[part.firstCorner / 3 + edge.triangle[s]];
      const std::uint32_t a = corner[edge.corner[s]], b = corner[(edge.corner[s] + 1u) % 3u];
      if (a == kGridLit || b == kGridLit) return;
      const bool swap = s == 1 && edge.turned;
      uv[s] = {unpackUnorm16x2(swap ? b : a), unpackUnorm16x2(swap ? a : b)};
    }
    const glm::uvec3& v = mesh.triangle[edge.triangle[0]];
    const glm::vec3 a(instance.toWorld * glm::vec4(mesh.position[v[edge.corner[0]]], 1.0f));
    const glm::vec3 b(instance.toWorld * glm::vec4(mesh.position[v[(edge.corner[0] + 1) % 3]], 1.0f));
    const float length = glm::distance(a, b);
    const int count =
        std::clamp(static_cast<int>(std::min(kPointsPerTexel * length / texelSize_, 1e6f)), 1, kMaxPoints);
    for (int k = 0; k < count; ++k) {
      const float f = (static_cast<float>(k) + 0.5f) / static_cast<float>(count);
      SeamPoint point;
      point.position = glm::mix(a, b, f);
      point.length = length / static_cast<float>(count);
      if (!addQuad(glm::mix(uv[0][0], uv[0][1], f), 1.0f, 0, point) ||
          !addQuad(glm::mix(uv[1][0], uv[1][1], f), -1.0f, 4, point))
        continue;
      if (points_.size() == points_.capacity() && !makeRoom(context)) return;
      points_.push_back(point);
    }
  }

  void collect(const PatchSet& set, Context& context) {
    std::vector<std::uint8_t> fixed(scene_.meshes.size(), 0);
    for (const Instance& instance : scene_.instances) fixed[instance.mesh] |= instance.charted();
    std::vector<std::vector<SeamEdge>> edges(scene_.meshes.size());
    parallelChunks(context, "", edges.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t m = begin; m < end; ++m) {
        if (fixed[m]) edges[m] = seamEdges(scene_.meshes[m], set.meshes[m]);
      }
    });
    for (std::uint32_t i = 0; i < scene_.instances.size(); ++i) {
      const Instance& instance = scene_.instances[i];
      if (!instance.charted()) continue;
      for (const SeamEdge& edge : edges[instance.mesh]) {
        if (!status_) return;
        addEdge(instance, texels_.parts[i], texels_.corners.front, edge, context);
        if (status_) addEdge(instance, texels_.parts[i], texels_.corners.back, edge, context);
      }
    }
  }

  bool reserveIndex(Context& context) {
    reads_ = 0;
    for (const SeamPoint& point : points_)
      reads_ += static_cast<std::size_t>(
          std::count_if(point.weight.begin(), point.weight.end(), [](float w) { return w != 0.0f; }));
    status_ = reserve(static_cast<double>(reads_) * (sizeof(Read) + sizeof(std::uint32_t)), context);
    return static_cast<bool>(status_);
  }

  // Collect which points read each texel, how many texels hold each cache, and where each texel's light came from.
  void index() {
    users_.assign(shared_.caches.size(), 0);
    for (const std::uint32_t cache : texels_.cache) {
      if (cache != kNoCache) ++users_[cache];
    }
    std::vector<Read> reads;
    reads.reserve(reads_);
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
      for (std::size_t k = 0; k < 8; ++k) {
        if (points_[p].weight[k] != 0.0f) reads.emplace_back(points_[p].texel[k], p);
      }
    }
    std::sort(reads.begin(), reads.end());
    reads.erase(std::unique(reads.begin(), reads.end()), reads.end());
    read_.reserve(reads.size());
    for (const auto& [texel, point] : reads) {
      if (touched_.empty() || touched_.back() != texel) {
        touched_.push_back(texel);
        firstRead_.push_back(static_cast<std::uint32_t>(read_.size()));
        origin_.push_back(positionAt(texel));
      }
      read_.push_back(point);
    }
    firstRead_.push_back(static_cast<std::uint32_t>(read_.size()));
  }

  // The mean positions that the two sides of a point read.
  std::array<glm::vec3, 2> sidesOf(const SeamPoint& p) const {
    std::array<glm::vec3, 2> mean{glm::vec3(0.0f), glm::vec3(0.0f)};
    for (std::size_t k = 0; k < 8; ++k) mean[k / 4] += std::abs(p.weight[k]) * positionAt(p.texel[k]);
    return mean;
  }

  double rootMeanSquare() const {
    double sum = 0.0, length = 0.0;
    for (const SeamPoint& p : points_) {
      const auto [a, b] = sidesOf(p);
      sum += static_cast<double>(p.length * glm::dot(a - b, a - b));
      length += static_cast<double>(p.length);
    }
    return length > 0.0 ? std::sqrt(sum / length) / static_cast<double>(texelSize_) : 0.0;
  }

  // The cost of a touched texel's cache as a function of the cache's position. It is quadratic, because the points that
  // read it take means of positions.
  Quadratic costAround(std::size_t slot) const {
    const std::uint32_t texel = touched_[slot];
    const glm::dvec3 origin(origin_[slot]);
    Quadratic cost;
    cost.add(static_cast<double>(texels_.share[texel] * texelSize_), 1.0, -origin);
    for (std::uint32_t r = firstRead_[slot]; r < firstRead_[slot + 1]; ++r) {
      const SeamPoint& p = points_[read_[r]];
      std::array<glm::dvec3, 2> others{glm::dvec3(0.0),
                                       glm::dvec3(0.0)};  // the means of the two sides without this texel
      std::array<double, 2> own{0.0, 0.0};
      for (std::size_t k = 0; k < 8; ++k) {
        const double weight = std::abs(static_cast<double>(p.weight[k]));
        if (p.texel[k] == texel)
          own[k / 4] += weight;
        else
          others[k / 4] += weight * glm::dvec3(positionAt(p.texel[k]));
      }
      cost.add(static_cast<double>(p.length), own[0] - own[1], others[0] - others[1]);
      for (std::size_t s = 0; s < 2; ++s)
        cost.add(kStray * static_cast<double>(p.length), own[s], others[s] - glm::dvec3(p.position));
    }
    return cost;
  }

  // Whether the texel took another cache.
  bool choose(std::uint32_t texel) {
    const auto slot =
        static_cast<std::size_t>(std::lower_bound(touched_.begin(), touched_.end(), texel) - touched_.begin());
    std::uint32_t& held = texels_.cache[texel];
    if (users_[held] < 2) return false;
    std::vector<std::uint32_t> candidates;
    for (std::uint32_t r = firstRead_[slot]; r < firstRead_[slot + 1]; ++r) {
      for (const std::uint32_t t : points_[read_[r]].texel) candidates.push_back(texels_.cache[t]);
    }
    std::sort(candidates.begin(), candidates.end());
    candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
    const std::uint32_t before = held;
    const glm::vec3 normal = shared_.caches[before].normal;
    const Quadratic costAt = costAround(slot);
    std::uint32_t best = before;
    double minCost = 0.999 * costAt(shared_.caches[before].positionWorld);
    for (const std::uint32_t candidate : candidates) {
      if (candidate == before || glm::dot(shared_.caches[candidate].normal, normal) < kMinCosine) continue;
      if (const double cost = costAt(shared_.caches[candidate].positionWorld); cost < minCost) {
        minCost = cost;
        best = candidate;
      }
    }
    held = best;
    --users_[before];
    ++users_[best];
    return best != before;
  }

  const Scene& scene_;
  const SharedCaches& shared_;
  const float texelSize_;
  const SeamTexels& texels_;
  Status status_ = done();
  std::vector<SeamPoint> points_;
  std::size_t reads_ = 0;                        // of texels by points
  std::vector<std::uint32_t> users_;             // texels that hold a cache
  std::vector<std::uint32_t> touched_;           // texels that seam points read, ascending
  std::vector<std::uint32_t> firstRead_, read_;  // [Size touched + 1] points of each
  std::vector<glm::vec3> origin_;                // [m] [Size touched]
};

}  // namespace

Result<SeamJump> stitchSeams(const Scene& scene, const PatchSet& set, const SharedCaches& shared, float texelSize,
                             const SeamTexels& texels, Context& context) {
  return Stitcher(scene, shared, texelSize, texels).run(set, context);
}

}  // namespace relume
