// SPDX-License-Identifier: MIT
// The lobe of resolve.cpp as the nine coefficients of three bands, written out: A_l y_l^m(n) and (4 pi / 3) y_1^m(n).
// In an anonymous namespace for the same reason as vectors.h.
#pragma once

namespace relume::cpu {
namespace {

// Float: a number, or a vector with one number per lane; n: its x, y, z; linear, clamped: SurfaceLobe.
template <class Float, class Normal>
inline void writeLobe(bool hasBand1, bool hasBand2, const Normal& n, Float linear, Float clamped, Float* lobe) {
  constexpr float kPi = 3.14159265f;
  const Float band1 = hasBand1 ? (clamped * (2.0f / 3.0f) + linear * (4.0f / 3.0f)) * (kPi * 0.488602512f) : Float{};
  const Float band2 = hasBand2 ? clamped * (0.25f * kPi) : Float{};
  lobe[0] = clamped * (kPi * 0.282094792f);
  lobe[1] = band1 * n.y;
  lobe[2] = band1 * n.z;
  lobe[3] = band1 * n.x;
  lobe[4] = band2 * 1.092548431f * n.x * n.y;
  lobe[5] = band2 * 1.092548431f * n.y * n.z;
  lobe[6] = band2 * 0.315391565f * (3.0f * n.z * n.z - 1.0f);
  lobe[7] = band2 * 1.092548431f * n.x * n.z;
  lobe[8] = band2 * 0.546274215f * (n.x * n.x - n.y * n.y);
}

}  // namespace
}  // namespace relume::cpu
