// SPDX-License-Identifier: MIT
// The checks of the numbers that light is computed with (of 2xx to 5xx), and the other 2xx and 4xx checks:
// surfels, caches and light map. The bake is safe to index (1xx found nothing).
#include "formats/decimal.h"
#include "formats/findings.h"
#include "formats/limits.h"
#include "formats/pack.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <string_view>
#include <tuple>
#include <vector>

namespace relume {
namespace {

// Within what storing and normalising in single precision can explain. False for NaN.
bool isUnit(const glm::vec3& v) { return std::abs(v.x * v.x + v.y * v.y + v.z * v.z - 1.0f) < 2e-3f; }

bool isZero(const glm::vec3& v) { return v.x == 0.0f && v.y == 0.0f && v.z == 0.0f; }

template <class Good>
void checkEach(const Array<glm::vec3>& values, const char* name, Check check, const char* expected, Good&& good,
               Findings& findings) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!good(values[i])) findings.add(check, At{name, i}, expected, values[i]);
  }
}

// Whether a bilinear read at a light-map point touches a texel without a cache with a weight that shows (1 %).
bool readsUnfilled(const Lightmap& map, const glm::vec2& uv) {
  const float x = uv.x * static_cast<float>(map.width) - 0.5f, y = uv.y * static_cast<float>(map.height) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y);
  const auto clamped = [](float v, std::uint32_t size) {
    return static_cast<std::size_t>(std::clamp(v, 0.0f, static_cast<float>(size - 1)));
  };
  for (int corner = 0; corner < 4; ++corner) {
    const int dx = corner & 1, dy = corner >> 1;
    const float weight = (dx ? x - x0 : 1.0f - (x - x0)) * (dy ? y - y0 : 1.0f - (y - y0));
    const std::size_t texel =
        clamped(y0 + static_cast<float>(dy), map.height) * map.width + clamped(x0 + static_cast<float>(dx), map.width);
    if (weight > 0.01f && map.cache[texel] == kNoCache) return true;
  }
  return false;
}

// Scan a triangle's points at most a texel apart (at most 64 an edge).
bool triangleReadsUnfilled(const Lightmap& map, const std::array<glm::vec2, 3>& uv) {
  float extent = 0.0f;
  for (std::size_t edge = 0; edge < 3; ++edge) {
    const glm::vec2 d = uv[(edge + 1) % 3] - uv[edge];
    extent = std::max(
        {extent, std::abs(d.x) * static_cast<float>(map.width), std::abs(d.y) * static_cast<float>(map.height)});
  }
  const int steps = std::clamp(static_cast<int>(std::ceil(extent)), 1, 64);
  for (int b = 0; b <= steps; ++b) {
    for (int c = 0; b + c <= steps; ++c) {
      const float fb = static_cast<float>(b) / static_cast<float>(steps);
      const float fc = static_cast<float>(c) / static_cast<float>(steps);
      if (readsUnfilled(map, (1.0f - fb - fc) * uv[0] + fb * uv[1] + fc * uv[2])) return true;
    }
  }
  return false;
}

// A part's occurrence follows from the parts before it.
void checkOccurrences(const Bake& bake, Findings& findings) {
  const Array<LightmapPart>& parts = bake.caches.lightmap.parts;
  std::map<std::tuple<std::string_view, std::uint32_t, std::uint32_t>, std::uint32_t> seen;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::uint32_t before = seen[{bake.instances[i].node, parts[i].primitive, parts[i].gpuInstance}]++;
    if (parts[i].occurrence != before)
      findings.add(Check::partOccurrence, At{"map.part", i}, std::to_string(before), parts[i].occurrence);
  }
}

// Whether parts take disjoint ranges of corners.
bool checkParts(const Lightmap& map, Findings& findings) {
  std::vector<std::size_t> order(map.parts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return map.parts[a].firstCorner < map.parts[b].firstCorner; });
  std::uint64_t end = 0;
  bool disjoint = true;
  for (const std::size_t i : order) {
    const LightmapPart& part = map.parts[i];
    if (part.triangleCount == 0) continue;
    disjoint = disjoint && part.firstCorner >= end;
    if (part.firstCorner < end)
      findings.add(Check::partsOverlap, At{"map.part", i}, "at least " + std::to_string(end), part.firstCorner);
    end = std::max<std::uint64_t>(end, part.firstCorner + std::uint64_t{3} * part.triangleCount);
  }
  return disjoint;
}

