// SPDX-License-Identifier: MIT
// formats/pack.h, as far as shaders need it, and the packed radiosity of nodes (runtime/gl/pack_node.h).

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

// Radiosity of a node: Y as a float, Co / 2Y and Cg / Y as 16-bit signed normalised integers. For colours without
// negative parts |Co| <= 2 Y and |Cg| <= Y, so nothing clips, whatever the unit.
uvec2 relumePackNode(vec3 yCoCg) {
  if (!(yCoCg.x > 0.0)) return uvec2(0u);
  vec2 chroma = clamp(yCoCg.yz / (yCoCg.x * vec2(2.0, 1.0)), -1.0, 1.0) * 32767.0;
  ivec2 rounded = ivec2(roundEven(chroma));
  return uvec2(floatBitsToUint(yCoCg.x), (uint(rounded.x) & 0xFFFFu) | (uint(rounded.y) << 16));
}

vec3 relumeUnpackNode(uvec2 node) {
  float y = uintBitsToFloat(node.x);
  return vec3(y, relumeUnpackSnorm16x2(node.y) * (y * vec2(2.0, 1.0)));
}
