// SPDX-License-Identifier: MIT
// See live_level.h.
#include "tools/render/live_level.h"

#include "runtime/shared/stopwatch.h"
#include "runtime/voxels/check_geometry.h"
#include "tools/render/live_view.h"
#include "tools/render/ray_shadows.h"

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <thread>

namespace relume {
namespace {

constexpr float kHistorySeconds = 0.15f;  // time constant of the blend with frames before

bool isSame(const Light& a, const Light& b) {
  return a.kind == b.kind && a.intensity == b.intensity && a.positionWorld == b.positionWorld &&
         a.direction == b.direction && a.range == b.range && a.innerConeRad == b.innerConeRad &&
         a.outerConeRad == b.outerConeRad;
}

bool isSame(const Sky& a, const Sky& b) {
  return a.radiance == b.radiance && a.below == b.below && a.map == b.map && a.rotationDeg == b.rotationDeg;
}

}  // namespace

bool areSame(const std::vector<Light>& a, const std::vector<Light>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Light& x, const Light& y) { return isSame(x, y); });
}

bool isSame(const LiveScene& a, const LiveScene& b) {
  return areSame(a.lights, b.lights) && a.emission == b.emission && isSame(a.sky, b.sky) &&
         a.bounceScale == b.bounceScale && a.bounces == b.bounces && a.toWorld == b.toWorld &&
         a.editsCastShadowsAlone == b.editsCastShadowsAlone;
}

Result<LiveLevel> LiveLevel::create(const Scene& scene, const LiveLevelOptions& options, Context& context,
                                    const std::optional<glm::vec3>& eyeWorld) {
  const unsigned threads = options.threads > 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  auto workers = std::make_unique<WorkerThreads>(threads);
  auto light = NestedCaches::create({options.rays});
  if (!light) return light.error();
  Stopwatch watch;
  auto volumes = voxeliseScene(scene, {options.cells, options.cascades, eyeWorld}, workers->parallelFor(), context);
  if (!volumes) return volumes.error();
  const double voxelsMs = watch.lap();
  LiveLevel level(scene, std::move(workers), std::move(*volumes), std::move(*light));
  level.backend_ = options.backend;
  level.piecesMs_ = voxelsMs - level.volumes_.passTimes().front().ms;
  if (!level.hasLight()) return level;
  auto tracer = RayTracer::create(scene, "", *level.context_, RayStructure::shadows, RayGeometry::drawn);
  if (!tracer) return tracer.error();
  level.tracer_.emplace(std::move(*tracer));
  level.traceMs_ = watch.lap();
  return level;
}

// Rays against what moves, and against all else where `lifts` says that more moves than did.
Status LiveLevel::trace(Scene& scene, bool lifts) {
  Stopwatch watch;
  const auto tracerOf = [&](bool isMoved) {
    for (std::size_t i = 0; i < scene.instances.size(); ++i)
      scene.instances[i].mode = (isMoved_[i] != 0) == isMoved ? scene_->instances[i].mode : BakeMode::ignore;
    return RayTracer::create(scene, "", *context_, RayStructure::shadows, RayGeometry::drawn);
  };
  if (lifts) {
    auto others = tracerOf(false);
    if (!others) return others.error();
    tracer_.emplace(std::move(*others));
  }
  auto moved = tracerOf(true);
  if (!moved) return moved.error();
  movedTracer_.emplace(std::move(*moved));
  traceMs_ = watch.lap();
  return done();
}

// Parts where they are now, for voxels and for rays.
Status LiveLevel::place(const std::vector<glm::mat4>& toWorld, bool editsCastShadowsAlone) {
  const std::vector<Instance>& now = moved_ ? moved_->instances : scene_->instances;
  isMoved_.resize(now.size());
  std::vector<PartEdit> edits;
  std::vector<glm::mat4x3> moving;
  bool moves = false, casts = false;
  for (std::uint32_t i = 0; i < now.size(); ++i) {
    const glm::mat4& to = toWorld.empty() ? scene_->instances[i].toWorld : toWorld[i];
    if (Status ok = checkTransform(glm::mat4x3(to), i); !ok) return ok;
    const bool isSame = to == now[i].toWorld;
    if (!scene_->instances[i].baked()) {  // in `now` what rays of the moved leave out is not
      moving.emplace_back(to);
      moves = moves || !isSame;
    } else if (!isSame) {
      casts = true;
      if (!editsCastShadowsAlone) edits.push_back({i, glm::mat4x3(to), true});
    }
  }
  if (!casts && !moves) return done();

  // Rays first: what is refused leaves both as they were.
  if (!moved_) moved_ = shadowScene(*scene_);
  const std::vector<Instance> before = moved_->instances;
  bool lifts = false;
  for (std::uint32_t i = 0; i < before.size(); ++i) {
    const glm::mat4& to = toWorld.empty() ? scene_->instances[i].toWorld : toWorld[i];
    if (to == before[i].toWorld) continue;
    relume::place(moved_->instances[i], to);
    lifts = lifts || isMoved_[i] == 0;
    isMoved_[i] = 1;
  }
  Status placed = hasLight() ? trace(*moved_, lifts) : done();
  PartPlaces places;
  if (!edits.empty()) places.edits = edits;
  if (moves) places.toWorld = moving;
  if (placed && (places.edits || places.toWorld)) placed = volumes_.place(places);
  if (placed) return done();
  moved_->instances = before;
  if (!hasLight()) return placed;
  if (Status back = trace(*moved_, true); !back) return back;
  return placed;
}

