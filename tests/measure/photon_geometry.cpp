// SPDX-License-Identifier: MIT
// IVG's Fig. 2: a grid that is filled with few triangles in place of many. A ball in the Cornell box, of 1280 or of
// 81,920 triangles.
#include "tests/measure/photon_tables.h"

#include "bake/reference/path_tracer.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>

namespace relume::test {
namespace {

constexpr std::uint64_t kPhotons = 8000000;
constexpr glm::uvec3 kPoints(20, 22, 20);

// A ball by splitting an icosahedron's triangles in four, some times.
Mesh icosphere(const glm::vec3& center, float radius, int splits) {
  const float g = 0.5f * (1.0f + std::sqrt(5.0f));
  std::vector<glm::vec3> unit{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                              {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (glm::vec3& p : unit) p = glm::normalize(p);
  std::vector<glm::uvec3> triangles{{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int split = 0; split < splits; ++split) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(unit.size()));
      if (fresh) unit.push_back(glm::normalize(unit[a] + unit[b]));
      return at->second;
    };
    std::vector<glm::uvec3> finer;
    for (const glm::uvec3& t : triangles) {
      const std::uint32_t ab = middle(t.x, t.y), bc = middle(t.y, t.z), ca = middle(t.z, t.x);
      for (const glm::uvec3& part : {glm::uvec3(t.x, ab, ca), {t.y, bc, ab}, {t.z, ca, bc}, {ab, bc, ca}})
        finer.push_back(part);
    }
    triangles = std::move(finer);
  }
  Mesh mesh;
  mesh.name = "ball";
  for (const glm::vec3& p : unit) mesh.position.push_back(center + radius * p);
  mesh.normal = unit;
  mesh.triangle = std::move(triangles);
  return mesh;
}

struct Ball {
  std::unique_ptr<Scene> scene;
  std::unique_ptr<RayTracer> tracer;
  std::unique_ptr<PhotonGrid> grid, again;  // `again`: by other random numbers
  double seconds = 0.0;                     // of a trace
};

Ball makeBall(const std::string& level, int splits, PhotonEstimator estimator) {
  Context context;
  Ball ball{std::make_unique<Scene>(orStop(importGltf(level, context))), {}, {}, {}, 0.0};
  Scene& scene = *ball.scene;
  const std::uint32_t triangles = scene.triangleCount();
  Material white;
  white.albedo = glm::vec3(0.72f);
  scene.materials.push_back(white);
  Mesh mesh = icosphere({0.3f, 1.1f, 0.35f}, 0.35f, splits);
  mesh.material = static_cast<std::uint32_t>(scene.materials.size() - 1);
  scene.meshes.push_back(std::move(mesh));
  Instance instance;
  instance.node = "ball";
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  instance.firstTriangle = triangles;
  scene.instances.push_back(instance);
  ball.tracer = std::make_unique<RayTracer>(orStop(RayTracer::create(scene, "", context)));
  const auto spot =
      std::find_if(scene.lights.begin(), scene.lights.end(), [](const SceneLight& l) { return l.name == "spot"; });
  if (spot == scene.lights.end()) stop(level + " has no light spot");
  const PhotonLight light{{&*spot, 1}, nullptr};
  const PhotonGrid empty(ball.tracer->boundsMin(), ball.tracer->boundsMax(), kPoints, estimator);
  ball.grid = std::make_unique<PhotonGrid>(empty);
  ball.again = std::make_unique<PhotonGrid>(empty);
  ball.seconds = secondsOf([&] { tracePhotons(*ball.tracer, light, kPhotons, 1, *ball.grid, context); });
  tracePhotons(*ball.tracer, light, kPhotons, 2, *ball.again, context);
  return ball;
}

// What the camera sees, and how much of its light it scatters.
struct View {
  SeenPixels pixels;
  std::vector<glm::vec3> albedo;
};

View seeBall(const Ball& ball) {
  Context context;
  ReferenceOptions options;
  options.width = options.height = 320;
  options.samplesPerPixel = 1;
  options.maxBounces = 0;
  const ReferenceImage image = orStop(renderReference(*ball.tracer, ball.scene->cameras[0], {}, options, context));
  View view{{image.width, image.height, image.position, image.normal}, image.albedo};
  for (std::size_t i = 0; i < image.depth.size(); ++i) {
    if (!(image.depth[i] > 0.0f)) view.pixels.normal[i] = glm::vec3(0.0f);
  }
  return view;
}

std::vector<glm::vec3> draw(const View& view, const PhotonGrid& grid, DirectionWeights weights) {
  Context context;
  std::vector<glm::vec3> picture = readDirectly(view.pixels, grid, {true, 0.0f, weights}, context);
  for (std::size_t i = 0; i < picture.size(); ++i) picture[i] *= view.albedo[i];
  return picture;
}

// [m] Pixels whose surfaces are farther apart show different ones, as on the ball's outline.
constexpr float kSameSurface = 0.02f;

// Largest and mean difference of a channel, in % of the largest of the first picture, where both show one surface.
struct Difference {
  double largest = 0.0, mean = 0.0;
};
Difference differenceOf(const SeenPixels& seenA, const std::vector<glm::vec3>& a, const SeenPixels& seenB,
                        const std::vector<glm::vec3>& b) {
  Difference d;
  double top = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (glm::distance(seenA.position[i], seenB.position[i]) > kSameSurface) continue;
    for (int k = 0; k < 3; ++k) {
      const double off = static_cast<double>(std::abs(a[i][k] - b[i][k]));
      d.largest = std::max(d.largest, off);
      d.mean += off / static_cast<double>(3 * a.size());
      top = std::max(top, static_cast<double>(a[i][k]));
    }
  }
  return {100.0 * d.largest / top, 100.0 * d.mean / top};
}

}  // namespace

