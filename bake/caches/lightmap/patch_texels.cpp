// SPDX-License-Identifier: MIT
// See patch_texels.h.
#include "bake/caches/lightmap/patch_texels.h"

#include "bake/base/parallel.h"
#include "bake/caches/charts/triangle_area.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume {
namespace {

// Samples per texel along each axis.
constexpr int kSamples = 4;
// Spots that are kept for a texel's cache.
constexpr std::size_t kMaxPoints = 8;
// Share of the way that a cache moves from the texel's centre toward the middle of the texel's surface: a cache in the
// corner of a room would see little but the corner.
constexpr float kInset = 0.8f;
constexpr std::uint32_t kMaxPatchTexels = 8192;
// A triangle with more sample points than this is looked through in blocks, of which unseen ones are skipped.
constexpr std::int64_t kManyPoints = 1 << 16;
constexpr int kBlock = 64;

// Texels along an axis of `length` texels: one if it is shorter than a texel, otherwise enough to span it.
std::uint32_t texelsAlong(float length) {
  if (!(length >= 1.0f)) return 1;
  return std::min(static_cast<std::uint32_t>(std::min(length, 1e6f)) + 1, kMaxPatchTexels);
}

// Barycentric weights of corners 1 and 2 at p. False outside the triangle, and for a triangle without area.
bool barycentricAt(const std::array<glm::vec2, 3>& t, const glm::vec2& p, float slack, glm::vec2& weights) {
  const float twice = cross2(t[1] - t[0], t[2] - t[0]);
  if (twice == 0.0f) return false;
  weights = {cross2(p - t[0], t[2] - t[0]) / twice, cross2(t[1] - t[0], p - t[0]) / twice};
  return weights.x >= -slack && weights.y >= -slack && weights.x + weights.y <= 1.0f + slack;
}

glm::vec2 clampInside(glm::vec2 w) {
  w = glm::max(w, glm::vec2(0.0f));
  const float sum = w.x + w.y;
  return sum > 1.0f ? w / sum : w;
}

struct ChartSample {
  glm::vec2 uv;
  std::uint32_t slot;  // triangle of the chart
  glm::vec2 barycentric;
  std::uint32_t texel;
  float area;  // [chart m²]
};

// Takes samples of one patch: at a lattice over the chart's rectangle, and in the middle of triangles that it misses.
class PatchSampler {
 public:
  PatchSampler(const Scene& scene, const PlaySpace& playSpace, const PatchSet& set, const Patch& patch,
               const glm::uvec2& resolution)
      : scene_(scene),
        playSpace_(playSpace),
        patch_(patch),
        charts_(set.meshes[scene.instances[patch.instance].mesh]),
        chart_(charts_.charts[patch.chart]),
        size_(charts_.size[patch.chart]),
        resolution_(resolution) {
    for (int k = 0; k < 2; ++k) {
      lattice_[k] = kSamples * static_cast<int>(std::max(resolution[k] - 1, 1u));
      step_[k] = std::max(size_[k], 1e-20f) / static_cast<float>(lattice_[k]);
    }
  }

  void run(std::uint32_t patchIndex, std::vector<PatchTexel>& texels, std::vector<ChartPoint>& points,
           Context& context) {
    collect(context);
    if (samples_.empty() || context.cancelled()) return;
    std::stable_sort(samples_.begin(), samples_.end(),
                     [](const ChartSample& a, const ChartSample& b) { return a.texel < b.texel; });
    const float toWorld = patch_.uvScale.x * patch_.uvScale.y;
    for (std::size_t begin = 0; begin < samples_.size();) {
      std::size_t end = begin;
      glm::vec2 middle(0.0f);
      float area = 0.0f;
      for (; end < samples_.size() && samples_[end].texel == samples_[begin].texel; ++end) {
        middle += samples_[end].uv * samples_[end].area;
        area += samples_[end].area;
      }
      PatchTexel texel;
      texel.patch = patchIndex;
      texel.x = samples_[begin].texel % resolution_.x;
      texel.y = samples_[begin].texel / resolution_.x;
      texel.area = area * toWorld;
      texel.firstPoint = static_cast<std::uint32_t>(points.size());
      const glm::vec2 center = centerOf(texel.x, texel.y);
      addPoints(begin, end, glm::mix(center, middle / area, kInset), points);
      texel.pointCount = static_cast<std::uint32_t>(points.size()) - texel.firstPoint;
      texels.push_back(texel);
      begin = end;
    }
  }

