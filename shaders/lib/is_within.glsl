// SPDX-License-Identifier: MIT
// Whether a vector of the host's is finite and no longer than it may be along any axis.
// By bits: drivers may take comparisons with what is no number either way.
bool relumeIsWithin(vec3 v, float most) {
  uvec3 exponent = floatBitsToUint(v) & 0x7F800000u;
  return all(notEqual(exponent, uvec3(0x7F800000u))) && all(lessThanEqual(abs(v), vec3(most)));
}
