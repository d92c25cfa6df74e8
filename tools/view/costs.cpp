// SPDX-License-Identifier: MIT
// See panel.h: times and memory.
#include "tools/view/panel.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>

namespace relume {
namespace {

constexpr std::array<ImU32, 6> kPassColors{IM_COL32(120, 120, 120, 255), IM_COL32(235, 165, 60, 255),
                                           IM_COL32(215, 90, 90, 255),   IM_COL32(90, 165, 235, 255),
                                           IM_COL32(110, 200, 120, 255), IM_COL32(190, 120, 220, 255)};
constexpr float kPlotHeight = 64.0f;

ImU32 colorOf(std::size_t pass) { return kPassColors[pass % kPassColors.size()]; }

// Passes on top of one another, the last frame at the right.
void plot(const TimeHistory& times) {
  const ImVec2 low = ImGui::GetCursorScreenPos();
  const float width = ImGui::GetContentRegionAvail().x, bar = width / static_cast<float>(TimeHistory::kFrames);
  float most = 1.0f;
  for (std::size_t age = 0; age < times.count(); ++age) {
    float sum = 0.0f;
    for (std::size_t pass = 0; pass < times.passCount(); ++pass) sum += times.at(pass, age);
    most = std::max(most, sum);
  }
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddRectFilled(low, {low.x + width, low.y + kPlotHeight}, IM_COL32(0, 0, 0, 120));
  for (std::size_t age = 0; age < times.count(); ++age) {
    const float right = low.x + width - bar * static_cast<float>(age);
    float y = low.y + kPlotHeight;
    for (std::size_t pass = 0; pass < times.passCount(); ++pass) {
      const float height = kPlotHeight * times.at(pass, age) / most;
      list.AddRectFilled({right - bar, y - height}, {right, y}, colorOf(pass));
      y -= height;
    }
  }
  ImGui::Dummy({width, kPlotHeight});
  const ImVec2 text(low.x + 4.0f, low.y + 2.0f);
  char label[32];
  std::snprintf(label, sizeof label, "%.1f ms", static_cast<double>(most));
  list.AddText({text.x + 1.0f, text.y + 1.0f}, IM_COL32(0, 0, 0, 255), label);
  list.AddText(text, IM_COL32_WHITE, label);
}

void timeTable(const TimeHistory& times) {
  float total = 0.0f, totalMean = 0.0f;
  ImGui::TextDisabled("%-14s %7s %7s", "pass [ms]", "last", "mean");
  for (std::size_t pass = 0; pass < times.passCount(); ++pass) {
    const float ms = times.at(pass, 0), mean = times.mean(pass);
    ImGui::PushStyleColor(ImGuiCol_Text, colorOf(pass));
    ImGui::Text("%-14s", times.name(pass).c_str());
    ImGui::PopStyleColor();
    ImGui::SameLine(0.0f, 0.0f);
    ImGui::Text(" %7.2f %7.2f", static_cast<double>(ms), static_cast<double>(mean));
    total += ms;
    totalMean += mean;
  }
  ImGui::Text("%-14s %7.2f %7.2f", "sum", static_cast<double>(total), static_cast<double>(totalMean));
}

// What the last frame of live light cost, on threads of its own or in OpenGL, and what was done once.
void liveTable(const LiveShading& live) {
  ImGui::TextDisabled("%-14s %7s", "live light", "ms");
  for (const PassTime& pass : live.passTimes()) ImGui::Text("%-14s %7.1f", pass.pass, pass.ms);
}

void memoryTable(const Viewer& viewer) {
  ImGui::TextDisabled("%-22s %7s", "memory", "KiB");
  std::size_t total = 0;
  for (const auto& [name, bytes] : viewer.memory()) {
    ImGui::Text("%-22.22s %7.0f", name.c_str(), static_cast<double>(bytes) / 1024.0);
    total += bytes;
  }
  ImGui::Text("%-22s %7.0f", "sum", static_cast<double>(total) / 1024.0);
}

void drawTables(const Session& session) {
  if (session.times.count() > 0) {
    plot(session.times);
    timeTable(session.times);
  }
  ImGui::Separator();
  const LiveShading* const live = session.viewer->live();
  if (live) {
    liveTable(*live);
    ImGui::Separator();
  }
  memoryTable(*session.viewer);
  ImGui::Separator();
  if (live) {
    ImGui::Text("%u voxels, %u caches", live->last().voxels, live->last().caches);
    ImGui::Text("frame %llu%s", static_cast<unsigned long long>(live->last().number),
                live->last().isSettled ? ", settled" : "");
    return;
  }
  const Bake& bake = session.level->bake;
  ImGui::Text("%u surfels, %u nodes", bake.surfels.count(), bake.hierarchy.nodeCount());
  ImGui::Text("%u caches, %u links", bake.caches.count(), bake.links.count());
  ImGui::Text("%s, %s", session.viewer->bands().c_str(),
              session.viewer->relighter().backend() == BackendKind::cpu ? "CPU" : "OpenGL");
}

}  // namespace

void drawCosts(Session& session) {
  drawTables(session);
  ImGui::Checkbox("fewer pixels while moving", &session.state.coarse);
}

}  // namespace relume
