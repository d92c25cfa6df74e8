// SPDX-License-Identifier: MIT
// See panel.h.
#include "tools/view/panel.h"

#include "tools/base/printable.h"
#include "tools/view/panel_controls.h"

#include <imgui.h>

#include <glm/common.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iterator>

namespace relume {
namespace {

constexpr float kWidth = 250.0f, kItemWidth = 150.0f, kMargin = 8.0f;

// Bands of luma and chroma by their names; the runtime says which of them a bake can have.
void bandControls(const Viewer& viewer, ViewState& state) {
  const Bands now{viewer.relighter().lumaBands(), viewer.relighter().chromaBands()};
  int luma = now.luma, chroma = now.chroma;
  ImGui::SliderInt("luma", &luma, 1, kMaxBands, "%d", ImGuiSliderFlags_AlwaysClamp);
  ImGui::SliderInt("chroma", &chroma, 1, luma, "%d", ImGuiSliderFlags_AlwaysClamp);
  chroma = std::min(chroma, luma);
  if (luma != now.luma || chroma != now.chroma) state.relightBy.bands = {luma, chroma};
}

// What of the light is shown, and how often it is reflected.
void bounceControls(ViewState& state) {
  ImGui::Checkbox("direct", &state.direct);
  ImGui::SameLine();
  ImGui::Checkbox("indirect", &state.indirect);
  ImGui::SliderInt("bounces", &state.bounces, 0, kMaxBounces, state.bounces > 0 ? "%d" : "all",
                   ImGuiSliderFlags_AlwaysClamp);
  ImGui::SliderFloat("of each", &state.bounceScale, 0.0f, 1.0f, "%.2f", ImGuiSliderFlags_AlwaysClamp);
}

// What surfaces mirror.
void glossControls(bool hasGloss, ViewState& state) {
  if (hasGloss) ImGui::Checkbox("gloss of the materials", &state.gloss);
  ImGui::BeginDisabled(state.gloss);
  ImGui::SliderFloat("gloss", &state.reflectance, 0.0f, 1.0f, "%.2f", ImGuiSliderFlags_AlwaysClamp);
  ImGui::SliderFloat("roughness", &state.roughness, 0.0f, 1.0f, "%.2f", ImGuiSliderFlags_AlwaysClamp);
  ImGui::EndDisabled();
}

// Light without a bake.
void liveControls(Session& session) {
  ViewState& state = session.state;
  ImGui::BeginDisabled(session.job.has_value());
  if (ImGui::Button("bake a draft")) session.bakeDraft();
  ImGui::EndDisabled();
  bounceControls(state);
  int cells = static_cast<int>(state.live.cells), rays = static_cast<int>(state.live.rays);
  if (ImGui::SliderInt("cells", &cells, kMinCells, kMaxCells, "%d", ImGuiSliderFlags_AlwaysClamp))
    state.live.cells = static_cast<std::uint32_t>(cells);
  constexpr auto kFlags = ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic;
  if (ImGui::SliderInt("rays", &rays, 8, 1024, "%d", kFlags)) state.live.rays = static_cast<std::uint32_t>(rays);
  int backend = state.live.backend == BackendKind::cpu ? 1 : 0;
  if (ImGui::Combo("by", &backend, "OpenGL\0CPU\0"))
    state.live.backend = backend == 1 ? BackendKind::cpu : BackendKind::gl;
  glossControls(session.level->hasGloss, state);
  ImGui::Checkbox("mirror by cones", &state.cones);
  ImGui::Checkbox("relight", &state.relight);
  int cascades = static_cast<int>(state.live.cascades);
  if (ImGui::SliderInt("cascades", &cascades, 1, kMaxCascades, "%d", ImGuiSliderFlags_AlwaysClamp))
    state.live.cascades = static_cast<std::uint32_t>(cascades);
}

// The kind of the bake's links. Another is another bake, by the options that made this one.
void linkKindControl(Session& session) {
  const LinkKind now = session.level->bake.links.kind;
  ImGui::BeginDisabled(session.job.has_value());
  if (ImGui::BeginCombo("links", std::string(linkKindName(now)).c_str())) {
    for (const LinkKind kind : kLinkKinds) {
      if (ImGui::Selectable(std::string(linkKindName(kind)).c_str(), kind == now) && kind != now)
        session.bakeLinks(kind);
    }
    ImGui::EndCombo();
  }
  ImGui::EndDisabled();
}

// What every light is relit by.
void relightControls(Session& session) {
  ViewState& state = session.state;
  Viewer& viewer = *session.viewer;
  bounceControls(state);
  bandControls(viewer, state);
  int backend = state.relightBy.backend == BackendKind::cpu ? 1 : 0;
  if (ImGui::Combo("by", &backend, "OpenGL\0CPU\0"))
    state.relightBy.backend = backend == 1 ? BackendKind::cpu : BackendKind::gl;
  if (viewer.hasMovingParts()) ImGui::Checkbox("objects shadow light over links", &state.movingParts);
  linkKindControl(session);
  glossControls(session.level->hasGloss, state);
  ImGui::Checkbox("mirror by cones", &state.cones);
  ImGui::Checkbox("relight", &state.relight);
  ImGui::SameLine();
  if (ImGui::Button("forget")) viewer.relighter().reset();
  ImGui::Checkbox("records", &state.records);
  if (const ViewRecords* records = viewer.records(); state.records && records) {
    ImGui::SameLine();
    if (viewer.showsRecords(state)) {
      ImGui::TextDisabled("%zu%s", records->records(), records->isComplete() ? "" : " ...");
    } else {
      ImGui::TextDisabled("off: objects moved");
    }
  }
}

// Materials that emit, and the sky.
void emitterControls(ViewState& state, bool canDrive) {
  constexpr auto kRadiance = ImGuiColorEditFlags_Float | ImGuiColorEditFlags_HDR | ImGuiColorEditFlags_NoOptions;
  ImGui::SliderFloat("emitters", &state.emission, 0.0f, 8.0f, "%.2f", ImGuiSliderFlags_AlwaysClamp);
  for (std::size_t i = 0; canDrive && i < state.emitters.size(); ++i) {
    ViewedEmitter& emitter = state.emitters[i];
    ImGui::PushID(static_cast<int>(i));
    namedCheckbox(emitter.name, emitter.isDriven);
    if (emitter.isDriven) {
      if (ImGui::ColorEdit3(emitter.image.empty() ? "W/m2/sr" : "factor", glm::value_ptr(emitter.radiance), kRadiance))
        emitter.radiance = glm::clamp(emitter.radiance, 0.0f, 1e9f);
    }
    ImGui::PopID();
  }
  if (state.sky.map) {
    ImGui::SliderFloat("sky's turn", &state.sky.rotationDeg, -360.0f, 360.0f, "%.0f deg", ImGuiSliderFlags_AlwaysClamp);
  } else if (ImGui::ColorEdit3("sky", glm::value_ptr(state.sky.radiance), kRadiance)) {
    state.sky.radiance = glm::clamp(state.sky.radiance, 0.0f, 1e9f);
  }
}

// Of a level whose objects all move, which may have thousands, the one that is picked.
void objectControls(const Session& session, ViewState& state) {
  const bool isPicked = session.level->movable() == Movable::all;
  if (isPicked && !session.objects.selected()) ImGui::TextDisabled("left mouse: pick an object");
  for (std::size_t i = 0; i < state.objects.size(); ++i) {
    if (isPicked && session.objects.selected() != i) continue;
    ViewedObject& object = state.objects[i];
    ImGui::PushID(static_cast<int>(i));
    namedPlace(object.name, object.position, session.viewer->levelSize());
    ImGui::PopID();
  }
  if (ImGui::Button("put back")) {
    for (ViewedObject& object : state.objects) object.position = object.home;
  }
  if (const std::size_t edited = session.viewer->editedObjects(state); edited > 0)
    ImGui::TextWrapped("%zu moved since the bake, which is stale there: light near %s is live", edited,
                       edited == 1 ? "it" : "them");
}

// Any of the overlays, by one row.
void overlayControls(const Bake& bake, ViewState& state) {
  std::string shown;
  for (std::size_t i = 0; i < state.overlays.size(); ++i) {
    if (state.overlays[i]) shown += (shown.empty() ? "" : ", ") + std::string(kOverlayTexts[i]);
  }
  if (ImGui::BeginCombo("overlay", shown.empty() ? "none" : shown.c_str())) {
    for (std::size_t i = 0; i < state.overlays.size(); ++i) ImGui::Checkbox(kOverlayTexts[i], &state.overlays[i]);
    ImGui::EndCombo();
  }
  if (state.shows(Overlay::clusters)) {
    const int levels = static_cast<int>(bake.hierarchy.levelCount());
    ImGui::SliderInt("level", &state.clusterLevel, 0, std::max(levels - 1, 0), "%d", ImGuiSliderFlags_AlwaysClamp);
  }
  if (state.shows(Overlay::links)) ImGui::TextDisabled("left mouse: pick the point");
  if (state.shows(Overlay::caches)) ImGui::TextDisabled("orange: moved, red: off");
}

void viewControls(const Scene& scene, const Bake& bake, bool hasBake, ViewState& state) {
  int mode = static_cast<int>(state.mode);
  constexpr int modes = static_cast<int>(std::size(kViewModeNames));
  if (ImGui::Combo("show", &mode, kViewModeNames, modes, modes)) state.mode = static_cast<ViewMode>(mode);
  ImGui::SliderFloat("exposure", &state.exposure, -8.0f, 8.0f, "%.1f stops", ImGuiSliderFlags_AlwaysClamp);
  if (hasBake) overlayControls(bake, state);
  if (scene.cameras.empty() || !ImGui::BeginCombo("camera", "fly to ...")) return;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    ImGui::PushID(static_cast<int>(i));
    if (namedSelectable(scene.cameras[i].name, false)) state.camera = FlyCamera::from(scene.cameras[i]);
    ImGui::PopID();
  }
  ImGui::EndCombo();
}

void help(const FlySpeed& speed) {
  constexpr const char* kKeys[][2] = {
      {"right mouse", "look around"},        {"W A S D Q E", "fly; Shift: fast"},
      {"mouse wheel", "fly faster, slower"}, {"left mouse", "pick, drag lights, objects"},
      {"Del  Ctrl+D", "remove, duplicate"},  {"Ctrl+Z  +Y", "undo, redo"},
      {"Ctrl+S  +O", "save, load lights"},   {"Esc", "let go"},
      {"F12  F11", "picture, film"},         {"G  Tab", "handles, this panel"}};
  for (const auto& [key, does] : kKeys) {
    ImGui::TextDisabled("%s", key);
    ImGui::SameLine(96.0f);
    ImGui::TextUnformatted(does);
  }
  ImGui::TextDisabled("flies at %s", speed.text().c_str());
}

// The window that was drawn last takes the mouse.
void cover(Session& session) {
  const ImVec2 low = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
  session.covered.push_back({{low.x, low.y}, {low.x + size.x, low.y + size.y}});
}

// Keep the panel whole within the window, as far as that has room for it: Dear ImGui pushes it over the edge of a
// window that is too small, and leaves it there. It is drawn there in the next frame.
void keepWithinWindow() {
  const ImVec2 display = ImGui::GetIO().DisplaySize, at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
  const float x = std::clamp(at.x, kMargin, std::max(display.x - size.x - kMargin, kMargin));
  const float y = std::clamp(at.y, kMargin, std::max(display.y - size.y - kMargin, kMargin));
  if (x != at.x || y != at.y) ImGui::SetWindowPos(ImVec2(x, y));
}

ImVec4 colorOf(Severity severity) {
  if (severity == Severity::error) return {1.0f, 0.55f, 0.5f, 1.0f};
  return severity == Severity::warning ? ImVec4(1.0f, 0.85f, 0.45f, 1.0f) : ImGui::GetStyleColorVec4(ImGuiCol_Text);
}

// At the lower edge, as wide as the window allows beside the panel. News goes by itself: the mouse reaches what is
// behind.
void drawMessages(Session& session) {
  const auto& shown = session.messages.shown();
  if (shown.empty()) return;
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  const bool besidePanel = session.state.panel && display.x >= kWidth + 320.0f;
  const float width = std::min(560.0f, display.x - (besidePanel ? kWidth + 24.0f : 16.0f));
  // Dear ImGui fits a window to its text a frame late, which in slow frames is seen.
  const ImGuiStyle& style = ImGui::GetStyle();
  const bool isNews =
      std::all_of(shown.begin(), shown.end(), [](const auto& message) { return message.severity == Severity::info; });
  const float indent = isNews ? 0.0f : ImGui::CalcTextSize("x").x + 2.0f * style.FramePadding.x + style.ItemSpacing.x;
  float height = 2.0f * style.WindowPadding.y - style.ItemSpacing.y;
  for (const Messages::Message& message : shown) {
    const float wrap = width - 2.0f * style.WindowPadding.x - indent;
    height += ImGui::CalcTextSize(printable(message.text).c_str(), nullptr, false, wrap).y + style.ItemSpacing.y;
  }
  ImGui::SetNextWindowPos(ImVec2(display.x - 8.0f, display.y - 8.0f), ImGuiCond_Always, ImVec2(1.0f, 1.0f));
  ImGui::SetNextWindowSize(ImVec2(width, std::min(height, display.y - 16.0f)));
  ImGui::Begin("messages", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoFocusOnAppearing |
                   (isNews ? ImGuiWindowFlags_NoInputs : ImGuiWindowFlags_None));
  std::size_t closed = shown.size();
  for (std::size_t i = 0; i < shown.size(); ++i) {
    ImGui::PushID(static_cast<int>(i));
    if (!isNews) {
      if (ImGui::SmallButton("x")) closed = i;
      ImGui::SameLine();
    }
    ImGui::PushStyleColor(ImGuiCol_Text, colorOf(shown[i].severity));
    ImGui::TextWrapped("%s", printable(shown[i].text).c_str());
    ImGui::PopStyleColor();
    ImGui::PopID();
  }
  if (!isNews) cover(session);
  ImGui::End();
  if (closed < session.messages.shown().size()) session.messages.close(closed);
}

// The comparison with the path-traced view in the upper right corner: how far it is, or what came of it.
void drawReference(Session& session) {
  if (!session.reference && !session.heat) return;
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  const float width = std::min(400.0f, display.x - kWidth - 32.0f);
  if (width < 120.0f) return;
  ImGui::SetNextWindowPos(ImVec2(display.x - 8.0f, 80.0f), ImGuiCond_Always, ImVec2(1.0f, 0.0f));
  ImGui::Begin("reference", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_AlwaysAutoResize);
  if (session.reference) {
    ImGui::TextUnformatted(session.reference->isCancelled() ? "stopping" : "tracing paths of this view");
    ImGui::ProgressBar(static_cast<float>(session.reference->progress()), ImVec2(width - 84.0f, 0.0f));
    ImGui::SameLine();
    if (ImGui::Button("cancel")) session.reference->cancel();
  } else {
    const HeatPicture& heat = *session.heat;
    ImGui::Text("differs by %.1f %% of the light", 100.0 * heat.error);
    ImGui::SameLine();
    const bool isClosed = ImGui::SmallButton("x");
    ImGui::Image(reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(session.heatTexture.name())),
                 ImVec2(width, width * static_cast<float>(heat.height) / static_cast<float>(heat.width)));
    ImGui::TextDisabled("red: too bright, blue: too dark");
    if (isClosed) session.heat.reset();
  }
  cover(session);
  ImGui::End();
}

