// SPDX-License-Identifier: MIT
// Lights edited in the window of relume-view, under Xvfb, by real mouse and keys (xdotool): what is saved says what was
// done, and the screen shows it.
#include "relume/bake/context.h"
#include "relume/bake/load_scene.h"
#include "tests/view/window_fixture.h"
#include "tools/render/lights_file.h"
#include "tools/view/light_editor.h"

#include <glm/geometric.hpp>

namespace relume {
namespace {

using namespace test;

constexpr std::uint32_t kWidth = 640, kHeight = 400;

class WindowEditing : public WindowTest {
 protected:
  WindowEditing() : WindowTest(kWidth, kHeight) {}
  void SetUp() override {
    WindowTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    ASSERT_NO_FATAL_FAILURE(bake("512"));
    Context context;
    const auto scene = loadScene(kWindowLevel, context);
    ASSERT_TRUE(scene);
    for (const Camera& camera : scene->cameras) {
      if (camera.name == "cam_living") camera_ = FlyCamera::from(camera);
    }
    view_ = {camera_.clipFromWorld(float{kWidth} / float{kHeight}, 0.02f, 100.0f), camera_.position, {kWidth, kHeight}};
    // Right of the panel, two metres ahead
    const MouseRay ray = view_.ray({430, 210});
    position_ = ray.origin + 2.0f * ray.direction;
    SceneLight light;
    light.name = "key";
    light.intensity = glm::vec3(12.0f);
    light.positionWorld = position_;
    ASSERT_TRUE(writeLightsFile(at("lights.json"), std::vector{light}));
  }
  bool showLights() {
    return show({kWindowLevel, "--bake", at("level.relume"), "--camera", "cam_living", "--lights", "none",
                 "--lights-file", at("lights.json"), "--view", "direct"},
                60, 0.2);
  }

  glm::ivec2 pixelOf(const glm::vec3& world) const { return glm::ivec2(*view_.project(world) + 0.5f); }
  // The middle of a handle of a light there.
  glm::ivec2 handleOf(const glm::vec3& position, Handle handle) const {
    const Gizmo gizmo{position, {0, -1, 0}, gizmoSize(view_, position)};
    const auto outline = gizmo.outline(handle);
    return pixelOf(isSquare(handle) ? 0.5f * (outline[0] + outline[2]) : 0.3f * outline[0] + 0.7f * outline[1]);
  }
  // The lights that Control and S save, once the file is there anew.
  std::vector<SceneLight> saved() const {
    fs::remove(at("lights.json"));
    screen_.press("ctrl+s");
    EXPECT_TRUE(screen_.waitFor([this](const ScreenPicture&) { return fs::exists(at("lights.json")); }));
    const auto lights = readLightsFile(at("lights.json"));
    EXPECT_TRUE(lights) << lights.error().message;
    return lights ? *lights : std::vector<SceneLight>();
  }

