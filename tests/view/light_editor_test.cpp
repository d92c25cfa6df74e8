// SPDX-License-Identifier: MIT
// Lights picked, dragged, added, removed, undone and saved, by pixels alone.
#include "tools/view/light_editor.h"

#include "tools/view/light_set.h"
#include "tools/view/view_edits.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>

namespace relume {
namespace {

namespace fs = std::filesystem;
using Lights = LightEditor::Lights;

constexpr RoomAhead kRoom{20.0f, {}};

PixelView viewOf(const FlyCamera& camera) {
  return {camera.clipFromWorld(1.6f, 0.02f, 100.0f), camera.position, {640, 400}};
}

ViewedLight lightAt(LightKind kind, const glm::vec3& position) {
  ViewedLight light;
  light.name = "light";
  light.light.kind = kind;
  light.light.positionWorld = light.home = position;
  light.light.direction = {0, -1, 0};
  return light;
}

class LightEditing : public testing::Test {
 protected:
  LightEditing() : view_(viewOf(camera_)) {
    lights_ = {lightAt(LightKind::point, {-1, 0.3f, -4}), lightAt(LightKind::spot, {1, 0.3f, -4}),
               lightAt(LightKind::directional, {0, 50, 0})};
    editor_.giveIds(lights_);
    edits_.begin(state_);
  }
  glm::vec2 iconOf(std::size_t i) const { return *view_.project(LightEditor::anchorOf(lights_[i], view_)); }
  void click(const glm::vec2& pixel) {
    editor_.press(lights_, view_, pixel);
    release();
  }
  // From the middle of a handle of the selected light, so many pixels.
  void drag(Handle handle, const glm::vec2& by) {
    const auto outline = editor_.gizmo(lights_, view_)->outline(handle);
    const glm::vec2 from =
        isRing(handle) ? *view_.project(outline[7]) : 0.5f * (*view_.project(outline[0]) + *view_.project(outline[1]));
    EXPECT_TRUE(editor_.press(lights_, view_, from));
    for (int i = 1; i <= 4; ++i) editor_.move(lights_, view_, from + 0.25f * static_cast<float>(i) * by);
  }

  // As the session does.
  void release() {
    editor_.release();
    edits_.commit(state_);
  }
  void undo() {
    editor_.cancelDrag(lights_);
    edits_.undo(state_);
    editor_.keepSelectionWithin(lights_);
  }

