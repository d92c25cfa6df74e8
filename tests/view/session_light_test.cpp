// SPDX-License-Identifier: MIT
// What the viewer shows of a level, without a window: light by parts, bands and backends, emitters, overlays, pictures,
// and the view held against a path-traced one.
#include "tests/view/session_fixture.h"

#include <numeric>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

TEST_F(ViewerSession, lightIsShownByParts) {
  options_.view = "full";
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  const auto brightness = [&](bool direct, bool indirect, int bounces) {
    session_->state.direct = direct;
    session_->state.indirect = indirect;
    session_->state.bounces = bounces;
    for (int i = 0; i < 20; ++i) frame();
    return brightness_;
  };
  const double all = brightness(true, true, 0), direct = brightness(true, false, 0),
               indirect = brightness(false, true, 0);
  EXPECT_LT(brightness(false, false, 0), 0.02 * all);
  EXPECT_GT(direct, 0.1 * all);
  EXPECT_GT(indirect, 0.1 * all);
  EXPECT_LT(std::max(direct, indirect), 0.95 * all);
  const double one = brightness(true, true, 1), two = brightness(true, true, 2),
               most = brightness(true, true, kMaxBounces);
  EXPECT_LT(direct, 0.98 * one);
  EXPECT_LT(one, 0.98 * two);
  EXPECT_LT(two, most);
  EXPECT_NEAR(most, all, 0.02 * all);
}

// What did not run has no time.
TEST_F(ViewerSession, costsAreThoseOfPassesThatRan) {
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  const auto relights = [&] {
    const auto passes = session_->viewer->relighter().passTimes();
    return std::ranges::any_of(session_->viewer->times(), [&](const auto& time) {
      return std::ranges::any_of(passes, [&](const PassTime& pass) { return time.first == pass.pass; });
    });
  };
  EXPECT_TRUE(relights());
  session_->state.relight = false;
  frame();
  EXPECT_FALSE(relights());
  EXPECT_GT(session_->times.passCount(), 0u);
}

TEST_F(ViewerSession, bandsAndBackendChangeWithoutADarkFrame) {
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  for (int i = 0; i < 30; ++i) frame();
  const double before = brightness_;

  session_->state.relightBy.bands = {2, 1};
  EXPECT_NEAR(frame(), before, 0.2 * before);
  EXPECT_EQ(session_->viewer->bands(), "Y2Co1Cg1");
  // What cannot be had is told, and taken back.
  session_->state.relightBy.bands = {9, 1};
  frame();
  EXPECT_EQ(session_->viewer->bands(), "Y2Co1Cg1");
  EXPECT_EQ(session_->state.relightBy.bands.luma, 2);
  EXPECT_TRUE(says("bands"));

  session_->state.relightBy.bands = {4, 2};
  for (int i = 0; i < 20; ++i) frame();
  const double gl = brightness_;
  session_->state.relightBy.backend = BackendKind::cpu;
  EXPECT_NEAR(frame(), gl, 0.2 * gl) << "the first frame by the CPU";
  EXPECT_EQ(session_->viewer->relighter().backend(), BackendKind::cpu);
  for (int i = 0; i < 20; ++i) frame();
  EXPECT_NEAR(brightness_, gl, 0.03 * gl) << "rays and shadow maps differ at edges alone";
  // Every frame is lit anew there, too.
  for (ViewedLight& light : session_->state.lights) light.on = false;
  for (int i = 0; i < 30; ++i) frame();
  EXPECT_LT(brightness_, 0.05 * gl);
  session_->state.relightBy.backend = BackendKind::gl;
  EXPECT_LT(frame(), 0.05 * gl);
}

// Light beyond what halves hold is dimmed as OpenGL dims it; clipped to infinity it would be drawn black.
TEST_F(ViewerSession, lightBeyondHalvesIsAsBrightByTheCpu) {
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  const auto bySide = [&](BackendKind backend) {
    session_->state.relightBy.backend = backend;
    for (int i = 0; i < 12; ++i) frame();
    return *session_->viewer->irradiance(session_->state, kWidth, kHeight);
  };
  const auto sum = [](const std::vector<glm::vec3>& pixels) {
    return std::accumulate(pixels.begin(), pixels.end(), 0.0,
                           [](double s, const glm::vec3& p) { return s + static_cast<double>(p.g); });
  };
  session_->state.direct = false;
  session_->state.bounces = 1;  // further ones the CPU reflects as they were before they were dimmed
  for (ViewedLight& light : session_->state.lights) light.light.intensity = glm::vec3(1e7f);
  const std::vector<glm::vec3> gl = bySide(BackendKind::gl), cpu = bySide(BackendKind::cpu);
  EXPECT_NEAR(sum(cpu), sum(gl), 0.03 * sum(gl));
  std::size_t lit = 0, black = 0;
  for (std::size_t i = 0; i < gl.size(); ++i) {
    lit += gl[i].g > 0.0f ? 1 : 0;
    black += gl[i].g > 0.0f && !(cpu[i].g > 0.0f) ? 1 : 0;
  }
  EXPECT_GT(lit, gl.size() / 2);
  EXPECT_EQ(black, 0u);
}

