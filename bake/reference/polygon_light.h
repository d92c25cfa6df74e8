// SPDX-License-Identifier: MIT
// Light of a triangle of radiance 1 that nothing is in the way of.
#pragma once

#include <glm/vec3.hpp>

#include <array>

namespace relume {

// [sr] Irradiance over radiance at the origin from what of a triangle is above two planes through it: the integral of
// the cosine to `shading` over the solid angle, Lambert's formula (Photometria, 1760). corners [m], relative to the
// point that is lit; either winding. Normals must be unit; 0 where the point lies in the triangle's plane.
float openTriangleLight(const std::array<glm::vec3, 3>& corners, const glm::vec3& shading, const glm::vec3& geometric);

}  // namespace relume
