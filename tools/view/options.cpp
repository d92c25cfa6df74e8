// SPDX-License-Identifier: MIT
// See options.h.
#include "tools/view/options.h"

#include "tools/base/number_check.h"
#include "tools/base/option_rules.h"
#include "tools/base/usage_message.h"
#include "tools/pages/write_pages.h"
#include "tools/render/exposure.h"
#include "tools/render/view_options.h"

#include <CLI/CLI.hpp>

#include <charconv>
#include <iostream>
#include <string_view>
#include <utility>

namespace relume {
namespace {

bool parseSize(const std::string& text, std::uint32_t& width, std::uint32_t& height) {
  const char* end = text.data() + text.size();
  const auto x = std::from_chars(text.data(), end, width);
  if (x.ec != std::errc() || x.ptr == end || *x.ptr != 'x') return false;
  const auto y = std::from_chars(x.ptr + 1, end, height);
  return y.ec == std::errc() && y.ptr == end && width >= 16 && width <= 8192 && height >= 16 && height <= 8192;
}

}  // namespace

Result<ViewerOptions> parseViewerOptions(int argc, char** argv) {
  ViewerOptions o;
  std::string size = "1280x720", bands, liveBackend = "auto", exposure = "auto";
  std::vector<std::string> emissions;
  CLI::App app{"Fly through a level, move its lights, look at what the relighter does", "relume-view"};
  app.set_version_flag("--version", RELUME_VERSION);
  app.footer("Exit status: 0 ok, 1 usage, 2 input/output, 3 invalid file, 4 failed, 5 unsupported.");
  app.add_option("SCENE", o.scene,
                 "glTF scene (.glb, .gltf) the bake was made from; others can be dropped on the window")
      ->type_name("FILE")
      ->required();
  app.add_option(
         "--bake", o.bake,
         "bake of that scene (.relume), loaded again whenever the file changes; default: none, light comes from "
         "caches in a grid of voxels, coarser and at once")
      ->type_name("FILE");
  app.add_flag(
      "--draft", o.draft,
      "without --bake: bake the scene at preset draft, in memory alone; so do --bands, --records, --overlay and "
      "--view texels or grid, which show a bake");
  app.add_flag("--edit", o.edit,
               "with a bake: let its static objects be moved as well; round about them light without a bake says what "
               "that does, until the level is baked again");
  app.add_option("--live-cells", o.live.cells,
                 "cells on a level's longest side: of its light without a bake, of the voxels of --cones")
      ->check(CLI::Range(kMinCells, kMaxCells))
      ->capture_default_str();
  app.add_option("--live-backend", liveBackend,
                 "what lights a level without a bake: cpu, gl (shadows by shadow maps, frames on the GPU), or auto, gl "
                 "where hardware draws")
      ->check(CLI::IsMember({"auto", "cpu", "gl"}))
      ->capture_default_str();
  app.add_option("--live-cascades", o.live.cascades,
                 "volumes in one another about the eye that light a level without a bake, each with cells half as "
                 "large as the one around it")
      ->check(CLI::Range(1u, kMaxCascades))
      ->capture_default_str();
  app.add_option("--live-rays", o.live.rays, "rays that a cell gathers by in each frame")
      ->check(CLI::Range(8, 4096))
      ->capture_default_str();
  app.add_option("--camera", o.camera,
                 "camera to start from; default: the scene's first, or one that frames the level when it has none");
  app.add_option("--lights", o.lights,
                 "lights that are on at the start, by their nodes' names, or else their own, separated by commas; "
                 "\"emissive\", "
                 "\"all\", \"none\"")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  app.add_option("--lights-file", o.lightsFile,
                 "more lights that are on: a JSON list of {type, position, direction, color, intensity, range, "
                 "innerConeAngle, outerConeAngle}, as KHR_lights_punctual; as `relume render` reads it")
      ->type_name("FILE");
  app.add_option("--sky-map", o.skyMap,
                 "equirectangular sky, OpenEXR or Radiance HDR, in W/m²/sr, as `relume render` reads it")
      ->type_name("FILE");
  app.add_option("--sky-rotation", o.skyRotationDeg, "degrees by which the sky map is turned about +Y")
      ->check(numberFrom(-360.0, 360.0))
      ->capture_default_str();
  addEmissionOption(app, emissions);
  app.add_flag("--allow-stale", o.allowStale,
               "show a bake of another state of the scene: parts are found by name, the others read the grid; a "
               "warning says so");
  addSceneOptions(app, o.sceneOptions);
  app.add_option("--size", size, "pixels, WIDTHxHEIGHT, 16..8192 each")->capture_default_str();
  app.add_option("--bands", bands, "bands of luminance and chrominance, as Y3Co1Cg1; default: as the bake recommends");
  app.add_option("--exposure", exposure,
                 "stops by which light is brightened, -30..30, or auto: headless frames take it from the first, as "
                 "`relume render` does, a window begins with 0")
      ->capture_default_str();
  addGlossOption(app, o.sceneOptions.gloss);
  app.add_option("--reflectance", o.reflectance,
                 "share of light that all surfaces mirror; the rest they scatter; without --gloss")
      ->check(numberFrom(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--roughness", o.roughness, "how wide they mirror it; the caches' bands carry 0.6 and up")
      ->check(numberFrom(0.0, 1.0))
      ->capture_default_str();
  app.add_flag("--cones", o.cones,
               "find what surfaces mirror by cones through voxels, sharper than caches have it; OpenGL follows them, "
               "as with --view occlusion, which shows how open surroundings are");
  app.add_option("--view", o.view, "what to shade with at the start")
      ->check(CLI::IsMember(std::vector<std::string>(kViewNames.begin(), kViewNames.end())))
      ->capture_default_str();
  app.add_flag("--records", o.records,
               "gather the light over links for the view, as `relume preview` does, a few records in each frame");
  app.add_option("--overlay", o.overlays, "what to lay over it at the start, separated by commas")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(std::vector<std::string>(kOverlayNames.begin(), kOverlayNames.end())));
  app.add_option("--shadow-size", o.shadowSize, "texels along a side of a shadow map")
      ->check(CLI::Range(64, 8192))
      ->capture_default_str();
  CLI::Option* headless =
      app.add_option("--headless", o.headlessFrames, "draw so many frames without a window, a light moving")
          ->check(CLI::Range(1, 100000));
  app.add_option("--move", o.moving, "the light that moves; default: the first point or spot light that is on")
      ->needs(headless);
  CLI::Option* output =
      app.add_option("-o,--output", o.output,
                     "folder of the headless frames; of the window's screenshots and films: default .")
          ->type_name("FOLDER");
  app.add_flag("--force", o.force, "let the frames write over files that are no PNG images, or read-only")
      ->needs(headless);
  headless->needs(output);
  // The build calls this for what is installed; --help does not list it.
  if (argc == 3 && std::string_view(argv[1]) == "--pages") {
    if (const Status written = writePages(describeCommandLine(app), argv[2]); !written) return written.error();
    o.exitNow = true;
    return o;
  }
  GivenTexts given;
  applyOptionRules(app, given);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() != static_cast<int>(CLI::ExitCodes::Success))
      return Error{ErrorCode::usage, usageMessage(app, e, given)};
    app.exit(e);
    o.exitNow = true;
    return o;
  }
  if (!parseSize(size, o.width, o.height))
    return Error{ErrorCode::usage, "--size: WIDTHxHEIGHT of 16..8192 pixels each expected, \"" + size + "\" found"};
  if (o.skyRotationDeg != 0.0f && o.skyMap.empty()) return Error{ErrorCode::usage, "--sky-rotation needs --sky-map"};
  const auto stops = readExposure(exposure);
  if (!stops) return stops.error();
  o.exposure = *stops;
  o.choosesLiveBackend = liveBackend == "auto";
  o.live.backend = liveBackend == "gl" ? BackendKind::gl : BackendKind::cpu;
  if (!bands.empty()) {
    const std::optional<Bands> named = bandsByName(bands);
    if (!named) return Error{ErrorCode::usage, "--bands: a name such as Y3Co1Cg1 expected, \"" + bands + "\" found"};
    o.bands = *named;
  }
  if (o.bake.empty() && (!bands.empty() || o.records || !o.overlays.empty() || o.view == "texels" || o.view == "grid"))
    o.draft = true;
  Context context;
  auto driven = readEmissions(emissions, context);
  if (!driven) return driven.error();
  o.driven = std::move(*driven);
  o.drivenFiles = emissionFiles(emissions);
  return o;
}

}  // namespace relume
