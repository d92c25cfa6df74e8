// SPDX-License-Identifier: MIT
// See default_view.h. Candidates are tried with rays: a level seen from outside shows fronts (a Cornell box through its
// open side, a house from the street); a closed room shows its walls' backs, and is looked at from within.
#include "tools/render/default_view.h"

#include "bake/base/random.h"
#include "bake/rays/ray_tracer.h"
#include "bake/visibility/find_starts.h"
#include "relume/bake/options.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace relume {
namespace {

constexpr std::uint32_t kStage = 0x76696577;  // the random streams' stage
constexpr int kSide = 24;                     // rays along a side of a trial image
constexpr float kEnoughFronts = 0.6f;         // of the hits of a view from outside
constexpr float kEnoughHits = 0.2f;           // of its rays

// What a trial image shows.
struct Trial {
  float fronts = 0.0f;    // share of the hits
  float hits = 0.0f;      // share of the rays
  float distance = 0.0f;  // [m] mean over the hits
};

Trial look(const RayTracer& tracer, const FramedView& view, float halfWidth, float halfHeight) {
  const glm::vec3 forward = glm::normalize(view.target - view.eye);
  const glm::vec3 right = glm::normalize(glm::cross(forward, glm::vec3(0, 1, 0)));
  const glm::vec3 up = glm::cross(right, forward);
  std::vector<Ray> rays;
  for (int i = 0; i < kSide * kSide; ++i) {
    const float x = (2.0f * static_cast<float>(i % kSide) + 1.0f) / kSide - 1.0f;
    const float y = (2.0f * static_cast<float>(i / kSide) + 1.0f) / kSide - 1.0f;
    rays.push_back({view.eye, 0.0f, glm::normalize(forward + halfWidth * x * right + halfHeight * y * up)});
  }
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  Trial trial;
  float count = 0.0f;
  for (const Hit& hit : hits) {
    if (!hit) continue;
    count += 1.0f;
    trial.distance += hit.distance;
    const bool sheet = tracer.scene().bothSides(tracer.scene().instances[hit.instance], hit.triangle);
    if (!hit.back || sheet) trial.fronts += 1.0f;
  }
  if (count == 0.0f) return trial;
  return {trial.fronts / count, count / static_cast<float>(hits.size()), trial.distance / count};
}

// Eight directions around, a little from above; the level's sphere fits the narrower angle of view.
FramedView bestFromOutside(const RayTracer& tracer, float halfWidth, float halfHeight, Trial& best) {
  const glm::vec3 centre = 0.5f * (tracer.boundsMin() + tracer.boundsMax());
  const float radius = std::max(0.5f * glm::length(tracer.boundsMax() - tracer.boundsMin()), 1e-3f);
  const float distance = radius / std::sin(std::atan(std::min(halfWidth, halfHeight)));
  FramedView chosen;
  for (int i = 0; i < 8; ++i) {
    // +Z first, where glTF's models face and boxes for tests are open.
    const float angle = glm::radians(45.0f * static_cast<float>(i));
    const float height = i == 0 ? 0.12f : 0.45f;
    const glm::vec3 away = glm::normalize(glm::vec3(std::sin(angle), height, std::cos(angle)));
    const FramedView view{centre + distance * away, centre};
    const Trial trial = look(tracer, view, halfWidth, halfHeight);
    if (trial.hits < kEnoughHits || trial.fronts <= best.fronts + 0.02f) continue;
    best = trial;
    chosen = view;
  }
  return chosen;
}

// A point in the air: the middle of the first play volume, else the free point next to the level's middle.
glm::vec3 pointWithin(const RayTracer& tracer, Context& context) {
  if (!tracer.scene().volumes.empty()) return glm::vec3(tracer.scene().volumes[0].toWorld[3]);
  const glm::vec3 low = tracer.boundsMin(), high = tracer.boundsMax(), centre = 0.5f * (low + high);
  glm::vec3 nearest = centre;
  float best = std::numeric_limits<float>::infinity();
  for (const glm::vec3& p : findFreePoints(tracer, kStage, context)) {
    const bool within = p.x > low.x && p.y > low.y && p.z > low.z && p.x < high.x && p.y < high.y && p.z < high.z;
    if (!within || glm::length(p - centre) >= best) continue;
    best = glm::length(p - centre);
    nearest = p;
  }
  return nearest;
}

// Back from that point as far as there is air, looking through it: the longest such view of sixteen.
FramedView bestFromWithin(const RayTracer& tracer, float halfWidth, float halfHeight, Context& context) {
  const glm::vec3 point = pointWithin(tracer, context);
  FramedView chosen{point, point + glm::vec3(0, 0, -1)};
  float best = -1.0f;
  for (int i = 0; i < 16; ++i) {
    const float angle = glm::radians(22.5f * static_cast<float>(i));
    const glm::vec3 forward = glm::normalize(glm::vec3(-std::sin(angle), -0.1f, -std::cos(angle)));
    const Hit behind = tracer.trace(Ray{point, 0.0f, -forward});
    const float room = behind ? behind.distance : 0.0f;
    FramedView view{point - 0.85f * room * forward, point};
    if (!(glm::length(view.target - view.eye) > 0.0f)) view.target = view.eye + forward;
    const Trial trial = look(tracer, view, halfWidth, halfHeight);
    const float worth = trial.distance * trial.fronts;
    if (worth <= best) continue;
    best = worth;
    chosen = view;
  }
  return chosen;
}

}  // namespace

Result<FramedView> frameLevel(const Scene& scene, float yfovRad, float aspect, Context& context) {
  // Who draws the level says what is wrong with it.
  auto onMessage = std::exchange(context.onMessage, nullptr);
  const auto tracer =
      RayTracer::create(scene, BakeOptions{}.embreeIsa, context, RayStructure::quick, RayGeometry::drawn);
  context.onMessage = std::move(onMessage);
  if (!tracer) return tracer.error();
  const float halfHeight = std::tan(0.5f * yfovRad), halfWidth = halfHeight * aspect;
  Trial outside;
  const FramedView view = bestFromOutside(*tracer, halfWidth, halfHeight, outside);
  if (outside.fronts >= kEnoughFronts) return view;
  return bestFromWithin(*tracer, halfWidth, halfHeight, context);
}

}  // namespace relume
