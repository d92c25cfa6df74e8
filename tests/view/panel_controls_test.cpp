// SPDX-License-Identifier: MIT
// The panel's own controls in a Dear ImGui that draws nowhere: names are shown whole, long texts stay whole, and small
// levels are edited in small steps.
#include "tools/view/panel_controls.h"

#include <gtest/gtest.h>
#include <imgui.h>

#include <functional>
#include <string>

namespace relume {
namespace {

class PanelControls : public testing::Test {
 protected:
  void SetUp() override {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {640, 480};
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsAlpha8(&pixels, &width, &height);
    frame([] {});
  }
  void TearDown() override { ImGui::DestroyContext(); }

  static void frame(const std::function<void()>& controls) {
    ImGui::GetIO().DeltaTime = 0.2f;  // two presses are no double click
    ImGui::NewFrame();
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({600, 400});
    ImGui::Begin("controls");
    controls();
    ImGui::End();
    ImGui::EndFrame();
  }
  // What a control draws.
  static int vertices(const std::function<void()>& control) {
    int drawn = 0;
    frame([&] {
      const int before = ImGui::GetWindowDrawList()->VtxBuffer.Size;
      control();
      drawn = ImGui::GetWindowDrawList()->VtxBuffer.Size - before;
    });
    return drawn;
  }
  // Press in the last item of the controls, right of its left edge, and move so far before the button is let go.
  static void press(const std::function<void()>& controls, float moved = 0.0f) {
    ImVec2 at;
    frame([&] {
      controls();
      at = ImGui::GetItemRectMin();
    });
    ImGuiIO& io = ImGui::GetIO();
    io.MousePos = {at.x + 2.0f, at.y + 5.0f};
    frame(controls);
    io.MouseDown[0] = true;
    frame(controls);
    for (int step = 0; step < 4; ++step) {
      io.MousePos.x += 0.25f * moved;
      frame(controls);
    }
    io.MouseDown[0] = false;
    frame(controls);
  }
};

TEST_F(PanelControls, namesAreShownWhateverTheyHold) {
  bool isOn = false;
  glm::vec3 place(0.0f);
  const auto checkbox = [&](const char* name) { return vertices([&, name] { namedCheckbox(name, isOn); }); };
  const auto selectable = [&](const char* name) { return vertices([name] { namedSelectable(name, false); }); };
  const auto drag = [&](const char* name) { return vertices([&, name] { namedPlace(name, place, 10.0f); }); };
  for (const char* name : {"lamp##left", "lamp###lef", "##lampleft"}) {
    EXPECT_EQ(checkbox(name), checkbox("lamp__left")) << name;
    EXPECT_EQ(selectable(name), selectable("lamp__left")) << name;
    EXPECT_EQ(drag(name), drag("lamp__left")) << name;
  }
}

TEST_F(PanelControls, aCheckboxIsSwitchedByItsName) {
  bool isOn = false;
  press([&] { namedCheckbox("lamp##left", isOn); });
  EXPECT_TRUE(isOn);
}

TEST_F(PanelControls, aLineOfAListIsPressedAnywhere) {
  int pressed = 0;
  press([&] { pressed += namedSelectable("lamp##left", false) ? 1 : 0; });
  EXPECT_EQ(pressed, 1);
}

TEST_F(PanelControls, aLongTextIsEditedWhole) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "\u00e4";
  const std::string before = text;
  const auto field = [&] { inputText("name", text); };
  press(field);
  EXPECT_EQ(text, before);
  ImGui::GetIO().AddInputCharacter('x');
  frame(field);
  frame(field);
  EXPECT_EQ(text, "x" + before);
}

TEST_F(PanelControls, dragsAreSlowInSmallLevels) {
  const auto dragged = [](float levelSize) {
    glm::vec3 place(0.0f);
    press([&] { dragPlace("position", place, levelSize); }, 100.0f);
    return place.x;
  };
  EXPECT_NEAR(dragged(20.0f), 2.0f, 0.2f);
  EXPECT_NEAR(dragged(0.05f), 0.01f, 1e-3f);
}

}  // namespace
}  // namespace relume
