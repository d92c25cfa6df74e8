// SPDX-License-Identifier: MIT
// What surfaces mirror, in hemispherical harmonics: the coefficients c_lm of RCS Eq. (9), by which a radiance record's
// light is read.
//
// A lobe cos^n about the reflected direction r, in the frame of the surface, depends on the angle between r and the
// normal, and is turned with r about the normal. Coefficients of lobes whose r lies over +X are kept at whole steps of
// that angle and of the exponent, and are linear between them.
#pragma once

#include "bake/preview/hsh.h"
#include "relume/bake/context.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace relume {

// The sharpest lobe that order 10 carries: Phong's exponent of RCS Fig. 9(b), a roughness of 0.395.
// (docs/notes/preview.md)
inline constexpr float kMaxRecordExponent = 20.0f;

// What is projected. mean: the lobe over its integral above the surface, as materials mirror it (relume/glossy.h), so
// that a uniform world is reflected as it is. phong: f cos theta of the BRDF f = (n + 2) / (2 pi) cos^n that RCS has.
enum class LobeKind { mean, phong };

// Immutable after it is made; any thread.
class LobeTable {
 public:
  static constexpr std::size_t kAngles = 64;     // of r from the normal, 0 to 90 degrees
  static constexpr std::size_t kExponents = 24;  // 1 to kMaxRecordExponent, by equal ratios

  // [order 1..kMaxHshOrder]
  LobeTable(int order, LobeKind kind, Context& context);

  // c_lm of a lobe about a unit axis in the surface's frame. An axis below the horizon is read at it, exponents outside
  // 1..kMaxRecordExponent at those, NaN at 1. [Size c >= order²]
  void evaluate(float exponent, const glm::vec3& axis, std::span<float> c) const;
  // Int of the lobe above the surface [sr]: 2 pi / (n + 1) for an axis along the normal, about half of that at the
  // horizon. cosine: of the axis.
  float integral(float exponent, float cosine) const;

  int order() const { return order_; }
  // Of lobes whose r lies over +X, of the functions of m >= 0, by exponent, then angle. [Size kExponents * kAngles *
  // order (order + 1) / 2]
  std::span<const float> coefficients() const { return coefficients_; }

 private:
  struct Place {
    std::size_t entry[4];
    float share[4];
  };
  Place placeOf(float exponent, float cosine) const;

  int order_;
  std::vector<int> even_;            // indices of the functions with m >= 0, the others are 0 where r is over +X
  std::vector<float> coefficients_;  // [Size kExponents * kAngles * even]
  std::vector<float> integral_;      // [Size kExponents * kAngles]
};

}  // namespace relume
