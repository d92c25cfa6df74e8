// SPDX-License-Identifier: MIT
// See simplify.h. Rounded numbers keep their type: bits that are zero cost nothing once a file is packed.
#include "relume/bake/simplify.h"

#include "formats/compact_links.h"
#include "formats/limits.h"
#include "formats/validate.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace relume {
namespace {

template <class T, class Round>
Array<T> rounded(const Array<T>& values, const Round& round) {
  std::vector<T> result = values.toVector();
  for (T& value : result) value = round(value);
  return result;
}

// To a multiple of `step`, a power of two.
glm::vec3 toMultiple(const glm::vec3& v, float step) {
  return glm::vec3(std::nearbyint(v.x / step), std::nearbyint(v.y / step), std::nearbyint(v.z / step)) * step;
}

// The nearest of the multiples around a point of a surface that does not lie behind it: shadow rays start there. A
// normal of 0 has no behind.
glm::vec3 toMultipleAbove(const glm::vec3& p, const glm::vec3& normal, float step) {
  const glm::vec3 low = glm::vec3(std::floor(p.x / step), std::floor(p.y / step), std::floor(p.z / step)) * step;
  glm::vec3 best = p;
  float bestSquare = std::numeric_limits<float>::infinity();
  for (int corner = 0; corner < 8; ++corner) {
    const glm::vec3 at = low + step * glm::vec3(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::vec3 moved = at - p;
    const float square = glm::dot(moved, moved);
    if (glm::dot(moved, normal) >= 0.0f && square < bestSquare) best = at, bestSquare = square;
  }
  return best;
}

Array<glm::vec3> toMultiplesAbove(const Array<glm::vec3>& points, const Array<glm::vec3>& normals, float step) {
  std::vector<glm::vec3> result = points.toVector();
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = toMultipleAbove(points[i], normals[i], step);
  return result;
}

// Stays of length 1 as closely as validateBake() asks for.
glm::vec3 toDirection(const glm::vec3& v) {
  const glm::vec3 multiple = toMultiple(v, 1.0f / 1024.0f);
  return std::abs(glm::dot(multiple, multiple) - 1.0f) < 1.9e-3f ? multiple : v;
}

// To seven significant bits. Finite and not negative; denormals become 0.
float toSignificantBits(float v) {
  constexpr std::uint32_t kDropped = 17, kHalf = 1u << (kDropped - 1);
  if (v < std::numeric_limits<float>::min()) return 0.0f;
  return std::bit_cast<float>((std::bit_cast<std::uint32_t>(v) + kHalf) >> kDropped << kDropped);
}

glm::vec3 toSignificantBits(const glm::vec3& v) {
  return {toSignificantBits(v.x), toSignificantBits(v.y), toSignificantBits(v.z)};
}

// [m] The largest power of two that is at most 1/64 of a surfel's radius; 0 where surfels have no size to go by.
float positionStep(const Surfels& surfels) {
  const float radius = std::sqrt(surfels.areaEach * std::numbers::inv_pi_v<float>);
  if (!std::isnormal(radius) || radius < 1e-6f) return 0.0f;
  int exponent = 0;
  std::frexp(radius / 64.0f, &exponent);
  return std::ldexp(1.0f, exponent - 1);
}

// Heads of a row: the last two bits of transfers become zero, and the row's sum is kept as well as they can.
void roundTransfers(std::span<std::uint32_t> row) {
  constexpr std::uint32_t kNodeBits = 20, kLargest = 0xFFCu;
  float lost = 0.0f;
  for (std::uint32_t& head : row) {
    const float wanted = unpackTransfer(head >> kNodeBits) + lost;
    const std::uint32_t bits = std::min((packTransfer(wanted) + 2u) & ~3u, kLargest);
    lost = wanted - unpackTransfer(bits);
    head = (head & ((1u << kNodeBits) - 1u)) | bits << kNodeBits;
  }
}

// A field of two's complement to a multiple of `step`, within what is symmetric about 0.
std::uint32_t roundSigned(std::uint32_t field, int bits, int step) {
  const int value = static_cast<int>(field << (32 - bits)) >> (32 - bits);
  const int largest = ((1 << (bits - 1)) - 1) / step * step;
  const int multiple = static_cast<int>(std::floor(static_cast<float>(value) / static_cast<float>(step) + 0.5f)) * step;
  return static_cast<std::uint32_t>(std::clamp(multiple, -largest, largest)) & ((1u << bits) - 1u);
}

// The shape of a link of kind irradiance (formats/compact_links.h).
std::uint32_t roundShape(std::uint32_t shape) {
  const std::uint32_t x = roundSigned(shape & 0xFFFu, 12, 32), y = roundSigned(shape >> 12 & 0xFFFu, 12, 32);
  const std::uint32_t cone = std::min(((shape >> 24) + 4u) & ~7u, 248u);
  return x | y << 12 | cone << 24;
}

void simplifyLinks(Links& links) {
  if (!linkHasHead(links.kind)) return;
  std::vector<std::uint32_t> head = links.head.toVector();
  for (std::uint32_t cache = 0; cache < links.cacheCount(); ++cache) {
    const std::uint32_t first = links.rowBegin[cache];
    roundTransfers(std::span(head).subspan(first, links.rowBegin[cache + 1] - first));
  }
  links.head = std::move(head);
  if (links.kind == LinkKind::irradiance) links.shape = rounded(links.shape, roundShape);
}

void leaveOutCoordinates(Lightmap& map) {
  map.cornerUv = {};
  map.backCornerUv = {};
  map.parts = rounded(map.parts, [](LightmapPart part) {
    part.triangleCount = 0;
    part.firstCorner = 0;
    return part;
  });
}

}  // namespace

Bake simplifyForWeb(const Bake& bake, const SimplifyOptions& options) {
  Bake simple = bake;
  const auto toBits = [](const glm::vec3& v) { return glm::min(toSignificantBits(v), glm::vec3(kMaxRadiance)); };
  Surfels& surfels = simple.surfels;
  if (const float step = positionStep(surfels); step > 0.0f) {
    Caches& caches = simple.caches;
    surfels.positionWorld = toMultiplesAbove(surfels.positionWorld, surfels.normal, step);
    caches.positionWorld = toMultiplesAbove(caches.positionWorld, caches.normal, step);
  }
  surfels.normal = rounded(surfels.normal, toDirection);
  surfels.albedo = rounded(surfels.albedo, toBits);
  surfels.emission = rounded(surfels.emission, toBits);
  Hierarchy& tree = simple.hierarchy;
  if (!pullsByArea(simple.provenance))
    tree.firstWeight = rounded(tree.firstWeight, [](float w) { return std::nearbyint(w * 512.0f) / 512.0f; });
  tree.skyDirection = rounded(tree.skyDirection, toDirection);
  simple.caches.normal = rounded(simple.caches.normal, toDirection);
  simplifyLinks(simple.links);
  if (!options.keepCoordinates) leaveOutCoordinates(simple.caches.lightmap);
  simple.shapes = {};
  simple.instances = rounded(simple.instances, [](BakedInstance part) {
    part.firstShape = part.shapeCount = 0;
    return part;
  });
  return simple;
}

}  // namespace relume
