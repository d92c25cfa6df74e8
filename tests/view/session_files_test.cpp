// SPDX-License-Identifier: MIT
// Files in the viewer: levels, bakes and lists of lights that are dropped on it, and where lights are saved.
#include "tests/rays/make_scene.h"
#include "tests/view/session_fixture.h"
#include "tools/view/light_set.h"

#include <memory>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr const char* kLight = R"({"type": "point", "name": "mine", "position": [1, 1, 1]})";

class SessionFiles : public LiveSession {
 protected:
  // A room with point lights of these names, and so many nodes "thing" in one place.
  static LevelPtr room(const std::string& file, const std::vector<std::string>& lights, std::uint32_t things = 0) {
    Scene scene;
    const std::uint32_t grey = addMaterial(scene, glm::vec3(0.5f));
    addInstance(scene, box({0, 0, 0}, {4, 3, 5}, true, grey));
    for (std::uint32_t i = 0; i < things; ++i) {
      addInstance(scene, box({1, 0, 1}, {2, 1, 2}, false, grey));
      scene.instances.back().node = "thing";
      scene.instances.back().nodeIndex = 1 + i;
    }
    finish(scene);
    for (const std::string& name : lights) {
      scene.lights.emplace_back();
      scene.lights.back().name = scene.lights.back().node = name;
      scene.lights.back().positionWorld = {2, 2, 2};
    }
    Context context;
    const auto level = loadBake(std::move(scene), {file, "", {}}, context);
    EXPECT_TRUE(level) << level.error().message;
    return level ? *level : nullptr;
  }
  void showRoom(const std::vector<std::string>& lights) {
    options_.scene = at("room.glb");
    options_.camera.clear();
    options_.lights = {"all"};
    options_.live = {8, 16, 1};
    options_.output = at("pictures");
    const LevelPtr level = room(options_.scene, lights);
    auto state = initialState(level->scene, options_);
    ASSERT_TRUE(state) << state.error().message;
    session_.emplace(std::move(*state), options_, EglContext::getProcAddress);
    ASSERT_TRUE(session_->show(level));
  }
  void write(const char* name, int lights) const {
    std::string text;
    for (int i = 0; i < lights; ++i) text += (i > 0 ? "," : "") + std::string(kLight);
    std::ofstream(at(name)) << "[" + text + "]";
  }
  std::string read(const char* name) const {
    std::ifstream file(at(name), std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  }
};

TEST_F(SessionFiles, aListThatIsRefusedIsNotSavedTo) {
  write("mine.json", 1);
  write("many.json", 33);
  options_.lightsFile = at("mine.json");
  showRoom({});
  const std::string mine = read("mine.json"), many = read("many.json");
  session_->drop({at("many.json")});
  EXPECT_TRUE(says("33 lights"));
  session_->run(Command::saveLights);
  EXPECT_EQ(read("many.json"), many);
  EXPECT_NE(read("mine.json"), mine) << "the list that there was is written, in the viewer's own words";
  write("other.json", 2);
  session_->drop({at("other.json")});
  session_->addLight(LightKind::point);
  session_->run(Command::saveLights);
  EXPECT_EQ(loadLightSet(at("other.json"))->size(), 3u);
}

TEST_F(SessionFiles, listsOfAnotherLevelAreNotSavedOver) {
  write("mine.json", 1);
  options_.lightsFile = at("mine.json");
  showRoom({});
  session_->run(Command::saveLights);
  session_->addLight(LightKind::point);
  session_->run(Command::saveLights);
  EXPECT_EQ(loadLightSet(at("mine.json"))->size(), 2u) << "what was saved is saved over";

  ASSERT_TRUE(session_->show(room(at("other.glb"), {"lamp"})));
  const std::string mine = read("mine.json");
  EXPECT_EQ(session_->lightsFile, "lights.json");
  session_->lightsFile = at("mine.json");
  session_->run(Command::saveLights);
  EXPECT_TRUE(says("mine.json\": not replaced"));
  EXPECT_EQ(read("mine.json"), mine);
  std::ofstream(at("empty.json")).close();
  for (const char* own : {"new.json", "new.json", "empty.json"}) {
    session_->lightsFile = at(own);
    session_->addLight(LightKind::point);
    session_->run(Command::saveLights);
    EXPECT_EQ(loadLightSet(at(own))->size(), session_->state.lights.size());
  }
  // Once it is loaded it is this level's own.
  session_->lightsFile = at("mine.json");
  session_->run(Command::loadLights);
  session_->run(Command::undo);
  session_->run(Command::saveLights);
  EXPECT_EQ(loadLightSet(at("mine.json"))->size(), session_->state.lights.size());
}

// A light that the file has more counts in what is undone as well.
TEST_F(SessionFiles, undoSwitchesNoMoreLightsOnThanThereAreShadowMaps) {
  showRoom({"lamp"});
  while (lightsOn(session_->state.lights) < kMaxLightsOn) session_->addLight(LightKind::point);
  session_->run(Command::removeLight);
  ASSERT_TRUE(session_->show(room(at("room.glb"), {"lamp", "new"})));
  EXPECT_EQ(lightsOn(session_->state.lights), kMaxLightsOn);
  session_->run(Command::undo);
  EXPECT_EQ(session_->state.lights.size(), kMaxLightsOn + 1);
  EXPECT_EQ(lightsOn(session_->state.lights), kMaxLightsOn);
  EXPECT_TRUE(says("1 light switched off: 32 are on"));
  frame();
  EXPECT_FALSE(says("shadow"));
}

TEST_F(SessionFiles, whatCannotBeDrawnIsNoPictureAndEndsTheFilm) {
  showRoom({"lamp"});
  frame();
  const std::vector<ViewedLight> lights = session_->state.lights;
  const std::vector<ViewedLight> many(kMaxLightsOn + 1, lights[0]);
  session_->state.lights = many;
  session_->run(Command::screenshot);
  frame();
  EXPECT_TRUE(says("no picture"));
  session_->state.lights = lights;
  frame();
  EXPECT_FALSE(fs::exists(at("pictures/relume_0001.png"))) << "nor is it taken later";
  session_->run(Command::film);
  frame();
  EXPECT_TRUE(session_->capture().isFilming());
  session_->state.lights = many;
  frame();
  EXPECT_FALSE(session_->capture().isFilming());
  EXPECT_TRUE(says("which ends the film: 1 frames"));
  EXPECT_TRUE(fs::exists(at("pictures/film_0001/frame_0000.png")));
  EXPECT_FALSE(fs::exists(at("pictures/film_0001/frame_0001.png")));
}

TEST_F(SessionFiles, aLevelBySeveralPathsIsTheSame) {
  options_.driven = {{"panel", glm::vec3(1.0f), 0, 0, {}}};
  showRoom({"lamp"});
  session_->addLight(LightKind::point);
  const std::string around = (folder_ / "folder" / ".." / "room.glb").string(),
                    relative = fs::relative(folder_ / "room.glb").string();
  for (const std::string& path : {around, relative}) {
    ASSERT_TRUE(session_->show(room(path, {"lamp"})));
    EXPECT_EQ(session_->state.lights.size(), 2u);
    EXPECT_TRUE(session_->edits.canUndo());
    session_->drop({path});
    EXPECT_EQ(session_->job->files().driven.size(), 1u) << "--emission is of this level";
    session_->job.reset();
  }
  ASSERT_TRUE(session_->show(room(at("other.glb"), {"lamp"})));
  EXPECT_EQ(session_->state.lights.size(), 1u);
}

TEST_F(SessionFiles, nodesOfOneNameAndPlaceStayWhereEachWasMovedTo) {
  showRoom({});
  const auto reload = [&] { return static_cast<bool>(session_->show(room(options_.scene, {}, 2))); };
  ASSERT_TRUE(reload());
  auto& objects = session_->state.objects;
  ASSERT_EQ(objects.size(), 3u);
  ASSERT_EQ(objects[1].home, objects[2].home);
  objects[2].position.y += 1.0f;
  ASSERT_TRUE(reload());
  EXPECT_EQ(objects[1].position, objects[1].home);
  EXPECT_EQ(objects[2].position, objects[2].home + glm::vec3(0, 1, 0));
}

// One that loads, and cannot be framed.
TEST_F(SessionFiles, aLevelThatCannotBeShownTakesNoOptionsAway) {
  options_.driven = {{"panel", glm::vec3(1.0f), 0, 0, {}}};
  showRoom({"lamp"});
  const auto empty = std::make_shared<LoadedLevel>();
  empty->sceneFile = at("empty.glb");
  ASSERT_FALSE(session_->show(empty));
  EXPECT_EQ(session_->level->sceneFile, at("room.glb"));
  session_->drop({at("room.glb")});
  EXPECT_EQ(session_->job->files().driven.size(), 1u) << "--emission is of the level that is shown still";
}

TEST_F(SessionFiles, aLevelAndItsBakeAreDroppedTogetherOrOneAfterTheOther) {
  showRoom({});
  const auto isLoaded = [&](const std::string& scene, const std::string& bake) {
    const LevelFiles files = session_->job->files();
    return files.scene == scene && files.bake == bake && !files.bakeBy;
  };
  const std::string bake = at("level.relume");
  session_->drop({bake});
  EXPECT_TRUE(isLoaded(at("room.glb"), bake)) << "of the level that is shown";
  session_->job.reset();
  session_->drop({kLevel});
  session_->drop({bake});
  EXPECT_TRUE(isLoaded(kLevel, bake)) << "of the level that is on its way";
  session_->drop({kLevel});
  session_->job->cancel();
  session_->drop({bake});
  EXPECT_TRUE(isLoaded(at("room.glb"), bake)) << "the level that was on its way is not wanted any more";
  session_->drop({bake, kLevel});
  EXPECT_TRUE(isLoaded(kLevel, bake));
  writeBakeFile(small(256));
  session_->drop({kLevel, bake});
  EXPECT_TRUE(isLoaded(kLevel, bake));
  ASSERT_TRUE(frames([&] { return !session_->job; }));
  EXPECT_EQ(session_->level->sceneFile, kLevel);
  EXPECT_EQ(session_->level->bakeFile, bake);
  EXPECT_EQ(titleOf(*session_->level), "two_rooms.glb, level.relume - Relume");

  // Links that were made in memory are not those of the file that is watched.
  session_->bakeLinks(LinkKind::cone);
  ASSERT_TRUE(frames([&] { return !session_->job; }));
  EXPECT_EQ(session_->level->bakeFile, bake);
  EXPECT_EQ(titleOf(*session_->level), "two_rooms.glb, baked in memory - Relume");
}

}  // namespace
}  // namespace relume
