// SPDX-License-Identifier: MIT
// See receivers.h.
#include "bake/preview/receivers.h"

#include "bake/base/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>

namespace relume {
namespace {

constexpr float kInFront = 0.3f;  // sine of the angle above the surface from which on a neighbour may block light

// Let pixels know of what their neighbours show in front of them.
void findOccluders(std::vector<PixelReceiver>& receivers, std::size_t width, std::size_t height) {
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      PixelReceiver& r = receivers[y * width + x];
      if (r.normal == glm::vec3(0.0f)) continue;
      for (std::size_t v = y > 0 ? y - 1 : 0; v <= std::min(y + 1, height - 1); ++v) {
        for (std::size_t u = x > 0 ? x - 1 : 0; u <= std::min(x + 1, width - 1); ++u) {
          const PixelReceiver& other = receivers[v * width + u];
          const glm::vec3 offset = other.positionWorld - r.positionWorld;
          const float distance = glm::length(offset);
          if (other.footprint > 0.0f && glm::dot(offset, r.geometricNormal) > kInFront * distance)
            r.occluder = std::min(r.occluder, distance);
        }
      }
    }
  }
}

}  // namespace

ReceiverMaker::ReceiverMaker(const CameraRays& camera)
    : origin_(camera.origin),
      forward_(camera.forward),
      orthographic_(camera.orthographic),
      pixel_(2.0f * glm::length(camera.up) / camera.height) {}

PixelReceiver ReceiverMaker::at(const SeenSurface& seen) const {
  PixelReceiver receiver{seen.positionWorld, seen.normal, seen.geometricNormal, pixel_};
  if (receiver.normal == glm::vec3(0.0f)) receiver.normal = receiver.geometricNormal;
  if (!orthographic_) receiver.footprint *= std::max(glm::dot(seen.positionWorld - origin_, forward_), 0.0f);
  return receiver;
}

std::vector<PixelReceiver> findReceivers(const RayTracer& drawn, const CameraRays& camera, Context& context) {
  const auto width = static_cast<std::size_t>(camera.width), height = static_cast<std::size_t>(camera.height);
  std::vector<PixelReceiver> receivers(width * height);
  const ReceiverMaker make(camera);
  parallelChunks(context, "", height, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<Ray> rays(width);
    std::vector<Hit> hits(width);
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < width; ++x)
        camera.at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, rays[x].origin, rays[x].direction);
      drawn.trace(rays, hits, RayOrder::coherent);
      for (std::size_t x = 0; x < width; ++x) {
        if (hits[x]) receivers[y * width + x] = make.at(seenAt(drawn.scene(), rays[x], hits[x]));
      }
    }
  });
  findOccluders(receivers, width, height);
  return receivers;
}

}  // namespace relume
