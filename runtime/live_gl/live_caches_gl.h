// SPDX-License-Identifier: MIT
// Light without a bake in OpenGL 4.3: the passes of LiveCaches and NestedCaches (runtime/live), each of which a test
// compares with its twin there. Voxels and their sides are found on the CPU (runtime/voxels/voxel_volume.h; their bits
// alone in OpenGL as well: voxels_gl.h); from then on light stays on the GPU:
//
//   lightDirectly()  direct light of each side, shadows by the host's GLSL; or copyDirect(): as the CPU found it
//   update()         radiance of all sides with last frame's bounces, and all caches gathered anew
//   glsl(), bind()   light at a place for a shader of the host's
//
// Frames make no OpenGL object unless the volume has changed. Bindings that a call uses are put back
// (runtime/gl/saved_state.h). The context that was current in create() is current in every other call, and when it
// dies.
#pragma once

#include "relume/lights.h"
#include "relume/live_light.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/live/live_frame.h"
#include "runtime/live_gl/volume_range.h"
#include "runtime/passes/programs.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

namespace gl {
class LitSides;
}

struct LiveCachesGlOptions {
  LiveOptions live;
  GetProcAddress getProcAddress;  // of the context that is current
  // float relumeVisibility(uint light, vec3 positionWorld, vec3 normal), as RelightOptions has it; empty = no shadows.
  std::string visibilityGlsl;
  std::optional<gpu::GroupThreads> groups;  // what work groups are to suit; nothing = the driver
  LiveGlNames names{};                      // of glsl()
};

class LiveCachesGl {
 public:
  // Errors of checkLiveOptions() and checkLiveGlNames(); usage: getProcAddress is empty; unsupported: no OpenGL 4.3;
  // failed: a shader's log.
  static Result<LiveCachesGl> create(const LiveCachesGlOptions& options);
  LiveCachesGl(LiveCachesGl&&) noexcept;
  LiveCachesGl& operator=(LiveCachesGl&&) noexcept;
  ~LiveCachesGl();

  // Direct light of each side; to be found again whenever the volume has changed. Of the setup its lights count. usage:
  // as Relighter::check(); unsupported: more voxels than OpenGL's buffers hold, after which there is no light until a
  // volume fits; memory. What else is refused leaves last frame's light, here and below.
  [[nodiscard]] Status lightDirectly(VolumeRange volumes, const LightSetup& setup);
  // The same as VoxelVolume::lightDirectly() has found it.
  [[nodiscard]] Status copyDirect(VolumeRange volumes);
  // A frame, as NestedCaches::update(). Errors of checkLiveFrame(), and as above.
  [[nodiscard]] Status update(VolumeRange volumes, const LiveFrame& frame);
  // Where receivers read the volumes of the last frame from (setReach()), which an eye that walks changes in each
  // frame.
  void takeReach(VolumeRange volumes);
  // No light, as before the first frame.
  void reset();

  // The program whose uniforms visibilityGlsl reads.
  std::uint32_t directProgram() const;
  // Which backend is faster where these functions draw: the CPU's where software does.
  static BackendKind fasterBackend(const GetProcAddress& getProcAddress);
  // As LiveGlResolve has them.
  const std::string& glsl() const;
  [[nodiscard]] Status checkTextureUnits(std::uint32_t program) const;
  // Whether a program has had setUniforms() since it was linked, of volumes.
  bool hasUniforms(std::uint32_t program) const;
  void setUniforms(std::uint32_t program) const;
  void bind() const;

  // As NestedCaches::irradiance(). The first call after a frame reads the caches back.
  glm::vec3 irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const;

  std::uint32_t activeCells() const;
  // Read back, of one volume, as LiveCaches::coefficients() and brightest() have them. Waits for the GPU.
  std::vector<float> coefficients(std::size_t level = 0) const;
  std::vector<float> brightest(std::size_t level = 0) const;
  // Radiance [W/m²/sr] of its sides, read back.
  std::vector<glm::vec3> radiance(std::size_t level = 0) const;
  // A volume's, with the texture that has it. [level: 0 before there are any]
  const gl::LitSides& sides(std::size_t level = 0) const;
  // Of the last frame that the GPU has finished; "cells" on the CPU.
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  struct State;
  explicit LiveCachesGl(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relume