// The corners of one side, cornerUv or backCornerUv.
void checkTriangles(const Lightmap& map, const Array<std::uint32_t>& corners, const char* name, Findings& findings) {
  if (corners.empty()) return;
  const std::uint32_t* passed = nullptr;  // the last triangle that reads filled texels: neighbours are often the same
  for (const LightmapPart& part : map.parts) {
    for (std::uint32_t t = 0; t < part.triangleCount; ++t) {
      const std::uint64_t first = part.firstCorner + std::uint64_t{3} * t;
      const std::uint32_t* corner = corners.data() + first;
      if (passed != nullptr && std::equal(corner, corner + 3, passed)) continue;
      const auto lit = std::count(corner, corner + 3, kGridLit);
      if (lit == 3) continue;
      if (lit > 0) {
        findings.add(Check::cornerMixed, At{name, first}, "none or three corners lit by the grid", std::to_string(lit));
        continue;
      }
      if (!map.cache.empty() && triangleReadsUnfilled(map, {unpackUnorm16x2(corner[0]), unpackUnorm16x2(corner[1]),
                                                            unpackUnorm16x2(corner[2])}))
        findings.add(Check::texelUnfilled, At{name, first}, "a cache in every texel it reads", "none");
      else
        passed = corner;
    }
  }
}

// Layers upon layers have more area than the box around them, but not a million times as much.
void checkExtent(const Bake& bake, Findings& findings) {
  constexpr double kMaxLayers = 1e6;
  std::array<double, 3> low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
  const auto add = [&](const Array<glm::vec3>& positions) {
    for (const glm::vec3& p : positions) {
      if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], static_cast<double>(p[static_cast<int>(k)]));
        high[k] = std::max(high[k], static_cast<double>(p[static_cast<int>(k)]));
      }
    }
  };
  add(bake.surfels.positionWorld);
  add(bake.caches.positionWorld);
  double square = 0.0;
  for (std::size_t k = 0; k < 3; ++k) square += (high[k] - low[k]) * (high[k] - low[k]);
  const double area = static_cast<double>(bake.surfels.areaEach) * bake.surfels.count();
  if (square > 0.0 && std::isfinite(square) && std::isfinite(area) && area > kMaxLayers * square)
    findings.add(Check::surfelArea, "scalars, surfel area",
                 "at most " + decimal(kMaxLayers * square) + " m² of all surfels, by the places they have", area);
}

// Halves by their bits, which are looked at without unpacking: 0 and above, minus 0 among them; within -1 to 1; finite.
bool isShareHalf(std::uint16_t half) { return half < 0x7C00u || half == 0x8000u; }
bool isCosineHalf(std::uint16_t half) { return (half & 0x7FFFu) <= 0x3C00u; }
bool isFiniteHalf(std::uint16_t half) { return (half & 0x7C00u) != 0x7C00u; }

// A block of links at a time: there are tens of millions of numbers, and compilers look at many at once where nothing
// depends on a single one.
void checkCoefficients(const Links& l, Findings& findings) {
  constexpr std::size_t kBlock = 256;
  const std::size_t stride = std::size_t{l.bands} * l.bands;
  const std::span<const std::uint16_t> all = l.shCoefficients;
  for (std::size_t begin = 0; begin < all.size(); begin += kBlock * stride) {
    const auto block = all.subspan(begin, std::min(kBlock * stride, all.size() - begin));
    std::int16_t largestExponent = 0;
    for (const std::uint16_t half : block)
      largestExponent = std::max(largestExponent, static_cast<std::int16_t>(half & 0x7C00u));
    for (std::size_t i = 0; i < block.size() && largestExponent == 0x7C00; ++i) {
      if (!isFiniteHalf(block[i]))
        findings.add(Check::linkCoefficient, At{"link.sh", begin + i}, "finite", unpackHalf(block[i]));
    }
    for (std::size_t i = 0; i < block.size(); i += stride) {
      if (!isShareHalf(block[i]))
        findings.add(Check::linkTransfer, At{"link.sh", begin + i}, "finite, >= 0", unpackHalf(block[i]));
    }
  }
}

// Links that have a head hold codes, all of which are good.
void checkLinkNumbers(const Links& l, Findings& findings) {
  for (std::size_t i = 0; i < l.cone.size(); ++i) {
    if (!isShareHalf(l.cone[i].transfer))
      findings.add(Check::linkTransfer, At{"link.cone", i}, "finite, >= 0", unpackHalf(l.cone[i].transfer));
    if (!isCosineHalf(l.cone[i].cosAlpha))
      findings.add(Check::linkCosAlpha, At{"link.cone", i}, "-1..1", unpackHalf(l.cone[i].cosAlpha));
  }
  checkCoefficients(l, findings);
}

}  // namespace

