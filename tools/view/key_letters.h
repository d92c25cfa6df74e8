// SPDX-License-Identifier: MIT
// Which key of a command was pressed on the keyboard that the user has: GLFW names letters by where they are on an
// American one.
#pragma once

namespace relume {

// The key that GLFW calls by the character `name` on the key, glfwGetKeyName(); `key` itself where there is none
// (null), or none that American keyboards have: there commands stay where those have them.
constexpr int lettered(int key, const char* name) {
  if (name == nullptr || name[0] <= ' ' || name[0] > '~' || name[1] != '\0') return key;
  return name[0] >= 'a' && name[0] <= 'z' ? name[0] - 'a' + 'A' : name[0];
}

}  // namespace relume
