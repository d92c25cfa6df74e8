// SPDX-License-Identifier: MIT
// Light by cells of surfaces: what rays find by them beside what they find at the very point.
#include "bake/preview/surface_cells.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "tests/preview/known_light.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr float kSpread = 0.05f;

// By means of what `exact` says of each point.
PatchRadiance patchesOf(const HitRadiance& exact) {
  return [&exact](std::span<const Ray> rays, std::span<const Hit> hits, std::span<glm::vec3> radiance) {
    std::vector<glm::vec3> found(rays.size(), glm::vec3(0.0f));
    exact(0, 1.0f, rays, hits, found);
    for (std::size_t i = 0; i < found.size(); ++i) radiance[i / kPatchPoints] += found[i] / float{kPatchPoints};
  };
}

// With numbers that are drawn for one ray after the other, as points on emitters are.
HitRadiance noisy(HitRadiance light) {
  return [light = std::move(light)](std::uint64_t item, float spread, std::span<const Ray> rays,
                                    std::span<const Hit> hits, std::span<glm::vec3> radiance) {
    light(item, spread, rays, hits, radiance);
    RandomStream random(1, 0, item);
    for (glm::vec3& found : radiance) found *= random.uniform();
  };
}

// A hall of 20 m with a block on its floor. Where its walls' fronts are outside, most cells count as lying in matter.
struct Hall {
  Scene scene;
  std::vector<Ray> rays;  // from a point up in it
  std::vector<Hit> hits;

  explicit Hall(bool frontsInside = true) {
    addInstance(scene, box({-10, 0, -10}, {10, 6, 10}, frontsInside));
    addInstance(scene, box({3, 0, 3}, {5, 1, 5}, false));
    finish(scene);
    const RayTracer tracer = tracerOf(scene);
    for (int i = 0; i < 4000; ++i) {
      const float z = 1.0f - (static_cast<float>(i) + 0.5f) / 2000.0f, angle = 2.39996323f * static_cast<float>(i),
                  radius = std::sqrt(1.0f - z * z);
      rays.push_back({{1, 3, 1}, 0.0f, {radius * std::cos(angle), z, radius * std::sin(angle)}});
    }
    hits.resize(rays.size());
    tracer.trace(rays, hits);
  }
  std::vector<glm::vec3> read(const HitRadiance& light, float spread) const {
    std::vector<glm::vec3> found(rays.size(), glm::vec3(0.0f));
    light(0, spread, rays, hits, found);
    return found;
  }
};

TEST(SurfaceCells, theirLightIsThatOfAPatchNoWiderThanTheRay) {
  const Hall hall;
  const RayTracer tracer = tracerOf(hall.scene);
  Context context;
  const HitRadiance linear =
      lightAt([](const glm::vec3& p) { return glm::vec3(20.0f + p.x, 20.0f + p.y, 20.0f + p.z); });
  const HitRadiance cells = cellRadiance(tracer, linear, patchesOf(linear), 1, context);
  const std::vector<glm::vec3> exact = hall.read(linear, kSpread), kept = hall.read(cells, kSpread);
  int different = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_LT(glm::distance(exact[i], kept[i]), 1.5f * kSpread * hall.hits[i].distance + 1e-2f) << i;
    different += exact[i] != kept[i] ? 1 : 0;
  }
  EXPECT_GT(different, 3500) << "most rays end on cells";
  // Rays as narrow as a thread end on no cell.
  EXPECT_EQ(hall.read(cells, 1e-5f), exact);
}

// The floor under the block is dark, as nobody sees it: cells around the block's foot hardly know of it.
TEST(SurfaceCells, whatNoRaySeesHasNoPart) {
  const Hall hall;
  const RayTracer tracer = tracerOf(hall.scene);
  Context context;
  const HitRadiance light = lightAt([](const glm::vec3& p) {
    const bool hidden = p.y < 0.5f && p.x > 3.001f && p.x < 4.999f && p.z > 3.001f && p.z < 4.999f;
    return glm::vec3(hidden ? 0.0f : 1.0f);
  });
  double missing = 0.0;
  for (const glm::vec3& found : hall.read(cellRadiance(tracer, light, patchesOf(light), 1, context), 0.4f))
    missing += 1.0 - found.x;
  EXPECT_LT(missing, 3.0) << "of 4000 rays, where it would be 11.5 if all cells had their light";
}

TEST(SurfaceCells, lightDoesNotDependOnWhoAsksFirst) {
  const Hall hall;
  const RayTracer tracer = tracerOf(hall.scene);
  const HitRadiance light = lightAt([](const glm::vec3& p) { return glm::abs(glm::fract(p * 3.7f)); });
  std::vector<std::vector<glm::vec3>> all;
  for (const int threads : {1, 2, 7}) {
    Context context;
    context.threads = threads;
    const HitRadiance cells = cellRadiance(tracer, light, patchesOf(light), 1, context);
    std::vector<glm::vec3>& found = all.emplace_back(hall.rays.size(), glm::vec3(0.0f));
    const std::size_t count = hall.rays.size();
    parallelChunks(context, "", count, 50, [&](std::size_t begin, std::size_t end) {
      if (threads == 2) begin = count - std::exchange(end, count - begin);  // from behind
      cells(begin, kSpread, std::span(hall.rays).subspan(begin, end - begin),
            std::span(hall.hits).subspan(begin, end - begin), std::span(found).subspan(begin, end - begin));
    });
  }
  EXPECT_EQ(all[0], all[1]);
  EXPECT_EQ(all[0], all[2]);
}

// Numbers are drawn ray by ray, so that rays that no cell answers must be asked in the same order, whether it is known
// before that no cell does or found out then.
TEST(SurfaceCells, raysAreAskedInOneOrderWhateverIsKnownOfTheCells) {
  const Hall hall(/*frontsInside=*/false);
  const RayTracer tracer = tracerOf(hall.scene);
  Context context;
  const HitRadiance light = lightAt([](const glm::vec3&) { return glm::vec3(1.0f); });
  const HitRadiance cells = cellRadiance(tracer, noisy(light), patchesOf(light), 1, context);
  const std::vector<glm::vec3> found = hall.read(cells, kSpread);
  EXPECT_LT(std::count(found.begin(), found.end(), glm::vec3(1.0f)), 2000) << "most rays end on no cell";
  EXPECT_EQ(hall.read(cells, kSpread), found);
}

TEST(SurfaceCells, lightThatIsNoNumberStaysNone) {
  const Hall hall;
  const RayTracer tracer = tracerOf(hall.scene);
  Context context;
  for (const float bad : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    const HitRadiance light = lightAt([bad](const glm::vec3&) { return glm::vec3(1.0f, bad, 1.0f); });
    for (const glm::vec3& found : hall.read(cellRadiance(tracer, light, patchesOf(light), 1, context), kSpread))
      EXPECT_FALSE(std::isfinite(found.y));
  }
}

}  // namespace
}  // namespace relume
