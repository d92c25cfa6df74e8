// SPDX-License-Identifier: MIT
// Radiance records (RCS 3): the light of a point's whole hemisphere, with what is needed to read it elsewhere.
#pragma once

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <cmath>

namespace relume {

// Light of one kind at a record. Columns are R, G, B.
struct RecordLight {
  glm::mat3 vector{0.0f};    // [W/m²] irradiance vector Int L omega d omega: E = I . n, and n x I is the gradient of
                             // rotation
  glm::mat3 gradient{0.0f};  // [W/m³] gradient of translation, in the tangent plane
};

struct Record {
  glm::vec3 positionWorld{0.0f};  // [m] p_k
  glm::vec3 normal{0.0f};         // unit, n_k
  float distance = 0.0f;          // [m] R_k: harmonic mean of the distances to what is seen, no longer than the
                                  // light's own scale |E| / |gradient|; infinite where nothing is seen
  float nearest = 0.0f;           // [m] least distance to what is seen; infinite where nothing is
  float limit = INFINITY;         // [m] beyond which other records have shown this one to be wrong
  float noise = 0.0f;             // [W/m²] standard error of E by the randomness of rays, luminance
  float footprint = 0.0f;         // [m] width of a pixel of the view at p_k
  RecordLight reflected;          // from surfaces
  RecordLight sky;                // straight from the sky
};

// Irradiance [W/m²] at a point and normal from a record's light. offset [m]: the point less p_k.
//
// Erratum: RCS Eq. (8) divides the gradients by E_k, which is undefined where that is 0; here they are absolute. To
// first order I . n is E_k + (n_k x n) . (n_k x I), the term of rotation.
inline glm::vec3 extrapolate(const RecordLight& light, const glm::vec3& offset, const glm::vec3& normal) {
  const glm::vec3 e = normal * light.vector + offset * light.gradient;
  return {e.x > 0.0f ? e.x : 0.0f, e.y > 0.0f ? e.y : 0.0f, e.z > 0.0f ? e.z : 0.0f};
}

}  // namespace relume
