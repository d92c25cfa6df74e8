// SPDX-License-Identifier: MIT
// What the viewer draws, in a window or without: one frame of shadow maps, relighting, the level and its overlays into
// whatever framebuffer is bound. Needs a current OpenGL 4.3 context for its lifetime.
#pragma once

#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/shared/bands.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/shadow_maps.h"
#include "tools/view/backdrop.h"
#include "tools/view/discs.h"
#include "tools/view/options.h"
#include "tools/view/view_state.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {

class Viewer {
 public:
  // Errors of the level, the relighter and the shaders. `scene` and `bake` must outlive the viewer. getProcAddress: of
  // whatever made the context. skyMap: null = none. previous: a viewer of an older bake of the level, whose light the
  // first frame begins with where both have a grid; null = none.
  static Result<Viewer> create(const Scene& scene, const Bake& bake, const ViewerOptions& options, const SkyMap* skyMap,
                               const GetProcAddress& getProcAddress, const Viewer* previous = nullptr);

  // Draw into `framebuffer`. `encode`: the target takes sRGB numbers, else linear ones. Where the relighter refuses the
  // lights, its error comes back and the level is drawn in last frame's light.
  Status draw(const ViewState& state, GLuint framebuffer, std::uint32_t width, std::uint32_t height, bool encode);

  // Clip space of a target of that aspect; its planes enclose the level.
  glm::mat4 clipFromWorld(const FlyCamera& camera, float aspect) const;

  // Milliseconds of the last frame: wall clock for the host's passes, the relighter's own for its passes.
  const std::vector<std::pair<std::string, double>>& times() const { return times_; }
  Relighter& relighter() { return relighter_; }
  // The bands it lights with, as "Y4Co2Cg2".
  std::string bands() const { return bandsName({relighter_.lumaBands(), relighter_.chromaBands()}); }

 private:
  Viewer(const Bake& bake, GlLevel level, ShadowMaps shadows, Relighter relighter)
      : bake_(&bake), level_(std::move(level)), shadows_(std::move(shadows)), relighter_(std::move(relighter)) {}
  void drawLevel(const ViewState& state, const std::vector<Light>& lights, const std::vector<glm::mat4>& moved,
                 const glm::mat4& clip, bool encode) const;
  void drawOverlays(const ViewState& state, const glm::mat4& clip, std::uint32_t width, std::uint32_t height,
                    bool encode) const;
  void drawLightmap(const ViewState& state, std::uint32_t width, std::uint32_t height, bool encode) const;
  std::vector<glm::vec3> surfelColors() const;
  std::vector<glm::vec3> cacheColors() const;

  const Bake* bake_;
  GlLevel level_;
  ShadowMaps shadows_;
  Relighter relighter_;
  GlProgram program_, lightmapProgram_;
  GlVertexArray nothing_;
  std::optional<Discs> surfels_, caches_;
  std::optional<Backdrop> backdrop_;
  std::vector<glm::vec3> skyPatches_;     // of the map, as it was turned when it was last drawn
  std::optional<float> patchesRotation_;  // [deg]
  std::vector<std::pair<std::string, double>> times_;
};

}  // namespace relume
