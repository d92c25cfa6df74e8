// SPDX-License-Identifier: MIT
// Undo and redo of all that is edited in a view, in one order: lights, where objects are, emitters and the sky.
#pragma once

#include "tools/view/edit_history.h"
#include "tools/view/view_state.h"

#include <glm/vec3.hpp>

#include <string>
#include <vector>

namespace relume {

// What a level's file has of all that.
struct FileParts {
  std::vector<ViewedLight> lights;
  std::vector<ViewedEmitter> emitters;
};

class ViewEdits {
 public:
  // Begin with a state, forgetting what was edited before.
  void begin(const ViewState& state);
  // Take a state for the one that is: another bake of the level is shown, whose file had `before` and has `now`. What
  // can be undone is kept, and follows the file where it is as the file had it. What else the level has more or fewer
  // of than it had stays as it is by undo and redo.
  void replace(const ViewState& state, const FileParts& before, const FileParts& now);

  // Note an edit, once it is over and nothing is dragged.
  void commit(const ViewState& state);
  bool canUndo() const { return history_.canUndo(); }
  bool canRedo() const { return history_.canRedo(); }
  void undo(ViewState& state);
  void redo(ViewState& state);

 private:
  struct Emitter {
    std::string name;
    bool isDriven;
    glm::vec3 radiance;
    bool operator==(const Emitter&) const = default;
  };
  // What is edited of a ViewState, by its names.
  struct Edited {
    std::vector<ViewedLight> lights;
    std::vector<glm::vec3> objects;  // their positions
    std::vector<Emitter> emitters;
    float emission = 1.0f;
    glm::vec3 skyRadiance{0.0f};
    float skyRotationDeg = 0.0f;
    bool operator==(const Edited&) const = default;
  };
  static Edited editedOf(const ViewState& state);
  static void put(const Edited& edited, ViewState& state);

  EditHistory<Edited> history_;
};

}  // namespace relume