void printGeometry(const std::string& shared, const std::string& folder) {
  const std::string level = shared + "/scenes/cornell/cornell.glb";
  std::printf(
      "| vectors | trace 1280, s | 81,920, s | ratio | each its ball: largest %% | mean %% | the fine ball: largest %% "
      "| "
      "mean %% | other photons: largest %% | mean %% |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  struct Row {
    const char* name;
    PhotonEstimator estimator;
    DirectionWeights weights;
  };
  for (const Row& row : {Row{"as printed", PhotonEstimator::printed, DirectionWeights::printed},
                         Row{"corrected", PhotonEstimator::corrected, DirectionWeights::corrected},
                         Row{"by length", PhotonEstimator::length, DirectionWeights::corrected}}) {
    const Ball coarse = makeBall(level, 3, row.estimator), fine = makeBall(level, 6, row.estimator);
    const View seenCoarse = seeBall(coarse), seenFine = seeBall(fine);
    const auto low = draw(seenCoarse, *coarse.grid, row.weights), high = draw(seenFine, *fine.grid, row.weights);
    const auto mixed = draw(seenFine, *coarse.grid, row.weights), again = draw(seenFine, *fine.again, row.weights);
    const SeenPixels& pixels = seenFine.pixels;
    const Difference each = differenceOf(pixels, high, seenCoarse.pixels, low),
                     same = differenceOf(pixels, high, pixels, mixed),
                     noise = differenceOf(pixels, high, pixels, again);
    std::printf("| %s | %.1f | %.1f | %.2f | %.1f | %.2f | %.1f | %.2f | %.1f | %.2f |\n", row.name, coarse.seconds,
                fine.seconds, coarse.seconds / fine.seconds, each.largest, each.mean, same.largest, same.mean,
                noise.largest, noise.mean);
    std::fflush(stdout);
    if (row.estimator != PhotonEstimator::length) continue;
    // Coarse, fine, and twenty times what is between the two on the fine ball.
    const std::uint32_t side = seenFine.pixels.width;
    std::vector<glm::vec3> strip(std::size_t{3} * side * side);
    for (std::uint32_t y = 0; y < side; ++y) {
      for (std::uint32_t x = 0; x < side; ++x) {
        const std::size_t from = std::size_t{y} * side + x, to = std::size_t{y} * 3 * side + x;
        strip[to] = low[from];
        strip[to + side] = high[from];
        strip[to + 2 * side] = 20.0f * glm::abs(high[from] - mixed[from]);
      }
    }
    if (const Status ok = writePng(folder + "/ivg_fig2.png", 3 * side, side, strip, 4.0f); !ok)
      stop(ok.error().message);
  }
}

}  // namespace relume::test
