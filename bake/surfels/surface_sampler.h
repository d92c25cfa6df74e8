// SPDX-License-Identifier: MIT
// Points on the surfaces that the play space sees, evenly spread by area (PIC 4.2): the candidates of the placements
// and the samples of the surfels' footprints.
//
// The sides of some hundred triangles are laid end to end along a line, each as long as its seen area, and the line is
// cut into equal steps: every triangle gets its share to within one point, and triangles too small for a point of their
// own share one with their neighbours. Within a triangle points follow the Halton sequence. Sides that are seen from
// far away only get points by their share of what is seen, not by their area.
//
// Steps are of a ladder (ladder.h), and each line begins by a random number of its own: an edit changes the points of
// the lines that it touches, and no others.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <vector>

namespace relume {

// Emitters, and drivable materials among them, and reflectors are kept apart: a surfel stands for points of its own
// class only.
inline constexpr std::uint32_t kReflector = 0xFFFFFFFFu;

struct SurfaceSample {
  glm::vec3 positionWorld{0.0f};
  glm::vec3 normal{0.0f};  // geometric, of the side
  SurfacePoint point;
  std::uint32_t side = 0;              // scene-wide 2 * triangle + back
  std::uint32_t emitter = kReflector;  // instance that emits from this side, or kReflector
  float density = 1.0f;                // how much denser than elsewhere surfels are wanted here; below 1 far away only
};

class SurfaceSampler {
 public:
  // Small emitters are sampled denser, so that about emitterPoints of pointCount fall on each; at most an eighth of all
  // points are spent on that. The tracer and the play space must outlive the sampler.
  SurfaceSampler(const RayTracer& tracer, const PlaySpace& playSpace, std::uint32_t pointCount,
                 std::uint32_t emitterPoints, Context& context);

  // The same with the sides that emit alone; empty where none does.
  SurfaceSampler emittersOnly() const;

  // About `count` points, more rather than fewer, but for those that alpha masks cut out, in the order of the scene's
  // triangles. laid: how many there are with those. Different salts give different points. Same points at any thread
  // count.
  std::vector<SurfaceSample> draw(std::size_t count, std::uint64_t seed, std::uint32_t salt, Context& context,
                                  std::size_t* laid = nullptr) const;

  bool empty() const { return side_.empty(); }
  double seenArea() const { return seenArea_; }  // [m²] alpha masks not taken off; far sides count as their points do
  double measure() const { return measure_; }    // [m²] the same, times density

 private:
  SurfaceSampler() = default;
  struct Side {
    std::uint32_t side = 0;
    std::uint32_t instance = 0;
    double begin = 0.0, end = 0.0;  // [m²] of all lines one after the other
    std::size_t line = 0;
  };
  struct Line {
    std::size_t firstSide = 0;  // of side_
    double begin = 0.0;         // [m²]
    std::uint64_t number = 0;   // the item of its random numbers
  };
  void numberInstances();
  float densityOf(std::uint32_t side, std::uint32_t instance) const;
  double measureOf(std::size_t index, std::uint32_t instance) const;
  void markMeasures();
  template <class Visit>
  void forEachSide(std::size_t first, std::size_t last, const Visit& visit) const;
  // Returns how many points were laid.
  std::size_t drawSide(const Side& side, double step, std::uint64_t seed, std::uint32_t salt,
                       std::vector<SurfaceSample>& out, Context& context) const;

  // What else is known of a side follows from the play space and the densities: there may be millions.
  const Scene* scene_ = nullptr;
  const PlaySpace* playSpace_ = nullptr;
  std::vector<std::uint32_t> side_;  // ascending
  std::size_t sidesPerMark_ = 1;
  std::vector<double> mark_;           // [m²] where every sidesPerMark_-th side begins
  std::vector<Line> line_;             // ascending
  std::vector<std::uint64_t> number_;  // [Size instances] by where each stands
  std::vector<std::uint32_t> chain_;   // [Size instances] the first of those that share its line
  std::vector<double> onLine_;         // [m²] [Size 0 or sides] length of each; empty = seen area x density
  std::vector<float> emitterDensity_;  // [Size instances] of emitting sides that are not far
  double farMeasure_ = 0.0;            // [m²] of all sides but far ones, by the share that far sides may have of it
  double measure_ = 0.0, seenArea_ = 0.0;
};

// The instance that emits from a side of one of its triangles, or kReflector.
std::uint32_t emitterOf(const Scene& scene, std::uint32_t instance, std::uint32_t side);

// The point of a triangle side at barycentric coordinates.
SurfaceSample sampleAt(const Scene& scene, std::uint32_t instance, std::uint32_t side, const glm::vec2& barycentric);

}  // namespace relume
