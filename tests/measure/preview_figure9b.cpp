// SPDX-License-Identifier: MIT
// RCS Fig. 9(b): the Cornell box with a glossy back wall, exponent 20, a = 0.25, 1000 x 1000 pixels. The wall is a
// metal of the roughness that has this exponent; what it mirrors of light that is reflected once is compared with a
// path tracer's.
#include "tests/measure/preview_tables.h"

#include "bake/preview/glossy_lobe.h"
#include "bake/preview/mirror_surface.h"
#include "bake/preview/preview.h"
#include "bake/preview/radiance_records.h"
#include "bake/reference/path_tracer.h"
#include "formats/color.h"
#include "relume/glossy.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

namespace relume {
namespace {

constexpr float kExponent = 20.0f;
constexpr std::uint32_t kSide = 1000, kSamples = 64;
constexpr std::uint32_t kBlock = 10;  // pixels along the side of what is compared: noise of the reference averages out

// Mean luminance of the wall's pixels in blocks, in those that lie on the wall as a whole.
std::vector<double> blocksOf(const std::vector<glm::vec3>& layer, const std::vector<std::uint8_t>& wall) {
  std::vector<double> blocks;
  for (std::uint32_t y = 0; y < kSide; y += kBlock) {
    for (std::uint32_t x = 0; x < kSide; x += kBlock) {
      double sum = 0.0;
      std::uint32_t count = 0;
      for (std::uint32_t i = 0; i < kBlock * kBlock; ++i) {
        const std::size_t pixel = std::size_t{y + i / kBlock} * kSide + x + i % kBlock;
        sum += static_cast<double>(luminance(layer[pixel]));
        count += wall[pixel];
      }
      if (count == kBlock * kBlock) blocks.push_back(sum / count);
    }
  }
  return blocks;
}

// Of a layer against the truth: RMSE over the mean, less the truth's own noise, and energy.
void printError(const std::vector<glm::vec3>& layer, const std::vector<double>& truth, const std::vector<double>& noise,
                const std::vector<std::uint8_t>& wall) {
  const std::vector<double> found = blocksOf(layer, wall);
  double squares = 0.0, noisy = 0.0, sum = 0.0, total = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    squares += (found[i] - truth[i]) * (found[i] - truth[i]);
    noisy += noise[i] * noise[i];
    sum += truth[i];
    total += found[i];
  }
  const double count = static_cast<double>(truth.size()), mean = sum / count;
  std::printf(" %.2f (noise %.2f) | %.4f |\n", 100.0 * std::sqrt(std::max(0.0, squares - noisy) / count) / mean,
              100.0 * std::sqrt(noisy / count) / mean, total / sum);
  std::fflush(stdout);
}

void printLit(const std::string& scenes, const std::string& light) {
  Context context;
  LitLevel level(scenes + "/cornell/cornell.glb", light, {}, context);
  for (Material& material : level.scene.materials) material.gloss.metalness = 0.0f;
  MaterialGloss& back = level.material("backWall").gloss;
  back.metalness = 1.0f;
  back.roughness = glossyRoughness(kExponent);
  const Camera& view = level.camera("cam_front");

  // 1. The truth, light reflected once before the wall, and which pixels show the wall
  ReferenceOptions traced;
  traced.width = traced.height = kSide;
  traced.samplesPerPixel = kSamples;
  traced.maxBounces = 1;
  traced.gloss = true;
  traced.emissive = level.emitters.has_value();
  const auto truth = renderReference(*level.tracer, view, level.lights, traced, context);
  if (!truth) LitLevel::stop(truth.error().message);
  const std::vector<MirrorSurface> seen = findMirrors(*level.tracer, CameraRays(view, kSide, kSide), context);
  std::vector<std::uint8_t> wall;
  for (const MirrorSurface& surface : seen) wall.push_back(surface.exponent > 0.9f * kExponent ? 1 : 0);
  const std::vector<double> expected = blocksOf(truth->glossyIndirect, wall),
                            noise = blocksOf(truth->glossyIndirectError, wall);

  // 2. By records
  for (const int order : {5, 10}) {
    for (const RecordReach reach : {RecordReach::printed, RecordReach::guarded}) {
      PreviewOptions options;
      options.width = options.height = kSide;
      options.samples = 1;
      options.accuracy = 0.25f;
      options.gloss = true;
      options.glossyOrder = order;
      options.reach = reach;
      if (reach == RecordReach::printed) {
        options.weight = RecordWeight::ward;
        options.rounds = 0;
        options.minPixels = 10.0f;
      }
      std::vector<Record> cache;
      const std::clock_t begin = std::clock();
      const auto start = std::chrono::steady_clock::now();
      const auto frame = renderPreview({*level.tracer, *level.tracer, view, level.lights, traced.emissive, level.sky},
                                       level.light, options, cache, context);
      if (!frame) LitLevel::stop(frame.error().message);
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const double processorSeconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
      std::uint32_t onWall = 0;  // which scatters nothing, so that all records on it are radiance records
      for (std::size_t i = 0; i < wall.size(); ++i) onWall += wall[i] != 0 && frame->recordAt[i] > 0.0f ? 1 : 0;
      std::printf("| %s | %s | %d | %u | %u, %u | %.1f | %.1f | %.1f |", light.c_str(),
                  reach == RecordReach::printed ? "printed" : "guarded", order, frame->records, frame->glossyRecords,
                  onWall, frame->recordSeconds, seconds - frame->recordSeconds, processorSeconds);
      printError(frame->mirrored, expected, noise, wall);
    }
  }
}

// What an order leaves of a mean lobe, root mean square over the hemisphere, in percent of it.
double missedOf(const LobeTable& table, float exponent, double deg) {
  constexpr int kRows = 128, kTurns = 128;
  const glm::dvec3 axis(std::sin(glm::radians(deg)), 0.0, std::cos(glm::radians(deg)));
  const auto order = static_cast<std::size_t>(table.order());
  std::vector<float> c(order * order);
  std::vector<double> h(c.size());
  table.evaluate(exponent, axis, c);
  const double integral = static_cast<double>(table.integral(exponent, static_cast<float>(axis.z)));
  double missed = 0.0, all = 0.0;
  for (int i = 0; i < kRows * kTurns; ++i) {
    const double z = (i / kTurns + 0.5) / kRows, r = std::sqrt(1.0 - z * z),
                 phi = glm::radians(360.0) * (i % kTurns + 0.5) / kTurns;
    const glm::dvec3 d(r * std::cos(phi), r * std::sin(phi), z);
    const double lobe = std::pow(std::max(0.0, glm::dot(d, axis)), static_cast<double>(exponent)) / integral;
    evaluateHsh(table.order(), d, h);
    double projected = 0.0;
    for (std::size_t k = 0; k < h.size(); ++k) projected += h[k] * static_cast<double>(c[k]);
    missed += (lobe - projected) * (lobe - projected);
    all += lobe * lobe;
  }
  return 100.0 * std::sqrt(missed / all);
}

void printLobes() {
  Context context;
  std::printf("| exponent | order | missed at 0, 30, 60, 80 degrees, %% |\n|---:|---:|---|\n");
  for (const float exponent : {1.0f, 3.4f, 8.0f, 15.0f, 20.0f}) {
    for (const int order : {5, std::max(6, hshOrderOf(exponent))}) {
      const LobeTable table(order, LobeKind::mean, context);
      std::printf("| %g | %d | %.1f, %.1f, %.1f, %.1f |\n", static_cast<double>(exponent), order,
                  missedOf(table, exponent, 0.0), missedOf(table, exponent, 30.0), missedOf(table, exponent, 60.0),
                  missedOf(table, exponent, 80.0));
    }
  }
  std::printf("\n");
}

}  // namespace

void printFigure9b(const std::string& scenes) {
  printLobes();
  std::printf(
      "RCS Fig. 9(b): a = 0.25: 3023 irradiance records, 869 radiance records, 12.2 s, drawn in 66 and 936 ms\n\n"
      "| light | records | order | irradiance records | radiance records, on the wall | records, s | the rest, s | "
      "all, cpu s | wall, rmse %% | "
      "energy |\n"
      "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  printLit(scenes, "emissive");
  printLit(scenes, "spot");
}

}  // namespace relume
