// SPDX-License-Identifier: MIT
// See panel.h. Together with window.cpp the only file that includes Dear ImGui.
#include "tools/view/panel.h"

#include <imgui.h>

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <iterator>

namespace relume {
namespace {

constexpr float kWidth = 250.0f, kItemWidth = 150.0f;

void lightControls(ViewedLight& viewed) {
  ImGui::Checkbox("##on", &viewed.on);
  ImGui::SameLine();
  if (!ImGui::TreeNode("light", "%s", viewed.name.c_str())) return;
  ImGui::SliderFloat("stops", &viewed.stops, -8.0f, 8.0f, "%.1f");
  ImGui::ColorEdit3("colour", glm::value_ptr(viewed.light.intensity),
                    ImGuiColorEditFlags_Float | ImGuiColorEditFlags_HDR | ImGuiColorEditFlags_NoOptions);
  if (viewed.light.kind != LightKind::directional) {
    if (ImGui::DragFloat3("position", glm::value_ptr(viewed.light.positionWorld), 0.02f, -1e6f, 1e6f, "%.2f"))
      viewed.home = viewed.light.positionWorld;
  }
  if (viewed.light.kind != LightKind::point) {
    glm::vec3 direction = viewed.light.direction;
    if (ImGui::DragFloat3("aim", glm::value_ptr(direction), 0.01f, -1.0f, 1.0f, "%.2f") &&
        glm::length(direction) > 1e-3f)
      viewed.light.direction = glm::normalize(direction);
  }
  if (ImGui::Checkbox("orbit", &viewed.orbits) && viewed.orbits) viewed.home = viewed.light.positionWorld;
  ImGui::TreePop();
}

void lightsControls(Viewer& viewer, ViewState& state) {
  for (std::size_t i = 0; i < state.lights.size(); ++i) {
    ImGui::PushID(static_cast<int>(i));
    lightControls(state.lights[i]);
    ImGui::PopID();
  }
  ImGui::SliderFloat("emitters", &state.emission, 0.0f, 8.0f, "%.2f");
  if (state.sky.map) {
    ImGui::SliderFloat("sky's turn", &state.sky.rotationDeg, -180.0f, 180.0f, "%.0f deg");
  } else {
    ImGui::ColorEdit3("sky", glm::value_ptr(state.sky.radiance),
                      ImGuiColorEditFlags_Float | ImGuiColorEditFlags_HDR | ImGuiColorEditFlags_NoOptions);
  }
  ImGui::SliderFloat("bounces", &state.bounceScale, 0.0f, 1.0f, "%.2f");
  ImGui::SliderFloat("gloss", &state.reflectance, 0.0f, 1.0f, "%.2f");
  ImGui::SliderFloat("roughness", &state.roughness, 0.0f, 1.0f, "%.2f");
  ImGui::Checkbox("relight", &state.relight);
  ImGui::SameLine();
  if (ImGui::Button("forget")) viewer.relighter().reset();
}

void objectControls(ViewState& state) {
  for (std::size_t i = 0; i < state.objects.size(); ++i) {
    ViewedObject& object = state.objects[i];
    ImGui::PushID(static_cast<int>(i));
    ImGui::DragFloat3(object.name.c_str(), glm::value_ptr(object.position), 0.02f, -1e6f, 1e6f, "%.2f");
    ImGui::PopID();
  }
  if (ImGui::Button("put back")) {
    for (ViewedObject& object : state.objects) object.position = object.home;
  }
}

void viewControls(const Scene& scene, ViewState& state) {
  int mode = static_cast<int>(state.mode);
  if (ImGui::Combo("show", &mode, kViewModeNames, static_cast<int>(std::size(kViewModeNames))))
    state.mode = static_cast<ViewMode>(mode);
  ImGui::SliderFloat("exposure", &state.exposure, -8.0f, 8.0f, "%.1f stops");
  ImGui::Checkbox("surfels", &state.surfels);
  ImGui::SameLine();
  ImGui::Checkbox("caches", &state.caches);
  ImGui::SameLine();
  ImGui::Checkbox("map", &state.lightmap);
  if (scene.cameras.empty() || !ImGui::BeginCombo("camera", "fly to ...")) return;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    ImGui::PushID(static_cast<int>(i));
    if (ImGui::Selectable(scene.cameras[i].name.c_str())) state.camera = FlyCamera::from(scene.cameras[i]);
    ImGui::PopID();
  }
  ImGui::EndCombo();
}

void timeTable(const Viewer& viewer) {
  double total = 0.0;
  for (const auto& [pass, ms] : viewer.times()) {
    ImGui::Text("%-14s %8.2f ms", pass.c_str(), ms);
    total += ms;
  }
  ImGui::Text("%-14s %8.2f ms", "sum", total);
  ImGui::Text("%-14s %11s", "bands", viewer.bands().c_str());
}

void help() {
  ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
  ImGui::PushTextWrapPos(kWidth - 8.0f);
  ImGui::TextUnformatted("Right mouse: look. W A S D Q E: fly, Shift: fast. Tab: hide or show this.");
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
}

}  // namespace

void drawPanel(const Scene& scene, const Bake& bake, Viewer& viewer, ViewState& state) {
  if (!state.panel) return;
  // As wide as its controls need and as tall as those that are open, within the window.
  ImGui::SetNextWindowPos(ImVec2(8, 8), ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSizeConstraints(ImVec2(kWidth, 0), ImVec2(kWidth, ImGui::GetIO().DisplaySize.y - 16.0f));
  ImGui::Begin("Relume", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::PushItemWidth(kItemWidth);
  help();
  if (ImGui::CollapsingHeader("View", ImGuiTreeNodeFlags_DefaultOpen)) viewControls(scene, state);
  if (ImGui::CollapsingHeader("Lights")) lightsControls(viewer, state);
  if (!state.objects.empty() && ImGui::CollapsingHeader("Objects")) objectControls(state);
  if (ImGui::CollapsingHeader("Times")) {
    ImGui::Text("%u surfels, %u caches,", bake.surfels.count(), bake.caches.count());
    ImGui::Text("%u links", bake.links.count());
    timeTable(viewer);
  }
  ImGui::PopItemWidth();
  ImGui::End();
}

}  // namespace relume
