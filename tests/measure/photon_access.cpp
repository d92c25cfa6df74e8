// SPDX-License-Identifier: MIT
// IVG's Figs. 4 and 5: grids that pixels read directly, and small ones that rays from pixels read, against references.
// Seconds are of the processor; what they are to each other can be compared with the paper's.
#include "tests/accuracy/compare_images.h"
#include "tests/measure/photon_tables.h"
#include "tests/measure/traced_light.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <memory>

namespace relume::test {
namespace {

constexpr int kGatherRays = 256;  // a pixel

struct AccessView {
  const char *level, *view, *light;
  glm::uvec3 direct, indirect;  // points, along x, y, z
  float exposure;
};
// Fig. 4: 40 x 50 x 40 points. Fig. 5: 30 x 20 x 92 points, and 12 x 8 x 20 that rays read; the longest side has the
// most. Fig. 5's larger grid had 80 M photons.
constexpr std::uint64_t kPhotons = 5000000;
constexpr AccessView kViews[] = {
    {"cornell", "cam_front__spot", "spot", {40, 50, 40}, {12, 12, 12}, 5.0f},
    {"two_rooms", "cam_hall__spot", "spot", {92, 20, 30}, {20, 8, 12}, 3.0f},
    {"sponza", "cam_arcade__torch", "torch", {92, 20, 30}, {20, 8, 12}, 10.0f},
};

SeenPixels pixelsOf(const ChannelImage& reference) {
  SeenPixels pixels{reference.width, reference.height, reference.layer("Position", "XYZ"),
                    reference.layer("Normal", "XYZ")};
  for (glm::vec3& n : pixels.normal) {
    const float length = glm::length(n);
    n = length > 0.5f ? n / length : glm::vec3(0.0f);
  }
  return pixels;
}

// How a grid is read, and how many spacings off the surface: IVG reads it there, where half of a cell is behind walls.
struct Access {
  const char* name;
  PhotonEstimator estimator;
  bool direct, smooth;
  float off;
  bool drawn;
};
constexpr Access kAccesses[] = {
    {"direct, tricubic, as printed", PhotonEstimator::printed, true, true, 0.0f, true},
    {"direct, tricubic, corrected", PhotonEstimator::corrected, true, true, 0.0f, false},
    {"direct, tricubic, by length", PhotonEstimator::length, true, true, 0.0f, true},
    {"direct, trilinear, by length", PhotonEstimator::length, true, false, 0.0f, false},
    {"direct, trilinear, by length, a spacing off", PhotonEstimator::length, true, false, 1.0f, true},
    {"indirect, by length", PhotonEstimator::length, false, false, 0.0f, true},
    {"indirect, by length, half a spacing off", PhotonEstimator::length, false, false, 0.5f, true},
};

void printView(const AccessView& view, const std::string& level, const std::string& reference,
               const std::string& folder) {
  Context context;
  const Scene scene = orStop(importGltf(level, context));
  const RayTracer tracer = orStop(RayTracer::create(scene, "", context));
  const std::vector<SceneLight> lights = lightsNamed(scene, view.light);
  const ChannelImage truth = orStop(readExr(reference));
  const SeenPixels pixels = pixelsOf(truth);
  std::vector<std::vector<glm::vec3>> strip;
  std::unique_ptr<PhotonGrid> grid;
  const Access* last = nullptr;
  double traced = 0.0;
  for (const Access& access : kAccesses) {
    const glm::uvec3 points = access.direct ? view.direct : view.indirect;
    if (last == nullptr || last->direct != access.direct || last->estimator != access.estimator) {
      grid = std::make_unique<PhotonGrid>(tracer.boundsMin(), tracer.boundsMax(), points, access.estimator);
      traced = secondsOf([&] { tracePhotons(tracer, {lights, nullptr}, kPhotons, 1, *grid, context); });
    }
    last = &access;
    const auto weights =
        access.estimator == PhotonEstimator::printed ? DirectionWeights::printed : DirectionWeights::corrected;
    std::vector<glm::vec3> picture;
    const double read = secondsOf([&] {
      picture = access.direct
                    ? readDirectly(pixels, *grid, {access.smooth, access.off, weights}, context)
                    : readIndirectly(pixels, *grid, {false, access.off, weights}, tracer, lights, kGatherRays, context);
    });
    ChannelImage candidate{truth.width, truth.height, {}};
    candidate.setLayer("", picture);
    const ImageDifference d = orStop(compareImages(truth, candidate, {}));
    std::printf("| %s/%s | %s | %u x %u x %u | %.1f | %.1f | %.2f | %.1f | %.1f | %.3f |\n", view.level, view.view,
                access.name, points.x, points.y, points.z, static_cast<double>(grid->bytes()) / (1 << 20), traced, read,
                100 * d.rmseClean, 100 * d.rmseTrimmed, d.energy);
    std::fflush(stdout);
    if (access.drawn) strip.push_back(std::move(picture));
  }
  // The pictures in rows of three, the reference last.
  strip.push_back(truth.layer("DiffInd"));
  const std::vector<glm::vec3> albedo = truth.layer("DiffCol");
  constexpr std::size_t kColumns = 3;
  const std::size_t width = kColumns * truth.width, height = (strip.size() / kColumns) * truth.height;
  std::vector<glm::vec3> all(width * height);
  for (std::size_t i = 0; i < albedo.size(); ++i) {
    const std::size_t x = i % truth.width, y = i / truth.width;
    for (std::size_t k = 0; k < strip.size(); ++k)
      all[(k / kColumns * truth.height + y) * width + k % kColumns * truth.width + x] = albedo[i] * strip[k][i];
  }
  const std::string path = folder + "/ivg_" + view.level + ".png";
  const Status ok =
      writePng(path, static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), all, view.exposure);
  if (!ok) stop(ok.error().message);
}

}  // namespace

void printAccess(const std::string& shared, const std::string& source, const std::string& folder) {
  std::printf(
      "| view | access | points | MiB | trace s | read s | RMSE %% | t1 %% | energy |\n"
      "|---|---|---|---:|---:|---:|---:|---:|---:|\n");
  for (const AccessView& view : kViews) {
    const std::string name = view.level;
    const bool shipped = name == "two_rooms";
    printView(
        view, shipped ? source + "/samples/level/two_rooms.glb" : shared + "/scenes/" + name + "/" + name + ".glb",
        (shipped ? source + "/tests/accuracy" : shared) + "/references/" + name + "/" + view.view + ".exr", folder);
  }
}

}  // namespace relume::test
