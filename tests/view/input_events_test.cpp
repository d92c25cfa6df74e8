// SPDX-License-Identifier: MIT
// What happens during one slow frame is handled over several, so that each of them sees what was pressed.
#include "tools/view/input_events.h"

#include <gtest/gtest.h>

#include <vector>

namespace relume {
namespace {

using Kind = InputEvent::Kind;
using Events = std::vector<InputEvent>;

constexpr int kControl = 341, kBackspace = 259, kEnter = 257;  // GLFW's

InputEvent mouse(Kind kind) { return {.kind = kind}; }
InputEvent press(int key) { return {.kind = Kind::key, .key = key, .isModifier = key == kControl}; }
InputEvent release(int key) { return {.kind = Kind::keyRelease, .key = key, .isModifier = key == kControl}; }
InputEvent character(char c) { return {.kind = Kind::character, .character = static_cast<unsigned char>(c)}; }

// How many each frame handles.
std::vector<std::size_t> frames(Events events) {
  std::vector<std::size_t> counts;
  while (!events.empty()) {
    counts.push_back(eventsOfFrame(events));
    if (counts.back() == 0) break;
    events.erase(events.begin(), events.begin() + static_cast<std::ptrdiff_t>(counts.back()));
  }
  return counts;
}

using Counts = std::vector<std::size_t>;

TEST(InputEvents, aFrameHasOneChangeOfTheButton) {
  EXPECT_EQ(eventsOfFrame({}), 0u);
  EXPECT_EQ(frames({mouse(Kind::move), mouse(Kind::press), mouse(Kind::move), mouse(Kind::release), mouse(Kind::move),
                    mouse(Kind::scroll)}),
            (Counts{2, 2, 2}));
}

TEST(InputEvents, whatIsTypedIsOneFramesAndAKeyThatWritesNothingIsItsLast) {
  EXPECT_EQ(frames({press('4'), character('4'), release('4'), press('5'), character('5'), release('5'), press(kEnter),
                    release(kEnter)}),
            (Counts{7, 1}));
  // All is selected, deleted, and written anew.
  EXPECT_EQ(frames({press(kControl), press('A'), release('A'), release(kControl), press(kBackspace),
                    release(kBackspace), press('X'), character('x'), release('X')}),
            (Counts{2, 3, 4}));
  // Control is down while the button is.
  EXPECT_EQ(frames({press(kControl), mouse(Kind::press), mouse(Kind::release), release(kControl)}), (Counts{2, 1, 1}));
}

TEST(InputEvents, aKeyThatIsPressedAgainIsSeenToBeReleased) {
  EXPECT_EQ(frames({press(kBackspace), release(kBackspace), press(kBackspace), release(kBackspace)}),
            (Counts{1, 1, 1, 1}));
  EXPECT_EQ(frames({press('4'), character('4'), release('4'), press('4'), character('4'), release('4')}),
            (Counts{3, 3}));
}

}  // namespace
}  // namespace relume