  FlyCamera camera_;
  PixelView view_;
  ViewState state_;
  Lights& lights_ = state_.lights;
  LightEditor editor_;
  ViewEdits edits_;
};

TEST_F(LightEditing, iconsArePickedAndTheBackgroundDeselects) {
  for (std::size_t i = 0; i < lights_.size(); ++i) {
    click(iconOf(i));
    EXPECT_EQ(editor_.indexIn(lights_), i);
    click({3, 397});
    EXPECT_FALSE(editor_.selected());
  }
  EXPECT_FALSE(edits_.canUndo()) << "picking is no edit";
}

// Suns that are not in view are drawn at one place in it.
TEST_F(LightEditing, aSecondClickSelectsTheNextLightAtAPlace) {
  for (const float height : {60.0f, 70.0f}) lights_.push_back(lightAt(LightKind::directional, {0, height, 0}));
  editor_.giveIds(lights_);
  ASSERT_EQ(iconOf(2), iconOf(4));
  for (const std::size_t sun : {2, 3, 4, 2}) {
    click(iconOf(2));
    EXPECT_EQ(editor_.indexIn(lights_), sun);
  }
  click(iconOf(0));
  click(iconOf(0) + glm::vec2(-3, 3));
  EXPECT_EQ(editor_.indexIn(lights_), 0u) << "the only one there stays selected";
  click(iconOf(2));
  EXPECT_EQ(editor_.indexIn(lights_), 2u);
}

TEST_F(LightEditing, aDragIsOneEditThatCanBeUndone) {
  const Lights before = lights_;
  click(iconOf(0));
  drag(Handle::axisX, {50, 0});
  EXPECT_FALSE(edits_.canUndo());
  release();
  EXPECT_GT(lights_[0].light.positionWorld.x, before[0].light.positionWorld.x + 0.2f);
  EXPECT_EQ(lights_[0].light.positionWorld.y, before[0].light.positionWorld.y);
  EXPECT_EQ(lights_[0].home, lights_[0].light.positionWorld);
  const Lights after = lights_;
  undo();
  EXPECT_EQ(lights_, before);
  EXPECT_FALSE(edits_.canUndo());
  edits_.redo(state_);
  EXPECT_EQ(lights_, after);
  EXPECT_FALSE(edits_.canRedo());
  // A drag that is called off, by a key or by an undo in the middle of it, changes nothing.
  drag(Handle::axisY, {0, -40});
  EXPECT_NE(lights_, after);
  editor_.cancelDrag(lights_);
  EXPECT_EQ(lights_, after);
  drag(Handle::axisY, {0, -40});
  undo();
  EXPECT_EQ(lights_, before);
}

// The level's file has changed under the window: names, places and all.
TEST(LightSet, followsTheFileWhereNothingWasEdited) {
  const auto named = [](const char* name, float x) {
    ViewedLight light = lightAt(LightKind::point, {x, 0, 0});
    light.name = name;
    return light;
  };
  const Lights before{named("still", 1), named("edited", 2), named("gone", 3),    named("edited and gone", 4),
                      named("twin", 5),  named("twin", 6),   named("removed", 7), named("orbits", 8)};
  const Lights now{named("still", 10), named("edited", 20), named("twin", 50), named("twin", 60),
                   named("new", 70),   named("orbits", 80), named("twin", 90), named("removed", 100)};
  Lights shown{before.begin(), before.begin() + 6};
  shown[0].on = false;
  shown[1].light.intensity = glm::vec3(9.0f);
  shown[3].light.range = 5.0f;
  shown.push_back(before[7]);
  shown.back().orbits = true;
  shown.back().light.positionWorld.z = 0.8f;
  shown.push_back(named("added", 11));

  Lights expected{now[0], shown[1], shown[3], now[2], now[3], now[5], shown.back(), now[4], now[6]};
  expected[0].on = false;
  expected[5].orbits = true;
  for (std::size_t i = 0; i < shown.size(); ++i) shown[i].id = i + 1;
  const Lights followed = followFile(shown, before, now);
  EXPECT_EQ(followed, expected);
  const std::size_t ids[] = {1, 2, 4, 5, 6, 7, 8, 0, 0};  // 3 is gone
  for (std::size_t i = 0; i < followed.size(); ++i) EXPECT_EQ(followed[i].id, ids[i]) << i;
  EXPECT_EQ(followFile(shown, before, before), shown) << "the same file";
}

TEST_F(LightEditing, ringsTurnSunsAndSpotsAlone) {
  click(iconOf(0));
  EXPECT_FALSE(editor_.gizmo(lights_, view_)->turns);
  for (const std::size_t i : {std::size_t{1}, std::size_t{2}}) {
    click({3, 397});
    click(iconOf(i));
    ASSERT_TRUE(editor_.gizmo(lights_, view_)->turns);
    EXPECT_EQ(editor_.gizmo(lights_, view_)->moves, i == 1);
    const glm::vec3 position = lights_[i].light.positionWorld;
    drag(Handle::ringZ, {25, 18});
    release();
    EXPECT_GT(glm::distance(lights_[i].light.direction, glm::vec3(0, -1, 0)), 0.1f);
    EXPECT_NEAR(glm::length(lights_[i].light.direction), 1.0f, 1e-5f);
    EXPECT_NEAR(lights_[i].light.direction.z, 0.0f, 1e-5f);
    EXPECT_EQ(lights_[i].light.positionWorld, position);
  }
}

TEST_F(LightEditing, addedRemovedAndLoadedSetsCanBeUndone) {
  const Lights first = lights_;
  editor_.add(lights_, newLight(LightKind::spot, camera_, lights_, kRoom));
  edits_.commit(state_);
  EXPECT_EQ(editor_.indexIn(lights_), 3u);
  EXPECT_TRUE(view_.shows(lights_[3].light.positionWorld));
  editor_.removeSelected(lights_);
  edits_.commit(state_);
  EXPECT_EQ(lights_, first);
  EXPECT_FALSE(editor_.selected());
  editor_.replace(lights_, {lightAt(LightKind::point, {5, 5, 5})});
  edits_.commit(state_);
  editor_.select(lights_[0].id);
  // What controls change is committed once they are let go.
  lights_[0].light.intensity = {1, 2, 3};
  undo();
  EXPECT_EQ(lights_[0].light.intensity, glm::vec3(1.0f));
  undo();
  EXPECT_EQ(lights_, first);
  undo();
  EXPECT_EQ(lights_.size(), 4u);
  editor_.select(lights_[3].id);
  undo();
  EXPECT_EQ(lights_, first);
  EXPECT_FALSE(editor_.selected()) << "of a light that is gone";
  for (int i = 0; i < 4; ++i) edits_.redo(state_);
  EXPECT_EQ(lights_[0].light.intensity, glm::vec3(1, 2, 3));
}

TEST_F(LightEditing, theSelectedLightIsTheSameWhereverItIsInTheList) {
  const Lights first = lights_;
  click(iconOf(0));
  editor_.removeSelected(lights_);
  edits_.commit(state_);
  click(iconOf(0));
  undo();
  ASSERT_EQ(lights_, first);
  EXPECT_EQ(editor_.indexIn(lights_), 1u) << "the light that was clicked on";
  // Lights that are the same otherwise, as a copy is, are told apart.
  editor_.add(lights_, lights_[1]);
  EXPECT_EQ(editor_.indexIn(lights_), 3u);
  editor_.removeSelected(lights_);
  EXPECT_EQ(lights_, first);
  // Another file has one less before it: it is dragged on, and put back.
  const Lights now{first[1], first[2]};
  click(iconOf(1));
  drag(Handle::axisX, {30, 0});
  lights_.erase(lights_.begin());
  const glm::vec3 there = lights_[0].light.positionWorld;
  editor_.keepSelectionWithin(lights_);
  editor_.move(lights_, view_, {400, 200});
  EXPECT_NE(lights_[0].light.positionWorld, there);
  EXPECT_EQ(lights_[1], now[1]);
  editor_.cancelDrag(lights_);
  EXPECT_EQ(lights_, now);
  drag(Handle::axisX, {30, 0});
  lights_.erase(lights_.begin());
  editor_.keepSelectionWithin(lights_);
  EXPECT_FALSE(editor_.isDragging()) << "of a light that is gone";
}

TEST_F(LightEditing, anOrbitIsNoEditAndADragEndsIt) {
  lights_[0].orbits = true;
  edits_.commit(state_);
  lights_[0].light.positionWorld += glm::vec3(0.1f);
  edits_.commit(state_);
  undo();
  EXPECT_FALSE(edits_.canUndo()) << "only the switch was an edit";
  edits_.redo(state_);
  click(iconOf(0));
  drag(Handle::axisX, {30, 0});
  EXPECT_FALSE(lights_[0].orbits);
}

TEST(LightSet, aNewLightFitsTheLevelAndStaysBeforeItsSurfaces) {
  const FlyCamera camera;
  const auto ahead = [&](float levelSize, std::optional<float> surface) {
    return glm::distance(newLight(LightKind::point, camera, {}, {levelSize, surface}).light.positionWorld,
                         camera.position);
  };
  EXPECT_FLOAT_EQ(ahead(20.0f, {}), 2.0f);
  EXPECT_FLOAT_EQ(ahead(3000.0f, 50.0f), 2.0f);
  EXPECT_FLOAT_EQ(ahead(20.0f, 0.5f), 0.4f);
  EXPECT_FLOAT_EQ(ahead(0.05f, {}), 0.01f);
  // What it lights there is as bright: power goes with the square of the way.
  const auto power = [&](float levelSize, std::optional<float> surface) {
    return newLight(LightKind::point, camera, {}, {levelSize, surface}).light.intensity.x;
  };
  EXPECT_FLOAT_EQ(power(20.0f, 0.5f), power(20.0f, {})) << "a room is lit, wherever the light is in it";
  EXPECT_FLOAT_EQ(power(0.05f, {}), power(20.0f, {}) * 0.005f * 0.005f);
}

TEST(LightSet, anOrbitFitsTheLevel) {
  const auto reach = [](float levelSize) {
    ViewState state;
    state.lights = {lightAt(LightKind::point, {1, 2, 3})};
    state.lights[0].orbits = true;
    animate(state, 3.14159265, levelSize);  // half round
    return glm::distance(state.lights[0].light.positionWorld, state.lights[0].home);
  };
  EXPECT_NEAR(reach(20.0f), 1.6f, 1e-5f);
  EXPECT_NEAR(reach(0.05f), 0.01f, 1e-5f);
}

// Unit vectors of floats are not of length 1 to the last digit.
TEST(LightSet, directionsComeBackToTheBit) {
  const fs::path file = fs::path(testing::TempDir()) / "relume_directions.json";
  Lights lights;
  for (int i = 0; i < 32; ++i) {
    ViewedLight light = lightAt(LightKind::directional, {0, 5, 0});
    const auto angle = static_cast<float>(i);
    light.light.direction = glm::normalize(glm::vec3(std::cos(angle), -0.7f, std::sin(1.3f * angle)));
    lights.push_back(light);
  }
  ASSERT_TRUE(saveLightSet(file, lights));
  const auto loaded = loadLightSet(file);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(*loaded, lights);
  fs::remove(file);
}

TEST_F(LightEditing, whatIsOnIsSavedAndLoaded) {
  const fs::path folder = fs::path(testing::TempDir()) / "relume_light_set";
  fs::remove_all(folder);
  fs::create_directories(folder);
  lights_[1].on = false;
  lights_[0].light.direction = {0, 0, -1};  // which the file does not have of a point
  ASSERT_TRUE(saveLightSet(folder / "set.json", lights_));
  auto loaded = loadLightSet(folder / "set.json");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(*loaded, (Lights{lights_[0], lights_[2]}));
  EXPECT_EQ(loadLightSet("").error().code, ErrorCode::usage);
  EXPECT_EQ(saveLightSet("", lights_).error().code, ErrorCode::usage);
  EXPECT_EQ(loadLightSet(folder / "none.json").error().code, ErrorCode::io);
  std::ofstream(folder / "many.json") << [] {
    std::string text = "[";
    for (int i = 0; i < 33; ++i) text += std::string(i ? "," : "") + R"({"type":"point","position":[0,0,0]})";
    return text + "]";
  }();
  EXPECT_EQ(loadLightSet(folder / "many.json").error().code, ErrorCode::unsupported);
  fs::remove_all(folder);

  Lights full(kMaxLightsOn, lights_[0]);
  EXPECT_FALSE(newLight(LightKind::point, camera_, full, kRoom).on);
  EXPECT_EQ(newLight(LightKind::point, camera_, {}, kRoom).name, "point");
  EXPECT_EQ(freeName("light", full), "light 2");
}

}  // namespace
}  // namespace relume