class ViewerCones : public ViewerSession, public testing::WithParamInterface<BackendKind> {};

// With a bake its surfels light the voxels that cones go through, whichever backend relights.
TEST_P(ViewerCones, findWhatABakesSurfacesMirror) {
  writeBakeFile(small(2048));
  options_.view = "glossy";
  options_.roughness = 0.3f;
  options_.live.cells = 12;
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  ViewState& state = session_->state;
  state.relightBy.backend = GetParam();
  for (int i = 0; i < 20; ++i) frame();
  const double caches = brightness_;
  state.cones = true;
  ASSERT_TRUE(frames([&] { return !session_->viewer->awaitsVoxels(state); }));
  const double cones = frame();
  EXPECT_GT(cones, 0.3 * caches);
  EXPECT_LT(cones, 3.0 * caches);
  EXPECT_NE(cones, caches);
  EXPECT_NEAR(frame(), cones, 0.02 * cones) << "at rest";
  // What is rough is mirrored by the caches alone.
  state.roughness = 0.7f;
  const double rough = frame();
  state.cones = false;
  EXPECT_NEAR(frame(), rough, 1e-4 * rough) << "light settles still";
  state.cones = true;
  state.roughness = 0.3f;

  if (GetParam() == BackendKind::cpu) return;

  // Other bands light the same voxels; a lamp that goes out takes their light along.
  state.relightBy.bands = {2, 1};
  for (int i = 0; i < 6; ++i) frame();
  EXPECT_NEAR(brightness_, cones, 0.2 * cones);
  for (ViewedLight& light : state.lights) light.on = false;
  for (int i = 0; i < 10; ++i) frame();
  EXPECT_LT(brightness_, 0.05 * cones);

  state.mode = ViewMode::occlusion;
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_GT(brightness_, 0.05);
  EXPECT_FALSE(session_->viewer->memory().empty());
}

INSTANTIATE_TEST_SUITE_P(Backends, ViewerCones, testing::Values(BackendKind::cpu, BackendKind::gl),
                         [](const auto& of) { return std::string(of.param == BackendKind::cpu ? "Cpu" : "OpenGl"); });

class ViewerMoving : public ViewerSession, public testing::WithParamInterface<BackendKind> {};

TEST_P(ViewerMoving, whatMovesShadowsAndReflectsLight) {
  writeBakeFile(small(2048));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  ViewState& state = session_->state;
  state.relightBy.backend = GetParam();
  const auto light = [&] {
    for (int i = 0; i < 20; ++i) frame();
    return *session_->viewer->irradiance(state, kWidth, kHeight);
  };
  const auto sum = [](const std::vector<glm::vec3>& pixels) {
    return std::accumulate(pixels.begin(), pixels.end(), 0.0,
                           [](double s, const glm::vec3& p) { return s + static_cast<double>(luminance(p)); });
  };
  state.direct = false;
  state.movingParts = false;
  const double home = sum(light());
  ASSERT_TRUE(session_->viewer->hasMovingParts());

  // The toy around the lamp lets none of its light out.
  ASSERT_FALSE(state.objects.empty());
  const auto lamp = std::find_if(state.lights.begin(), state.lights.end(), [](const ViewedLight& l) { return l.on; });
  ASSERT_NE(lamp, state.lights.end());
  state.objects[0].position = lamp->light.positionWorld;
  EXPECT_LT(sum(light()), 0.02 * home);
  state.objects[0].position = state.objects[0].home;
  const std::vector<glm::vec3> without = light();
  EXPECT_NEAR(sum(without), home, 0.02 * home);

  // On the floor it changes what is near it, which is much where caches are so few, and little else.
  state.movingParts = true;
  const std::vector<glm::vec3> with = light();
  double most = 0.0;
  std::size_t changed = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    const double scale = std::max(static_cast<double>(luminance(without[i])), 1e-3 * home / (kWidth * kHeight));
    const double change = std::abs(static_cast<double>(luminance(with[i]) - luminance(without[i]))) / scale;
    most = std::max(most, change);
    changed += change > 0.02 ? 1 : 0;
  }
  EXPECT_GT(most, 0.05);
  EXPECT_LT(changed, with.size() / 4);
  EXPECT_NEAR(sum(with), sum(without), 0.1 * sum(without));

  // Where it moves its shadow moves.
  state.objects[0].position.x -= 0.5f;
  const std::vector<glm::vec3> moved = light();
  EXPECT_NE(moved, with);
  state.objects[0].position.x += 0.5f;
  EXPECT_NEAR(sum(light()), sum(with), 1e-3 * sum(with));
}

