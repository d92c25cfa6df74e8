// SPDX-License-Identifier: MIT
// See panel_controls.h.
#include "tools/view/panel_controls.h"

#include <imgui.h>

#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <cstddef>

namespace relume {
namespace {

constexpr float kMostMetres = 1e6f;
constexpr float kSmallLevel = 5.0f;  // [m] below which centimetres are not fine enough

// Dear ImGui asks for room before it writes.
int resize(ImGuiInputTextCallbackData* data) {
  std::string& text = *static_cast<std::string*>(data->UserData);
  text.resize(static_cast<std::size_t>(data->BufTextLen));
  data->Buf = text.data();
  return 0;
}

void nameBehind(const std::string& name) {
  ImGui::SameLine(0.0f, ImGui::GetStyle().ItemInnerSpacing.x);
  ImGui::TextUnformatted(name.data(), name.data() + name.size());
}

}  // namespace

bool inputText(const char* label, std::string& text) {
  return ImGui::InputText(label, text.data(), text.capacity() + 1, ImGuiInputTextFlags_CallbackResize, resize, &text);
}

bool namedCheckbox(const std::string& name, bool& value) {
  bool isChanged = ImGui::Checkbox("##named", &value);
  nameBehind(name);
  // As a label would
  if (ImGui::IsItemClicked()) {
    value = !value;
    isChanged = true;
  }
  return isChanged;
}

bool namedSelectable(const std::string& name, bool isSelected) {
  const char* const end = name.data() + name.size();
  const float x = ImGui::GetCursorPosX();
  const float width = std::max(ImGui::CalcTextSize(name.data(), end).x, ImGui::GetContentRegionAvail().x);
  const bool isPressed = ImGui::Selectable("##named", isSelected, ImGuiSelectableFlags_None, ImVec2(width, 0.0f));
  ImGui::SameLine(x);
  ImGui::TextUnformatted(name.data(), end);
  return isPressed;
}

bool namedPlace(const std::string& name, glm::vec3& positionWorld, float levelSize) {
  const bool isDragged = dragPlace("##named", positionWorld, levelSize);
  nameBehind(name);
  return isDragged;
}

bool dragPlace(const char* label, glm::vec3& positionWorld, float levelSize) {
  return ImGui::DragFloat3(label, glm::value_ptr(positionWorld), std::min(0.02f, 2e-3f * levelSize), -kMostMetres,
                           kMostMetres, levelSize < kSmallLevel ? "%.4f" : "%.2f", ImGuiSliderFlags_AlwaysClamp);
}

bool dragRange(const char* label, float& range, float levelSize) {
  const char* const format = range > 0.0f ? levelSize < kSmallLevel ? "%.4f m" : "%.2f m" : "no limit";
  return ImGui::DragFloat(label, &range, std::min(0.05f, 5e-3f * levelSize), 0.0f, kMostMetres, format,
                          ImGuiSliderFlags_AlwaysClamp);
}

}  // namespace relume
