// SPDX-License-Identifier: MIT
// What the kernels of light_surfels.h and pull.h read and write: plain memory and no header that has functions
// (vectors.h says why).
#pragma once

#include "runtime/shared/light_rows.h"

#include <cstddef>
#include <cstdint>

namespace relume::cpu {

// Surfels are lit a block at a time, all of it in the first-level cache.
constexpr std::uint32_t kSurfelBlock = 256;
constexpr std::uint32_t kAtRoom = 16;

// A light with what every surfel would compute again.
struct PreparedLight {
  std::uint32_t kind = 0;   // LightKind
  float position[3] = {};   // [m]
  float direction[3] = {};  // unit
  float intensity[3] = {};
  float inverseRange2 = 0.0f;               // [1/m²] 0 = no range
  float cosOuter = 0.0f, coneScale = 0.0f;  // a spot's smooth edge: 1 inside the inner angle, 0 outside the outer
};

struct LightSurfelsJob {
  const std::uint32_t* word[4] = {};  // of the surfels (runtime/shared/pack_surfel.h), each padded to whole blocks
  float origin[3] = {}, step[3] = {};
  float radius = 0.0f;          // [m] of a disc of a surfel's area
  float discReach2 = 0.0f;      // [m²] square of kDiscReach (runtime/direct_light.h) radii
  float inverseRadius2 = 0.0f;  // [1/m²]
  const PreparedLight* light = nullptr;
  std::uint32_t lightCount = 0;
  float bounceScale = 0.0f;
  // Irradiance of each of the light map's caches for its own normal (runtime/shared/pack_color.h).
  const std::uint32_t* color = nullptr;
  std::int32_t mapWidth = 0, mapHeight = 0;
  // Cache of each texel, counted from the light map's first, all ones = none; and one more. Where mapCache is null: the
  // same counted from the first of all, which is wideFirst.
  const std::uint16_t* mapCache = nullptr;
  const std::uint32_t* wideMapCache = nullptr;
  std::int32_t wideFirst = 0;
  const float* lobe = nullptr;  // factors of the linear and of the clamped form by TiltedSurfel::angle, in turn
  bool thirdBand = false;       // whether lobes have more than four coefficients
  LightRows gridLight, mapLight;
};

// The irradiance of the light map's caches for their own normals.
struct ColorCachesJob {
  LightRows light;
  const std::uint32_t* normal = nullptr;  // of each cache, from light.first on: packOctahedral() (formats/pack.h)
  bool normalsCount = false;              // the linear form for a cache's normal; without, coefficient 0 alone counts:
  float constant[2] = {};                 // times this, for caches without and with a normal
  std::uint32_t* color = nullptr;         // out, packed, from cache light.first on
};

// A surfel that reads the light map for a normal that is not the map's.
struct TiltedSurfel {
  std::uint8_t slot;   // within its block
  std::uint8_t angle;  // between its normal and the light map's: 255 = pi
};

// A surfel that reads the grid.
struct GriddedSurfel {
  std::uint8_t slot;    // within its block
  std::uint8_t caches;  // that many shares (runtime/shared/receivers.h)
};
constexpr std::uint32_t kShareShift = 22, kShareOne = 1023;

// Irradiance and radiosity of a block: kSurfelBlock numbers each of red, green, blue.
struct LightSurfelsKernel {
  // e = irradiance by all lights without shadows.
  void (*direct)(const LightSurfelsJob& job, std::uint32_t first, std::uint32_t count, float* e);
  // Colours of the caches [begin, end), begin >= light.first; of those without a normal, black if normals count.
  void (*colorCaches)(const ColorCachesJob& job, std::uint32_t begin, std::uint32_t end);
  // e += bounceScale * the light map's, where a surfel's receiver is a point of it.
  void (*addFlatBounce)(const LightSurfelsJob& job, std::uint32_t first, std::uint32_t count, float* e);
  // Where these surfels of the block that begins at `first` are, e becomes `before` + bounceScale * the light map's
  // under their lobes. before: kSurfelBlock numbers each of red, green, blue, by index in `tilted`.
  void (*addTiltedBounce)(const LightSurfelsJob& job, std::uint32_t first, const TiltedSurfel* tilted,
                          std::uint32_t count, const float* before, float* e);
  // e += bounceScale * the grid's at these surfels of the block that begins at `first`. share: those of one after the
  // other.
  void (*addGriddedBounce)(const LightSurfelsJob& job, std::uint32_t first, const GriddedSurfel* gridded,
                           std::uint32_t count, const std::uint32_t* share, float* e);
  // at = the numbers of the `wanted` bits that are set from `first` on, and anything in kAtRoom entries behind them.
  void (*listBits)(const std::uint64_t* bits, std::uint32_t first, std::uint32_t wanted, std::uint32_t* at);
  // node[at[i]] = albedo * e + emitted, packed with the dither of its node. `emitted` may be null.
  void (*store)(const LightSurfelsJob& job, std::uint32_t first, std::uint32_t count, const float* e,
                const float* emitted, const std::uint32_t* at, std::uint32_t* node);
  // node[at[i]] = weight of child 2 i times it, plus the rest of child 2 i + 1, at most kSurfelBlock nodes at a time.
  // weight: 16 bits over 65534.
  void (*pull)(const std::uint32_t* child, const std::uint16_t* weight, const std::uint32_t* at, std::uint32_t count,
               std::uint32_t* node);
};

extern const LightSurfelsKernel kLightSurfelsBaseline, kLightSurfelsAvx2, kLightSurfelsAvx512;

}  // namespace relume::cpu
