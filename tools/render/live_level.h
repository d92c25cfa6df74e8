// SPDX-License-Identifier: MIT
// A level that is lit without a bake while its lights and its parts move: voxels, shadows by rays, and caches that
// follow from frame to frame (runtime/live/nested_caches.h). A frame does what has changed and no more.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/scene/sky.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/lights.h"
#include "relume/result.h"
#include "runtime/live/nested_caches.h"
#include "runtime/voxels/nested_volumes.h"
#include "tools/base/worker_threads.h"

#include <glm/mat4x4.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {

struct LiveLevelOptions {
  std::uint32_t cells = 32;    // [8..64] on the level's longest side
  std::uint32_t rays = 64;     // [8..4096] of a cell in each frame
  unsigned threads = 0;        // 0 = as many as the machine has
  std::uint32_t cascades = 1;  // [1..4] volumes in one another about the eye
  // What lights the voxels and gathers. gl: not LiveLevel, which then has voxels alone.
  BackendKind backend = BackendKind::cpu;
  bool operator==(const LiveLevelOptions&) const = default;
};

// What a frame is lit by.
struct LiveScene {
  std::vector<Light> lights;
  float emission = 1.0f;  // [>= 0] factor on emitting surfaces
  Sky sky;
  float bounceScale = 1.0f;          // [0..1] share of light that each bounce keeps
  int bounces = 0;                   // light is reflected so often, found anew in each frame; 0 = a bounce more in each
  std::vector<glm::mat4> toWorld{};  // [Size instances, or 0 = where the level has them]
  // Static parts that stand elsewhere cast shadows from there, and light goes on as if they had not been moved: what a
  // bake does until it is made again.
  bool editsCastShadowsAlone = false;
  std::optional<glm::vec3> eyeWorld{};  // where volumes are centred; nothing = where they are
};

bool areSame(const std::vector<Light>& a, const std::vector<Light>& b);
// Whether both give the same light, from the same eye.
bool isSame(const LiveScene& a, const LiveScene& b);

// How frames of light follow one another: bounces add up and what was there fades; what stands still is averaged.
class LivePace {
 public:
  // A frame begins, `seconds` after the one before. isStill: it is of the same as that one.
  void begin(bool isStill, double seconds);
  // What to make bounce number `bounce` of it from.
  LiveFrame frame(const LiveScene& scene, int bounce);
  // It has ended. Whether another frame of the same would change next to nothing.
  void end(const LiveScene& scene);
  bool isSettled() const { return averaged_ >= kAveraged; }

 private:
  // Bounces add up and what was there fades, for so many frames and seconds at least; then so many are averaged.
  static constexpr int kBuildUp = 24, kAveraged = 64;
  static constexpr double kBuildUpSeconds = 1.0;

  std::optional<Sky> sky_;  // of the map
  std::vector<glm::vec3> skyMap_;
  std::uint32_t raySet_ = 0;
  int still_ = 0, averaged_ = 0;               // frames since something changed, and those of them that are averaged
  double seconds_ = 0.0, stillSeconds_ = 0.0;  // [s] of this frame, and since something changed
};

class LiveLevel {
 public:
  // Errors of VoxelScene, NestedVolumes, RayTracer and NestedCaches; failed: more memory than the context allows. The
  // scene must outlive it. eyeWorld: as LiveScene's, for the first frame.
  static Result<LiveLevel> create(const Scene& scene, const LiveLevelOptions& options, Context& context,
                                  const std::optional<glm::vec3>& eyeWorld = std::nullopt);

  // A frame, `seconds` after the one before. What is refused by name leaves last frame's light, and parts where they
  // were. Errors of NestedVolumes::centre(), edit(), move() and lightDirectly(), RayTracer::create(),
  // NestedCaches::update().
  Status update(const LiveScene& frame, double seconds);
  // Whether another frame of the same would change next to nothing.
  bool isSettled() const { return !hasLight() || pace_.isSettled(); }

  const NestedVolumes& volumes() const { return volumes_; }
  const VoxelVolume& volume() const { return volumes_.outermost(); }
  const NestedCaches& light() const { return light_; }
  // Of the last frame, and of what was done once: "pieces", "voxelise", "shadow rays".
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  LiveLevel(const Scene& scene, std::unique_ptr<WorkerThreads> threads, NestedVolumes volumes, NestedCaches light)
      : scene_(&scene), threads_(std::move(threads)), volumes_(std::move(volumes)), light_(std::move(light)) {}
  bool hasLight() const { return backend_ == BackendKind::cpu; }
  Status place(const std::vector<glm::mat4>& toWorld, bool editsCastShadowsAlone);
  Status trace(Scene& scene, bool lifts);
  Status lightDirectly(const std::vector<Light>& lights, bool isChangedAlone);

  const Scene* scene_;
  BackendKind backend_ = BackendKind::cpu;
  std::unique_ptr<Scene> moved_;  // what rays meet, once something has moved
  std::unique_ptr<WorkerThreads> threads_;
  std::unique_ptr<Context> context_ = std::make_unique<Context>();
  NestedVolumes volumes_;
  NestedCaches light_;
  std::optional<RayTracer> tracer_, movedTracer_;  // of what has stood where it is from the start, and of all else
  std::vector<std::uint8_t> isMoved_;              // [Size 0 or instances] whether the second has it
  std::optional<LiveScene> last_;
  bool hasMoved_ = false;  // volumes, with the eye, since they were lit
  LivePace pace_;
  double piecesMs_ = 0.0, traceMs_ = 0.0, directMs_ = 0.0, cellsMs_ = 0.0, bounceMs_ = 0.0, gatherMs_ = 0.0;
};

}  // namespace relume