 private:
  glm::vec2 centerOf(std::uint32_t x, std::uint32_t y) const {
    const glm::vec2 t(resolution_.x > 1 ? static_cast<float>(x) / static_cast<float>(resolution_.x - 1) : 0.5f,
                      resolution_.y > 1 ? static_cast<float>(y) / static_cast<float>(resolution_.y - 1) : 0.5f);
    return t * size_;
  }

  std::uint32_t texelIndexOf(const glm::vec2& uv) const {
    const glm::vec2 t = texelOf(uv, size_, resolution_);
    const auto x = std::min(static_cast<std::uint32_t>(std::max(t.x + 0.5f, 0.0f)), resolution_.x - 1);
    const auto y = std::min(static_cast<std::uint32_t>(std::max(t.y + 0.5f, 0.0f)), resolution_.y - 1);
    return y * resolution_.x + x;
  }

  bool seen(std::uint32_t slot, const glm::vec2& barycentric) const {
    return seenBy(scene_, playSpace_, patch_, {chart_.triangle[slot], barycentric});
  }

  // Whether any point of the triangle in a block of the lattice may be seen. Blocks are parallelograms in its plane.
  bool blockSeen(std::uint32_t slot, int x, int y) const {
    const auto& t = chart_.uv[slot];
    const float twice = cross2(t[1] - t[0], t[2] - t[0]);
    if (twice == 0.0f) return true;
    const Instance& instance = scene_.instances[patch_.instance];
    const glm::uvec3& v = scene_.meshes[instance.mesh].triangle[chart_.triangle[slot]];
    const auto& position = scene_.meshes[instance.mesh].position;
    glm::vec3 low(INFINITY), high(-INFINITY);
    for (int k = 0; k < 4; ++k) {
      const glm::vec2 uv = glm::vec2(x + (k & 1) * kBlock, y + (k >> 1) * kBlock) * step_;
      const glm::vec2 w(cross2(uv - t[0], t[2] - t[0]) / twice, cross2(t[1] - t[0], uv - t[0]) / twice);
      const glm::vec3 local =
          position[v.x] + w.x * (position[v.y] - position[v.x]) + w.y * (position[v.z] - position[v.x]);
      const glm::vec3 world(instance.toWorld * glm::vec4(local, 1.0f));
      low = glm::min(low, world);
      high = glm::max(high, world);
    }
    return playSpace_.mayBeSeenIn(2 * (instance.firstTriangle + chart_.triangle[slot]) + patch_.side, low, high);
  }

