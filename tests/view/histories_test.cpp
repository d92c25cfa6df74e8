// SPDX-License-Identifier: MIT
// What the viewer remembers: edits, times, messages.
#include "tools/view/edit_history.h"
#include "tools/view/messages.h"
#include "tools/view/time_history.h"
#include "tools/view/view_edits.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace relume {
namespace {

ViewedObject objectAt(const char* name, float home) { return {name, glm::vec3(home), glm::vec3(home)}; }

// A level with a lamp, a lit material and two objects.
ViewState stateOfALevel() {
  ViewState state;
  ViewedLight lamp;
  lamp.name = "lamp";
  lamp.light.positionWorld = lamp.home = glm::vec3(1.0f);
  state.lights = {lamp};
  state.emitters = {{"ring", false, glm::vec3(2.0f), 0, 0, {}}};
  state.objects = {objectAt("chair", 3.0f), objectAt("table", 4.0f)};
  return state;
}

FileParts partsOf(const ViewState& state) { return {state.lights, state.emitters}; }

TEST(EditHistory, anEditAfterAnUndoForgetsWhatWasUndone) {
  EditHistory<int> history(0);
  EXPECT_FALSE(history.commit(0));
  EXPECT_EQ(history.undo(), 0);
  for (int i = 1; i <= 3; ++i) EXPECT_TRUE(history.commit(i));
  EXPECT_EQ(history.undo(), 2);
  EXPECT_EQ(history.undo(), 1);
  EXPECT_EQ(history.redo(), 2);
  EXPECT_TRUE(history.commit(9));
  EXPECT_FALSE(history.canRedo());
  EXPECT_EQ(history.redo(), 9);
  EXPECT_EQ(history.undo(), 2);
}

TEST(EditHistory, keepsTheLastSteps) {
  EditHistory<int> history(0);
  const int edits = static_cast<int>(EditHistory<int>::kMaxSteps) + 10;
  for (int i = 1; i <= edits; ++i) history.commit(i);
  int last = edits;
  while (history.canUndo()) last = history.undo();
  EXPECT_EQ(last, 10);
}

// A drag holds a light while a bake is loaded.
TEST(ViewEdits, aBakeThatIsLoadedDuringADragLeavesItsStartToUndo) {
  ViewState state = stateOfALevel();
  const FileParts file = partsOf(state);
  ViewEdits edits;
  edits.begin(state);
  state.lights[0].light.positionWorld.x = 5.0f;
  state.objects[0].position.x = 6.0f;
  state.emitters[0].isDriven = true;
  state.emission = 0.5f;
  edits.replace(state, file, file);
  EXPECT_FALSE(edits.canUndo());
  state.lights[0].light.positionWorld.x = 7.0f;
  edits.commit(state);
  const ViewState dragged = state;
  ASSERT_TRUE(edits.canUndo());
  edits.undo(state);
  EXPECT_EQ(state.lights, stateOfALevel().lights);
  EXPECT_EQ(state.objects[0].position, state.objects[0].home);
  EXPECT_FALSE(state.emitters[0].isDriven);
  EXPECT_EQ(state.emission, 1.0f);
  EXPECT_FALSE(edits.canUndo());
  edits.redo(state);
  EXPECT_EQ(state.lights, dragged.lights);
  EXPECT_EQ(state.objects[0].position, dragged.objects[0].position);
}

// A file with all of it elsewhere, more and less: nothing that the window edited, so nothing to undo.
TEST(ViewEdits, aLevelThatChangesIsNoEdit) {
  ViewState state = stateOfALevel();
  ViewEdits edits;
  edits.begin(state);
  const FileParts before = partsOf(state);
  state.lights[0].light.intensity = glm::vec3(9.0f);
  state.lights.push_back(state.lights[0]);
  state.lights[1].name = "new";
  state.emitters = {{"ring", false, glm::vec3(7.0f), 0, 0, {}}, {"new", false, glm::vec3(1.0f), 0, 0, {}}};
  state.objects = {objectAt("new", 1.0f), objectAt("chair", 9.0f)};
  edits.replace(state, before, partsOf(state));
  edits.commit(state);
  EXPECT_FALSE(edits.canUndo());
}

TEST(ViewEdits, objectsThatWereNotMovedFollowTheLevel) {
  ViewState state = stateOfALevel();
  const FileParts file = partsOf(state);
  ViewEdits edits;
  edits.begin(state);
  state.lights.clear();
  edits.commit(state);
  state.objects[0] = objectAt("chair", 8.0f);
  edits.replace(state, file, file);
  edits.undo(state);
  EXPECT_EQ(state.lights.size(), 1u);
  EXPECT_EQ(state.objects[0].position, glm::vec3(8.0f));
  edits.redo(state);
  EXPECT_EQ(state.objects[0].position, glm::vec3(8.0f));
}

// A level without a bake moves all objects, its bake the dynamic ones alone.
TEST(ViewEdits, movesOfObjectsAreUndoneByTheirNames) {
  const glm::vec3 moved(0.0f, 5.0f, 0.0f);
  const std::vector<ViewedObject> baked{objectAt("table", 4.0f)}, reordered{baked[0], objectAt("chair", 3.0f)};
  for (const std::vector<ViewedObject>& later : {baked, reordered}) {
    ViewState state = stateOfALevel();
    const FileParts file = partsOf(state);
    ViewEdits edits;
    edits.begin(state);
    state.objects[1].position = moved;
    edits.commit(state);
    state.objects = later;
    state.objects[0].position = moved;
    edits.replace(state, file, file);
    edits.commit(state);
    edits.undo(state);
    EXPECT_FALSE(edits.canUndo()) << "a bake is no edit";
    for (const ViewedObject& object : state.objects) EXPECT_EQ(object.position, object.home) << object.name;
    edits.redo(state);
    EXPECT_EQ(state.objects[0].position, moved);
    if (later.size() > 1) {
      EXPECT_EQ(state.objects[1].position, state.objects[1].home);
    }
  }
}

TEST(ViewEdits, objectsOfOneNameAndPlaceAreToldApart) {
  ViewState state = stateOfALevel();
  state.objects = {objectAt("leg", 1.0f), objectAt("leg", 1.0f), objectAt("leg", 2.0f)};
  ViewEdits edits;
  edits.begin(state);
  for (ViewedObject& object : state.objects) {
    object.position.x += 1.0f;
    edits.commit(state);
  }
  for (std::size_t i = state.objects.size(); i-- > 0;) {
    edits.undo(state);
    for (std::size_t k = 0; k < state.objects.size(); ++k)
      EXPECT_EQ(state.objects[k].position != state.objects[k].home, k < i) << i << " " << k;
  }
}

TEST(TimeHistory, hasTheLastFramesOfTheSamePasses) {
  TimeHistory times;
  EXPECT_EQ(times.count(), 0u);
  const int frames = static_cast<int>(TimeHistory::kFrames) + 5;
  for (int i = 0; i < frames; ++i) times.add({{"pull", i}, {"draw", 2.0}});
  ASSERT_EQ(times.count(), TimeHistory::kFrames);
  EXPECT_EQ(times.at(0, 0), static_cast<float>(frames - 1));
  EXPECT_EQ(times.at(0, times.count() - 1), 5.0f);
  EXPECT_EQ(times.mean(1), 2.0f);
  times.add({{"pull", 1.0}});
  EXPECT_EQ(times.count(), 1u);
  EXPECT_EQ(times.passCount(), 1u);
  EXPECT_EQ(times.name(0), "pull");
}

TEST(Messages, errorsStayAndNewsGo) {
  Messages messages;
  messages.say(Severity::info, "news", 0.0);
  EXPECT_FALSE(messages.check(Error{ErrorCode::io, "trouble"}, 0.0));
  EXPECT_FALSE(messages.check(Error{ErrorCode::io, "trouble"}, 1.0));
  EXPECT_TRUE(messages.check(done(), 1.0));
  EXPECT_EQ(messages.shown().size(), 2u) << "what is shown already is not repeated";
  messages.forgetOld(Messages::kNewsSeconds + 0.1);
  ASSERT_EQ(messages.shown().size(), 1u);
  EXPECT_EQ(messages.shown()[0].text, "trouble");
  for (int i = 0; i < 9; ++i) messages.say(Severity::error, std::to_string(i), 2.0);
  EXPECT_EQ(messages.shown().size(), Messages::kMaxShown);
  EXPECT_EQ(messages.shown().back().text, "8");
  messages.close(0);
  EXPECT_EQ(messages.shown().front().text, "6");
}

TEST(Messages, newsAreNeverInPlaceOfAnError) {
  Messages messages;
  messages.say(Severity::error, "trouble", 0.0);
  messages.say(Severity::warning, "doubt", 0.0);
  for (int i = 0; i < 5; ++i) messages.say(Severity::info, std::to_string(i), 0.0);
  EXPECT_EQ(messages.shown().size(), 2 + Messages::kMaxShown);
  EXPECT_EQ(messages.shown()[0].text, "trouble");
  EXPECT_EQ(messages.shown()[1].text, "doubt");
  EXPECT_EQ(messages.shown()[2].text, "1") << "the oldest news went";
  for (int i = 0; i < 5; ++i) messages.say(Severity::error, "trouble " + std::to_string(i), 0.0);
  messages.update("speed", "fast", 0.0);
  EXPECT_EQ(messages.shown().back().text, "fast") << "errors hide no news";
}

}  // namespace
}  // namespace relume
