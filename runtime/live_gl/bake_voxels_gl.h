// SPDX-License-Identifier: MIT
// A voxel volume lit by a bake, in OpenGL 4.3: the pass of SurfelVoxels (runtime/cones/surfel_voxels.h), which a test
// compares. Light stays on the GPU, from the relighter's nodes to the texture that cones read (lit_sides.h).
//
// Frames make no OpenGL object unless the volume has changed. Bindings that a call uses are put back
// (runtime/gl/saved_state.h). The context that was current in create() is current in every other call, and when it
// dies.
#pragma once

#include "relume/lights.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/cones/surfel_voxels.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

namespace gl {
class LitSides;
}

struct BakeVoxelsGlOptions {
  int lumaBands = 4, chromaBands = 2;  // of the relighter
  GetProcAddress getProcAddress;       // of the context that is current
  // As RelightOptions has it: shadows on sides that have no surfels. Empty = none.
  std::string visibilityGlsl;
};

class BakeVoxelsGl {
 public:
  // usage: getProcAddress is empty; unsupported: no OpenGL 4.3; failed: a shader's log.
  static Result<BakeVoxelsGl> create(const BakeVoxelsGlOptions& options);
  BakeVoxelsGl(BakeVoxelsGl&&) noexcept;
  BakeVoxelsGl& operator=(BakeVoxelsGl&&) noexcept;
  ~BakeVoxelsGl();

  // A frame, as SurfelVoxels::light(). surfels: of the same volume and the relighter's bake, as in the call before
  // unless the standing parts have changed. inputs: of a GL relighter, in the light of its last frame. usage: the
  // volume has been edited since `surfels` were found, inputs of none, lights that Relighter::check() refuses,
  // emissionScale outside of 0 to 1e9; unsupported: more voxels than OpenGL's buffers hold; memory. What is refused
  // leaves last frame's light.
  [[nodiscard]] Status light(const VoxelVolume& volume, const SurfelVoxels& surfels, const GlResolveInputs& inputs,
                             std::span<const Light> lights, const glm::vec3& emissionScale);

  // With the texture of their radiance: ConesGl::fill().
  const gl::LitSides& sides() const;
  // The program whose uniforms visibilityGlsl reads.
  std::uint32_t directProgram() const;
  // Radiance [W/m²/sr] of the sides, read back.
  std::vector<glm::vec3> radiance() const;
  // Of the last frame that the GPU has finished.
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  struct State;
  explicit BakeVoxelsGl(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relume
