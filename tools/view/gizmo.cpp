// SPDX-License-Identifier: MIT
// See gizmo.h.
#include "tools/view/gizmo.h"

#include <glm/common.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr float kAxisPixels = 80.0f, kReachPixels = 9.0f;
constexpr float kSquareLow = 0.22f, kSquareHigh = 0.5f;  // of the axes' length
constexpr float kRing = 1.25f;                           // likewise, a ring's radius
constexpr int kRingPoints = 64;
constexpr float kEndOn = 0.05f;    // sine of the smallest angle between a ray and the handle that it drags
constexpr float kFarthest = 1e4f;  // of the distance from the eye: no drag goes further

glm::vec3 unitAxis(int axis) {
  glm::vec3 a(0.0f);
  a[axis] = 1.0f;
  return a;
}

float distanceToSegment(const glm::vec2& p, const glm::vec2& a, const glm::vec2& b) {
  const glm::vec2 along = b - a;
  const float length2 = glm::dot(along, along);
  const float t = length2 > 0.0f ? std::clamp(glm::dot(p - a, along) / length2, 0.0f, 1.0f) : 0.0f;
  return glm::distance(p, a + t * along);
}

float cross2(const glm::vec2& a, const glm::vec2& b) { return a.x * b.y - a.y * b.x; }

bool isInside(const std::vector<glm::vec2>& quad, const glm::vec2& p) {
  int left = 0;
  for (std::size_t i = 0; i < quad.size(); ++i)
    left += cross2(quad[(i + 1) % quad.size()] - quad[i], p - quad[i]) > 0.0f ? 1 : 0;
  return left == 0 || left == static_cast<int>(quad.size());
}

// Pixels between a handle and the mouse; infinite where a part of it is behind the eye.
float pixelDistance(const Gizmo& gizmo, Handle handle, const PixelView& view, const glm::vec2& pixel) {
  std::vector<glm::vec2> points;
  for (const glm::vec3& p : gizmo.outline(handle)) {
    const auto projected = view.project(p);
    if (!projected) return std::numeric_limits<float>::infinity();
    points.push_back(*projected);
  }
  if (isSquare(handle)) return isInside(points, pixel) ? 0.0f : std::numeric_limits<float>::infinity();
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i + 1 < points.size(); ++i)
    nearest = std::min(nearest, distanceToSegment(pixel, points[i], points[i + 1]));
  return nearest;
}

// The point of a line through `centre` that is nearest to the ray.
std::optional<glm::vec3> onLine(const MouseRay& ray, const glm::vec3& centre, const glm::vec3& axis) {
  const glm::vec3 to = centre - ray.origin;
  const float cosine = glm::dot(ray.direction, axis), sine2 = 1.0f - cosine * cosine;
  if (!(sine2 >= kEndOn * kEndOn)) return std::nullopt;
  const float along = (cosine * glm::dot(ray.direction, to) - glm::dot(axis, to)) / sine2;
  if (!(std::abs(along) <= kFarthest * glm::length(to))) return std::nullopt;
  return centre + along * axis;
}

std::optional<glm::vec3> onPlane(const MouseRay& ray, const glm::vec3& centre, const glm::vec3& normal) {
  const float cosine = glm::dot(ray.direction, normal);
  if (!(std::abs(cosine) >= kEndOn)) return std::nullopt;
  const float distance = glm::dot(centre - ray.origin, normal) / cosine;
  if (!(distance > 0.0f && distance <= kFarthest * glm::length(centre - ray.origin))) return std::nullopt;
  return ray.origin + distance * ray.direction;
}

std::optional<glm::vec3> underMouse(const Gizmo& gizmo, Handle handle, const PixelView& view, const glm::vec2& pixel) {
  const MouseRay ray = view.ray(pixel);
  const glm::vec3 axis = unitAxis(axisOf(handle));
  return isAxis(handle) ? onLine(ray, gizmo.centreWorld, axis) : onPlane(ray, gizmo.centreWorld, axis);
}

}  // namespace

MouseRay PixelView::ray(const glm::vec2& pixel) const {
  const glm::vec2 ndc(2.0f * pixel.x / size.x - 1.0f, 1.0f - 2.0f * pixel.y / size.y);
  const glm::vec4 far = glm::inverse(glm::dmat4(clipFromWorld)) * glm::dvec4(ndc, 1.0, 1.0);
  return {eye, glm::normalize(glm::vec3(far) / far.w - eye)};
}

