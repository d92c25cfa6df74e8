// SPDX-License-Identifier: MIT
// RCS Table 1: error of irradiance by the pixels of a plane, by kind of plane, against a fine fan of the whole
// hemisphere at the same points, which the level's cameras see, under the same light, which is reflected once.
#include "tests/measure/preview_tables.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/preview/gather.h"
#include "bake/preview/receivers.h"
#include "tools/render/hemispheres_gl.h"

#include <glm/geometric.hpp>

#include <array>
#include <cmath>

namespace relume {
namespace {

constexpr std::uint32_t kWidth = 320, kHeight = 180;
constexpr std::uint32_t kTruthRays = 16384;
constexpr float kWideFovRad = 2.6516353f;  // half a side of the plane is four times its distance

using Irradiances = std::vector<glm::dvec3>;

// Points that the cameras see, in random pixels.
std::vector<PixelReceiver> findPoints(const RayTracer& tracer, std::size_t count, Context& context) {
  std::vector<PixelReceiver> points;
  const Scene& scene = tracer.scene();
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const CameraRays camera(scene.cameras[c], kWidth, kHeight);
    const std::vector<PixelReceiver> seen = findReceivers(tracer, camera, context);
    RandomStream random(1, 0, c);
    const std::size_t until = (c + 1) * count / scene.cameras.size();
    for (std::size_t tries = 0; points.size() < until && tries < 100 * count; ++tries) {
      const PixelReceiver& r = seen[random.below(kWidth * kHeight)];
      if (r.normal != glm::vec3(0.0f)) points.push_back(r);
    }
  }
  return points;
}

// The three kinds of one plane, which differ by what a pixel counts for.
struct Planes {
  explicit Planes(float fovRad, std::uint32_t side = 64)
      : kinds{planeCells(side, fovRad, Hemisphere::plane), planeCells(side, fovRad, Hemisphere::scaled),
              planeCells(side, fovRad, Hemisphere::border)} {}
  std::array<HemisphereCells, 3> kinds;

  glm::dvec3 sum(std::size_t kind, std::span<const glm::vec3> radiance) const {
    glm::dvec3 e(0.0);
    for (std::size_t i = 0; i < radiance.size(); ++i) e += double{kinds[kind].integral[i].z} * glm::dvec3(radiance[i]);
    return e;
  }
};

Irradiances byFan(const LitLevel& level, const std::vector<PixelReceiver>& points, std::uint32_t rays,
                  Context& context) {
  RecordGatherer::Options options;
  options.rays = rays;
  const RecordGatherer gatherer(*level.tracer, level.light, level.sky, options);
  Irradiances found(points.size());
  parallelChunks(context, "", points.size(), 16, [&](std::size_t begin, std::size_t end) {
    RecordGatherer::Scratch scratch;
    for (std::size_t i = begin; i < end; ++i) {
      const Record record = gatherer.gather(points[i], i, scratch);
      found[i] = glm::dvec3(record.normal * record.reflected.vector);
    }
  });
  return found;
}

RecordGatherer::Options planeOptions(float fovRad, std::uint32_t side = 64) {
  RecordGatherer::Options options;
  options.hemisphere = Hemisphere::plane;
  options.planeFovRad = fovRad;
  options.planeSide = side;
  return options;
}

std::array<Irradiances, 3> byRays(const LitLevel& level, const std::vector<PixelReceiver>& points, float fovRad,
                                  Context& context, std::uint32_t side = 64) {
  const RecordGatherer gatherer(*level.tracer, level.light, level.sky, planeOptions(fovRad, side));
  const Planes planes(fovRad, side);
  std::array<Irradiances, 3> found;
  found.fill(Irradiances(points.size()));
  parallelChunks(context, "", points.size(), 16, [&](std::size_t begin, std::size_t end) {
    RecordGatherer::Scratch scratch;
    for (std::size_t i = begin; i < end; ++i) {
      gatherer.gather(points[i], i, scratch);
      for (std::size_t kind = 0; kind < 3; ++kind) found[kind][i] = planes.sum(kind, scratch.reflected);
    }
  });
  return found;
}

#ifdef RELUME_RENDER_GL
// The same pixels drawn by OpenGL; empty where there is none.
std::array<Irradiances, 3> byGl(const LitLevel& level, const std::vector<PixelReceiver>& points, float fovRad) {
  std::array<Irradiances, 3> found;
  const auto hemispheres = drawHemispheresByGl(level.scene, level.lights, PreviewOptions{}, 4096);
  if (!hemispheres) {
    std::fprintf(stderr, "%s\n", hemispheres.error().message.c_str());
    return found;
  }
  found.fill(Irradiances(points.size()));
  const RecordGatherer gatherer(*level.tracer, level.light, level.sky, planeOptions(fovRad));
  const Planes planes(fovRad);
  constexpr std::size_t kBatch = 64;
  const std::size_t pixels = gatherer.cells().count();
  std::vector<glm::mat4> poses;
  std::vector<glm::vec3> radiance(kBatch * pixels);
  std::vector<float> distance(kBatch * pixels);
  RecordGatherer::Scratch scratch;
  for (std::size_t first = 0; first < points.size(); first += kBatch) {
    poses.clear();
    for (std::size_t i = first; i < std::min(first + kBatch, points.size()); ++i)
      poses.push_back(gatherer.poseOf(points[i]));
    const std::size_t count = poses.size() * pixels;
    hemispheres->draw(poses, std::span(radiance).first(count), std::span(distance).first(count));
    for (std::size_t k = 0; k < poses.size(); ++k) {
      gatherer.gatherDrawn(points[first + k], std::span(radiance).subspan(k * pixels, pixels),
                           std::span(distance).subspan(k * pixels, pixels), scratch);
      for (std::size_t kind = 0; kind < 3; ++kind) found[kind][first + k] = planes.sum(kind, scratch.reflected);
    }
  }
  return found;
}
#endif

void printRow(const char* name, const Irradiances& found, const Irradiances& truth) {
  double square = 0.0, sum = 0.0, relative = 0.0, energy = 0.0, total = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const glm::dvec3 d = found[i] - truth[i];
    square += glm::dot(d, d);
    sum += glm::dot(truth[i], truth[i]);
    if (glm::length(truth[i]) > 0.0) relative += glm::length(d) / glm::length(truth[i]);
    energy += found[i].x + found[i].y + found[i].z;
    total += truth[i].x + truth[i].y + truth[i].z;
  }
  std::printf("| %s | %.1f | %.1f | %.3f |\n", name, 100.0 * std::sqrt(square / sum),
              100.0 * relative / static_cast<double>(truth.size()), energy / total);
  std::fflush(stdout);
}