  void collect(Context& context) {
    std::vector<std::uint8_t> taken(static_cast<std::size_t>(lattice_.x) * static_cast<std::size_t>(lattice_.y), 0);
    const float sampleArea = step_.x * step_.y;
    for (std::uint32_t slot = 0; slot < chart_.triangle.size() && !context.cancelled(); ++slot) {
      const auto& t = chart_.uv[slot];
      const glm::vec2 low = glm::min(t[0], glm::min(t[1], t[2])) / step_ - 0.5f,
                      high = glm::max(t[0], glm::max(t[1], t[2])) / step_ - 0.5f;
      bool any = false;
      const int firstY = std::max(0, static_cast<int>(std::ceil(low.y - 1e-3f))),
                lastY = std::min(lattice_.y - 1, static_cast<int>(high.y + 1e-3f)),
                firstX = std::max(0, static_cast<int>(std::ceil(low.x - 1e-3f))),
                lastX = std::min(lattice_.x - 1, static_cast<int>(high.x + 1e-3f));
      const bool many = std::int64_t{lastX - firstX + 1} * (lastY - firstY + 1) > kManyPoints;
      std::vector<std::uint8_t> rowOfBlocks;
      for (int y = firstY; y <= lastY && !context.cancelled(); ++y) {
        if (many && (y == firstY || y % kBlock == 0)) {
          rowOfBlocks.assign(static_cast<std::size_t>(lastX / kBlock) + 1, 0);
          for (int b = firstX / kBlock; b <= lastX / kBlock; ++b)
            rowOfBlocks[static_cast<std::size_t>(b)] = blockSeen(slot, b * kBlock, y / kBlock * kBlock);
          any = true;  // a triangle this large is not missed by the lattice
        }
        for (int x = firstX; x <= lastX; ++x) {
          if (many && !rowOfBlocks[static_cast<std::size_t>(x / kBlock)]) {
            x |= kBlock - 1;
            continue;
          }
          const glm::vec2 uv = (glm::vec2(x, y) + 0.5f) * step_;
          glm::vec2 w;
          if (!barycentricAt(t, uv, 1e-4f, w)) continue;
          any = true;
          std::uint8_t& mark =
              taken[static_cast<std::size_t>(y) * static_cast<std::size_t>(lattice_.x) + static_cast<std::size_t>(x)];
          if (mark) continue;
          mark = 1;
          w = clampInside(w);
          if (seen(slot, w)) samples_.push_back({uv, slot, w, texelIndexOf(uv), sampleArea});
        }
      }
      // Take one sample of a triangle that the lattice missed, for its own area.
      constexpr glm::vec2 kMiddle(1.0f / 3.0f);
      if (!any && seen(slot, kMiddle)) {
        const glm::vec2 uv = (t[0] + t[1] + t[2]) / 3.0f;
        const float area = 0.5f * std::abs(cross2(t[1] - t[0], t[2] - t[0]));
        if (area > 0.0f) samples_.push_back({uv, slot, kMiddle, texelIndexOf(uv), area});
      }
    }
  }

  // Add spots for a texel's cache: the target itself if a triangle covers it, then samples by their distance from it,
  // of which some are left out evenly.
  void addPoints(std::size_t begin, std::size_t end, const glm::vec2& target, std::vector<ChartPoint>& points) {
    const glm::vec2 world = patch_.uvScale;
    const auto distance2 = [&](const ChartSample& s) {
      const glm::vec2 d = (s.uv - target) * world;
      return glm::dot(d, d);
    };
    std::stable_sort(samples_.begin() + static_cast<std::ptrdiff_t>(begin),
                     samples_.begin() + static_cast<std::ptrdiff_t>(end),
                     [&](const ChartSample& a, const ChartSample& b) { return distance2(a) < distance2(b); });
    for (std::size_t i = begin; i < std::min(end, begin + 4); ++i) {
      glm::vec2 w;
      if (!barycentricAt(chart_.uv[samples_[i].slot], target, 1e-4f, w)) continue;
      points.push_back({chart_.triangle[samples_[i].slot], clampInside(w)});
      break;
    }
    const std::size_t count = end - begin, kept = std::min(kMaxPoints, count);
    for (std::size_t k = 0; k < kept; ++k) {
      const ChartSample& s = samples_[begin + k * count / kept];
      points.push_back({chart_.triangle[s.slot], s.barycentric});
    }
  }

