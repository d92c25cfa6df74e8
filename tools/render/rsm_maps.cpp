// SPDX-License-Identifier: MIT
// See rsm_maps.h.
#include "tools/render/rsm_maps.h"

#include "formats/frame_about.h"

#include "bake/base/parallel.h"
#include "bake/rays/seen_surface.h"
#include "bake/reference/path_tracer.h"
#include "bake/scene/camera_rays.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace relume {
namespace {

constexpr float kWidestSpot = 1.3962634f;  // [rad] 80 degrees
constexpr float kFlattest = 1e-3f;         // cosine of the flattest surface whose area is told

// Axes of a face: right and up span half of it at distance 1 (directional: half of it) [m].
struct Face {
  glm::vec3 right, up, forward;
};

Face acrossTo(const glm::vec3& forward) {
  const glm::mat3 frame = frameAbout(forward);
  return {frame[0], frame[1], frame[2]};
}

Face cubeFace(std::uint32_t face) {
  glm::vec3 forward(0.0f);
  const auto axis = static_cast<int>(face / 2);
  forward[axis] = face % 2 == 0 ? 1.0f : -1.0f;
  return acrossTo(forward);
}

// Solid angle of the rectangle between the middle of a face and (x, y) at distance 1.
double cornerAngle(double x, double y) { return std::atan(x * y / std::sqrt(1.0 + x * x + y * y)); }

double solidAngle(double x0, double y0, double x1, double y1) {
  return cornerAngle(x1, y1) - cornerAngle(x0, y1) - cornerAngle(x1, y0) + cornerAngle(x0, y0);
}

// Where a light's rays start, and how much of it each carries.
class LightRays {
 public:
  LightRays(const RayTracer& tracer, const SceneLight& light, std::uint32_t side) : light_(light), side_(side) {
    if (light.kind == LightKind::directional) {
      fitSphere(tracer);
      return;
    }
    origin_ = light.positionWorld;
    const bool isNarrow = light.kind == LightKind::spot && light.outerConeRad <= kWidestSpot;
    faces_ = isNarrow ? 1 : 6;
    const float wide = isNarrow ? std::tan(light.outerConeRad) : 1.0f;
    for (std::uint32_t f = 0; f < faces_; ++f) {
      face_[f] = isNarrow ? acrossTo(glm::normalize(light.direction)) : cubeFace(f);
      face_[f].right *= wide;
      face_[f].up *= wide;
    }
    wide_ = wide;
  }

  std::uint32_t faces() const { return faces_; }

  Ray at(std::uint32_t face, std::uint32_t x, std::uint32_t y) const {
    const Face& f = face_[face];
    const glm::vec3 across = place(x) * f.right + place(y) * f.up;
    Ray ray;
    if (light_.kind == LightKind::directional) {
      ray.origin = origin_ + across;
      ray.direction = f.forward;
    } else {
      ray.origin = origin_;
      ray.direction = glm::normalize(f.forward + across);
    }
    return ray;
  }

  // The light's area across the ray, where it has gone so far. [m²]
  double areaAcross(std::uint32_t x, std::uint32_t y, double distance) const {
    const double step = 2.0 * wide_ / side_, x0 = step * x - wide_, y0 = step * y - wide_;
    if (light_.kind == LightKind::directional) return step * step;
    return solidAngle(x0, y0, x0 + step, y0 + step) * distance * distance;
  }

 private:
  float place(std::uint32_t i) const {
    return (2.0f * static_cast<float>(i) + 1.0f) / static_cast<float>(side_) - 1.0f;
  }

  void fitSphere(const RayTracer& tracer) {
    const glm::vec3 low = tracer.boundsMin(), high = tracer.boundsMax();
    const float radius = std::max(0.5f * glm::distance(low, high), 1e-3f);
    // A texel more on either side, for the snapping.
    wide_ = radius * (1.0f + 2.0f / static_cast<float>(side_));
    const float texel = 2.0f * wide_ / static_cast<float>(side_);
    Face face = acrossTo(glm::normalize(light_.direction));
    const glm::vec3 middle = 0.5f * (low + high);
    const auto snapped = [&](const glm::vec3& axis) {
      return (std::round(glm::dot(middle, axis) / texel) * texel - glm::dot(middle, axis)) * axis;
    };
    origin_ = middle + snapped(face.right) + snapped(face.up) - 1.01f * radius * face.forward;
    face.right *= wide_;
    face.up *= wide_;
    face_[0] = face;
  }

