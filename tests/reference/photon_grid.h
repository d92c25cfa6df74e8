// SPDX-License-Identifier: MIT
// IVG's own way to its grid, as an oracle: photons from the lights, reflected stochastically, whose ways between
// surfaces add to the irradiance vectors of the points that they pass (IVG 3.3). Six vectors a point for each colour,
// not compressed; read trilinearly or by a cubic B-spline (IVG 4.1).
//
// A photon travels from one surface to the next, found first; then its way walks the grid without asking for surfaces.
// w = -travel is where its light comes from.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/reference/emitters.h"
#include "formats/irradiance_vector.h"
#include "relume/bake/context.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relume::test {

// What a way adds to the vectors.
//   printed    where it passes a face of the lattice, flux w / A to the nearest point, for the half that the face's
//   axis
//              and w say; A is the part of the face that is the point's.
//   corrected  Erratum: the same over |cosine| to the axis, since a face counts flux, radiance times cosine. The
//              cosine is clamped to kMinCosine, for without a bound the variance is infinite.
//   length     Deviation: flux w times the length in a point's dual cell over the cell's volume, for all three halves
//              that w is in. The mean over the cell without bias, and bounded.
enum class PhotonEstimator { printed, corrected, length };
inline constexpr float kMinCosine = 0.05f;

class PhotonGrid {
 public:
  using Vectors = std::array<SixVectors, 3>;  // of R, G, B [W/m²]

  // resolution: points along each axis, the outer ones on the box. [resolution >= 2]
  PhotonGrid(const glm::vec3& low, const glm::vec3& high, const glm::uvec3& resolution, PhotonEstimator estimator);

  // A photon of some flux [W] that goes from one point to another; what is outside the box does not count.
  void addWay(const glm::vec3& from, const glm::vec3& to, const glm::vec3& flux);
  void add(const PhotonGrid& other);

  std::size_t indexOf(const glm::uvec3& point) const {
    return (std::size_t{point.z} * resolution_.y + point.y) * resolution_.x + point.x;
  }
  const Vectors& at(const glm::uvec3& point) const { return vectors_[indexOf(point)]; }
  // [m²] the part of the faces across an axis that is a point's: a half on the box's sides, a quarter on its edges.
  float faceArea(const glm::uvec3& point, int axis) const;
  // [m³]
  float cellVolume(const glm::uvec3& point) const;
  const glm::vec3& spacing() const { return spacing_; }  // [m]
  std::size_t bytes() const { return vectors_.size() * sizeof(Vectors); }

  // Irradiance [W/m²] for a unit normal, not negative. smooth: by a cubic B-spline.
  glm::vec3 irradiance(const glm::vec3& position, const glm::vec3& normal, bool smooth,
                       DirectionWeights weights = DirectionWeights::corrected) const;

 private:
  float side(const glm::uvec3& point, int axis) const;
  void addFaces(const glm::vec3& from, const glm::vec3& to, const glm::vec3& flux);
  void addCells(const glm::vec3& from, const glm::vec3& to, const glm::vec3& flux);
  void addVector(const glm::uvec3& point, int axis, const glm::vec3& w, const glm::vec3& flux);

  glm::vec3 low_, spacing_;
  glm::uvec3 resolution_;
  PhotonEstimator estimator_;
  std::vector<Vectors> vectors_;
};

struct PhotonLight {
  std::span<const SceneLight> lights;
  const EmittingTriangles* emitters = nullptr;  // null: none
};

// Trace photons into a grid, which must be empty: light that was reflected at least once. The same at any number of
// threads. [photons >= 1]
void tracePhotons(const RayTracer& tracer, const PhotonLight& light, std::uint64_t photons, std::uint64_t seed,
                  PhotonGrid& grid, Context& context);

}  // namespace relume::test
