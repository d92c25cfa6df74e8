// SPDX-License-Identifier: MIT
// What the parts of bench_photon_grid share: what a camera sees, lit by a grid of photons.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "tests/reference/photon_grid.h"
#include "tools/images/image_io.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume::test {

[[noreturn]] inline void stop(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  std::exit(1);
}

template <class T>
T orStop(Result<T> result) {
  if (!result) stop(result.error().message);
  return std::move(*result);
}

// [s] of the processor, all threads: other programs do not count.
template <class Work>
double secondsOf(const Work& work) {
  const auto begin = std::clock();
  work();
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

// The surfaces at the pixels' centres; normals of length 0 where there is none.
struct SeenPixels {
  std::uint32_t width = 0, height = 0;
  std::vector<glm::vec3> position, normal;  // [m]; unit, toward the viewer
};

// How the grid is read: by a cubic B-spline or trilinearly; [spacings] how far off the surface, along its normal.
struct GridRead {
  bool smooth = false;
  float off = 0.0f;
  DirectionWeights weights = DirectionWeights::corrected;

  glm::vec3 operator()(const PhotonGrid& grid, const glm::vec3& position, const glm::vec3& normal) const {
    return grid.irradiance(position + off * grid.spacing() * normal, normal, smooth, weights);
  }
};

// Irradiance / pi of pixels as the grid has it (IVG 4.1).
std::vector<glm::vec3> readDirectly(const SeenPixels& pixels, const PhotonGrid& grid, const GridRead& read,
                                    Context& context);
// The same by rays from each pixel: where they end they find the lights, and read the grid (IVG 4.3).
std::vector<glm::vec3> readIndirectly(const SeenPixels& pixels, const PhotonGrid& grid, const GridRead& read,
                                      const RayTracer& tracer, std::span<const SceneLight> lights, int rays,
                                      Context& context);

// IVG's Fig. 2: a picture in `folder`, a table on standard output. Figs. 4 and 5: likewise. `shared`: folder of the
// levels, scenes/level/level.glb, and of their references; `source`: that of the project.
void printGeometry(const std::string& shared, const std::string& folder);
void printAccess(const std::string& shared, const std::string& source, const std::string& folder);

}  // namespace relume::test