INSTANTIATE_TEST_SUITE_P(Backends, ViewerMoving, testing::Values(BackendKind::cpu, BackendKind::gl),
                         [](const auto& of) { return std::string(of.param == BackendKind::cpu ? "Cpu" : "OpenGl"); });

TEST_F(ViewerSession, emittersAreDriven) {
  options_.scene = RELUME_SOURCE_DIR "/samples/area_lights/stars.glb";
  options_.camera.clear();
  options_.lights = {"none"};
  Context context;
  options_.driven = *readEmissions({"ring=2,0,0"}, context);
  const auto level = loadLevel({options_.scene, "", {}, false, options_.driven, presetOptions(Preset::draft)}, context);
  ASSERT_TRUE(level) << level.error().message;
  auto state = initialState((*level)->scene, options_);
  ASSERT_TRUE(state) << state.error().message;
  session_.emplace(std::move(*state), options_, EglContext::getProcAddress);
  ASSERT_TRUE(session_->show(*level));
  ASSERT_GE(session_->state.emitters.size(), 2u);
  const auto ring = std::find_if(session_->state.emitters.begin(), session_->state.emitters.end(),
                                 [](const ViewedEmitter& e) { return e.name == "ring"; });
  ASSERT_NE(ring, session_->state.emitters.end());
  EXPECT_TRUE(ring->isDriven);
  for (int i = 0; i < 4; ++i) frame();
  EXPECT_LT(brightness_, 1e-4) << "green of a red light";
  ring->radiance = {0.0f, 2.0f, 0.0f};
  for (int i = 0; i < 4; ++i) frame();
  const double driven = brightness_;
  EXPECT_GT(driven, 0.01);
  ring->isDriven = false;
  for (int i = 0; i < 40; ++i) frame();
  EXPECT_LT(brightness_, 1e-4) << "with --lights none, what is not driven is dark";
}

TEST_F(ViewerSession, overlaysAndViewsShowTheBakeAndAPointIsPicked) {
  options_.view = "direct";
  options_.lights = {"none"};
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  EXPECT_LT(frame(), 1e-4) << "no light, no overlay";
  for (const Overlay overlay : {Overlay::clusters, Overlay::links}) {
    session_->state.overlays = {};
    session_->state.overlays[static_cast<std::size_t>(overlay)] = true;
    EXPECT_GT(frame(), 0.01) << static_cast<int>(overlay);
  }
  // The links are those of the point that is clicked on.
  const double ofCentre = brightness_;
  const glm::vec2 pixel(20.0f, 44.0f);
  session_->press(pixel);
  frame();
  ASSERT_TRUE(session_->state.picked);
  EXPECT_LT(glm::distance(*session_->pixels().project(*session_->state.picked), pixel), 1.0f);
  EXPECT_NE(frame(), ofCentre);
  // Caches and surfels show light, and are dark without.
  for (const Overlay overlay : {Overlay::surfels, Overlay::caches}) {
    session_->state.overlays = {};
    session_->state.overlays[static_cast<std::size_t>(overlay)] = true;
    const double dark = frame();
    session_->state.sky.radiance = glm::vec3(4.0f);
    session_->state.mode = ViewMode::albedo;  // of which the sky changes nothing
    session_->state.overlays = {};
    const double without = frame();
    session_->state.overlays[static_cast<std::size_t>(overlay)] = true;
    EXPECT_GT(std::abs(frame() - without), 1e-4) << static_cast<int>(overlay);
    session_->state.sky.radiance = glm::vec3(0.0f);
    session_->state.mode = ViewMode::direct;
    for (int i = 0; i < 30; ++i) frame();
    EXPECT_LT(dark, 0.05);
  }
  session_->state.overlays = {};
  session_->state.mode = ViewMode::texels;
  const double texels = frame();
  EXPECT_GT(texels, 0.1);
  session_->state.mode = ViewMode::grid;
  EXPECT_LT(frame(), 0.1 * texels) << "light over links, of which there is none";
}