// isChangedAlone: lights and parts are as they were, and volumes may have moved.
Status LiveLevel::lightDirectly(const std::vector<Light>& lights, bool isChangedAlone) {
  LightSetup setup;
  setup.lights = lights;
  setup.visibility = rayVisibility(*tracer_, lights, *context_);
  if (movedTracer_) setup.visibility = throughBoth(setup.visibility, rayVisibility(*movedTracer_, lights, *context_));
  return isChangedAlone ? volumes_.lightChanged(setup) : volumes_.lightDirectly(setup);
}

void LivePace::begin(bool isStill, double seconds) {
  seconds_ = seconds;
  still_ = isStill ? still_ + 1 : 0;
  stillSeconds_ = isStill ? stillSeconds_ + std::max(seconds, 0.0) : 0.0;
  const bool isBuiltUp = still_ > kBuildUp && stillSeconds_ > kBuildUpSeconds;
  averaged_ = isBuiltUp ? averaged_ + 1 : 0;
}

LiveFrame LivePace::frame(const LiveScene& scene, int bounce) {
  if (!sky_ || !isSame(*sky_, scene.sky)) {
    skyMap_ = liveSkyMap(scene.sky);
    sky_ = scene.sky;
  }
  LiveFrame frame;
  frame.emissionScale = glm::vec3(scene.emission);
  frame.sky = {scene.sky.radiance, skyMap_, skyMap_.empty() ? 0 : kLiveSkySide};
  if (scene.bounces == 0) {
    // Blended with the frames before, at rest averaged
    const auto mean = static_cast<float>(averaged_), blend = std::exp(-static_cast<float>(seconds_) / kHistorySeconds);
    frame.keep = std::clamp(std::max(blend, mean / (mean + 1.0f)), 0.0f, 0.99f);
    frame.raySet = raySet_++;
  }
  frame.bounceScale = scene.bounces == 0 || bounce > 0 ? scene.bounceScale : 0.0f;
  return frame;
}

void LivePace::end(const LiveScene& scene) {
  if (scene.bounces > 0 && still_ > 0) averaged_ = kAveraged;  // the same rays find the same light
}

Status LiveLevel::update(const LiveScene& next, double seconds) {
  if (!next.toWorld.empty() && next.toWorld.size() != scene_->instances.size())
    return Error{ErrorCode::usage, "live light: " + std::to_string(next.toWorld.size()) + " transforms for " +
                                       std::to_string(scene_->instances.size()) + " instances"};
  // 1. What has moved, and direct light of it
  if (next.eyeWorld) {
    const Result<bool> moved = volumes_.centre(*next.eyeWorld);
    if (!moved) return moved.error();
    hasMoved_ = hasMoved_ || *moved;
  }
  const bool isPlaced = last_ && last_->toWorld == next.toWorld;
  const bool isSameLight = isPlaced && areSame(last_->lights, next.lights), isLit = isSameLight && !hasMoved_;
  if (!isPlaced) {
    if (Status ok = place(next.toWorld, next.editsCastShadowsAlone); !ok) return ok;
  }
  const bool isStill = last_ && !hasMoved_ && isSame(*last_, next);
  if (hasLight() && !isLit) {
    if (Status ok = lightDirectly(next.lights, isSameLight); !ok) return ok;
  }
  last_ = next;
  hasMoved_ = false;
  if (!hasLight()) return done();

  // 2. The caches
  pace_.begin(isStill, seconds);
  cellsMs_ = bounceMs_ = gatherMs_ = 0.0;
  for (int bounce = 0; bounce < std::max(next.bounces, 1); ++bounce) {
    if (Status ok = light_.update(volumes_, pace_.frame(next, bounce)); !ok) return ok;
    const std::vector<PassTime> times = light_.passTimes();
    cellsMs_ += times[0].ms;
    bounceMs_ += times[1].ms;
    gatherMs_ += times[2].ms;
  }
  pace_.end(next);
  const std::vector<PassTime> times = volumes_.passTimes();
  directMs_ = isLit ? 0.0 : times[2].ms;
  return done();
}

std::vector<PassTime> LiveLevel::passTimes() const {
  const std::vector<PassTime> voxels = volumes_.passTimes();
  return {{"pieces", piecesMs_}, {"voxelise", voxels[0].ms}, {"move", voxels[1].ms}, {"shadow rays", traceMs_},
          {"direct", directMs_}, {"cells", cellsMs_},        {"bounce", bounceMs_},  {"gather", gatherMs_}};
}

std::vector<std::pair<std::string, std::size_t>> LiveLevel::bufferSizes() const {
  auto sizes = volumes_.bufferSizes();
  const auto lit = light_.bufferSizes();
  sizes.insert(sizes.end(), lit.begin(), lit.end());
  return sizes;
}

}  // namespace relume
