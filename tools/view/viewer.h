// SPDX-License-Identifier: MIT
// What the viewer draws, in a window or without: one frame of shadow maps, relighting, the level and its overlays into
// whatever framebuffer is bound. Needs a current OpenGL 4.3 context for its lifetime.
#pragma once

#include "bake/scene/sky.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/shared/bands.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/shadow_maps.h"
#include "tools/view/backdrop.h"
#include "tools/view/discs.h"
#include "tools/view/fly_camera.h"
#include "tools/view/options.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// A light of the scene as it stands now.
struct ViewedLight {
  std::string name;
  Light light;
  bool on = true;
  float stops = 0.0f;   // its intensity is multiplied by 2^stops
  bool orbits = false;  // circles around its home
  glm::vec3 home{0.0f};
};

// A dynamic node of the scene as it stands now.
struct ViewedObject {
  std::string name;
  glm::vec3 home{0.0f};      // [m] centre of its bounds, where the level has it
  glm::vec3 position{0.0f};  // [m] and where it is
};

enum class ViewMode : int { full, direct, links, glossy, albedo, normal };
inline constexpr const char* kViewModeNames[] = {"all light",    "direct light", "light over links",
                                                 "glossy light", "albedo",       "normals"};

// Everything that may change between frames.
struct ViewState {
  FlyCamera camera;
  std::vector<ViewedLight> lights;
  float emission = 1.0f;  // factor on emitting surfaces
  Sky sky;                // its map, where it has one, is the one that the viewer was made with
  float bounceScale = 1.0f;
  ViewMode mode = ViewMode::full;
  float reflectance = 0.0f;  // [0..1] of all surfaces: share of light that they mirror in lobes
  float roughness = 0.6f;    // [0..1] that sets the lobes' exponent
  float exposure = 0.0f;     // [stops]
  bool surfels = false, caches = false, lightmap = false;
  bool relight = true;  // false freezes the light over links
  std::vector<ViewedObject> objects;
  bool panel = true;  // whether the panel is shown
};

class Viewer {
 public:
  // Errors of the level, the relighter and the shaders. `scene` and `bake` must outlive the viewer. getProcAddress: of
  // whatever made the context. skyMap: null = none.
  static Result<Viewer> create(const Scene& scene, const Bake& bake, const ViewerOptions& options, const SkyMap* skyMap,
                               const GetProcAddress& getProcAddress);

  // Draw into `framebuffer`. `encode`: the target takes sRGB numbers, else linear ones.
  Status draw(const ViewState& state, GLuint framebuffer, std::uint32_t width, std::uint32_t height, bool encode);

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

// The state a scene starts with, as the command line has it. A level without a camera is framed, as `relume render`
// does. usage: a camera or light the scene does not know.
Result<ViewState> initialState(const Scene& scene, const ViewerOptions& options);

// Move the lights that orbit to where they are at `seconds`.
void animate(ViewState& state, double seconds);

}  // namespace relume
