// SPDX-License-Identifier: MIT
// What the viewer draws, in a window or without: one frame of shadow maps, relighting, the level and its overlays into
// whatever framebuffer is bound. A level without a bake has live light in place of the relighter's, and no overlays.
// Needs a current OpenGL 4.3 context for its lifetime.
#pragma once

#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/shared/bands.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/shadow_maps.h"
#include "tools/view/backdrop.h"
#include "tools/view/bake_on_gpu.h"
#include "tools/view/cpu_light.h"
#include "tools/view/edit_shading.h"
#include "tools/view/level_parts.h"
#include "tools/view/live_shading.h"
#include "tools/view/loaded_level.h"
#include "tools/view/overlays.h"
#include "tools/view/shading.h"
#include "tools/view/view_cones.h"
#include "tools/view/view_records.h"
#include "tools/view/view_state.h"

#include <glm/geometric.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {

class Viewer {
 public:
  // Errors of the level, the relighter and the shaders. `level` must outlive the viewer. state: its sky map, choice of
  // relighter and emitters' images. getProcAddress: of whatever made the context. previous: a viewer of an older bake
  // of the level, whose light the first frame begins with where both have a grid; null = none.
  static Result<Viewer> create(const LoadedLevel& level, std::uint32_t shadowSize, const ViewState& state,
                               const GetProcAddress& getProcAddress, const Viewer* previous = nullptr);

  // Relight by other bands or another backend, beginning with the light that there is. On an error nothing changes.
  // Without a bake it does nothing.
  Status choose(const RelightChoice& choice);
  const RelightChoice& relightBy() const { return choice_; }

  // Get ready for ViewState::records, without which draw() takes no notice of it. Errors of ViewRecords; unsupported:
  // there is no bake.
  Status makeRecords();
  const ViewRecords* records() const { return records_.get(); }  // null until then
  // Whether they are found and shown: they are of the level as it was baked, and wait while static objects stand
  // elsewhere.
  bool showsRecords(const ViewState& state) const { return state.records && records_ && editedObjects(state) == 0; }

  // Draw into `framebuffer`. `encode`: the target takes what a screen shows, sRGB behind a
  // soft shoulder, else linear light, as `relume render` has it. Where the relighter refuses the
  // lights, its error comes back and the level is drawn in last frame's light.
  Status draw(const ViewState& state, GLuint framebuffer, std::uint32_t width, std::uint32_t height, bool encode);

  // What a camera sees in a target of that aspect; its planes enclose the level.
  LevelView viewOf(const FlyCamera& camera, float aspect) const;

  // Diagonal of the level's box [m].
  float levelSize() const { return glm::length(level_.boundsMax() - level_.boundsMin()); }

  // What the framebuffer that is bound shows at a pixel, after draw() [m]; nothing for the sky. Row 0 is on top.
  std::optional<glm::vec3> surfaceAt(const ViewState& state, const glm::vec2& pixel, std::uint32_t width,
                                     std::uint32_t height) const;

  // [m] To the surface in the middle of what the camera sees; nothing for the sky. Leaves the default framebuffer
  // bound.
  std::optional<float> distanceAhead(const ViewState& state) const;

  // Irradiance / pi [W/m²/sr] in the last frame's light at each pixel, row 0 on top, 0 where nothing is hit. Leaves the
  // default framebuffer bound. failed: a shader did not compile. [Size width * height]
  Result<std::vector<glm::vec3>> irradiance(const ViewState& state, std::uint32_t width, std::uint32_t height);

  // Milliseconds of the last frame: wall clock for the host's passes, the relighter's own for its passes.
  const std::vector<std::pair<std::string, double>>& times() const { return times_; }
  // What is held for light: name and bytes of each buffer.
  std::vector<std::pair<std::string, std::size_t>> memory() const;
  // What lights a level without a bake; null where there is one.
  LiveShading* live() { return live_ ? &*live_ : nullptr; }
  const LiveShading* live() const { return live_ ? &*live_ : nullptr; }
  // What lights with a bake: of the backend that was chosen. [live() is null]
  Relighter& relighter() { return cpu_ ? cpu_->relighter() : *gl_; }
  const Relighter& relighter() const { return cpu_ ? cpu_->relighter() : *gl_; }
  // Whether voxels that cones of this view go through are still being found.
  bool awaitsVoxels(const ViewState& state) const {
    return shadingKind(state, false, true).cones && (live_ ? live_->awaitsVoxels() : voxels_ && voxels_->isComing());
  }
  // Static objects of a baked level that stand elsewhere than in the bake; and whether light near them is still coming.
  std::size_t editedObjects(const ViewState& state) const { return edits_ ? edits_->edited(state) : 0; }
  bool awaitsEdits() const { return edits_ && !edits_->isSettled(); }
  // Whether what moves can shadow and reflect its light over links.
  bool hasMovingParts() const { return parts_.count() > 0; }
  // The bands it lights with, as "Y4Co2Cg2".
  std::string bands() const { return live_ ? "Y3Co3Cg3" : bandsName({gl_->lumaBands(), gl_->chromaBands()}); }

 private:
  Viewer(const LoadedLevel& level, GlLevel drawn, ShadowMaps shadows)
      : loaded_(&level), bake_(&level.bake), level_(std::move(drawn)), shadows_(std::move(shadows)) {}
  Status build(const RelightChoice& choice, const Relighter* previous);
  Status relight(const ViewState& state, const std::vector<Light>& lights, const std::vector<glm::mat4>& moved);
  Status lightVoxels(const ViewState& state, const std::vector<Light>& lights, const std::vector<glm::mat4>& moved);
  Status followCones(const ViewState& state, const std::vector<glm::mat4>& moved, const LevelView& view,
                     std::uint32_t width, std::uint32_t height);
  void setEmissions(const ViewState& state);
  void drawDepths(const std::vector<glm::mat4>& moved, const LevelView& view) const;
  // hasCones: they have been followed for this view.
  Status drawLevel(const ViewState& state, const std::vector<Light>& lights, const std::vector<glm::mat4>& moved,
                   const LevelView& view, bool encode, bool hasCones);

  const LoadedLevel* loaded_;
  const Bake* bake_;
  GlLevel level_;
  ShadowMaps shadows_;
  RelightOptions options_;           // of the GL relighter
  std::optional<LiveShading> live_;  // one of this and gl_ from create() on
  std::optional<Relighter> gl_;      // draws by what it holds
  std::optional<CpuLight> cpu_;      // that fills it, where the CPU was chosen
  LevelParts parts_;                 // of a level with a bake
  RelightChoice choice_;
  std::vector<std::size_t> dynamic_;  // of the objects, those that no bake knows
  std::optional<EditShading> edits_;  // of a level with a bake whose static objects move
  std::optional<std::pair<std::vector<Light>, std::vector<glm::mat4>>> shadowed_;  // what the shadow maps are of
  GlProgram depthProgram_;
  Shading shading_;        // of gl_, or of live light
  ShadingKind shownKind_;  // of the last view that was drawn
  std::optional<Overlays> overlays_;
  std::optional<Backdrop> backdrop_;
  std::unique_ptr<ViewRecords> records_;
  std::unique_ptr<BakeOnGpu> voxels_;     // of a level with a bake, since cones were first asked for
  std::unique_ptr<ViewCones> cones_;      // of the last view that showed what they find
  std::vector<glm::vec3> skyPatches_;     // of the map, as it was turned when it was last drawn
  std::optional<float> patchesRotation_;  // [deg]
  std::vector<std::pair<std::string, double>> times_;
};

}  // namespace relume
