// SPDX-License-Identifier: MIT
// See render_pictures.h.
#include "tools/render/render_pictures.h"

#include "formats/color.h"
#include "tools/images/image_io.h"
#include "tools/render/exposure.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

constexpr float kDim = 0.4f;
constexpr float kFarGrey = 0.1f;  // of the farthest depth: black is where nothing is

// [0..1] of a range; the middle of one without extent.
float within(float value, float low, float high) { return high > low ? (value - low) / (high - low) : 0.5f; }

glm::vec3 dataColor(const RenderedFrame& frame, std::size_t pixel, Aov aov, const PictureScale& scale) {
  const float depth = frame.depth[pixel];
  if (!(depth != 0.0f)) return glm::vec3(0.0f);
  if (aov == Aov::normal) return frame.normal[pixel] * 0.5f + 0.5f;
  if (aov == Aov::depth) return glm::vec3(1.0f - (1.0f - kFarGrey) * within(depth, scale.nearestM, scale.farthestM));
  const glm::vec3 p = frame.position[pixel], low = scale.bounds.min, high = scale.bounds.max;
  return {within(p.x, low.x, high.x), within(p.y, low.y, high.y), within(p.z, low.z, high.z)};
}

// Records as white dots on what is seen, dim; weights as a grey that no weight makes white.
glm::vec3 recordColor(const RenderedFrame& frame, std::size_t pixel, Aov aov) {
  if (aov == Aov::weight) return glm::vec3(frame.weight[pixel] / (frame.weight[pixel] + kGreyWeight));
  if (frame.records[pixel] > 0.0f) return glm::vec3(1.0f);
  return glm::vec3(kDim * std::sqrt(luminance(frame.albedo[pixel])));
}

}  // namespace

bool isLight(Aov aov) {
  return aov == Aov::indirect || aov == Aov::bounced || aov == Aov::direct || aov == Aov::glossy || aov == Aov::full ||
         aov == Aov::unbounced || aov == Aov::voxels;
}

PictureScale scaleOf(const RenderedFrame& frame, std::span<const Aov> aovs, const std::optional<float>& stops,
                     const SceneBounds& bounds) {
  PictureScale scale{stops.value_or(0.0f), bounds};
  if (!stops) {
    std::vector<glm::vec3> light;
    for (const Aov aov : aovs) {
      if (!isLight(aov)) continue;
      const std::vector<glm::vec3> layer = composeAov(frame, aov);
      light.insert(light.end(), layer.begin(), layer.end());
    }
    scale.exposureStops = autoExposure(light);
  }
  bool any = false;
  for (const float depth : frame.depth) {
    if (depth == 0.0f) continue;
    scale.nearestM = any ? std::min(scale.nearestM, depth) : depth;
    scale.farthestM = any ? std::max(scale.farthestM, depth) : depth;
    any = true;
  }
  return scale;
}

std::vector<std::uint8_t> drawPicture(const RenderedFrame& frame, Aov aov, const PictureScale& scale) {
  const bool records = aov == Aov::records || aov == Aov::weight;
  const bool data = records || aov == Aov::normal || aov == Aov::position || aov == Aov::depth;
  if (!data) return encodeSrgb(composeAov(frame, aov), isLight(aov) ? std::exp2(scale.exposureStops) : 1.0f);
  std::vector<std::uint8_t> rgb(3 * std::size_t{frame.width} * frame.height);
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    const glm::vec3 color = records ? recordColor(frame, i / 3, aov) : dataColor(frame, i / 3, aov, scale);
    const float value = color[static_cast<int>(i % 3)];
    rgb[i] = static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(value, 0.0f, 1.0f)));
  }
  return rgb;
}

}  // namespace relume