TEST_F(ViewerSession, picturesAndFilmsAreNumberedAndReplaceNothing) {
  options_.output = at("pictures");
  options_.view = "albedo";
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  fs::create_directories(at("pictures"));
  std::ofstream(folder_ / "pictures" / "relume_0001.png") << "mine";
  session_->run(Command::screenshot);
  frame();
  frame();
  EXPECT_TRUE(fs::exists(folder_ / "pictures" / "relume_0002.png"));
  EXPECT_FALSE(fs::exists(folder_ / "pictures" / "relume_0003.png"));
  EXPECT_EQ(fs::file_size(folder_ / "pictures" / "relume_0001.png"), 4u);
  const auto picture = readPicture(at("pictures") + "/relume_0002.png", "");
  ASSERT_TRUE(picture) << picture.error().message;
  ASSERT_EQ(picture->picture.width, kWidth);
  ASSERT_EQ(picture->picture.height, kHeight);
  // As drawn, in sRGB, with the floor below.
  double sum = 0.0;
  for (const glm::vec3& p : picture->picture.pixels) sum += static_cast<double>(linearToSrgb(p.g));
  EXPECT_NEAR(sum / (kWidth * kHeight), brightness_, 0.01);

  const double before = session_->animationTime();
  session_->run(Command::film);
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_NEAR(session_->animationTime() - before, 3 * Capture::kFrameSeconds, 1e-9) << "a film has its own clock";
  EXPECT_EQ(session_->frameSeconds(0.4), Capture::kFrameSeconds) << "and its camera flies by that";
  session_->run(Command::film);
  EXPECT_EQ(session_->frameSeconds(0.4), 0.4);
  frame();
  const fs::path film = folder_ / "pictures" / "film_0001";
  EXPECT_TRUE(fs::exists(film / "frame_0000.png") && fs::exists(film / "frame_0002.png"));
  EXPECT_FALSE(fs::exists(film / "frame_0003.png"));
  EXPECT_TRUE(says("3 frames"));
  session_->run(Command::film);
  frame();
  EXPECT_TRUE(fs::exists(folder_ / "pictures" / "film_0002" / "frame_0000.png"));
  // A folder that goes away ends the film, and says so; so does a place where none can be made.
  fs::remove_all(at("pictures"));
  frame();
  EXPECT_FALSE(session_->capture().isFilming());
  std::ofstream(at("pictures")) << "a file";
  session_->run(Command::screenshot);
  frame();
  EXPECT_TRUE(says("cannot make folder"));
  // What frames cost is kept.
  EXPECT_GT(session_->times.count(), 5u);
  EXPECT_GE(session_->times.passCount(), 5u);
}

TEST_F(ViewerSession, aViewIsHeldAgainstThePathTracedOne) {
  options_.view = "full";
  start("");
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  const auto errorNow = [&] {
    for (int i = 0; i < 30; ++i) frame();
    session_->compareWithReference();
    EXPECT_TRUE(frames([&] { return session_->heat.has_value(); }));
    return session_->heat ? session_->heat->error : 0.0;
  };
  const double whole = errorNow();
  ASSERT_EQ(session_->heat->rgb.size(), std::size_t{3} * session_->heat->width * session_->heat->height);
  EXPECT_LT(whole, 0.35) << "a draft, and the paths' own noise";
  // All light is held against it, whatever is shown of it.
  session_->state.direct = session_->state.indirect = false;
  EXPECT_NEAR(errorNow(), whole, 0.1);
  EXPECT_FALSE(session_->state.direct || session_->state.indirect);
  // What is missing is told: light over links that is frozen while a lamp is turned up.
  session_->state.relight = false;
  for (ViewedLight& light : session_->state.lights) light.light.intensity *= 20.0f;
  EXPECT_GT(errorNow(), whole + 0.1);
  session_->state.relight = true;
  // Paths know no share of a bounce.
  session_->state.bounceScale = 0.5f;
  session_->compareWithReference();
  EXPECT_FALSE(session_->reference.has_value());
  EXPECT_TRUE(says("not compared"));
  session_->state.bounceScale = 1.0f;
  session_->compareWithReference();
  session_->reference->cancel();
  EXPECT_TRUE(frames([&] { return !session_->reference; }));
  EXPECT_FALSE(session_->heat);
}

