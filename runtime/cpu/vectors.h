// SPDX-License-Identifier: MIT
// The vectors of simd/vectors.h with RELUME_LANES (4, 8 or 16) lanes, and what the kernels unpack into them: colours
// and directions. The file kernels_<set>.cpp defines RELUME_LANES and is compiled for that instruction set.
#pragma once

#include "simd/vectors.h"

namespace relume::cpu {
namespace {

constexpr int kLanes = RELUME_LANES;
using Floats = FloatsOf<kLanes>;
using Ints = IntsOf<kLanes>;
using Bytes = BytesOf<kLanes>;
using Floats3 = Vectors3<Floats>;

inline Floats splat(float v) { return relume::splat<Floats>(v); }

// Red, green and blue of packed colours (runtime/shared/pack_color.h).
inline void unpackColors(Ints bits, Floats& r, Floats& g, Floats& b) {
  const Floats scale = asFloats(((bits >> 3) & 0x1F800000) + (87 << 23));
  r = toFloats(bits & 511) * scale;
  g = toFloats((bits >> 9) & 511) * scale;
  b = toFloats((bits >> 18) & 255) * (scale + scale);
}

// packColor() of the colours of lanes whose dithers are given.
inline Ints packColors(Floats r, Floats g, Floats b, Floats dither) {
  const Floats largest = max(max(r, g), b);
  Ints exponent = (asInts(largest) >> 23) - 95;
  exponent = exponent & ~(exponent < 0);
  exponent = (exponent & (exponent < 63)) | (63 & ~(exponent < 63));
  const Floats scale = asFloats((167 - exponent) << 23);
  const auto part = [&dither](Floats v, float limit) __attribute__((always_inline)) {
    return __builtin_convertvector(min(max(v + dither, Floats{}), splat(limit)), Ints);
  };
  return part(r * scale, 511.0f) | part(g * scale, 511.0f) << 9 | part(b * (0.5f * scale), 255.0f) << 18 |
         exponent << 26;
}

// Y, Co, Cg of red, green, blue (formats/color.h).
inline void toYCoCg(Floats r, Floats g, Floats b, Floats& y, Floats& co, Floats& cg) {
  const Floats green = 0.5f * g, rest = 0.25f * (r + b);
  y = green + rest;
  co = 0.5f * (r - b);
  cg = green - rest;
}

// 4 Y, 2 Co and 4 Cg of packed colours (formats/color.h) whose channels are multiples of `scale`: sums of their bits.
__attribute__((always_inline)) inline void colorsInUnits(Ints bits, Floats scale, Floats* color) {
  const Ints red = bits & 511, green2 = (bits >> 8) & 1022, blue2 = (bits >> 17) & 510;
  const Ints redBlue = red + blue2;
  color[0] = toFloats(green2 + redBlue) * scale;
  color[1] = toFloats(red - blue2) * scale;
  color[2] = toFloats(green2 - redBlue) * scale;
}

// The same times f.
__attribute__((always_inline)) inline void scaledColors(Ints bits, Floats f, Floats* color) {
  colorsInUnits(bits, asFloats(((bits >> 3) & 0x1F800000) + (87 << 23)) * f, color);
}

// Unit direction of a packed octahedral one, kBits each of u and v from bit kFrom on (formats/pack.h, compact_links.h).
template <int kBits, int kFrom = 0>
__attribute__((always_inline)) inline void unpackDirections(Ints bits, Floats& x, Floats& y, Floats& z) {
  const Ints signBit = Ints{} + INT32_MIN;
  constexpr float kOne = static_cast<float>((1 << (kBits - 1)) - 1);
  constexpr int kRest = 32 - kBits;
  const Floats u = toFloats((bits << (kRest - kFrom)) >> kRest),
               v = toFloats((bits << (kRest - kBits - kFrom)) >> kRest);
  const Floats sizeV = asFloats(asInts(v) & ~signBit), restU = kOne - asFloats(asInts(u) & ~signBit),
               restV = kOne - sizeV;
  const Floats w = restU - sizeV;
  // The lower half is folded outward: |u| becomes what |v| leaves, and |v| what |u| leaves, where that is less.
  const Floats foldedU = limitSize(u, restV), foldedV = limitSize(v, restU);
  const Floats lengthSquared = foldedU * foldedU + foldedV * foldedV + w * w;
#if RELUME_LANES == 16
  // 14 bits of a direction that has six.
  const Floats scale = kBits <= 6 ? roughInverseSqrt(lengthSquared) : inverseSqrt(lengthSquared);
#else
  const Floats scale = inverseSqrt(lengthSquared);
#endif
  x = foldedU * scale;
  y = foldedV * scale;
  z = w * scale;
}

}  // namespace
}  // namespace relume::cpu
