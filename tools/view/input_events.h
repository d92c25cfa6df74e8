// SPDX-License-Identifier: MIT
// What mouse and keys did, in its order, and how much of it a frame handles: who looks at them once a frame, as Dear
// ImGui does, would miss what is over within a slow one.
#pragma once

#include <glm/vec2.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace relume {

struct InputEvent {
  // press and release are the left button's; key is a press of one, and a character what it writes.
  enum class Kind { press, move, release, key, keyRelease, character, scroll, drop } kind = Kind::move;
  glm::vec2 at{0.0f};                // [pixel]
  int key = 0, mods = 0;             // GLFW's
  int letter = 0;                    // of the key, by lettered()
  bool isModifier = false;           // Control, Shift and their like
  unsigned int character = 0;        // Unicode's
  std::vector<std::string> paths{};  // that were dropped together
  float notches = 0.0f;              // of the wheel
};

// How many of the events the next frame handles: up to one press or release of the button or one press of a key that
// writes nothing, and no press of a key that is released before in the same frame.
inline std::size_t eventsOfFrame(std::span<const InputEvent> events) {
  using Kind = InputEvent::Kind;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const InputEvent& event = events[i];
    if (event.kind == Kind::press || event.kind == Kind::release) return i + 1;
    if (event.kind != Kind::key) continue;
    const auto before = events.first(i);
    const bool isAgain = std::any_of(before.begin(), before.end(), [&](const InputEvent& e) {
      return e.kind == Kind::keyRelease && e.key == event.key;
    });
    if (isAgain) return i;
    const bool writes = i + 1 < events.size() && events[i + 1].kind == Kind::character;
    if (!event.isModifier && !writes) return i + 1;
  }
  return events.size();
}

}  // namespace relume
