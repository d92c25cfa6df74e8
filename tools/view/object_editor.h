// SPDX-License-Identifier: MIT
// Moves an object of the level by the mouse: which one is at a place that was clicked, where a drag of its gizmo takes
// it. Knows pixels and objects, and nothing of windows; view_edits.h undoes it.
#pragma once

#include "relume/bake/scene.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/view/gizmo.h"
#include "tools/view/view_state.h"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace relume {

// The object whose surface is nearest to a point of the world, where it stands now; nothing in a level without
// triangles. nodes: movingNodes() of the scene. [Size objects == nodes]
std::optional<std::size_t> objectAt(const Scene& scene, std::span<const MovingNode> nodes,
                                    std::span<const ViewedObject> objects, const glm::vec3& pointWorld);

class ObjectEditor {
 public:
  using Objects = std::vector<ViewedObject>;

  std::optional<std::size_t> selected() const { return selected_; }
  // Lets go of what is dragged.
  void select(std::optional<std::size_t> index);
  bool isDragging() const { return drag_.has_value(); }
  // Nothing unless an object is selected and in front of the eye.
  std::optional<Gizmo> gizmo(const Objects& objects, const PixelView& view) const;
  // The handle that is dragged, or that a press at `pixel` would grab.
  Handle handleAt(const Objects& objects, const PixelView& view, const glm::vec2& pixel) const;

  // The left button. press() says whether it grabbed a handle of the selected object.
  bool press(const Objects& objects, const PixelView& view, const glm::vec2& pixel);
  void move(Objects& objects, const PixelView& view, const glm::vec2& pixel) const;
  void release() { drag_.reset(); }
  // Put back what is being dragged.
  void cancelDrag(Objects& objects);

 private:
  std::optional<std::size_t> selected_;
  std::optional<Drag> drag_;
};

}  // namespace relume
