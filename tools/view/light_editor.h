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

  std::optional<std::size_t> selected() const { return selected_; }
  void select(std::optional<std::size_t> index) { selected_ = index; }
  bool isDragging() const { return drag_.has_value(); }
  // The handle that is dragged, or that a press at `pixel` would grab.
  Handle handleAt(const Lights& lights, const PixelView& view, const glm::vec2& pixel) const;

  // Where a light's icon is: its position; of a sun that is not in view, a place in it.
  static glm::vec3 anchorOf(const ViewedLight& light, const PixelView& view);
  // Nothing unless a light is selected.
  std::optional<Gizmo> gizmo(const Lights& lights, const PixelView& view) const;

  // The left button. press() says whether there was a light or a handle under the mouse; where not, none is selected.
  bool press(Lights& lights, const PixelView& view, const glm::vec2& pixel);
  void move(Lights& lights, const PixelView& view, const glm::vec2& pixel);
  void release() { drag_.reset(); }
  // Put back what is being dragged.
  void cancelDrag(Lights& lights);

  // add() selects the light.
  void add(Lights& lights, ViewedLight light);
  void removeSelected(Lights& lights);
  void replace(Lights& lights, Lights with);
  // Deselects a light that is gone.
  void keepSelectionWithin(const Lights& lights);

 private:
  std::optional<std::size_t> selected_;
  std::optional<Drag> drag_;
  std::optional<ViewedLight> before_;  // what is dragged, as it was
};

}  // namespace relume