// While a film is made, how long it is, in the upper right corner. It is not in the film.
void drawFilming(const Capture& capture) {
  char text[48];
  std::snprintf(text, sizeof text, "filming, %u frames", capture.frames());
  const ImVec2 size = ImGui::CalcTextSize(text), low(ImGui::GetIO().DisplaySize.x - size.x - 14.0f, 12.0f);
  ImDrawList& list = *ImGui::GetForegroundDrawList();
  list.AddRectFilled({low.x - 24.0f, low.y - 5.0f}, {low.x + size.x + 6.0f, low.y + size.y + 5.0f},
                     IM_COL32(0, 0, 0, 180), 4.0f);
  list.AddCircleFilled({low.x - 12.0f, low.y + 0.5f * size.y}, 5.0f, IM_COL32(235, 60, 60, 255));
  list.AddText(low, IM_COL32_WHITE, text);
}

// What is being baked or loaded, in the middle of the upper edge beside the panel, with a way out.
void drawProgress(Session& session) {
  const LevelJob::Progress progress = session.job->progress();
  const LevelFiles& files = session.job->files();
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  const float left = display.x > 2.0f * kWidth ? kWidth + 16.0f : 8.0f,
              width = std::min(420.0f, display.x - left - 8.0f);
  ImGui::SetNextWindowPos(ImVec2(0.5f * (left + display.x - width), 8.0f));
  ImGui::SetNextWindowSize(ImVec2(width, 0.0f));
  ImGui::Begin("progress", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoFocusOnAppearing);
  const bool isOfScene = files.bakeBy || files.bake.empty();
  const std::string name = std::filesystem::path(isOfScene ? files.scene : files.bake).filename().string();
  ImGui::TextWrapped("%s %s", files.bakeBy ? "Baking" : "Loading", printable(name).c_str());
  char text[96];
  if (session.job->isCancelled()) {
    std::snprintf(text, sizeof text, "stopping");
  } else if (progress.secondsLeft > 1.0) {
    std::snprintf(text, sizeof text, "%s, %.0f s left", progress.stage.c_str(), progress.secondsLeft);
  } else {
    std::snprintf(text, sizeof text, "%s", progress.stage.c_str());
  }
  ImGui::ProgressBar(static_cast<float>(progress.fraction), ImVec2(width - 84.0f, 0.0f), text);
  ImGui::SameLine();
  if (ImGui::Button("cancel")) session.job->cancel();
  cover(session);
  ImGui::End();
}

}  // namespace