  const Scene& scene_;
  const PlaySpace& playSpace_;
  const Patch& patch_;
  const MeshCharts& charts_;
  const Chart& chart_;
  glm::vec2 size_;
  glm::uvec2 resolution_;
  glm::ivec2 lattice_{1};
  glm::vec2 step_{1.0f};
  std::vector<ChartSample> samples_;
};

// Add the one texel of a small patch. Its spots are the chart's representative points, seen ones first.
void addSmallPatch(const Scene& scene, const PlaySpace& playSpace, const MeshCharts& charts, const Patch& patch,
                   std::uint32_t index, std::vector<PatchTexel>& texels, std::vector<ChartPoint>& points) {
  const auto& candidates = charts.points[patch.chart];
  PatchTexel texel;
  texel.patch = index;
  texel.area = patch.area;
  texel.firstPoint = static_cast<std::uint32_t>(points.size());
  for (const bool wanted : {true, false}) {
    for (const ChartPoint& point : candidates) {
      if (seenBy(scene, playSpace, patch, point) == wanted) points.push_back(point);
    }
  }
  texel.pointCount = static_cast<std::uint32_t>(points.size()) - texel.firstPoint;
  texels.push_back(texel);
}

}  // namespace

glm::vec2 texelOf(const glm::vec2& uv, const glm::vec2& chartSize, const glm::uvec2& resolution) {
  glm::vec2 texel(0.0f);
  for (int k = 0; k < 2; ++k) {
    if (resolution[k] > 1)
      texel[k] = std::clamp(uv[k] / chartSize[k], 0.0f, 1.0f) * static_cast<float>(resolution[k] - 1);
  }
  return texel;
}

glm::uvec2 resolutionOf(const Scene& scene, const PatchSet& set, const Patch& patch, float texelSize) {
  const MeshCharts& charts = set.meshes[scene.instances[patch.instance].mesh];
  const glm::vec2 length = charts.size[patch.chart] * patch.uvScale * (patch.density / texelSize);
  return {texelsAlong(length.x), texelsAlong(length.y)};
}

PatchTexels layTexels(const Scene& scene, const PlaySpace& playSpace, const PatchSet& set, float texelSize,
                      Context& context) {
  PatchTexels result;
  result.texelSize = texelSize;
  result.resolution.resize(set.patches.size());
  constexpr std::size_t kGrain = 64;
  struct Part {
    std::vector<PatchTexel> texels;
    std::vector<ChartPoint> points;
    std::vector<std::uint32_t> count;
  };
  std::vector<Part> parts((set.patches.size() + kGrain - 1) / kGrain);
  parallelChunks(context, "", set.patches.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    Part& part = parts[begin / kGrain];
    for (std::size_t p = begin; p < end; ++p) {
      const Patch& patch = set.patches[p];
      const MeshCharts& charts = set.meshes[scene.instances[patch.instance].mesh];
      const glm::uvec2 resolution = resolutionOf(scene, set, patch, texelSize);
      const std::size_t before = part.texels.size();
      const auto index = static_cast<std::uint32_t>(p);
      if (resolution != glm::uvec2(1))
        PatchSampler(scene, playSpace, set, patch, resolution).run(index, part.texels, part.points, context);
      // Also where everything fell between the samples.
      result.resolution[p] = part.texels.size() > before ? resolution : glm::uvec2(1);
      if (part.texels.size() == before) addSmallPatch(scene, playSpace, charts, patch, index, part.texels, part.points);
      part.count.push_back(static_cast<std::uint32_t>(part.texels.size() - before));
    }
  });

  // Join the parts in order; each goes once it is joined.
  std::size_t texels = 0, points = 0;
  for (const Part& part : parts) {
    texels += part.texels.size();
    points += part.points.size();
  }
  result.texels.reserve(texels);
  result.points.reserve(points);
  result.firstTexel.reserve(set.patches.size() + 1);
  result.firstTexel.push_back(0);
  for (Part& each : parts) {
    const Part part = std::move(each);
    const auto base = static_cast<std::uint32_t>(result.points.size());
    for (PatchTexel texel : part.texels) {
      texel.firstPoint += base;
      result.texels.push_back(texel);
    }
    result.points.insert(result.points.end(), part.points.begin(), part.points.end());
    for (const std::uint32_t count : part.count) result.firstTexel.push_back(result.firstTexel.back() + count);
  }
  return result;
}

}  // namespace relume