void checkNumbers(const Bake& bake, Findings& findings) {
  const Surfels& s = bake.surfels;
  if (s.count() > 0 && !(std::isfinite(s.areaEach) && s.areaEach > 0.0f))
    findings.add(Check::surfelArea, "scalars, surfel area", "above 0", s.areaEach);
  checkEach(s.normal, "surfel.normal", Check::surfelNormal, "length 1", isUnit, findings);
  checkEach(
      s.albedo, "surfel.albedo", Check::surfelAlbedo, "0..1",
      [](const glm::vec3& v) {
        return v.x >= 0.0f && v.x <= 1.0f && v.y >= 0.0f && v.y <= 1.0f && v.z >= 0.0f && v.z <= 1.0f;
      },
      findings);
  checkEach(s.emission, "surfel.emission", Check::surfelEmission, "0 to 1e9 W/m²/sr", isRadiance, findings);
  for (std::size_t i = 0; i < bake.emitters.tapWidth.size(); ++i) {
    const float width = bake.emitters.tapWidth[i];
    if (!(width >= 0.0f && width <= kMaxTapWidth))
      findings.add(Check::emitterTapWidth, At{"emit.width", i}, "0 to 65536", width);
  }
  const Hierarchy& h = bake.hierarchy;
  checkEach(h.skyDirection, "sky.direction", Check::skyDirection, "length 1", isUnit, findings);
  for (std::uint32_t node = 0; node < h.nodeCount(); ++node) {
    if (!(h.firstWeight[node] >= 0.0f && h.firstWeight[node] <= 1.0f))
      findings.add(Check::firstWeightRange, At{"node.weight", node}, "0..1", h.firstWeight[node]);
  }
  checkEach(
      bake.caches.normal, "cache.normal", Check::cacheNormal, "length 1 or 0",
      [](const glm::vec3& v) { return isUnit(v) || isZero(v); }, findings);
  checkLinkNumbers(bake.links, findings);
}

void checkSurfels(const Bake& bake, Findings& findings) {
  const Surfels& s = bake.surfels;
  checkExtent(bake, findings);
  for (std::size_t i = 0; i < s.receiver.size() && !bake.caches.lightmap.cache.empty(); ++i) {
    if (s.receiver[i] != kGridReceiver && readsUnfilled(bake.caches.lightmap, unpackUnorm16x2(s.receiver[i])))
      findings.add(Check::surfelReceiverUnfilled, At{"surfel.receiver", i}, "a cache in every texel it reads", "none");
  }
}

void checkCaches(const Bake& bake, Findings& findings) {
  const Caches& c = bake.caches;
  // Grid caches gather the sphere, light-map caches the hemisphere above their surface; each cache is read somewhere.
  std::vector<bool> used(c.count(), false);
  for (std::size_t i = 0; i < c.grid.cache.size(); ++i) {
    const std::uint32_t cache = c.grid.cache[i];
    if (cache == kNoCache) continue;
    used[cache] = true;
    if (!isZero(c.normal[cache]))
      findings.add(Check::gridCacheNormal, At{"grid.cache", i}, "a cache with normal 0", c.normal[cache]);
  }
  for (std::size_t i = 0; i < c.grid.fine.size(); ++i) {
    const std::uint32_t cache = c.grid.fine[i];
    if (cache >= kHangingPoint) continue;
    used[cache] = true;
    if (!isZero(c.normal[cache]))
      findings.add(Check::gridCacheNormal, At{"grid.fine", i}, "a cache with normal 0", c.normal[cache]);
  }
  for (std::size_t i = 0; i < c.lightmap.cache.size(); ++i) {
    const std::uint32_t cache = c.lightmap.cache[i];
    if (cache == kNoCache) continue;
    used[cache] = true;
    if (isZero(c.normal[cache]))
      findings.add(Check::lightmapCacheNormal, At{"map.cache", i}, "a cache with a normal", c.normal[cache]);
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) findings.add(Check::cacheUnused, "cache " + std::to_string(i), "a grid point or texel", "none");
  }
  checkOccurrences(bake, findings);
  // Parts that share corners could have any multiple of the triangles that a file has room for.
  if (!checkParts(c.lightmap, findings)) return;
  checkTriangles(c.lightmap, c.lightmap.cornerUv, "map.corner", findings);
  checkTriangles(c.lightmap, c.lightmap.backCornerUv, "map.back", findings);
}

}  // namespace relume