void drawPanel(Session& session) {
  session.covered.clear();
  drawMessages(session);
  if (session.job) drawProgress(session);
  drawReference(session);
  if (session.capture().isFilming()) drawFilming(session.capture());
  if (!session.state.panel || !session.level) return;
  // As wide as its controls need and as tall as those that are open, within the window.
  ImGui::SetNextWindowPos(ImVec2(kMargin, kMargin), ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSizeConstraints(ImVec2(kWidth, 0), ImVec2(kWidth, ImGui::GetIO().DisplaySize.y - 2.0f * kMargin));
  ImGui::Begin("Relume", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::PushItemWidth(kItemWidth);
  if (ImGui::CollapsingHeader("View", ImGuiTreeNodeFlags_DefaultOpen))
    viewControls(session.level->scene, session.level->bake, session.level->isBaked, session.state);
  // A light that is picked shows its controls.
  if (session.editor.selected() && session.editor.selected() != session.shownLight) ImGui::SetNextItemOpen(true);
  session.shownLight = session.editor.selected();
  if (ImGui::CollapsingHeader("Lights")) drawLightControls(session);
  // So does an object.
  if (session.objects.selected() && session.objects.selected() != session.shownObject) ImGui::SetNextItemOpen(true);
  session.shownObject = session.objects.selected();
  if (ImGui::CollapsingHeader("Emitters, sky, objects")) {
    emitterControls(session.state, session.level->isBaked);
    if (!session.state.objects.empty()) objectControls(session, session.state);
  }
  if (ImGui::CollapsingHeader("Relight")) {
    if (session.viewer->live()) {
      liveControls(session);
    } else {
      relightControls(session);
    }
    if (ImGui::Button("compare with path tracing")) session.compareWithReference();
  }
  if (ImGui::CollapsingHeader("Costs")) drawCosts(session);
  if (ImGui::CollapsingHeader("Mouse and keys")) help(session.flySpeed);
  ImGui::PopItemWidth();
  cover(session);
  keepWithinWindow();
  ImGui::End();
}

}  // namespace relume
