// SPDX-License-Identifier: MIT
// See light_editor.h.
#include "tools/view/light_editor.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <utility>

namespace relume {
namespace {

constexpr float kMaxPosition = 1e6f;  // [m] well within what a list of lights may say

}  // namespace

glm::vec3 LightEditor::anchorOf(const ViewedLight& light, const PixelView& view) {
  const glm::vec3& position = light.light.positionWorld;
  if (light.light.kind != LightKind::directional || view.shows(position)) return position;
  // A sun shines everywhere: its rings stand at the right of the view, where neither panel nor level's middle is.
  constexpr float kAhead = 3.0f;  // [m]
  const MouseRay ray = view.ray({0.85f * view.size.x, 0.3f * view.size.y});
  return ray.origin + kAhead * ray.direction;
}

std::optional<std::size_t> LightEditor::indexIn(const Lights& lights) const {
  if (!selected_) return std::nullopt;
  const auto found = std::ranges::find(lights, *selected_, &ViewedLight::id);
  if (found == lights.end()) return std::nullopt;
  return static_cast<std::size_t>(found - lights.begin());
}

void LightEditor::select(std::optional<std::size_t> id) {
  drag_.reset();
  selected_ = id;
}

std::optional<Gizmo> LightEditor::gizmo(const Lights& lights, const PixelView& view) const {
  const auto index = indexIn(lights);
  if (!index) return std::nullopt;
  const ViewedLight& light = lights[*index];
  if (drag_) {
    // Rings stay where they were grabbed; handles that move go with the light.
    Gizmo dragged = drag_->start;
    if (!isRing(drag_->handle)) dragged.centreWorld = light.light.positionWorld;
    dragged.direction = light.light.direction;
    return dragged;
  }
  Gizmo gizmo;
  gizmo.centreWorld = anchorOf(light, view);
  gizmo.direction = light.light.direction;
  gizmo.size = gizmoSize(view, gizmo.centreWorld);
  gizmo.moves = light.light.kind != LightKind::directional;
  gizmo.turns = light.light.kind != LightKind::point;
  if (!(gizmo.size > 0.0f)) return std::nullopt;
  return gizmo;
}

Handle LightEditor::handleAt(const Lights& lights, const PixelView& view, const glm::vec2& pixel) const {
  if (drag_) return drag_->handle;
  const auto shown = gizmo(lights, view);
  return shown ? pickHandle(*shown, view, pixel) : Handle::none;
}

bool LightEditor::press(Lights& lights, const PixelView& view, const glm::vec2& pixel) {
  const auto shown = gizmo(lights, view);
  if (shown) {
    drag_ = beginDrag(*shown, pickHandle(*shown, view, pixel), view, pixel);
    if (drag_) {
      before_ = lights[*indexIn(lights)];
      return true;
    }
  }
  std::vector<std::size_t> nearest;  // ids: several where lights are at one place, as suns out of view are
  float best = kLightIconPixels + 3.0f;
  for (const ViewedLight& light : lights) {
    const auto at = view.project(anchorOf(light, view));
    const float distance = at ? glm::distance(*at, pixel) : best;
    if (distance >= best && (nearest.empty() || distance > best)) continue;
    if (distance < best) nearest.clear();
    best = distance;
    nearest.push_back(light.id);
  }
  // Of those the one after the one that is selected.
  const auto is = std::find(nearest.begin(), nearest.end(), selected_);
  const bool isBeforeAnother = is != nearest.end() && is + 1 != nearest.end();
  selected_ = isBeforeAnother ? is[1] : nearest.empty() ? std::nullopt : std::optional(nearest.front());
  return selected_.has_value();
}

void LightEditor::move(Lights& lights, const PixelView& view, const glm::vec2& pixel) {
  const auto index = indexIn(lights);
  if (!drag_ || !index) return;
  const auto to = dragTo(*drag_, view, pixel);
  if (!to) return;
  ViewedLight& light = lights[*index];
  light.orbits = false;
  if (isRing(drag_->handle)) {
    light.light.direction = to->direction;
  } else {
    light.light.positionWorld = light.home = glm::clamp(to->centreWorld, -kMaxPosition, kMaxPosition);
  }
}

void LightEditor::cancelDrag(Lights& lights) {
  if (!drag_) return;
  if (const auto index = indexIn(lights)) lights[*index] = *before_;
  drag_.reset();
}

void LightEditor::giveIds(Lights& lights) {
  for (ViewedLight& light : lights) {
    if (light.id == 0) light.id = ++lastId_;
  }
}

void LightEditor::add(Lights& lights, ViewedLight light) {
  cancelDrag(lights);
  light.id = ++lastId_;
  selected_ = light.id;
  lights.push_back(std::move(light));
}

void LightEditor::removeSelected(Lights& lights) {
  cancelDrag(lights);
  if (const auto index = indexIn(lights)) lights.erase(lights.begin() + static_cast<std::ptrdiff_t>(*index));
  selected_.reset();
}

void LightEditor::replace(Lights& lights, Lights with) {
  cancelDrag(lights);
  lights = std::move(with);
  for (ViewedLight& light : lights) light.id = ++lastId_;
  selected_.reset();
}

void LightEditor::keepSelectionWithin(const Lights& lights) {
  if (!indexIn(lights)) select({});
}

}  // namespace relume
