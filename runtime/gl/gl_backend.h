// SPDX-License-Identifier: MIT
// The OpenGL backend: steps 2 to 5 in order, and the only place with barriers.
#pragma once

#include "runtime/gl/passes.h"
#include "runtime/gl/timer.h"
#include "runtime/relighter.h"

#include <memory>
#include <string>

namespace relume::gl {

class GlBackend {
 public:
  // The bake must pass checkBake() and outlive this; a context must be current, here and in every other call.
  // unsupported: no OpenGL 4.3 core, buffers too large; failed: a shader's log. renderer: the name of the driver that
  // work groups are to suit; null = the one that runs here.
  static Result<std::unique_ptr<GlBackend>> create(const Bake& bake, int lumaBands, int chromaBands,
                                                   std::string_view visibilityGlsl, float deringing = 0.0f,
                                                   const char* renderer = nullptr);

  // One frame. `setup` must pass checkSetup().
  void relight(const LightSetup& setup);
  void reset();

  // [W/m²/sr] as cpu::CacheLight lays them out; read back once a frame.
  std::span<const float> coefficients() const;
  std::vector<glm::vec3> nodeRadiosity() const;  // [W/m²]
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const { return gpu_.bufferSizes(); }
  GlResolveInputs resolveInputs() const;
  std::string resolveGlsl() const { return resolveGlsl_; }
  void bindResolveInputs() const { bindResolve(gpu_); }
  GLuint surfelProgram() const { return surfels_.program(); }

 private:
  GlBackend(const Bake& bake, int lumaBands, int chromaBands) : bake_(bake), luma_(lumaBands), chroma_(chromaBands) {}

  const Bake& bake_;
  int luma_, chroma_;
  GpuBake gpu_;
  BouncePass bounce_;
  SurfelPass surfels_;
  PullPass pull_;
  CachePass caches_;
  std::string resolveGlsl_;
  bool lit_ = false;  // whether the caches hold a frame
  mutable FrameTimer<3> timer_;
  mutable std::vector<float> coefficients_;  // read back
  mutable bool readBack_ = false;            // whether coefficients_ are this frame's
};

}  // namespace relume::gl
