// SPDX-License-Identifier: MIT
// See receivers.h.
#include "bake/preview/receivers.h"

#include "bake/base/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>

namespace relume {

ReceiverMaker::ReceiverMaker(const CameraRays& camera)
    : origin_(camera.origin),
      forward_(camera.forward),
      orthographic_(camera.orthographic),
      pixel_(2.0f * glm::length(camera.up) / camera.height) {}

Receiver ReceiverMaker::at(const SeenSurface& seen) const {
  Receiver receiver{seen.positionWorld, seen.normal, seen.geometricNormal, pixel_};
  if (receiver.normal == glm::vec3(0.0f)) receiver.normal = receiver.geometricNormal;
  if (!orthographic_) receiver.footprint *= std::max(glm::dot(seen.positionWorld - origin_, forward_), 0.0f);
  return receiver;
}

std::vector<Receiver> findReceivers(const RayTracer& drawn, const CameraRays& camera, Context& context) {
  const auto width = static_cast<std::size_t>(camera.width), height = static_cast<std::size_t>(camera.height);
  std::vector<Receiver> receivers(width * height);
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
  return receivers;
}

}  // namespace relume
