// SPDX-License-Identifier: MIT
// Undo and redo of all that is edited in a view, in one order: lights, where objects are, emitters and the sky.
#pragma once

#include "tools/view/edit_history.h"
#include "tools/view/view_state.h"

#include <glm/vec3.hpp>

#include <cstddef>
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
  // Another bake of the level is shown, whose file had `before` and has `now`: a state that is not what was edited.
  // What can be undone is kept, and follows the file where it is as the file had it; edits of the state that have not
  // been noted yet are noted by the next commit(). What the level has no more stays as it is by undo and redo, and so
  // does what it has elsewhere.
  void replace(const ViewState& state, const FileParts& before, const FileParts& now);

  // Note an edit, once it is over and nothing is dragged.
  void commit(const ViewState& state);
  bool canUndo() const { return history_.canUndo(); }
  bool canRedo() const { return history_.canRedo(); }
  // How many lights were on in what comes back and are switched off, because a file has added others since and more
  // than kMaxLightsOn would be on.
  std::size_t undo(ViewState& state);
  std::size_t redo(ViewState& state);

 private:
  struct Emitter {
    std::string name;
    bool isDriven;
    glm::vec3 radiance;
    bool operator==(const Emitter&) const = default;
  };
  // An object that is not at home. Those of one name and home are told apart by their order.
  struct MovedObject {
    std::string name;
    glm::vec3 home;
    std::ptrdiff_t number;  // of its twins before it
    glm::vec3 position;
    bool operator==(const MovedObject&) const = default;
  };
  // What is edited of a ViewState, by its names.
  struct Edited {
    std::vector<ViewedLight> lights;
    std::vector<MovedObject> objects;  // all others are at home
    std::vector<Emitter> emitters;
    float emission = 1.0f;
    glm::vec3 skyRadiance{0.0f};
    float skyRotationDeg = 0.0f;
    bool operator==(const Edited&) const = default;
  };
  static Edited editedOf(const ViewState& state);
  static void put(const Edited& edited, ViewState& state);
  std::size_t bring(const Edited& edited, ViewState& state);
  static void follow(const FileParts& before, const FileParts& now, Edited& edited);

  EditHistory<Edited> history_;
};

}  // namespace relume