  FlyCamera camera_;
  PixelView view_;
  glm::vec3 position_{0.0f};
};

// Lights of the level, which the panel lists although they are off.
constexpr int kLevelLights = 3;

bool isReddish(const Rgb& c) { return c.r > 200 && c.g < 110 && c.b < 110; }

// Share of the pixels that differ by more than 25 of 255, all channels together.
double changedShare(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  if (a.empty() || a.size() != b.size()) return std::nan("");
  std::size_t changed = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const glm::vec3 difference = glm::abs(a[i] - b[i]);
    changed += difference.r + difference.g + difference.b > 25.0f / 255.0f ? 1 : 0;
  }
  return static_cast<double>(changed) / static_cast<double>(a.size());
}

TEST_F(WindowEditing, aLightIsDraggedUndoneSavedRemovedAndLoaded) {
  if (!showLights()) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  const auto before = restingPixels();

  // A click on the light shows its gizmo, with a red axis.
  const double red = screen_.picture().share(isReddish);
  screen_.click(1, pixelOf(position_));
  ASSERT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return p.share(isReddish) > red + 3e-4; })) << "no gizmo";

  // Its vertical axis lifts it, and lifts it alone; the wall's light goes with it.
  const glm::ivec2 from = handleOf(position_, Handle::axisY);
  screen_.dragOnce(1, from, from + glm::ivec2(0, -60));
  std::vector<SceneLight> lights = saved();
  ASSERT_EQ(lights.size(), 1u);
  const glm::vec3 lifted = lights[0].positionWorld;
  EXPECT_EQ(lifted.x, position_.x);
  EXPECT_EQ(lifted.z, position_.z);
  EXPECT_NEAR(lifted.y - position_.y, 60.0f * view_.metresPerPixel(position_), 0.06f);
  EXPECT_GT(changedShare(before, restingPixels()), 0.05) << "the level must be lit from there";

  // A square moves it in its plane, behind the news of four pictures as well.
  for (int i = 0; i < 4; ++i) screenshot();
  const glm::ivec2 corner = handleOf(lifted, Handle::squareY);
  screen_.dragOnce(1, corner, corner + glm::ivec2(40, 8));
  const glm::vec3 aside = saved().at(0).positionWorld;
  EXPECT_NEAR(aside.y, lifted.y, 1e-5f);
  EXPECT_GT(glm::distance(aside, lifted), 0.1f);

  // Back and forth again: to the bit.
  screen_.press("ctrl+z");
  EXPECT_EQ(saved().at(0).positionWorld, lifted);
  screen_.press("ctrl+z");
  EXPECT_EQ(saved().at(0).positionWorld, position_);
  EXPECT_LT(changedShare(before, restingPixels()), 0.03) << "the level must be lit as before";
  screen_.press("ctrl+y");
  EXPECT_EQ(saved().at(0).positionWorld, lifted);
  screen_.press("ctrl+shift+z");
  EXPECT_EQ(saved().at(0).positionWorld, aside);

  // A damaged file is told on the screen, loads nothing, and is not written over.
  const std::string damaged = R"([{"type": "point"}])";
  std::ofstream(at("lights.json")) << damaged;
  const double pink = restingScreen().share(isErrorText);
  screen_.press("ctrl+o");
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return p.share(isErrorText) > pink + 1e-4; }))
      << "no error shown";
  screenshot();  // of a later frame: all of the error is on the screen
  const double told = screen_.picture().share(isErrorText);
  screen_.press("ctrl+s");
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return p.share(isErrorText) > told + 1e-4; }))
      << "no second error";
  screenshot();  // after which the file is not being saved
  EXPECT_EQ(readAll(at("lights.json")), damaged);
  EXPECT_EQ(saved().at(0).positionWorld, aside);

  // Duplicated, removed, and put back
  screen_.press("ctrl+d");
  lights = saved();
  ASSERT_EQ(lights.size(), 2u);
  EXPECT_EQ(lights[1].name, "key 2");
  screen_.press("Delete");
  EXPECT_EQ(saved().size(), 1u);
  screen_.press("ctrl+z");
  EXPECT_EQ(saved().size(), 2u);

  // A good file replaces the set.
  std::ofstream(at("lights.json")) << R"([{"type": "spot", "position": [1, 2, 3], "direction": [0, -2, 0]}])";
  screen_.press("ctrl+o");
  screenshot();  // after which the file is read
  lights = saved();
  ASSERT_EQ(lights.size(), 1u);
  EXPECT_EQ(lights[0].kind, LightKind::spot);
  EXPECT_EQ(lights[0].positionWorld, glm::vec3(1, 2, 3));
}

// The panel's buttons add, undo, save and load; rings turn a spot that is picked.
TEST_F(WindowEditing, lightsAreAddedByButtonsAndASpotIsTurned) {
  SceneLight spot;
  spot.name = "spot";
  spot.kind = LightKind::spot;
  spot.intensity = glm::vec3(12.0f);
  spot.positionWorld = position_;
  spot.direction = {0, -1, 0};
  ASSERT_TRUE(writeLightsFile(at("lights.json"), std::vector{spot}));
  if (!showLights()) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();

  // A ring about z, which looks at the camera least of all edge on
  const double red = restingScreen().share(isReddish);
  screen_.click(1, pixelOf(position_));
  ASSERT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return p.share(isReddish) > red + 3e-4; })) << "no gizmo";
  Gizmo gizmo{position_, {0, -1, 0}, gizmoSize(view_, position_)};
  gizmo.turns = true;
  const glm::ivec2 grabbed = pixelOf(gizmo.outline(Handle::ringZ)[7]);
  screen_.dragOnce(1, grabbed, grabbed + glm::ivec2(24, 18));
  const SceneLight turned = saved().at(0);
  EXPECT_GT(glm::distance(turned.direction, glm::vec3(0, -1, 0)), 0.05f);
  EXPECT_NEAR(turned.direction.z, 0.0f, 1e-4f);
  EXPECT_EQ(turned.positionWorld, position_);

  // Under Lights, which a light that is picked has opened: a row of buttons, the lights, and below them undo, redo,
  // save and load.
  constexpr int kRow = 23;
  screen_.press("Escape");
  const auto press = [&](const glm::ivec2& button) {
    screenshot();  // after which all controls are where they stay
    clickControl(button);
  };
  const int buttons = 160 + kRow;
  press({45, buttons});
  std::vector<SceneLight> lights = saved();
  ASSERT_EQ(lights.size(), 2u);
  EXPECT_EQ(lights[1].kind, LightKind::point);
  screen_.press("Escape");  // whose controls are away then
  const auto undoRow = [&](int shown) { return buttons + kRow * shown + 27; };
  press({35, undoRow(kLevelLights + 2)});
  EXPECT_EQ(saved().size(), 1u);
  press({77, undoRow(kLevelLights + 1)});
  EXPECT_EQ(saved().size(), 2u);
  fs::remove(at("lights.json"));
  press({121, undoRow(kLevelLights + 2)});
  ASSERT_TRUE(screen_.waitFor([this](const ScreenPicture&) { return fs::exists(at("lights.json")); }));
  ASSERT_TRUE(writeLightsFile(at("lights.json"), std::vector{spot}));
  press({166, undoRow(kLevelLights + 2)});
  screenshot();  // after which the file is read
  EXPECT_EQ(saved().size(), 1u);
}

}  // namespace
}  // namespace relume
