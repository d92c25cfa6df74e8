// SPDX-License-Identifier: MIT
// See panel.h: the list of lights, the one that is selected, undo, save and load.
#include "tools/view/light_intensity.h"
#include "tools/view/light_set.h"
#include "tools/view/panel.h"
#include "tools/view/panel_controls.h"

#include <imgui.h>

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>

namespace relume {
namespace {

// A button that is dim, and does nothing, while there is nothing for it to do.
bool button(const char* label, bool enabled) {
  ImGui::BeginDisabled(!enabled);
  const bool pressed = ImGui::Button(label);
  ImGui::EndDisabled();
  return pressed && enabled;
}

void intensityControls(Light& light) {
  glm::vec3 color = colorOfLight(light.intensity);
  if (ImGui::ColorEdit3("colour", glm::value_ptr(color), ImGuiColorEditFlags_Float | ImGuiColorEditFlags_NoOptions))
    light.intensity = withColor(light.intensity, color);
  float strength = strengthOf(light.intensity);
  const char* unit = light.kind == LightKind::directional ? "%.4g W/m2" : "%.4g W/sr";
  if (ImGui::DragFloat("intensity", &strength, 0.01f * std::max(strength, 0.05f), 0.0f, 1e20f, unit,
                       ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoRoundToFormat))
    light.intensity = withStrength(light.intensity, strength);
}

void coneControls(Light& light) {
  float inner = glm::degrees(light.innerConeRad), outer = glm::degrees(light.outerConeRad);
  const bool innerMoved = ImGui::SliderFloat("inner", &inner, 0.0f, 90.0f, "%.1f deg", ImGuiSliderFlags_AlwaysClamp);
  const bool outerMoved = ImGui::SliderFloat("outer", &outer, 0.0f, 90.0f, "%.1f deg", ImGuiSliderFlags_AlwaysClamp);
  constexpr float kMost = glm::half_pi<float>();
  if (innerMoved) {
    light.innerConeRad = std::min(glm::radians(inner), kMost);
    light.outerConeRad = std::max(light.innerConeRad, light.outerConeRad);
  }
  if (outerMoved) {
    light.outerConeRad = std::min(glm::radians(outer), kMost);
    light.innerConeRad = std::min(light.innerConeRad, light.outerConeRad);
  }
}

void selectedControls(Session& session, ViewedLight& viewed) {
  Light& light = viewed.light;
  const float levelSize = session.viewer->levelSize();
  inputText("name", viewed.name);
  intensityControls(light);
  if (light.kind != LightKind::directional && dragPlace("position", light.positionWorld, levelSize))
    viewed.home = light.positionWorld;
  if (light.kind != LightKind::point) {
    glm::vec3 direction = light.direction;
    if (ImGui::DragFloat3("aim", glm::value_ptr(direction), 0.01f, -1.0f, 1.0f, "%.2f", ImGuiSliderFlags_AlwaysClamp) &&
        glm::length(direction) > 1e-3f)
      light.direction = glm::normalize(direction);
  }
  if (light.kind == LightKind::spot) coneControls(light);
  if (light.kind != LightKind::directional) dragRange("range", light.range, levelSize);
  if (ImGui::Checkbox("orbit", &viewed.orbits) && viewed.orbits) viewed.home = light.positionWorld;
  ImGui::SameLine();
  const bool copies = ImGui::Button("duplicate");
  ImGui::SameLine();
  // Last, for they end what `viewed` refers to.
  if (ImGui::Button("remove")) return session.run(Command::removeLight);
  if (copies) session.run(Command::duplicateLight);
}

void lightList(Session& session) {
  std::vector<ViewedLight>& lights = session.state.lights;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    ImGui::PushID(static_cast<int>(i));
    bool on = lights[i].on;
    if (ImGui::Checkbox("##on", &on)) {
      if (!on || lightsOn(lights) < kMaxLightsOn) {
        lights[i].on = on;
      } else {
        session.say(Severity::warning, std::to_string(kMaxLightsOn) + " lights are on, and no more can be");
      }
    }
    ImGui::SameLine();
    const bool isSelected = session.editor.selected() == lights[i].id;
    if (namedSelectable(lights[i].name.empty() ? "(no name)" : lights[i].name, isSelected))
      session.editor.select(isSelected ? std::nullopt : std::optional(lights[i].id));
    ImGui::PopID();
  }
  if (lights.empty()) ImGui::TextDisabled("none");
}

}  // namespace

void drawLightControls(Session& session) {
  if (ImGui::Button("+ point")) session.addLight(LightKind::point);
  ImGui::SameLine();
  if (ImGui::Button("+ spot")) session.addLight(LightKind::spot);
  ImGui::SameLine();
  if (ImGui::Button("+ sun")) session.addLight(LightKind::directional);
  lightList(session);
  if (const auto selected = session.editor.indexIn(session.state.lights)) {
    ImGui::Separator();
    selectedControls(session, session.state.lights[*selected]);
  }
  ImGui::Separator();
  if (button("undo", session.edits.canUndo())) session.run(Command::undo);
  ImGui::SameLine();
  if (button("redo", session.edits.canRedo())) session.run(Command::redo);
  ImGui::SameLine();
  if (ImGui::Button("save")) session.run(Command::saveLights);
  ImGui::SameLine();
  if (ImGui::Button("load")) session.run(Command::loadLights);
  inputText("file", session.lightsFile);
}

}  // namespace relume
