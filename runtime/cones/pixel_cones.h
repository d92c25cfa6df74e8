// SPDX-License-Identifier: MIT
// Light from the hemisphere over each pixel of a picture by one cone a pixel in place of 25: pixels take turns in a
// pattern of 5 x 5, share what they found with the others of the pattern, blur within surfaces, and keep what earlier
// frames found (VCT, Hong 2015, Sections 4.2 and 4.3).
//
// Deviations: pixels are not regrouped by cone and back (Segovia et al. 2006), which costs two copies and saves nothing
// here; the cones of a frame are turned against those of the one before; what is kept is limited to what is around the
// pixel, so that a light that is switched off goes out.
//
// Threads: one at a time.
#pragma once

#include "relume/result.h"
#include "runtime/cones/cone_light.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kPattern = 5;  // pixels a side; a cone of the hemisphere each

// What a camera sees, a pixel each, row 0 on top. [Size width * height, all finite]
struct PixelReceivers {
  std::uint32_t width = 0, height = 0;                      // [1..16384]
  std::span<const glm::vec3> positionWorld, plane, normal;  // [m]; unit: of the surface's plane, and to shade with
  std::span<const float> depth;                             // [m] along the viewing axis; 0 = nothing is seen
  glm::mat4 clipFromWorld{1.0f};                            // y upward, as OpenGL's
};

struct PixelConeOptions {
  bool interleaved = true;  // false: all 25 cones for each pixel
  bool gather = true, blur = true;
  bool keep = true;               // light of earlier frames
  std::uint32_t mostFrames = 16;  // [1..1024] whose mean is kept (w_max)
  float falloff = 1.0f;           // [1/m] of occlusion, as Cone's
};

// usage: numbers that are out of range or not finite; spans of another size.
Status checkPixelConeOptions(const PixelConeOptions& options);
Status checkPixels(const PixelReceivers& pixels);
Status checkPixelFrame(std::uint32_t width, std::uint32_t height, const glm::mat4& clipFromWorld);

// What a frame leaves for the next. [Size width * height]
struct PixelHistory {
  std::uint32_t width = 0, height = 0;
  std::vector<glm::vec4> light;
  std::vector<glm::vec3> position, normal;
  std::vector<float> depth, weight;
  glm::mat4 clipFromWorld{1.0f};
};

class PixelCones {
 public:
  // usage: mostFrames or falloff out of range.
  static Result<PixelCones> create(const PixelConeOptions& options);

  // A frame. usage: spans of another size, a depth that is negative, a number that is not finite; memory. The light of
  // the frame before stays then. Pixels of another number drop what was kept.
  [[nodiscard]] Status update(const ConeTracer& cones, const PixelReceivers& pixels, const ParallelFor& parallelFor);
  void reset();

  // Mean radiance of the hemisphere [W/m²/sr] and in alpha occlusion; 0 where nothing is seen. [Size width * height]
  std::span<const glm::vec4> light() const { return light_; }
  // [Size width * height] how many frames a pixel's light is the mean of.
  std::span<const float> frames() const { return weight_; }
  // Whether a pixel and one to its right, below it or both lie on different surfaces (the discontinuity buffer).
  std::span<const std::uint8_t> edges() const { return edge_; }
  std::vector<PassTime> passTimes() const;

 private:
  explicit PixelCones(const PixelConeOptions& options) : options_(options) {}

  PixelConeOptions options_;
  std::vector<glm::vec4> light_;
  std::vector<float> weight_;
  std::vector<std::uint8_t> edge_;
  PixelHistory history_;
  std::uint32_t frame_ = 0;
  double coneMs_ = 0.0, edgeMs_ = 0.0, gatherMs_ = 0.0, blurMs_ = 0.0, keepMs_ = 0.0;
};

// By how much of a circle the cones of a frame are turned.
inline float turnOfFrame(std::uint32_t frame) {
  const float turn = 0.618034f * static_cast<float>(frame % 4096);
  return turn - std::floor(turn);
}

// Which cone a pixel takes.
inline std::uint32_t coneOfPixel(std::uint32_t x, std::uint32_t y) { return y % kPattern * kPattern + x % kPattern; }

}  // namespace relume
