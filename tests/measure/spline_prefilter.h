// SPDX-License-Identifier: MIT
// Coefficients of the cubic B-spline that passes through given values at the points of a lattice.
#pragma once

#include <glm/vec3.hpp>

#include <cstddef>
#include <span>

namespace relume::test {

// Replace values, `stride` numbers a point with x fastest, by coefficients: a spline over them, whose border points go
// on for ever as those of readGridTexture() do, has the values at the points. Along each axis it is the system
// c[i-1] + 4 c[i] + c[i+1] = 6 v[i], solved by elimination, which is the recursive filter with the pole sqrt(3) - 2 and
// that border. [Size values = stride * points]
void prefilterSpline(std::span<float> values, const glm::uvec3& resolution, std::size_t stride);

}  // namespace relume::test
