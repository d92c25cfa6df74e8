// SPDX-License-Identifier: MIT
// What moves through a baked level and takes part in its indirect light (PIC Section 6): it shadows the bake's links
// and reflects the light that falls on it. Shapes are made once; each frame says which of them stand where
// (LightSetup::movingParts). The bake knows nothing of them, and none of its bytes changes.
//
//   MovingMesh crate{positions, triangles, {&brown, 1}};
//   auto shapes = MovingShapes::create({&crate, 1});
//   ... every frame:
//   MovingPart parts[] = {{0, crateToWorld}};
//   setup.movingShapes = &*shapes;
//   setup.movingParts = parts;
//
// A shape is any mesh of triangles: a ball, a capsule or a box is the triangles of one. It is kept as bits of a small
// grid in its own axes, 32 voxels on the longest side, so that a frame voxelises nothing; what is thinner than a voxel
// counts as thick as one. Lengths in metres, light in W/m²/sr.
//
// A part acts where the sphere around it covers more than 0.02 sr, within some 12.5 radii of that sphere. What emits is
// seen from farther off, to 100 radii, fading from 71 on, or less far where so many parts emit that each cache would be
// in reach of more than two in the mean. There its light follows within RelightOptions::movingLag frames, and other
// parts do not hide it.
//
// CPU and OpenGL backend and GpuPasses give the same light, but for rounding. The latter
// two upload all shapes in the first frame that names them, and again where a frame names another MovingShapes: keep
// what a level needs in one.
//
// Errors: create() names mesh, vertex or triangle; Relighter::relight() refuses parts that it cannot place by their
// index (more than RelightOptions::movingParts, a shape that there is not, a matrix that is not finite), and keeps last
// frame's light; so does GpuPasses::frame(). Threads: const functions from any number of threads; several relighters
// may share one MovingShapes, which must live until the last relight() or frame() that names it has returned.
#pragma once

#include "relume/result.h"
#include "relume/vectors.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace relume {

// A rigid mesh. Spans are read by MovingShapes::create() alone.
struct MovingMesh {
  std::span<const glm::vec3> position;    // [m] within 1e8 on each axis, in the mesh's own axes
  std::span<const glm::uvec3> triangle;   // vertex indices; the front is counter-clockwise
  std::span<const glm::vec3> albedo;      // [0..1] [Size 1 for the whole mesh, or triangles]
  std::span<const glm::vec3> emission{};  // [W/m²/sr] [0..1e9] [Size 0, 1 or triangles] of the fronts,
                                          // times LightSetup::emissionScale
};

inline constexpr std::uint32_t kMaxMovingParts = 256;  // of a frame

// A shape as it stands in this frame.
struct MovingPart {
  std::uint32_t shape = 0;    // index into the meshes of MovingShapes::create()
  glm::mat4x3 toWorld{1.0f};  // numbers within 1e8; may mirror. One that flattens the shape hides the part
};

struct MovingShape;

class MovingShapes {
 public:
  // usage: a mesh without triangles, an index out of range, a span of the wrong size, a number that is not finite or
  // out of its range; the message names mesh, vertex or triangle. memory: it ran out.
  static Result<MovingShapes> create(std::span<const MovingMesh> meshes);
  MovingShapes(MovingShapes&&) noexcept;
  MovingShapes& operator=(MovingShapes&&) noexcept;
  ~MovingShapes();

  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] std::size_t bytes() const;

  // Of the runtime's own use. [shape < count()]
  [[nodiscard]] const MovingShape& shape(std::uint32_t index) const;
  // Likewise: another number for all shapes of the program that create() has made, never 0.
  [[nodiscard]] std::uint64_t id() const;

 private:
  struct State;
  explicit MovingShapes(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relume
