// SPDX-License-Identifier: MIT
// One side of an occupied voxel in 32 bytes, of which a level has hundreds of thousands. Places of light are as they
// were found, and so is their normal where all have one; the rest is rounded to less than the voxel's sums were: places
// to 2^-9 voxel, normals to 1e-3, those of light on curved surfaces to half a degree, albedo to 2^-13 as surfaces have
// it, areas to 2^-12. What a side emits is kept beside it (VoxelLayer::emission), as few do.
#pragma once

#include "formats/octahedron.h"

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace relume {

// A place of the surfaces in a voxel at which direct light is found.
class SideSample {
 public:
  SideSample() = default;
  // place [-32..32, 1/64 voxel from the voxel's middle], normal [127 times the unit one], count [0..4] how many of the
  // side's four places it stands for
  SideSample(const glm::ivec3& place, const glm::ivec3& normal, std::uint32_t count)
      : place_(place), normal_(normal), count_(count) {}

  const glm::ivec3& place() const { return place_; }
  const glm::ivec3& normal() const { return normal_; }
  std::uint32_t count() const { return count_; }  // 0 = there is none
  bool operator==(const SideSample&) const = default;

 private:
  glm::ivec3 place_{0}, normal_{0};
  std::uint32_t count_ = 0;
};

// Means over the triangles that face the side, by area and by how squarely they do. Where none does, the back of those
// that face the other side.
class VoxelSide {
 public:
  // On the surfaces nearest to four places spread over the voxel, each once, with counts that sum to four; light and
  // shadow vary within it. Those that are there come first; or there is none.
  using Samples = std::array<SideSample, 4>;

  VoxelSide() = default;
  // place [-2..2 voxels], normal is unit, albedo [0..1], area [>= 0]
  VoxelSide(const glm::vec3& place, const glm::vec3& normal, const glm::vec3& albedo, float area,
            const Samples& samples) {
    const glm::vec2 direction = toOctahedron(normal);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(k);
      putSigned(kPlace + kPlaceBits * k, kPlaceBits, place[axis] * kPlaceSteps);
      put(kAlbedo + kAlbedoBits * k, kAlbedoBits,
          static_cast<std::uint32_t>(rounded(albedo[axis] * kAlbedoRange, 0.0f, kAlbedoRange)));
      if (k < 2) putSigned(kNormal + kNormalBits * k, kNormalBits, direction[axis] * kNormalRange);
    }
    // What has an area keeps some.
    const std::uint32_t steps = (std::bit_cast<std::uint32_t>(area) + (1u << (kAreaShift - 1))) >> kAreaShift;
    put(kArea, kAreaBits, area > 0.0f ? std::max(steps, 1u) : 0);
    putSamples(samples);
  }

  // [voxels] from the voxel's middle, in front of all that faces this side, so that light reaches it. Sums with places
  // in a grid are exact.
  glm::vec3 place() const { return glm::vec3(triple(kPlace, kPlaceBits)) / kPlaceSteps; }
  glm::vec3 normal() const { return octahedral(kNormal, kNormalBits); }  // unit
  glm::vec3 albedo() const {
    const auto at = [&](std::uint32_t k) { return static_cast<float>(get(kAlbedo + kAlbedoBits * k, kAlbedoBits)); };
    return glm::vec3(at(0), at(1), at(2)) / kAlbedoRange;
  }
  // [m²] of triangles that face it; 0 = their backs alone
  float area() const { return std::bit_cast<float>(get(kArea, kAreaBits) << kAreaShift); }

  Samples samples() const {
    Samples samples;
    const bool isCurved = get(kCurved, 1) != 0;
    glm::ivec3 normal = isCurved ? glm::ivec3(0) : triple(kLightNormal, 8);
    if (!isCurved && normal == glm::ivec3(0)) return samples;
    std::array<std::uint32_t, 4> counts{};
    std::size_t used = 0;
    for (std::uint32_t i = 0; i < 4; ++i) {
      const glm::ivec3 place = triple(kLight + kLightBits * i, kLightBits / 3);
      if (isCurved) normal = glm::ivec3(glm::floor(127.0f * octahedral(kLightNormal + 16 * i, 8) + 0.5f));
      std::size_t same = 0;
      while (same < used && !(samples[same].place() == place && samples[same].normal() == normal)) ++same;
      samples[same] = SideSample(place, normal, ++counts[same]);
      used = std::max(used, same + 1);
    }
    return samples;
  }
  bool operator==(const VoxelSide&) const = default;

 private:
  static constexpr std::uint32_t kLightBits = 21, kPlaceBits = 10, kNormalBits = 11, kAlbedoBits = 12, kAreaBits = 19,
                                 kAreaShift = 31 - kAreaBits;
  // Where they begin: four places of light, whether their normals differ, one of 3 x 8 bits or four of 2 x 8; the
  // means.
  static constexpr std::uint32_t kLight = 0, kCurved = kLight + 4 * kLightBits, kLightNormal = kCurved + 1,
                                 kPlace = kLightNormal + 64, kNormal = kPlace + 3 * kPlaceBits,
                                 kAlbedo = kNormal + 2 * kNormalBits, kArea = kAlbedo + 3 * kAlbedoBits;
  static_assert(kArea + kAreaBits == 256);
  static constexpr float kPlaceSteps = 256.0f, kAlbedoRange = 4095.0f,
                         kNormalRange = static_cast<float>((1u << (kNormalBits - 1)) - 1);

  static float rounded(float v, float low, float high) { return glm::clamp(glm::floor(v + 0.5f), low, high); }
  void putSamples(const Samples& samples) {
    const bool isCurved = std::any_of(samples.begin(), samples.end(), [&](const SideSample& s) {
      return s.count() > 0 && s.normal() != samples.front().normal();
    });
    put(kCurved, 1, isCurved ? 1 : 0);
    putTriple(kLightNormal, 8, samples.front().normal());
    std::uint32_t i = 0;
    for (const SideSample& s : samples) {
      for (std::uint32_t n = 0; n < s.count() && i < 4; ++n, ++i) {
        putTriple(kLight + kLightBits * i, kLightBits / 3, s.place());
        if (!isCurved) continue;
        const glm::vec2 direction = toOctahedron(glm::vec3(s.normal()));
        putSigned(kLightNormal + 16 * i, 8, direction.x * 127.0f);
        putSigned(kLightNormal + 16 * i + 8, 8, direction.y * 127.0f);
      }
    }
  }

  void putTriple(std::uint32_t at, std::uint32_t width, const glm::ivec3& v) {
    for (std::uint32_t k = 0; k < 3; ++k)
      put(at + width * k, width, static_cast<std::uint32_t>(v[static_cast<int>(k)]));
  }
  glm::ivec3 triple(std::uint32_t at, std::uint32_t width) const {
    return {getSigned(at, width), getSigned(at + width, width), getSigned(at + 2 * width, width)};
  }
  glm::vec3 octahedral(std::uint32_t at, std::uint32_t width) const {
    return fromOctahedron(glm::vec2(getSigned(at, width), getSigned(at + width, width)) /
                          static_cast<float>((1 << (width - 1)) - 1));
  }

  // To the nearest integer that there is room for.
  void putSigned(std::uint32_t at, std::uint32_t width, float v) {
    const auto most = static_cast<float>((1 << (width - 1)) - 1);
    put(at, width, static_cast<std::uint32_t>(static_cast<int>(rounded(v, -most, most))));
  }
  int getSigned(std::uint32_t at, std::uint32_t width) const {
    return static_cast<int>(get(at, width) << (32 - width)) >> (32 - width);
  }

  // Numbers of up to 32 bits, which may lie in two words.
  void put(std::uint32_t at, std::uint32_t width, std::uint32_t value) {
    const std::uint64_t mask = (std::uint64_t{1} << width) - 1, bits = value & mask;
    const std::uint32_t word = at / 64, shift = at % 64;
    bits_[word] = (bits_[word] & ~(mask << shift)) | bits << shift;
    if (shift + width <= 64) return;
    const std::uint32_t rest = 64 - shift;
    bits_[word + 1] = (bits_[word + 1] & ~(mask >> rest)) | bits >> rest;
  }
  std::uint32_t get(std::uint32_t at, std::uint32_t width) const {
    const std::uint32_t word = at / 64, shift = at % 64;
    std::uint64_t value = bits_[word] >> shift;
    if (shift + width > 64) value |= bits_[word + 1] << (64 - shift);
    return static_cast<std::uint32_t>(value & ((std::uint64_t{1} << width) - 1));
  }

  std::array<std::uint64_t, 4> bits_{};
};
static_assert(sizeof(VoxelSide) == 32);

}  // namespace relume
