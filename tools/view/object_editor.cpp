// SPDX-License-Identifier: MIT
// See object_editor.h.
#include "tools/view/object_editor.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <limits>

namespace relume {
namespace {

constexpr float kMaxDrag = 1e6f;  // [m]

float squaredDistanceToEdge(const glm::vec3& p, const glm::vec3& a, const glm::vec3& b) {
  const glm::vec3 along = b - a, to = p - a;
  const float length2 = glm::dot(along, along);
  const float t = length2 > 0.0f ? std::clamp(glm::dot(to, along) / length2, 0.0f, 1.0f) : 0.0f;
  const glm::vec3 off = to - t * along;
  return glm::dot(off, off);
}

float squaredDistance(const glm::vec3& p, const std::array<glm::vec3, 3>& corner) {
  const glm::vec3 normal = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
  const float area2 = glm::dot(normal, normal);
  bool isAbove = area2 > 0.0f;
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::vec3 &a = corner[k], &b = corner[(k + 1) % 3];
    isAbove = isAbove && glm::dot(glm::cross(b - a, p - a), normal) >= 0.0f;
    nearest = std::min(nearest, squaredDistanceToEdge(p, a, b));
  }
  if (!isAbove) return nearest;
  const float height = glm::dot(p - corner[0], normal);
  return height * height / area2;
}

}  // namespace

std::optional<std::size_t> objectAt(const Scene& scene, std::span<const MovingNode> nodes,
                                    std::span<const ViewedObject> objects, const glm::vec3& pointWorld) {
  std::optional<std::size_t> found;
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t k = 0; k < nodes.size() && k < objects.size(); ++k) {
    const glm::vec3 point = pointWorld - (objects[k].position - objects[k].home);
    for (std::uint32_t i = 0; i < nodes[k].instanceCount; ++i) {
      const Instance& instance = scene.instances[nodes[k].firstInstance + i];
      const auto triangles = static_cast<std::uint32_t>(scene.meshes[instance.mesh].triangle.size());
      for (std::uint32_t t = 0; t < triangles; ++t) {
        const float distance = squaredDistance(point, scene.corners(instance, t));
        if (!(distance < nearest)) continue;
        nearest = distance;
        found = k;
      }
    }
  }
  return found;
}

void ObjectEditor::select(std::optional<std::size_t> index) {
  drag_.reset();
  selected_ = index;
}

std::optional<Gizmo> ObjectEditor::gizmo(const Objects& objects, const PixelView& view) const {
  if (!selected_ || *selected_ >= objects.size()) return std::nullopt;
  Gizmo gizmo = drag_ ? drag_->start : Gizmo();
  gizmo.centreWorld = objects[*selected_].position;
  if (!drag_) gizmo.size = gizmoSize(view, gizmo.centreWorld);
  if (!(gizmo.size > 0.0f)) return std::nullopt;
  return gizmo;
}

Handle ObjectEditor::handleAt(const Objects& objects, const PixelView& view, const glm::vec2& pixel) const {
  if (drag_) return drag_->handle;
  const auto shown = gizmo(objects, view);
  return shown ? pickHandle(*shown, view, pixel) : Handle::none;
}

bool ObjectEditor::press(const Objects& objects, const PixelView& view, const glm::vec2& pixel) {
  const auto shown = gizmo(objects, view);
  if (shown) drag_ = beginDrag(*shown, pickHandle(*shown, view, pixel), view, pixel);
  return drag_.has_value();
}

void ObjectEditor::move(Objects& objects, const PixelView& view, const glm::vec2& pixel) const {
  if (!drag_) return;
  if (const auto to = dragTo(*drag_, view, pixel))
    objects[*selected_].position = glm::clamp(to->centreWorld, -kMaxDrag, kMaxDrag);
}

void ObjectEditor::cancelDrag(Objects& objects) {
  if (!drag_) return;
  objects[*selected_].position = drag_->start.centreWorld;
  drag_.reset();
}

}  // namespace relume
