// SPDX-License-Identifier: MIT
// Everything of the viewer that may change between frames: camera, lights, objects, sky, what is shown. Plain data; the
// panel, the light handles and the command line write it, Viewer reads it.
#pragma once

#include "bake/scene/sky.h"
#include "relume/bake/scene.h"
#include "relume/lights.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/shared/bands.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/render/drive_scene.h"
#include "tools/render/live_level.h"
#include "tools/view/fly_camera.h"
#include "tools/view/options.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace relume {

// A light of the scene, of a file or of the window's own as it stands now.
struct ViewedLight {
  std::string name;
  Light light;  // of a directional one the position says where it is drawn
  bool on = true;
  bool orbits = false;   // circles around its home
  glm::vec3 home{0.0f};  // [m]
  std::size_t id = 0;    // of no other light of the window, now or before (LightEditor::giveIds()); 0 = none yet

  // Whether it is the same to somebody who edits lights: neither its id nor where an orbit has taken it counts.
  bool operator==(const ViewedLight& other) const;
};

// A node of the scene that can be moved, as it stands now.
struct ViewedObject {
  std::string name;
  glm::vec3 home{0.0f};      // [m] centre of its bounds, where the level has it
  glm::vec3 position{0.0f};  // [m] and where it is
};

// A material whose light a frame may replace, as it stands now.
struct ViewedEmitter {
  std::string name;
  bool isDriven = false;     // else it emits what the level has
  glm::vec3 radiance{1.0f};  // [W/m²/sr] while it is driven; of one with an image a factor on it
  std::uint32_t width = 0, height = 0;
  std::vector<glm::vec3> image;  // [W/m²/sr] [Size width * height] of --emission MATERIAL=FILE; empty = none
};

// How light over links is made. Zero bands: as the bake recommends.
struct RelightChoice {
  Bands bands;
  BackendKind backend = BackendKind::gl;
  bool operator==(const RelightChoice& other) const {
    return bands.luma == other.bands.luma && bands.chroma == other.bands.chroma && backend == other.backend;
  }
};

enum class ViewMode : int {
  full,
  direct,
  links,
  glossy,
  albedo,
  normal,
  texels,
  grid,
  occlusion,
  irradiance
};  // the last for reading back
inline constexpr const char* kViewModeNames[] = {"all light", "direct light", "light over links",   "glossy light",
                                                 "albedo",    "normals",      "light map's texels", "light of the grid",
                                                 "occlusion"};

// Whether what is shown is light, which an exposure scales, and not a property of surfaces.
constexpr bool showsLight(ViewMode mode) {
  return mode != ViewMode::albedo && mode != ViewMode::normal && mode != ViewMode::texels &&
         mode != ViewMode::occlusion;
}

enum class Overlay : std::size_t { surfels, clusters, caches, links, lightmap };  // as kOverlayNames
inline constexpr const char* kOverlayTexts[] = {"surfels", "hierarchy", "caches", "links of a point", "light map"};

inline constexpr int kMaxBounces = 8;

// Everything that may change between frames.
struct ViewState {
  FlyCamera camera;
  std::vector<ViewedLight> lights;
  float emission = 1.0f;  // factor on emitting surfaces
  Sky sky;                // its map, where it has one, is the one that the viewer was made with
  std::vector<ViewedEmitter> emitters;
  RelightChoice relightBy;
  LiveLevelOptions live;  // of a level without a bake
  float bounceScale = 1.0f;
  int bounces =
      0;  // [0..kMaxBounces] light is reflected so often, from reset in each frame; 0 = one more in each frame
  bool direct = true, indirect = true;  // what of the light is shown
  bool records = false;  // light over links is gathered for the view, where it stands still for long enough
  ViewMode mode = ViewMode::full;
  bool gloss = false;        // surfaces mirror as their materials say, and not as the next two do
  bool cones = false;        // cones find what surfaces mirror
  float reflectance = 0.0f;  // [0..1] of all surfaces: share of light that they mirror in lobes
  float roughness = 0.6f;    // [0..1] that sets the lobes' exponent
  float exposure = 0.0f;     // [stops]
  std::array<bool, kOverlayNames.size()> overlays{};
  bool shows(Overlay overlay) const { return overlays[static_cast<std::size_t>(overlay)]; }
  int clusterLevel = 6;             // [0..] of the hierarchy, of Overlay::clusters
  std::optional<glm::vec3> picked;  // [m] point of Overlay::links; nothing: the middle of the view
  bool relight = true;              // false freezes the light over links
  // [s] > 0: without a bake each frame waits for light of its own, so long after the one before; with one for voxels
  double liveStep = 0.0;
  std::vector<ViewedObject> objects;
  bool movingParts = true;  // with a bake: objects shadow and reflect light over links
  bool coarse = true;       // frames have fewer pixels while what is seen moves, where whole ones take long
  bool panel = true;        // whether the panel is shown
  bool handles = true;      // and the lights' icons and gizmos
};

// The state a scene starts with, as the command line has it. A level without a camera is framed, as `relume render`
// does. usage: a camera or light the scene does not know.
Result<ViewState> initialState(const Scene& scene, const ViewerOptions& options);

// That --camera is the name of several cameras, or that the one which it starts with is not shown as the level has it;
// nothing where neither is so.
std::optional<std::string> cameraWarning(const Scene& scene, const ViewerOptions& options);

// The lights of a level; those that --lights names are on.
std::vector<ViewedLight> lightsOf(const Scene& scene, const std::vector<std::string>& on);

// Its drivable materials, of which those of `driven` are driven.
std::vector<ViewedEmitter> emittersOf(const Scene& scene, const std::vector<DrivenMaterial>& driven);

// The nodes of a level that can be moved, where it has them.
std::vector<ViewedObject> objectsOf(const Scene& scene, Movable movable);

// How far each has been moved, as GlLevel::drawDynamic() wants it.
std::vector<glm::mat4> movesOf(const ViewState& state);

// The lights that are on.
std::vector<Light> activeLights(const ViewState& state);

// Move the lights that orbit to where they are at `seconds`, in a level of that diagonal [m].
void animate(ViewState& state, double seconds, float levelSize);

}  // namespace relume