  const SceneLight& light_;
  std::uint32_t side_, faces_ = 1;
  glm::vec3 origin_{0.0f};
  float wide_ = 1.0f;  // half a face
  std::array<Face, 6> face_{};
};

RsmTexel texelAt(const RayTracer& tracer, const SceneLight& light, const LightRays& rays, const Ray& ray,
                 std::uint32_t x, std::uint32_t y) {
  RsmTexel texel;
  const Hit hit = tracer.trace(ray);
  if (!hit) return texel;
  const SeenSurface seen = seenAt(tracer.scene(), ray, hit);
  glm::vec3 toLight;
  float distance = 0.0f;
  const glm::vec3 arrives = lightIrradiance(light, seen.positionWorld, -ray.direction, toLight, distance);
  const double across = rays.areaAcross(x, y, hit.distance);
  texel.positionWorld = seen.positionWorld;
  texel.normal = seen.normal;
  texel.area = static_cast<float>(across / std::max(-glm::dot(ray.direction, seen.normal), kFlattest));
  texel.flux = static_cast<float>(across) * arrives * glm::clamp(albedoAt(tracer.scene(), seen.point), 0.0f, 1.0f);
  return texel;
}

}  // namespace

RsmMap renderRsm(const RayTracer& tracer, const SceneLight& light, std::uint32_t side, Context& context) {
  const LightRays rays(tracer, light, side);
  RsmMap map;
  map.side = side;
  map.faces = rays.faces();
  map.texel.resize(std::size_t{map.faces} * side * side);
  parallelChunks(context, "", std::size_t{map.faces} * side, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end && !context.cancelled(); ++row) {
      const auto face = static_cast<std::uint32_t>(row / side), y = static_cast<std::uint32_t>(row % side);
      for (std::uint32_t x = 0; x < side; ++x)
        map.texel[row * side + x] = texelAt(tracer, light, rays, rays.at(face, x, y), x, y);
    }
  });
  return map;
}

DepthPicture renderDepth(const RayTracer& tracer, const Camera& camera, std::uint32_t width, std::uint32_t height,
                         Context& context) {
  DepthPicture picture;
  DepthView& view = picture.view;
  view.width = width;
  view.height = height;
  picture.depth.assign(std::size_t{width} * height, 0.0f);
  const CameraRays rays(camera, width, height);
  parallelChunks(context, "", height / view.stride + 1, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end && !context.cancelled(); ++row) {
      const auto y = static_cast<std::uint32_t>(row) * view.stride + view.stride / 2;
      for (std::uint32_t x = view.stride / 2; x < width && y < height; x += view.stride) {
        Ray ray;
        rays.at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, ray.origin, ray.direction);
        const Hit hit = tracer.trace(ray);
        if (hit) picture.depth[std::size_t{y} * width + x] = hit.distance * glm::dot(ray.direction, rays.forward);
      }
    }
  });
  // Pixel (x, y) lies at right (2 (x + 0.5) / width - 1) + up (1 - 2 (y + 0.5) / height), at depth 1 with perspective.
  const float stepX = 2.0f / rays.width, stepY = 2.0f / rays.height;
  const glm::vec3 corner = (0.5f * stepX - 1.0f) * rays.right + (1.0f - 0.5f * stepY) * rays.up;
  view.perspective = !rays.orthographic;
  view.worldFromPixel = view.perspective
                            ? glm::mat4x3(stepX * rays.right, -stepY * rays.up, corner + rays.forward, rays.origin)
                            : glm::mat4x3(stepX * rays.right, -stepY * rays.up, rays.forward, rays.origin + corner);
  view.depth = picture.depth;
  return picture;
}

}  // namespace relume
