// SPDX-License-Identifier: MIT
// Light of a triangle of radiance 1 that nothing is in the way of, and the integral that it is made of.
#pragma once

#include <glm/vec3.hpp>

#include <array>

namespace relume {

// Of omega x d omega along the arc between two directions, of any length: half its sum around a patch of the sphere,
// the patch on the left, is the integral of omega over it (Lambert, Photometria, 1760). 0 where the two are parallel.
glm::dvec3 lambertArc(const glm::dvec3& from, const glm::dvec3& to);

// [sr] Irradiance over radiance at the origin from what of a triangle is above two planes through it: the integral of
// the cosine to `shading` over the solid angle. corners [m], relative to the point that is lit; either winding. Normals
// must be unit; 0 where the point lies in the triangle's plane.
float openTriangleLight(const std::array<glm::vec3, 3>& corners, const glm::vec3& shading, const glm::vec3& geometric);

}  // namespace relume
