// SPDX-License-Identifier: MIT
// Edits a set of lights by the mouse: picks one, drags it by its gizmo. Knows pixels and lights, and nothing of
// windows; light_handles.h draws it, view_edits.h undoes it.
#pragma once

#include "tools/view/gizmo.h"
#include "tools/view/view_state.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace relume {

inline constexpr float kLightIconPixels = 9.0f;  // radius

class LightEditor {
 public:
  using Lights = std::vector<ViewedLight>;

  // The id of the light that is selected, and its place among the lights; nothing where it is not there.
  std::optional<std::size_t> selected() const { return selected_; }
  std::optional<std::size_t> indexIn(const Lights& lights) const;
  // Lets go of what is dragged.
  void select(std::optional<std::size_t> id);
  bool isDragging() const { return drag_.has_value(); }
  // The handle that is dragged, or that a press at `pixel` would grab.
  Handle handleAt(const Lights& lights, const PixelView& view, const glm::vec2& pixel) const;

  // Where a light's icon is: its position; of a sun that is not in view, a place in it.
  static glm::vec3 anchorOf(const ViewedLight& light, const PixelView& view);
  // Nothing unless a light that is there is selected.
  std::optional<Gizmo> gizmo(const Lights& lights, const PixelView& view) const;

  // The left button. press() says whether there was a light or a handle under the mouse; where not, none is selected.
  // Of lights at one place a second press selects the next.
  bool press(Lights& lights, const PixelView& view, const glm::vec2& pixel);
  void move(Lights& lights, const PixelView& view, const glm::vec2& pixel);
  void release() { drag_.reset(); }
  // Put back what is being dragged.
  void cancelDrag(Lights& lights);

  // Ids for the lights that have none.
  void giveIds(Lights& lights);
  // add() selects the light. What comes has ids of its own.
  void add(Lights& lights, ViewedLight light);
  void removeSelected(Lights& lights);
  void replace(Lights& lights, Lights with);
  // Deselects a light that is gone, and lets go of it.
  void keepSelectionWithin(const Lights& lights);

 private:
  std::size_t lastId_ = 0;
  std::optional<std::size_t> selected_;  // by its id: undo and other files move lights in their list
  std::optional<Drag> drag_;
  std::optional<ViewedLight> before_;  // what is dragged, as it was
};

}  // namespace relume
