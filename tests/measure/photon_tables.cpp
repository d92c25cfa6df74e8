// SPDX-License-Identifier: MIT
// Figures 2, 4 and 5 of IVG once more: docs/notes/vectors.md.
//
//   bench_photon_grid SHARED SOURCE PICTURES [geometry|access|all]
#include "tests/measure/photon_tables.h"

#include "bake/base/parallel.h"
#include "bake/reference/path_tracer.h"
#include "tests/measure/traced_light.h"

#include <glm/geometric.hpp>

namespace relume::test {
namespace {

// Light(pixel) for all pixels that show a surface.
template <class Light>
std::vector<glm::vec3> forPixels(const SeenPixels& pixels, Context& context, const Light& light) {
  std::vector<glm::vec3> found(pixels.position.size(), glm::vec3(0.0f));
  parallelChunks(context, "", found.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (pixels.normal[i] != glm::vec3(0.0f)) found[i] = light(i) / kPathPi;
    }
  });
  return found;
}

// What a surface sends back along a ray.
glm::vec3 reflectedBy(const Hit& hit, const PhotonGrid& grid, const GridRead& read, const RayTracer& tracer,
                      std::span<const SceneLight> lights) {
  const Scene& scene = tracer.scene();
  const SurfacePoint p = hit.point();
  const auto c = scene.corners(scene.instances[p.instance], p.triangle);
  glm::vec3 n = geometricNormal(scene, p);
  if (hit.back) n = -n;
  glm::vec3 at = c[0] + (c[1] - c[0]) * p.barycentric.x + (c[2] - c[0]) * p.barycentric.y;
  at += n * tracer.epsilonAt(at);
  return albedoAt(scene, p) / kPathPi * (directIrradiance(tracer, lights, at, n) + read(grid, at, n));
}

}  // namespace

std::vector<glm::vec3> readDirectly(const SeenPixels& pixels, const PhotonGrid& grid, const GridRead& read,
                                    Context& context) {
  return forPixels(pixels, context, [&](std::size_t i) { return read(grid, pixels.position[i], pixels.normal[i]); });
}

std::vector<glm::vec3> readIndirectly(const SeenPixels& pixels, const PhotonGrid& grid, const GridRead& read,
                                      const RayTracer& tracer, std::span<const SceneLight> lights, int rays,
                                      Context& context) {
  return forPixels(pixels, context, [&](std::size_t i) {
    RandomStream random(21, 0x69766772, i);
    const glm::vec3 n = pixels.normal[i], origin = pixels.position[i] + n * tracer.epsilonAt(pixels.position[i]);
    glm::vec3 sum(0.0f);
    for (int k = 0; k < rays; ++k) {
      if (const Hit hit = tracer.trace({origin, 0.0f, cosineDirection(n, random.uniform2())}))
        sum += reflectedBy(hit, grid, read, tracer, lights);
    }
    return kPathPi / static_cast<float>(rays) * sum;
  });
}

}  // namespace relume::test

int main(int argc, char** argv) {
  const std::string which = argc > 4 ? argv[4] : "all";
  if (argc < 4 || (which != "geometry" && which != "access" && which != "all"))
    return std::fprintf(stderr, "usage: bench_photon_grid SHARED SOURCE PICTURES [geometry|access|all]\n"), 1;
  if (which != "access") relume::test::printGeometry(argv[1], argv[3]);
  if (which != "geometry") relume::test::printAccess(argv[1], argv[2], argv[3]);
  return 0;
}
