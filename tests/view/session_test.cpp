// SPDX-License-Identifier: MIT
// Levels that come and go while the viewer runs, without a window: baked on a thread, loaded again when the file
// changes, refused when it is damaged.
#include "tests/rays/make_scene.h"
#include "tests/view/session_fixture.h"

namespace relume {
namespace {

using namespace test;

TEST_F(ViewerSession, aBakeThatChangesIsLoadedWithoutADarkFrame) {
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  // The light of its first frames alone lacks bounces.
  const double first = brightness_;
  for (int i = 0; i < 30; ++i) frame();
  const double converged = brightness_;
  ASSERT_GT(converged, 1.3 * first) << "bounces are too weak for this test to see them";

  session_->state.camera.position.y += 0.001f;
  const auto camera = session_->state.camera.position;
  writeBakeFile(small(600));
  ASSERT_TRUE(frames([&] { return session_->level->bake.surfels.count() != 512u; }));
  EXPECT_NEAR(brightness_, converged, 0.15 * converged) << "the first frame by the new bake";
  EXPECT_EQ(session_->state.camera.position, camera);
  EXPECT_TRUE(says("loaded"));
}

// The table of memory says all that is held for light: where the CPU relights, what OpenGL draws by as well; and
// records.
TEST_F(ViewerSession, memoryIsOfAllThatLights) {
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  const auto total = [&] {
    std::size_t sum = 0;
    for (const auto& [name, bytes] : session_->viewer->memory()) sum += bytes;
    return sum;
  };
  const auto bytesOf = [&](const std::string& wanted) {
    std::size_t sum = 0;
    for (const auto& [name, bytes] : session_->viewer->memory()) sum += name == wanted ? bytes : 0;
    return sum;
  };
  const auto sizesOf = [](const Relighter& relighter) {
    std::size_t sum = 0;
    for (const auto& [name, bytes] : relighter.bufferSizes()) sum += bytes;
    return sum;
  };
  const std::size_t byGl = total();
  EXPECT_EQ(byGl, sizesOf(session_->viewer->relighter()));
  EXPECT_GE(bytesOf("links"), 4u * session_->level->bake.links.count());
  // The backend that relights alone keeps what parts need.
  const std::size_t drawn = byGl - bytesOf("moving parts");
  EXPECT_LT(drawn, byGl);

  session_->state.relightBy.backend = BackendKind::cpu;
  ASSERT_TRUE(frames([&] { return session_->viewer->relighter().backend() == BackendKind::cpu; }));
  EXPECT_GT(bytesOf("moving parts"), 0u);
  EXPECT_EQ(bytesOf("OpenGL's"), drawn);
  EXPECT_EQ(total(), drawn + sizesOf(session_->viewer->relighter()));

  session_->state.relightBy.backend = BackendKind::gl;
  session_->state.records = true;
  ASSERT_TRUE(frames([&] { return session_->viewer->records() && session_->viewer->records()->records() > 100; }));
  EXPECT_GE(bytesOf("records"), 100 * sizeof(Record));
}

TEST_F(ViewerSession, aDamagedBakeIsToldAndTheOldOneKept) {
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  for (int i = 0; i < 10; ++i) frame();
  const double before = brightness_;
  const LevelPtr level = session_->level;

  std::string bytes = [&] {
    std::ifstream file(at("level.relume"), std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  }();
  std::ofstream(at("level.relume"), std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  ASSERT_TRUE(frames([&] { return says("what is shown stays"); }));
  EXPECT_TRUE(says("level.relume"));
  EXPECT_EQ(session_->level, level);
  EXPECT_NEAR(frame(), before, 0.1 * before);
  // It is told once, and a file that is whole again is loaded.
  while (!session_->messages.shown().empty()) session_->messages.close(0);
  for (int i = 0; i < 40; ++i) frame();
  EXPECT_FALSE(says("what is shown stays"));
  std::ofstream(at("level.relume"), std::ios::binary) << bytes;
  EXPECT_TRUE(frames([&] { return session_->level != level; }));
  // So is the end of a file that was gone for a while.
  const LevelPtr second = session_->level;
  fs::remove(at("level.relume"));
  for (int i = 0; i < 40; ++i) frame();
  EXPECT_EQ(session_->level, second);
  std::ofstream(at("level.relume"), std::ios::binary) << bytes;
  EXPECT_TRUE(frames([&] { return session_->level != second; }));
}

TEST_F(ViewerSession, aDroppedLevelIsBakedAndShown) {
  start("");
  double furthest = 0.0;
  ASSERT_TRUE(frames([&] {
    if (session_->job) furthest = std::max(furthest, session_->job->progress().fraction);
    return session_->level != nullptr;
  }));
  EXPECT_GT(furthest, 0.0);
  EXPECT_EQ(session_->level->bakeFile, "");
  EXPECT_GT(frame(), 0.01);
  EXPECT_TRUE(says("preset draft"));

  // Another one: its own camera and lights.
  const std::string other = RELUME_SOURCE_DIR "/samples/blender/cabin.glb";
  session_->drop({other});
  EXPECT_TRUE(session_->job.has_value());
  ASSERT_TRUE(frames([&] { return session_->level->sceneFile == other; }));
  EXPECT_EQ(session_->state.lights.size(), session_->level->scene.lights.size());
  EXPECT_FALSE(session_->edits.canUndo());

  // What is no level, and what is no level inside, is told; a list of lights is loaded.
  const LevelPtr level = session_->level;
  session_->drop({at("notes.txt")});
  EXPECT_TRUE(says("notes.txt"));
  std::ofstream(at("broken.glb")) << "glTF";
  session_->drop({at("broken.glb")});
  ASSERT_TRUE(frames([&] { return says("broken.glb") && !session_->job; }));
  EXPECT_EQ(session_->level, level);
  // So is one with nothing in it.
  std::ofstream(at("empty.gltf")) << R"({"asset": {"version": "2.0"}})";
  session_->drop({at("empty.gltf")});
  ASSERT_TRUE(frames([&] { return says("\"empty.gltf\" has no triangle to draw") && !session_->job; }));
  EXPECT_EQ(session_->level, level);
  std::ofstream(at("one.json")) << R"([{"type": "point", "position": [1, 2, 3]}])";
  session_->drop({at("one.json")});
  EXPECT_EQ(session_->state.lights.size(), 1u);
  // A bake of another level is refused.
  writeBakeFile(small(512));
  session_->drop({at("level.relume")});
  ASSERT_TRUE(frames([&] { return says("was not baked from") && !session_->job; }));
  EXPECT_EQ(session_->level, level);
}

TEST_F(ViewerSession, aBakeIsMadeAnewWithLinksOfAnotherKind) {
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  for (int i = 0; i < 30; ++i) frame();
  const double before = brightness_;
  ASSERT_EQ(session_->level->bake.links.kind, LinkKind::oct6);
  for (const LinkKind kind : {LinkKind::sh, LinkKind::cone, LinkKind::irradiance}) {
    session_->bakeLinks(kind);
    ASSERT_TRUE(session_->job.has_value());
    ASSERT_TRUE(frames([&] { return !session_->job; }));
    ASSERT_EQ(session_->level->bake.links.kind, kind);
    EXPECT_EQ(session_->level->bake.surfels.count(), 512u) << "by the options of the bake that there was";
    EXPECT_TRUE(says("with " + std::string(linkKindName(kind)) + " links"));
    EXPECT_NEAR(frame(), before, 0.05 * before) << "light goes on";
  }
  // The file is watched as before.
  writeBakeFile(small(600));
  ASSERT_TRUE(frames([&] { return session_->level->bake.surfels.count() != 512u; }));
  EXPECT_EQ(session_->level->bake.links.kind, LinkKind::oct6);
}

TEST_F(ViewerSession, allEditsAreUndoneInTheirOrder) {
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  ViewState& state = session_->state;
  ASSERT_FALSE(state.lights.empty());
  ASSERT_FALSE(state.emitters.empty());
  ASSERT_FALSE(state.objects.empty()) << "the level has a dynamic object";
  const ViewState first = state;
  // Each is an edit once its control is let go.
  const auto edit = [&](const auto& change) {
    session_->endControls(true);
    change();
    session_->endControls(true);
    session_->endControls(false);
    frame();
  };
  edit([&] { state.lights[0].light.intensity *= 2.0f; });
  edit([&] { state.objects[0].position.y += 1.0f; });
  edit([&] { state.sky.radiance = glm::vec3(3.0f); });
  edit([&] { state.emitters[0].isDriven = !state.emitters[0].isDriven; });
  edit([&] { state.emission = 0.5f; });
  session_->addLight(LightKind::point);
  const ViewState last = state;

  session_->run(Command::undo);
  EXPECT_EQ(state.lights.size(), first.lights.size());
  EXPECT_EQ(state.emission, 0.5f);
  session_->run(Command::undo);
  EXPECT_EQ(state.emission, first.emission);
  EXPECT_NE(state.emitters[0].isDriven, first.emitters[0].isDriven);
  session_->run(Command::undo);
  EXPECT_EQ(state.emitters[0].isDriven, first.emitters[0].isDriven);
  EXPECT_EQ(state.sky.radiance, glm::vec3(3.0f));
  session_->run(Command::undo);
  EXPECT_EQ(state.sky.radiance, first.sky.radiance);
  EXPECT_NE(state.objects[0].position, first.objects[0].position);
  session_->run(Command::undo);
  EXPECT_EQ(state.objects[0].position, first.objects[0].position);
  EXPECT_NE(state.lights[0], first.lights[0]);
  session_->run(Command::undo);
  EXPECT_EQ(state.lights, first.lights);
  EXPECT_FALSE(session_->edits.canUndo());

  // Another bake of the level is no edit, and keeps them.
  session_->bakeLinks(LinkKind::cone);
  ASSERT_TRUE(frames([&] { return session_->level->bake.links.kind == LinkKind::cone; }));
  for (int i = 0; i < 6; ++i) session_->run(Command::redo);
  EXPECT_EQ(state.lights, last.lights);
  EXPECT_EQ(state.objects[0].position, last.objects[0].position);
  EXPECT_EQ(state.sky.radiance, last.sky.radiance);
  EXPECT_EQ(state.emission, last.emission);
  EXPECT_FALSE(session_->edits.canRedo());
}

// A level and its bake of the same name: what was edited in the window stays, all else is the new file's.
TEST_F(ViewerSession, aChangedLevelHasItsOwnLightsAndEmitters) {
  options_.lights = {"all"};
  Context context;
  const auto first = loadLevel({kLevel, "", {}, false, {}, small(256)}, context);
  ASSERT_TRUE(first) << first.error().message;
  auto begun = initialState((*first)->scene, options_);
  ASSERT_TRUE(begun) << begun.error().message;
  session_.emplace(std::move(*begun), options_, EglContext::getProcAddress);
  ASSERT_TRUE(session_->show(*first));
  ViewState& state = session_->state;
  const auto indexOf = [](const auto& list, const std::string& name) {
    const auto found = std::find_if(list.begin(), list.end(), [&](const auto& one) { return one.name == name; });
    return static_cast<std::size_t>(found - list.begin());
  };
  ASSERT_EQ(state.lights.size(), 3u) << "sun, lamp, spot";
  ASSERT_EQ(state.emitters.size(), 1u) << "panel";
  const glm::vec3 panel = state.emitters[0].radiance;
  const std::size_t spot = indexOf(state.lights, "spot");
  const float range = state.lights[spot].light.range;
  state.lights[spot].light.range = 4.0f;
  session_->endControls(false);
  session_->addLight(LightKind::point);
  ASSERT_EQ(session_->editor.indexIn(state.lights), 3u);

  auto changed = std::make_shared<LoadedLevel>(**first);
  std::vector<SceneLight>& lights = changed->scene.lights;
  lights[indexOf(lights, "lamp")].intensity *= 3.0f;
  lights[indexOf(lights, "spot")].intensity *= 3.0f;
  const glm::vec3 lamp = lights[indexOf(lights, "lamp")].intensity;
  lights.push_back(lights[indexOf(lights, "lamp")]);
  lights.back().name = lights.back().node = "second lamp";
  lights.erase(lights.begin() + static_cast<std::ptrdiff_t>(indexOf(lights, "sun")));
  std::vector<Material>& materials = changed->scene.materials;
  materials[indexOf(materials, "panel")].emission *= 2.0f;
  materials[indexOf(materials, "rug")].emission = glm::vec3(5.0f);
  changed->materials = materials;
  ASSERT_TRUE(session_->show(changed));
  std::vector<std::string> names;
  for (const ViewedLight& light : state.lights) names.push_back(light.name);
  EXPECT_EQ(names, (std::vector<std::string>{"lamp", "spot", "point", "second lamp"}));
  EXPECT_EQ(state.lights[0].light.intensity, lamp);
  EXPECT_EQ(state.lights[1].light.range, 4.0f);
  EXPECT_EQ(session_->editor.indexIn(state.lights), 2u) << "the light that was added, which the file has not";
  ASSERT_EQ(state.emitters.size(), 2u);
  EXPECT_EQ(state.emitters[indexOf(state.emitters, "panel")].radiance, 2.0f * panel);
  EXPECT_EQ(state.emitters[indexOf(state.emitters, "rug")].radiance, glm::vec3(5.0f));
  frame();

  // What is undone is of the file that there is now.
  session_->run(Command::undo);
  ASSERT_EQ(state.lights.size(), 3u) << "the point light is not added yet";
  EXPECT_EQ(state.lights[0].light.intensity, lamp);
  session_->run(Command::undo);
  EXPECT_EQ(state.lights[1].light.range, range);
  EXPECT_EQ(state.lights[1].light.intensity, lights[indexOf(lights, "spot")].intensity);

  // One that the file has no more is no more selected either.
  EXPECT_FALSE(session_->editor.selected()) << "the point light is not added yet";
  session_->editor.select(state.lights.back().id);
  ASSERT_EQ(state.lights.back().name, "second lamp");
  // Emitters that were driven here stay so, whatever their number and order are.
  const std::size_t driven = indexOf(state.emitters, "panel");
  state.emitters[driven].isDriven = true;
  state.emitters[driven].radiance = {1.0f, 0.0f, 0.0f};
  session_->endControls(false);
  ASSERT_TRUE(session_->show(*first));
  EXPECT_FALSE(session_->editor.selected());
  ASSERT_EQ(state.emitters.size(), 1u);
  EXPECT_TRUE(state.emitters[0].isDriven);
  EXPECT_EQ(state.emitters[0].radiance, glm::vec3(1.0f, 0.0f, 0.0f));
  session_->run(Command::undo);
  EXPECT_FALSE(state.emitters[0].isDriven);
  EXPECT_EQ(state.emitters[0].radiance, panel);
}

TEST_F(ViewerSession, noMoreLightsAreOnThanThereAreShadowMaps) {
  start("");
  ASSERT_FALSE(session_->state.lights.empty());
  session_->state.lights.resize(40, session_->state.lights.front());
  for (ViewedLight& light : session_->state.lights) light.on = true;
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  EXPECT_TRUE(says("8 lights switched off"));
  EXPECT_GT(frame(), 0.0);
  EXPECT_FALSE(says("shadow"));
  session_->addLight(LightKind::point);
  EXPECT_FALSE(session_->state.lights.back().on);
  frame();
  EXPECT_FALSE(says("shadow"));
}

// The view's near plane is within a room of 12 x 9 x 15 mm.
TEST_F(LiveSession, aLevelOfMillimetresIsSeen) {
  Scene room;
  const std::uint32_t grey = addMaterial(room, glm::vec3(0.5f));
  addInstance(room, box({0, 0, 0}, {0.012f, 0.009f, 0.015f}, true, grey));
  finish(room);
  options_.scene = "room.glb";
  options_.camera.clear();
  options_.lights = {"all"};
  options_.view = "albedo";
  Context context;
  const auto level = loadBake(std::move(room), {options_.scene, "", {}}, context);
  ASSERT_TRUE(level) << level.error().message;
  auto state = initialState((*level)->scene, options_);
  ASSERT_TRUE(state) << state.error().message;
  session_.emplace(std::move(*state), options_, EglContext::getProcAddress);
  ASSERT_TRUE(session_->show(*level));
  EXPECT_GT(frame(), 0.2) << "walls everywhere";
}

TEST_F(ViewerSession, aBakeCanBeCancelled) {
  start("");
  ASSERT_TRUE(session_->job.has_value());
  session_->job->cancel();
  ASSERT_TRUE(frames([&] { return !session_->job; }));
  EXPECT_TRUE(says("cancelled"));
  EXPECT_EQ(session_->level, nullptr);
  // A window that is closed meanwhile waits for nothing longer than a step of the work.
  session_->begin({kLevel, "", {}, false, {}, presetOptions(Preset::draft)});
  session_.reset();
}

}  // namespace
}  // namespace relume
