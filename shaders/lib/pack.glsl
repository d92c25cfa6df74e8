// SPDX-License-Identifier: MIT
// formats/pack.h, as far as shaders need it, surfels (runtime/shared/pack_surfel.h) and colours (runtime/shared/pack_color.h).

vec2 relumeUnpackSnorm16x2(uint bits) {
  ivec2 v = ivec2(int(bits << 16) >> 16, int(bits) >> 16);
  return max(vec2(v) / 32767.0, -1.0);
}

vec2 relumeUnpackUnorm16x2(uint bits) { return vec2(bits & 0xFFFFu, bits >> 16) / 65535.0; }

// Unit direction; zero for the code of no direction.
vec3 relumeUnpackOctahedral(uint bits) {
  if (bits == 0x80008000u) return vec3(0.0);
  vec2 p = relumeUnpackSnorm16x2(bits);
  vec3 d = vec3(p, 1.0 - abs(p.x) - abs(p.y));
  float fold = max(-d.z, 0.0);
  d.xy -= vec2(p.x < 0.0 ? -fold : fold, p.y < 0.0 ? -fold : fold);
  return normalize(d);
}

// runtime/shared/half_scale.h: a factor on numbers that belong together, the largest of which has that magnitude.
float relumeHalfScale(float largest) { return largest > 65504.0 ? 65504.0 / largest : 1.0; }

float relumeLargest(vec4 v) {
  v = abs(v);
  return max(max(v.x, v.y), max(v.z, v.w));
}

// Parts of compact links (formats/compact_links.h): f of a head; direction of n bits each of u and v; cos alpha.
float relumeUnpackTransfer(uint head) { return unpackHalf2x16((head >> 18) & 0x3FFCu).x; }

vec3 relumeUnpackDirection(uint bits, int n) {
  ivec2 v = ivec2(int(bits << uint(32 - n)) >> (32 - n), int(bits << uint(32 - 2 * n)) >> (32 - n));
  vec2 p = max(vec2(v) / float((1 << (n - 1)) - 1), -1.0);
  vec3 d = vec3(p, 1.0 - abs(p.x) - abs(p.y));
  float fold = max(-d.z, 0.0);
  d.xy -= vec2(p.x < 0.0 ? -fold : fold, p.y < 0.0 ? -fold : fold);
  return normalize(d);
}

float relumeUnpackCone(uint bits, int shift, int n) {
  uint most = (1u << uint(n)) - 1u;
  float q = float((bits >> uint(shift)) & most) / float(most);
  return 1.0 - 2.0 * q * q;
}

// Colours without negative parts in 32 bits, rounded down after adding `dither` of [0,1).
float relumeDither(uint i) { return float((i * 2654435769u) >> 8) * 5.9604644775390625e-8; }

uint relumePackColor(vec3 rgb, float dither) {
  float largest = max(max(rgb.r, rgb.g), rgb.b);
  int exponent = clamp((floatBitsToInt(largest) >> 23) - 95, 0, 63);
  float scale = intBitsToFloat((167 - exponent) << 23);
  uvec3 part = uvec3(clamp(rgb * (scale * vec3(1.0, 1.0, 0.5)) + dither, vec3(0.0), vec3(511.0, 511.0, 255.0)));
  return part.r | (part.g << 9) | (part.b << 18) | (uint(exponent) << 26);
}

vec3 relumeUnpackColor(uint bits) {
  float scale = uintBitsToFloat(((bits >> 26) + 87u) << 23);
  return vec3(bits & 511u, (bits >> 9) & 511u, (bits >> 18) & 255u) * (scale * vec3(1.0, 1.0, 2.0));
}