void printLevel(const std::string& scenes, const std::string& name, const std::string& lights, std::size_t count) {
  Context context;
  const LitLevel level(scenes + "/" + name + "/" + name + ".glb", lights, {}, context);
  const std::vector<PixelReceiver> points = findPoints(*level.tracer, count, context);
  const Irradiances truth = byFan(level, points, kTruthRays, context);
  std::printf("\n| %s, %s: %zu points | RMS %% | mean %% | energy |\n|---|---:|---:|---:|\n", name.c_str(),
              lights.c_str(), points.size());
  const RecordGatherer::Options usual;
  const auto rays = byRays(level, points, usual.planeFovRad, context);
  printRow("`plane`", rays[0], truth);
  printRow("`scaled`", rays[1], truth);
  printRow("`border`", rays[2], truth);
  // Every tenth point: a rasteriser in software draws a hundred large levels a second.
  const auto some = [](const auto& all) {
    std::decay_t<decltype(all)> tenth;
    for (std::size_t i = 0; i < all.size(); i += 10) tenth.push_back(all[i]);
    return tenth;
  };
  const Irradiances someTruth = some(truth);
  printRow("`plane`, every tenth point", some(rays[0]), someTruth);
  printRow("`scaled`, every tenth point", some(rays[1]), someTruth);
  printRow("`border`, every tenth point", some(rays[2]), someTruth);
  printRow("`border` of 256 x 256, the same points", byRays(level, some(points), usual.planeFovRad, context, 256)[2],
           someTruth);
#ifdef RELUME_RENDER_GL
  if (!level.emitters) {
    const auto drawn = byGl(level, some(points), usual.planeFovRad);
    if (!drawn[0].empty()) {
      printRow("OpenGL, `plane`, the same points", drawn[0], someTruth);
      printRow("OpenGL, `scaled`, the same points", drawn[1], someTruth);
      printRow("OpenGL, `border`, the same points", drawn[2], someTruth);
    }
  }
#endif
  const auto wide = byRays(level, points, kWideFovRad, context);
  printRow("t = 4, `plane`", wide[0], truth);
  printRow("t = 4, `scaled`", wide[1], truth);
  printRow("t = 4, `border`", wide[2], truth);
  printRow("fan of 4096 rays", byFan(level, points, 4096, context), truth);
}

}  // namespace

void printTable1(const std::string& scenes, std::size_t points, const std::string& only) {
  std::printf("RCS Table 1, Sibenik: plane 18.1 %%, scaled 10.4 %%, border 5.8 %% RMS\n");
  const std::array<std::pair<const char*, const char*>, 9> kLit{{{"cornell", "emissive"},
                                                                 {"cornell", "spot"},
                                                                 {"sponza", "torch"},
                                                                 {"sponza", "spot"},
                                                                 {"sponza", "sun"},
                                                                 {"pandora", "lamp"},
                                                                 {"pandora", "sun"},
                                                                 {"breakfast_room", "lamp_a,lamp_b"},
                                                                 {"breakfast_room", "sun"}}};
  for (const auto& [level, lights] : kLit) {
    if (only.empty() || only == level) printLevel(scenes, level, lights, points);
  }
}

}  // namespace relume
