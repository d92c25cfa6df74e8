// SPDX-License-Identifier: MIT
// What `relume render` draws, independent of the backend: the request, the pixel sums that a backend returns, and the
// images that are made of them.
#pragma once

#include "bake/scene/camera_rays.h"
#include "bake/scene/sky.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/cones/radiance_mips.h"
#include "runtime/live/rsm_light.h"
#include "runtime/shared/bands.h"
#include "tools/render/drive_scene.h"
#include "tools/render/scene_bounds.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// An image that can be asked for. Irradiance layers are divided by pi and carry no albedo: where several surfaces share
// a pixel they are the albedo-weighted mean, and zero where a channel's albedo is zero.
enum class Aov {
  indirect,   // irradiance / pi by links: reflected light, and what emitters and sky send
  bounced,    // indirect less what comes straight from emitters and sky: light reflected at least once
  direct,     // irradiance / pi by punctual lights
  glossy,     // mean radiance by links in lobes about the reflected directions, without reflectance; with materials'
              // gloss what surfaces mirror, with it, highlights of punctual lights included
  full,       // radiance toward the camera: (direct + indirect) albedo + emission, and materials' gloss
  unbounced,  // full less bounced times albedo: what the level would look like if nothing reflected light twice
  albedo,
  normal,
  position,
  depth,      // normal toward the viewer, position [m] and depth [m, along the viewing axis] at
              // the pixel's centre; zero where nothing is hit
  occlusion,  // how open the surroundings of what is seen are, of RenderRequest::live: 1 where nothing hides them
  voxels,     // radiance of the lit voxel that the camera sees at the pixel's centre, of RenderRequest::live
  records,    // of previews alone: 1 at the pixels that have a record, else 0
  weight,     // likewise: the sum of the records' weights at the pixel's centre
};

// Every name of Aov, in its order.
const std::vector<std::string>& aovNames();
// Whether it shows light that arrives over links, or without a bake live.
bool needsBake(Aov aov);

// Light without a bake as CRC prints it (runtime/live/rsm_light.h). The request's bounces take the place of the
// options'. Cones see voxels that the same maps light (runtime/cones/rsm_voxels.h): light that is reflected once.
struct RsmRequest {
  RsmOptions options;
  std::uint32_t side = 0;                  // [16..2048] texels along a map's side; 0 = 256, 512 where voxels are lit
  std::uint32_t frames = 64;               // [1..1024] of other samples, averaged
  float presence = 1.0f, bleeding = 1.0f;  // [0..100]
};

// Light without a bake (runtime/live/live_caches.h).
struct LiveRequest {
  std::uint32_t cells = 32;                                             // [8..64] of the volume's longest side
  std::uint32_t rays = 64;                                              // [8..4096] of a cell in each frame
  RadianceMips::Directions directions = RadianceMips::Directions::six;  // of what cones read
  std::optional<RsmRequest> rsm{};                                      // in place of rays through lit voxels
  std::optional<SceneBounds> box{};                                     // that is voxelised; empty = the scene's
  bool roams = false;                                                   // the box: more of the level lies beyond it
  bool lit = true;             // false: what is wanted does not depend on light, so the voxels stay dark
  std::uint32_t cascades = 1;  // [1..4] volumes in one another about the camera
};

struct EditedLevel;

struct RenderRequest {
  const Bake* bake = nullptr;           // null: no light over links
  std::optional<LiveRequest> live;      // in place of a bake; beside one, voxels that it lights: gloss by cones
  const EditedLevel* edited = nullptr;  // what was edited since the bake: live light says what has changed there
  Camera camera;
  std::vector<SceneLight> lights;      // the punctual lights that are on
  bool emissive = false;               // emitting surfaces are on
  std::vector<DrivenMaterial> driven;  // that emit something else, and are on; driveScene() of the scene as well
  Sky sky;
  int bounces = 0;                             // [0..] frames from reset: light reflected so many times; 0 = converged
  std::uint32_t width = 320, height = 180;     // [1..16384]
  std::uint32_t samples = 4;                   // [1..16] sub-pixels along a side, box filter
  std::uint32_t shadowSize = 2048;             // [64..8192] texels a side of a shadow map (GL)
  Bands bands;                                 // as RelightOptions
  const MovingShapes* movingShapes = nullptr;  // what of movingParts, which shadow and reflect light over links
  std::vector<MovingPart> movingParts;
  bool straight = false;                        // bounced or unbounced is wanted
  std::optional<float> exponent;                // [0..kMaxExponent] of all surfaces' lobes: glossy is wanted
  GridLookup gridLookup = GridLookup::stencil;  // how the grid is read for irradiance
  bool gloss = false;                           // surfaces mirror as their materials say (relume/glossy.h)
  bool centres = false;                         // normal, position or depth is wanted
  std::optional<float> occlusionFalloff;        // [1/m] [0..1e6] occlusion is wanted; `live` holds
  bool voxels = false;                          // the volume's voxels are wanted; `live` holds

  // Whether surfaces that emit are drawn as such.
  bool drawsEmission() const { return emissive || !driven.empty(); }
  // Whether light in lobes is drawn.
  bool drawsGlossy() const { return exponent || gloss; }
  // Whether cones are followed through the volume.
  bool drawsCones() const { return live && (drawsGlossy() || occlusionFalloff); }
};

// Pixel means, row 0 on top, [Size width * height]. Radiances are with albedo.
struct RenderedFrame {
  std::uint32_t width = 0, height = 0;
  std::vector<glm::vec3> albedo, emission;  // emission: surfaces that are on, and the sky where nothing is hit
  std::vector<glm::vec3> direct, indirect, straight;  // [W/m²/sr] reflected light by kind of arrival; straight: the
                                                      // part of indirect that comes unreflected from emitters and sky
  bool mirrors = false;                               // glossy is part of what the camera sees: RenderRequest::gloss
  std::vector<glm::vec3> glossy;            // [W/m²/sr] without reflectance unless `mirrors`; empty unless asked for
  std::vector<glm::vec3> normal, position;  // at pixel centres; empty unless asked for
  std::vector<float> depth;
  std::vector<float> open;             // empty unless asked for: RenderRequest::occlusionFalloff
  std::vector<glm::vec3> voxels;       // [W/m²/sr] at pixel centres; empty unless asked for
  std::vector<float> records, weight;  // empty but for previews
  int frames = 0;                      // relight frames run
  std::vector<PassTime> passTimes;     // of the last relight frame
  std::vector<std::pair<std::string, std::size_t>> bufferBytes;
  std::string renderer;  // "cpu", or GL_RENDERER
  std::string bands;     // that were lit, by name; empty without a bake

  // Black, with the layers that are asked for.
  void resize(const RenderRequest& request);
};

// The image of one layer. [Size width * height]
std::vector<glm::vec3> composeAov(const RenderedFrame& frame, Aov aov);

// The runtime light with the fields of a scene light.
Light toRuntimeLight(const SceneLight& light);
std::vector<Light> toRuntimeLights(const std::vector<SceneLight>& lights);

// The light a request asks for, after the frames it asks for; and the frame of unreflected emission and sky that
// `bounced` subtracts. Both empty without a bake.
struct Relit {
  std::optional<Relighter> all, straight;
  int frames = 0;
};
// `prepare` is called on each new relighter before its first frame: the GL backend sets its shadow maps there. Errors
// of the relighter: the bake, or a light that it refuses.
Result<Relit> relightRequest(const RenderRequest& request, const RelightOptions& options, const Visibility& visibility,
                             const std::function<void(const Relighter&)>& prepare);

}  // namespace relume
