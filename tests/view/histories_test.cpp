// SPDX-License-Identifier: MIT
// What the viewer remembers: edits, times, messages.
#include "tools/view/edit_history.h"
#include "tools/view/messages.h"
#include "tools/view/time_history.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

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

}  // namespace
}  // namespace relume
