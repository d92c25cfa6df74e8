// SPDX-License-Identifier: MIT
// The geometry of a gizmo: which of its handles is under the mouse, and where a drag takes what it is attached to.
// Pixels in, world out; no OpenGL and no user interface. Axes and squares between them move, rings turn a direction.
//
// While a handle is dragged, the point that was grabbed stays under the mouse: on an axis the point of the axis that is
// nearest to the mouse's ray, on a square the ray's intersection with its plane, on a ring the angle of that
// intersection.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <optional>
#include <vector>

namespace relume {

struct MouseRay {
  glm::vec3 origin{0.0f};
  glm::vec3 direction{0.0f};  // unit
};

// A camera and the pixels that show it, row 0 on top.
struct PixelView {
  glm::mat4 clipFromWorld{1.0f};
  glm::vec3 eye{0.0f};
  glm::vec2 size{1.0f};  // [pixel]

  MouseRay ray(const glm::vec2& pixel) const;
  // Nothing for a point that is not in front of the eye.
  std::optional<glm::vec2> project(const glm::vec3& world) const;
  bool shows(const glm::vec3& world) const;
  // [m] that a pixel is wide at that point; 0 where it is not in front of the eye.
  float metresPerPixel(const glm::vec3& world) const;
};

enum class Handle { none, axisX, axisY, axisZ, squareX, squareY, squareZ, ringX, ringY, ringZ };
inline constexpr std::array<Handle, 9> kHandles{Handle::axisX,   Handle::axisY,   Handle::axisZ,
                                                Handle::squareX, Handle::squareY, Handle::squareZ,
                                                Handle::ringX,   Handle::ringY,   Handle::ringZ};
// 0..2: the axis, the square's normal, the ring's axis.
int axisOf(Handle handle);
bool isAxis(Handle handle);
bool isSquare(Handle handle);
bool isRing(Handle handle);

struct Gizmo {
  glm::vec3 centreWorld{0.0f};       // [m]
  glm::vec3 direction{0, -1, 0};     // that rings turn
  float size = 1.0f;                 // [m] length of the axes
  bool moves = true, turns = false;  // which handles there are

  bool has(Handle handle) const;
  // Ends of an axis, corners of a square, points along a ring, in the world. [Size 2, 4 or 65]
  std::vector<glm::vec3> outline(Handle handle) const;
};

// As long on the screen wherever it stands.
float gizmoSize(const PixelView& view, const glm::vec3& centreWorld);

// The handle under a pixel; none further than a few pixels from all of them.
Handle pickHandle(const Gizmo& gizmo, const PixelView& view, const glm::vec2& pixel);

// What a drag remembers of where it began.
struct Drag {
  Handle handle = Handle::none;
  Gizmo start;
  glm::vec3 grabbed{0.0f};  // the point under the mouse, relative to the centre
};

// Nothing where the handle is seen end on, so that no point of it is under the mouse.
std::optional<Drag> beginDrag(const Gizmo& gizmo, Handle handle, const PixelView& view, const glm::vec2& pixel);

struct Dragged {
  glm::vec3 centreWorld{0.0f};
  glm::vec3 direction{0.0f};  // unit
};
// Where the mouse at `pixel` takes it. Nothing where the ray runs along the handle, or meets it far behind all that is
// shown: what is dragged stays where it is.
std::optional<Dragged> dragTo(const Drag& drag, const PixelView& view, const glm::vec2& pixel);

}  // namespace relume