std::optional<glm::vec2> PixelView::project(const glm::vec3& world) const {
  const glm::vec4 clip = clipFromWorld * glm::vec4(world, 1.0f);
  if (!(clip.w > 1e-6f)) return std::nullopt;
  return glm::vec2(0.5f + 0.5f * clip.x / clip.w, 0.5f - 0.5f * clip.y / clip.w) * size;
}

bool PixelView::shows(const glm::vec3& world) const {
  const auto p = project(world);
  return p && p->x >= 0.0f && p->y >= 0.0f && p->x < size.x && p->y < size.y;
}

float PixelView::metresPerPixel(const glm::vec3& world) const {
  const glm::vec4 clip = clipFromWorld * glm::vec4(world, 1.0f);
  // Clip space is linear along its y row: so many units of it to a metre across the view.
  const float perMetre = glm::length(glm::vec3(clipFromWorld[0].y, clipFromWorld[1].y, clipFromWorld[2].y));
  return clip.w > 0.0f ? 2.0f * clip.w / (perMetre * size.y) : 0.0f;
}

int axisOf(Handle handle) { return handle == Handle::none ? 0 : (static_cast<int>(handle) - 1) % 3; }
bool isAxis(Handle handle) { return handle >= Handle::axisX && handle <= Handle::axisZ; }
bool isSquare(Handle handle) { return handle >= Handle::squareX && handle <= Handle::squareZ; }
bool isRing(Handle handle) { return handle >= Handle::ringX && handle <= Handle::ringZ; }

bool Gizmo::has(Handle handle) const { return handle != Handle::none && (isRing(handle) ? turns : moves); }

std::vector<glm::vec3> Gizmo::outline(Handle handle) const {
  const int axis = axisOf(handle);
  const glm::vec3 u = size * unitAxis((axis + 1) % 3), v = size * unitAxis((axis + 2) % 3);
  if (isAxis(handle)) return {centreWorld, centreWorld + size * unitAxis(axis)};
  if (isSquare(handle)) {
    return {centreWorld + kSquareLow * (u + v), centreWorld + kSquareHigh * u + kSquareLow * v,
            centreWorld + kSquareHigh * (u + v), centreWorld + kSquareLow * u + kSquareHigh * v};
  }
  std::vector<glm::vec3> ring;
  for (int i = 0; i <= kRingPoints; ++i) {
    const float angle = glm::two_pi<float>() * static_cast<float>(i) / kRingPoints;
    ring.push_back(centreWorld + kRing * (std::cos(angle) * u + std::sin(angle) * v));
  }
  return ring;
}

float gizmoSize(const PixelView& view, const glm::vec3& centreWorld) {
  // A small window has a small gizmo.
  return std::min(kAxisPixels, 0.18f * std::min(view.size.x, view.size.y)) * view.metresPerPixel(centreWorld);
}

Handle pickHandle(const Gizmo& gizmo, const PixelView& view, const glm::vec2& pixel) {
  Handle best = Handle::none;
  float nearest = kReachPixels;
  for (const Handle handle : kHandles) {
    if (!gizmo.has(handle)) continue;
    // A ring that is seen edge on lies over an axis; it can be grabbed elsewhere.
    const float distance = (isRing(handle) ? 2.0f : 1.0f) * pixelDistance(gizmo, handle, view, pixel);
    if (distance >= nearest) continue;
    nearest = distance;
    best = handle;
  }
  return best;
}

std::optional<Drag> beginDrag(const Gizmo& gizmo, Handle handle, const PixelView& view, const glm::vec2& pixel) {
  if (!gizmo.has(handle)) return std::nullopt;
  const auto point = underMouse(gizmo, handle, view, pixel);
  if (!point) return std::nullopt;
  return Drag{handle, gizmo, *point - gizmo.centreWorld};
}

std::optional<Dragged> dragTo(const Drag& drag, const PixelView& view, const glm::vec2& pixel) {
  const auto point = underMouse(drag.start, drag.handle, view, pixel);
  if (!point) return std::nullopt;
  const glm::vec3 now = *point - drag.start.centreWorld;
  if (!isRing(drag.handle)) return Dragged{drag.start.centreWorld + now - drag.grabbed, drag.start.direction};
  const glm::vec3 axis = unitAxis(axisOf(drag.handle));
  const float angle = std::atan2(glm::dot(axis, glm::cross(drag.grabbed, now)), glm::dot(drag.grabbed, now));
  const glm::mat4 turn = glm::rotate(glm::mat4(1.0f), angle, axis);
  return Dragged{drag.start.centreWorld, glm::normalize(glm::vec3(turn * glm::vec4(drag.start.direction, 0.0f)))};
}

}  // namespace relume
