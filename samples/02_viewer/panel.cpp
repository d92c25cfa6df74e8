// SPDX-License-Identifier: MIT
// See panel.h. Together with window.cpp the only file that includes Dear ImGui.
#include "samples/02_viewer/panel.h"

#include <imgui.h>

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <iterator>

namespace relume {
namespace {

void lightControls(ViewedLight& viewed) {
  ImGui::Checkbox(viewed.name.c_str(), &viewed.on);
  if (!viewed.on) return;
  ImGui::Indent();
  ImGui::SliderFloat("stops", &viewed.stops, -8.0f, 8.0f, "%.1f");
  ImGui::ColorEdit3("intensity", glm::value_ptr(viewed.light.intensity),
                    ImGuiColorEditFlags_Float | ImGuiColorEditFlags_HDR);
  if (viewed.light.kind != LightKind::directional) {
    if (ImGui::DragFloat3("position", glm::value_ptr(viewed.light.positionWorld), 0.02f))
      viewed.home = viewed.light.positionWorld;
  }
  if (viewed.light.kind != LightKind::point) {
    glm::vec3 direction = viewed.light.direction;
    if (ImGui::DragFloat3("direction", glm::value_ptr(direction), 0.01f, -1.0f, 1.0f) && glm::length(direction) > 1e-3f)
      viewed.light.direction = glm::normalize(direction);
  }
  if (ImGui::Checkbox("orbit", &viewed.orbits) && viewed.orbits) viewed.home = viewed.light.positionWorld;
  ImGui::Unindent();
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
  ImGui::Checkbox("light map", &state.lightmap);
  for (const Camera& camera : scene.cameras) {
    if (ImGui::Button(camera.name.c_str())) state.camera = FlyCamera::from(camera);
    ImGui::SameLine();
  }
  ImGui::NewLine();
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

}  // namespace

void drawPanel(const Scene& scene, const Bake& bake, Viewer& viewer, ViewState& state) {
  ImGui::SetNextWindowPos(ImVec2(8, 8), ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize(ImVec2(340, 700), ImGuiCond_FirstUseEver);
  ImGui::Begin("Relume");
  ImGui::Text("%u surfels, %u caches, %u links", bake.surfels.count(), bake.caches.count(), bake.links.count());
  if (ImGui::CollapsingHeader("View", ImGuiTreeNodeFlags_DefaultOpen)) viewControls(scene, state);
  if (ImGui::CollapsingHeader("Lights", ImGuiTreeNodeFlags_DefaultOpen)) {
    for (std::size_t i = 0; i < state.lights.size(); ++i) {
      ImGui::PushID(static_cast<int>(i));
      lightControls(state.lights[i]);
      ImGui::PopID();
    }
    ImGui::SliderFloat("emitters", &state.emission, 0.0f, 8.0f);
    ImGui::ColorEdit3("sky", glm::value_ptr(state.sky), ImGuiColorEditFlags_Float | ImGuiColorEditFlags_HDR);
    ImGui::SliderFloat("bounces", &state.bounceScale, 0.0f, 1.0f);
    ImGui::Checkbox("relight", &state.relight);
    ImGui::SameLine();
    if (ImGui::Button("forget")) viewer.relighter().reset();
    glm::vec3 toy(state.moved[3]);
    if (ImGui::DragFloat3("dynamic", glm::value_ptr(toy), 0.02f)) state.moved[3] = glm::vec4(toy, 1.0f);
  }
  if (ImGui::CollapsingHeader("Times", ImGuiTreeNodeFlags_DefaultOpen)) timeTable(viewer);
  ImGui::TextDisabled("right mouse: look; W A S D Q E: fly, Shift: fast");
  ImGui::End();
}

}  // namespace relume
