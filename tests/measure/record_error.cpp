// SPDX-License-Identifier: MIT
// RCS Table 1: error of irradiance by the pixels of a plane, by kind of plane, against a fine fan of the whole
// hemisphere at the same points, which the level's cameras see, under the same light, which is reflected once.
//
//   bench_record_error LEVEL.glb LIGHT[,LIGHT...] [POINTS]
#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/preview/gather.h"
#include "bake/preview/receivers.h"
#include "relume/bake/context.h"

#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr std::uint32_t kWidth = 320, kHeight = 180;
constexpr std::uint32_t kTruthRays = 16384, kPlaneSide = 64;

// Points that the cameras see, in random pixels.
std::vector<PixelReceiver> findPoints(const RayTracer& tracer, std::size_t count, Context& context) {
  std::vector<PixelReceiver> points;
  const Scene& scene = tracer.scene();
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const CameraRays camera(scene.cameras[c], kWidth, kHeight);
    const std::vector<PixelReceiver> seen = findReceivers(tracer, camera, context);
    RandomStream random(1, 0, c);
    const std::size_t until = (c + 1) * count / scene.cameras.size();
    for (std::uint32_t tries = 0; points.size() < until && tries < 100 * count; ++tries) {
      const PixelReceiver& r = seen[random.below(kWidth * kHeight)];
      if (r.normal != glm::vec3(0.0f)) points.push_back(r);
    }
  }
  return points;
}

std::vector<glm::dvec3> gatherAll(const RayTracer& tracer, const HitRadiance& light,
                                  const std::vector<PixelReceiver>& points, const RecordGatherer::Options& options,
                                  Context& context) {
  const Sky dark;
  const RecordGatherer gatherer(tracer, light, dark, options);
  std::vector<glm::dvec3> irradiance(points.size());
  parallelChunks(context, "", points.size(), 16, [&](std::size_t begin, std::size_t end) {
    RecordGatherer::Scratch scratch;
    for (std::size_t i = begin; i < end; ++i) {
      const Record record = gatherer.gather(points[i], i, scratch);
      irradiance[i] = glm::dvec3(record.normal * record.reflected.vector);
    }
  });
  return irradiance;
}

int measure(const std::string& level, const std::string& lightNames, std::size_t count) {
  Context context;
  const auto scene = importGltf(level, context);
  if (!scene) return std::fprintf(stderr, "%s\n", scene.error().message.c_str()), 1;
  const auto tracer = RayTracer::create(*scene, "", context, RayStructure::bundles);
  if (!tracer) return std::fprintf(stderr, "%s\n", tracer.error().message.c_str()), 1;
  std::vector<SceneLight> lights;
  for (const SceneLight& light : scene->lights) {
    if (("," + lightNames + ",").find("," + light.name + ",") != std::string::npos) lights.push_back(light);
  }
  if (lights.empty() || scene->cameras.empty())
    return std::fprintf(stderr, "%s: a camera and lights of those names expected\n", level.c_str()), 1;
  const Sky dark;
  const HitRadiance light = directRadiance(*tracer, *tracer, lights, nullptr, dark, 1);

  const std::vector<PixelReceiver> points = findPoints(*tracer, count, context);
  RecordGatherer::Options options;
  options.rays = kTruthRays;
  const std::vector<glm::dvec3> truth = gatherAll(*tracer, light, points, options, context);
  std::printf("%s, %s: %zu points\n", level.c_str(), lightNames.c_str(), points.size());
  const std::array<std::pair<const char*, Hemisphere>, 4> kinds{{{"fan of 4096", Hemisphere::fan},
                                                                 {"plane", Hemisphere::plane},
                                                                 {"scaled", Hemisphere::scaled},
                                                                 {"border", Hemisphere::border}}};
  for (const auto& [name, kind] : kinds) {
    options.hemisphere = kind;
    options.rays = kPlaneSide * kPlaneSide;
    options.planeSide = kPlaneSide;
    const std::vector<glm::dvec3> found = gatherAll(*tracer, light, points, options, context);
    double square = 0.0, sum = 0.0, relative = 0.0, energy = 0.0, total = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const glm::dvec3 d = found[i] - truth[i];
      square += glm::dot(d, d);
      sum += glm::dot(truth[i], truth[i]);
      if (glm::length(truth[i]) > 0.0) relative += glm::length(d) / glm::length(truth[i]);
      energy += found[i].x + found[i].y + found[i].z;
      total += truth[i].x + truth[i].y + truth[i].z;
    }
    std::printf("  %-12s RMS %5.1f %%, mean %5.1f %%, energy %.3f\n", name, 100.0 * std::sqrt(square / sum),
                100.0 * relative / static_cast<double>(points.size()), energy / total);
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "bench_record_error LEVEL.glb LIGHT[,LIGHT...] [POINTS]\n"), 1;
  return relume::measure(argv[1], argv[2], argc > 3 ? std::strtoul(argv[3], nullptr, 10) : 1000);
}
