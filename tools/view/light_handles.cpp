// SPDX-License-Identifier: MIT
// See light_handles.h.
#include "tools/view/light_handles.h"

#include <imgui.h>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>

namespace relume {
namespace {

constexpr std::array<ImU32, 3> kAxisColors{IM_COL32(235, 80, 80, 255), IM_COL32(110, 205, 85, 255),
                                           IM_COL32(85, 140, 250, 255)};
constexpr ImU32 kBright = IM_COL32(255, 225, 90, 255), kDark = IM_COL32(0, 0, 0, 170);

ImVec2 at(const glm::vec2& p) { return {p.x, p.y}; }

ImU32 withAlpha(ImU32 color, int alpha) {
  return (color & ~IM_COL32_A_MASK) | (static_cast<ImU32>(alpha) << IM_COL32_A_SHIFT);
}

// The light's hue, bright enough to be seen.
ImU32 hueOf(const Light& light) {
  const float most = glm::max(light.intensity.x, glm::max(light.intensity.y, light.intensity.z));
  const glm::vec3 c = most > 0.0f ? glm::pow(light.intensity / most, glm::vec3(1.0f / 2.2f)) : glm::vec3(0.6f);
  return ImGui::ColorConvertFloat4ToU32({c.x, c.y, c.z, 1.0f});
}

// A short line the way the light travels.
void drawDirection(ImDrawList& list, const Light& light, const glm::vec3& anchor, const PixelView& view, ImU32 color) {
  constexpr float kPixels = 34.0f;
  const auto from = view.project(anchor);
  const auto to = view.project(anchor + kPixels * view.metresPerPixel(anchor) * light.direction);
  if (!from || !to) return;
  list.AddLine(at(*from), at(*to), kDark, 4.0f);
  list.AddLine(at(*from), at(*to), color, 2.0f);
  list.AddCircleFilled(at(*to), 3.0f, color);
}

// The name of what is selected, beside it.
void drawName(ImDrawList& list, const std::string& name, const glm::vec2& centre) {
  const ImVec2 corner(centre.x + 14.0f, centre.y + 8.0f), size = ImGui::CalcTextSize(name.c_str());
  list.AddRectFilled({corner.x - 3.0f, corner.y - 1.0f}, {corner.x + size.x + 3.0f, corner.y + size.y + 2.0f}, kDark,
                     3.0f);
  list.AddText(corner, kBright, name.c_str());
}

void drawIcon(ImDrawList& list, const ViewedLight& viewed, const PixelView& view, bool isSelected) {
  const glm::vec3 anchor = LightEditor::anchorOf(viewed, view);
  const auto centre = view.project(anchor);
  if (!centre) return;
  const ImU32 color = withAlpha(hueOf(viewed.light), viewed.on ? 255 : 110);
  if (viewed.light.kind != LightKind::point && (viewed.on || isSelected))
    drawDirection(list, viewed.light, anchor, view, color);
  const float radius = 0.7f * kLightIconPixels;
  list.AddCircleFilled(at(*centre), radius + 2.0f, kDark);
  if (viewed.on) {
    list.AddCircleFilled(at(*centre), radius, color);
  } else {
    list.AddCircle(at(*centre), radius - 1.0f, color, 0, 2.0f);
  }
  if (!isSelected) return;
  list.AddCircle(at(*centre), kLightIconPixels + 2.0f, kBright, 0, 2.0f);
  drawName(list, viewed.name, *centre);
}

void drawHandle(ImDrawList& list, const Gizmo& gizmo, Handle handle, const PixelView& view, bool isBright) {
  std::vector<ImVec2> points;
  for (const glm::vec3& p : gizmo.outline(handle)) {
    const auto projected = view.project(p);
    if (!projected) return;
    points.push_back(at(*projected));
  }
  const ImU32 color = isBright ? kBright : kAxisColors[static_cast<std::size_t>(axisOf(handle))];
  const int count = static_cast<int>(points.size());
  if (isSquare(handle)) {
    list.AddConvexPolyFilled(points.data(), count, withAlpha(color, isBright ? 150 : 80));
    list.AddPolyline(points.data(), count, color, ImDrawFlags_Closed, 1.5f);
    return;
  }
  list.AddPolyline(points.data(), count, kDark, 0, isAxis(handle) ? 5.0f : 4.0f);
  list.AddPolyline(points.data(), count, color, 0, isAxis(handle) ? 3.0f : 2.0f);
  if (!isAxis(handle)) return;
  // The arrow's head
  const glm::vec2 tip(points[1].x, points[1].y), tail(points[0].x, points[0].y);
  const float length = glm::distance(tip, tail);
  if (length < 4.0f) return;
  const glm::vec2 along = (tip - tail) / length, side(-along.y, along.x);
  list.AddTriangleFilled(at(tip + 9.0f * along), at(tip + 5.0f * side), at(tip - 5.0f * side), color);
}

void drawGizmo(ImDrawList& list, const Gizmo& gizmo, Handle bright, const PixelView& view) {
  // Axes last: a ring that is seen edge on would hide one.
  for (auto handle = kHandles.rbegin(); handle != kHandles.rend(); ++handle) {
    if (gizmo.has(*handle)) drawHandle(list, gizmo, *handle, view, *handle == bright);
  }
}

}  // namespace

void drawLightHandles(const LightEditor& editor, const LightEditor::Lights& lights, const PixelView& view,
                      const glm::vec2& mouse) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  for (std::size_t i = 0; i < lights.size(); ++i) drawIcon(list, lights[i], view, editor.selected() == lights[i].id);
  const auto gizmo = editor.gizmo(lights, view);
  if (!gizmo) return;
  drawGizmo(list, *gizmo, editor.handleAt(lights, view, mouse), view);
}

void drawObjectHandles(const ObjectEditor& editor, const ObjectEditor::Objects& objects, const PixelView& view,
                       const glm::vec2& mouse) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const auto gizmo = editor.gizmo(objects, view);
  if (!gizmo) return;
  drawGizmo(list, *gizmo, editor.handleAt(objects, view, mouse), view);
  if (const auto centre = view.project(gizmo->centreWorld)) drawName(list, objects[*editor.selected()].name, *centre);
}

}  // namespace relume
