// SPDX-License-Identifier: MIT
// What cones through voxels find in OpenGL for the view of a level, lit by its bake (bake_on_gpu.h) or without one, by
// OpenGL or by the CPU (live_shading.h): what surfaces mirror, or how open their surroundings are
// (runtime/live_gl/cones_gl.h). Pictures of the view's size that the level is shaded by.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/live_gl/cones_gl.h"
#include "tools/gl_scene/draw_targets.h"
#include "tools/gl_scene/gl_handle.h"
#include "tools/view/view_state.h"

#include <glm/mat4x4.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// A view that they are followed for.
struct ConeView {
  std::uint32_t width = 0, height = 0;
  glm::mat4 clipFromWorld{1.0f};
  std::uint64_t lit = 0;                 // the number of the light's frame
  std::function<void(bool gloss)> draw;  // the level by the program that is in use; gloss: with normal maps
};

class ViewCones {
 public:
  // occlusion: what is looked for, in place of what surfaces mirror. Errors of ConesGl and of the shaders.
  static Result<std::unique_ptr<ViewCones>> create(bool occlusion, const GetProcAddress& getProcAddress);
  bool isOfOcclusion() const { return occlusion_; }

  // A frame. volumes, lit: as ConesGl::fill() has them. Changes framebuffer, viewport, program and textures. Errors of
  // ConesGl.
  Status update(const ViewState& state, VolumeRange volumes, std::span<const gl::LitSides* const> lit,
                const ConeView& view);

  // What a shader reads, after `const bool viewCones`:
  //   vec3 coneGlossy()   mirrored radiance [W/m²/sr] at this fragment, by the lobe of update()'s state
  //   float coneOpen()    [0..1] how open its surroundings are
  static std::string glsl();
  void bind() const;

  std::vector<PassTime> passTimes() const { return cones_.passTimes(); }
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const { return cones_.bufferSizes(); }

 private:
  ViewCones(bool occlusion, ConesGl cones) : occlusion_(occlusion), cones_(std::move(cones)) {}
  Result<GLuint> program(bool gloss);

  bool occlusion_;
  ConesGl cones_;
  std::array<GlProgram, 2> programs_;  // of surfaces without materials' gloss, and with it
  std::array<bool, 2> isMade_{};
  DrawTargets surfaces_;   // places, planes, normals, mirrored directions
  std::uint64_t lit_ = 0;  // that the voxels are of, 0 = none
};

}  // namespace relume
