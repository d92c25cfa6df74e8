// SPDX-License-Identifier: MIT
// The command line of relume-view.
#pragma once

#include "relume/result.h"
#include "runtime/shared/bands.h"
#include "tools/base/scene_options.h"
#include "tools/render/drive_scene.h"
#include "tools/render/live_level.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace relume {

inline constexpr std::array<const char*, 9> kViewNames{"full",   "direct", "links", "glossy",   "albedo",
                                                       "normal", "texels", "grid",  "occlusion"};  // as ViewMode
inline constexpr std::array<const char*, 5> kOverlayNames{"surfels", "clusters", "caches", "links", "lightmap"};

struct ViewerOptions {
  std::string scene, bake, camera;
  std::vector<std::string> lights{"all"};  // as `relume render`
  std::string lightsFile;                  // as `relume render`; empty: none
  std::string skyMap;                      // likewise
  float skyRotationDeg = 0.0f;             // [-360..360] of the map
  SceneOptions sceneOptions;
  std::vector<DrivenMaterial> driven;    // --emission, as `relume render`
  std::vector<std::string> drivenFiles;  // that it names
  bool draft = false;                    // without a bake: make one at preset draft
  LiveLevelOptions live;                 // else
  bool choosesLiveBackend = true;        // live.backend is to be the faster one of where the window draws
  bool edit = false;                     // static objects of a baked level can be moved
  bool allowStale = false;               // show a bake that is not of this scene
  std::uint32_t width = 1280, height = 720;
  std::uint32_t shadowSize = 2048;
  std::uint32_t headlessFrames = 0;   // > 0: no window, this many frames with a moving light
  std::string moving;                 // that light; empty: the first that is on and has a position
  std::string output;                 // folder of the headless frames, or of the window's pictures
  bool force = false;                 // frames may replace files that are no PNG images
  Bands bands;                        // zeros: as the bake recommends
  std::optional<float> exposure;      // [stops]; nothing: of the first headless frame, 0 in a window
  float reflectance = 0.0f;           // [0..1] of all surfaces
  float roughness = 0.6f;             // [0..1] likewise
  bool cones = false;                 // what surfaces mirror by cones through voxels
  bool records = false;               // light over links by records of the view
  std::string view = "full";          // a name of kViewNames
  std::vector<std::string> overlays;  // of kOverlayNames
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();  // of the program
  bool exitNow = false;                                                            // --help or --version were printed

  // Whether the level of the command line is lit without a bake.
  bool isLive() const { return bake.empty() && !draft; }
};

// usage: unknown options, values out of their ranges.
Result<ViewerOptions> parseViewerOptions(int argc, char** argv);

}  // namespace relume