TEST_F(ViewerSession, recordsFillTheViewAndAreRelit) {
  writeBakeFile(small(4096));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  for (int i = 0; i < 30; ++i) frame();
  const double byCaches = brightness_;
  EXPECT_EQ(session_->viewer->records(), nullptr) << "none is made before it is asked for";

  session_->state.records = true;
  EXPECT_NEAR(frame(), byCaches, 0.2 * byCaches) << "caches go on where there is no record yet";
  const auto count = [this] { return session_->viewer->records()->records(); };
  EXPECT_GT(count(), 0u);
  EXPECT_LE(count(), 20 * ViewRecords::kPerFrame);
  ASSERT_TRUE(frames([&] { return session_->viewer->records()->isComplete(); }));
  for (int i = 0; i < 10; ++i) frame();
  ASSERT_TRUE(frames([&] { return session_->viewer->records()->isComplete(); })) << "once more when light rests";
  const double byRecords = brightness_;
  std::size_t whole = count();
  EXPECT_NEAR(byRecords, byCaches, 0.1 * byCaches);
  EXPECT_NE(byRecords, byCaches);
  EXPECT_GT(whole, 100u);
  EXPECT_GT(session_->viewer->records()->sizeBytes(), 1000 * whole);

  // OpenGL splats them where it relights, the processor where that does.
  EXPECT_TRUE(session_->viewer->records()->isSplattedByGl());
  session_->state.relightBy.backend = BackendKind::cpu;
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_FALSE(session_->viewer->records()->isSplattedByGl());
  EXPECT_NEAR(brightness_, byRecords, 0.05 * byRecords);
  EXPECT_GE(count(), whole) << "all are kept";
  session_->state.relightBy.backend = BackendKind::gl;
  for (int i = 0; i < 10; ++i) frame();
  ASSERT_TRUE(frames([&] { return session_->viewer->records()->isComplete(); }));
  for (int i = 0; i < 10; ++i) frame();
  ASSERT_TRUE(frames([&] { return session_->viewer->records()->isComplete(); }));
  EXPECT_TRUE(session_->viewer->records()->isSplattedByGl());
  EXPECT_NEAR(brightness_, byRecords, 0.02 * byRecords);
  whole = count();

  // Lights: the same records in other light.
  const std::vector<ViewedLight> lights = session_->state.lights;
  for (ViewedLight& light : session_->state.lights) light.light.intensity *= 0.5f;
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_LT(brightness_, 0.9 * byRecords);
  EXPECT_EQ(count(), whole) << "none is made while the light changes";
  for (ViewedLight& light : session_->state.lights) light.on = false;
  for (int i = 0; i < 40; ++i) frame();
  EXPECT_LT(brightness_, 0.05 * byRecords);

  // A turn of the camera keeps them; a window of another size, too.
  session_->state.lights = lights;
  const std::size_t before = count();
  session_->state.camera.yawRad += 0.05f;
  ASSERT_TRUE(frames([&] { return session_->viewer->records()->isComplete(); }));
  EXPECT_GE(count(), before);
  EXPECT_LT(count(), 2 * before);

  // Caches again, and the same with another bake, that has records of its own.
  session_->state.camera.yawRad -= 0.05f;
  session_->state.records = false;
  for (int i = 0; i < 40; ++i) frame();
  EXPECT_NEAR(brightness_, byCaches, 0.01 * byCaches);
  session_->state.records = true;
  const LoadedLevel* const old = session_->level.get();
  writeBakeFile(small(2048));
  session_->begin({kLevel, at("level.relume"), {}, false});
  ASSERT_TRUE(frames([&] { return session_->level.get() != old; }));
  ASSERT_TRUE(frames([&] { return session_->viewer->records() && session_->viewer->records()->isComplete(); }));
  EXPECT_NEAR(brightness_, byRecords, 0.2 * byRecords);
}

TEST(Heat, isRedWhereLightLeaksAndBlueWhereItLacks) {
  const std::vector<glm::vec3> reference(4, glm::vec3(1.0f));
  const std::vector<glm::vec3> shown{glm::vec3(1.0f), glm::vec3(2.0f), glm::vec3(0.0f), glm::vec3(1.0f)};
  const HeatPicture heat = heatOf(2, 2, shown, reference);
  EXPECT_NEAR(heat.error, 0.5, 1e-6);
  EXPECT_EQ(heat.rgb[0], 255);
  EXPECT_EQ(heat.rgb[2], 255);
  EXPECT_GT(heat.rgb[3], heat.rgb[5] + 100);
  EXPECT_LT(heat.rgb[6] + 100, heat.rgb[8]);
  EXPECT_EQ(heatOf(1, 1, {glm::vec3(1.0f)}, {glm::vec3(0.0f)}).error, 0.0);
}

}  // namespace
}  // namespace relume
