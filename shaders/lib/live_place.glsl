// SPDX-License-Identifier: MIT
// Where a part's vertices lie in the grid: StepPlace of runtime/voxels/step_place.h, line by line. Integers alone, for
// how a driver rounds floating-point sums is its own affair. Pairs of words are 64 bits, the high ones first.

// v 2^shift, cut, at most 2^48.
uvec2 relumeScaled(uvec2 v, int shift) {
  if (v == uvec2(0u)) return v;
  int top = v.x != 0u ? 32 + findMSB(v.x) : findMSB(v.y);
  if (top + shift >= 48) return uvec2(1u << 16, 0u);
  if (shift >= 32) return uvec2(v.y << (shift - 32), 0u);
  if (shift > 0) return uvec2(v.x << shift | v.y >> (32 - shift), v.y << shift);
  if (shift == 0) return v;
  if (shift > -32) return uvec2(v.x >> -shift, v.y >> -shift | v.x << (32 + shift));
  return uvec2(0u, shift > -64 ? v.x >> (-32 - shift) : 0u);
}

uvec2 relumeSum(uvec2 a, uvec2 b) {
  uint carry, low = uaddCarry(a.y, b.y, carry);
  return uvec2(a.x + b.x + carry, low);
}

// A factor times a coordinate, whose bits these are. [2^-16 of a step]
uvec2 relumeProduct(int by, uint bits, int exponent) {
  uint power = bits >> 23 & 255u, mantissa = (bits & 0x7FFFFFu) | (power > 0u ? 0x800000u : 0u);
  uvec2 size;
  umulExtended(uint(abs(by)), mantissa, size.x, size.y);
  uvec2 cut = relumeScaled(size, exponent + int(max(power, 1u)) - 150 + 16);
  return (by < 0) != ((bits >> 31) != 0u) ? relumeSum(~cut, uvec2(0u, 1u)) : cut;
}

int relumeStepsAlong(ivec4 row, int high, int exponent, uvec3 position) {
  uvec2 sum = relumeSum(uvec2(uint(high), uint(row.w)), uvec2(0u, 1u << 15));
  for (int c = 0; c < 3; ++c) sum = relumeSum(sum, relumeProduct(row[c], position[c], exponent));
  int top = int(sum.x);
  return top >= 1 << 13 ? 1 << 29 : top < -(1 << 13) ? -(1 << 29) : int(sum.x << 16 | sum.y >> 16);
}

// [1/64 voxel] from the grid's corner. position: the bits of its floats.
ivec3 relumeStepsOf(RelumePlace place, uvec3 position) {
  return ivec3(relumeStepsAlong(place.x, place.high.x, place.exponent, position),
               relumeStepsAlong(place.y, place.high.y, place.exponent, position),
               relumeStepsAlong(place.z, place.high.z, place.exponent, position));
}
