// SPDX-License-Identifier: MIT
// See screen_box.h. Seen along one axis of the image, a sphere is a circle, and its outline the two tangents from the
// eye.
#include "bake/preview/screen_box.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace relume {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-3;  // [pixel] of the positions that are compared with the box

struct Range {
  double min = 0.0, max = 0.0;
};

// Tangents of the angles under which a circle at (across, ahead) is seen in front of the eye; empty behind it.
Range tangents(double across, double ahead, double radius) {
  const double distance = std::hypot(across, ahead);
  if (!(distance > radius)) return {-kInfinity, kInfinity};
  const double middle = std::atan2(across, ahead), half = std::asin(radius / distance);
  constexpr double kRight = std::numbers::pi / 2;
  if (middle - half >= kRight || middle + half <= -kRight) return {1.0, 0.0};
  return {middle - half <= -kRight ? -kInfinity : std::tan(middle - half),
          middle + half >= kRight ? kInfinity : std::tan(middle + half)};
}

// Pixels from a range of the image, which spans -1..1.
void toPixels(const Range& range, double pixels, std::uint32_t& min, std::uint32_t& max) {
  const auto at = [pixels](double x) { return std::clamp(pixels * (0.5 + 0.5 * x), -1.0, pixels + 1.0); };
  if (!(range.min <= range.max)) return;
  const double low = std::floor(at(range.min) - kRounding), high = std::floor(at(range.max) + kRounding) + 1.0;
  min = static_cast<std::uint32_t>(std::clamp(low, 0.0, pixels));
  max = static_cast<std::uint32_t>(std::clamp(high, 0.0, pixels));
}

}  // namespace

ScreenBox boxOfSphere(const CameraRays& camera, const glm::vec3& centerWorld, float radius) {
  const glm::dvec3 center = glm::dvec3(centerWorld) - glm::dvec3(camera.origin);
  const double halfWidth = glm::length(glm::dvec3(camera.right)), halfHeight = glm::length(glm::dvec3(camera.up));
  ScreenBox box;
  if (!(halfWidth > 0.0 && halfHeight > 0.0)) return box;
  const double x = glm::dot(center, glm::dvec3(camera.right)) / halfWidth,
               y = -glm::dot(center, glm::dvec3(camera.up)) / halfHeight,
               z = glm::dot(center, glm::dvec3(camera.forward));
  const double r = radius;
  const Range across = camera.orthographic ? Range{x - r, x + r} : tangents(x, z, r);
  const Range down = camera.orthographic ? Range{y - r, y + r} : tangents(y, z, r);
  toPixels({across.min / halfWidth, across.max / halfWidth}, camera.width, box.minX, box.maxX);
  toPixels({down.min / halfHeight, down.max / halfHeight}, camera.height, box.minY, box.maxY);
  return box;
}

}  // namespace relume
