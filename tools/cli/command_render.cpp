// SPDX-License-Identifier: MIT
// `relume render`: relight a camera's view headlessly, with Embree and the CPU backend, or with OpenGL through EGL.
#include "bake/base/memory_budget.h"
#include "bake/rays/ray_tracer.h"
#include "bake/scene/check_triangles.h"
#include "bake/stage_memory.h"
#include "formats/limits.h"
#include "relume/bake/load_scene.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_file.h"
#include "runtime/shared/bands.h"
#include "runtime/voxels/nested_volumes.h"
#include "tools/base/number_check.h"
#include "tools/base/output_files.h"
#include "tools/base/parse_numbers.h"
#include "tools/base/printable.h"
#include "tools/base/scene_options.h"
#include "tools/base/usage_message.h"
#include "tools/cli/commands.h"
#include "tools/cli/layer_files.h"
#include "tools/cli/rsm_flags.h"
#include "tools/cli/terminal.h"
#include "tools/compare/find_edits.h"
#include "tools/compare/fit_bake.h"
#include "tools/compare/staleness.h"
#include "tools/render/exposure.h"
#include "tools/render/move_nodes.h"
#include "tools/render/moving_parts.h"
#include "tools/render/render_cpu.h"
#include "tools/render/render_frame.h"
#include "tools/render/render_pictures.h"
#include "tools/render/view_options.h"
#ifdef RELUME_RENDER_GL
#include "tools/render/render_gl.h"
#endif

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <span>

namespace relume {
namespace {

struct RenderArguments : PictureOptions {
  std::string editedFrom;  // empty = the level is as it was baked
  EditBlendOptions edit;
  std::string bounces = "converged", backend = "cpu", bands, exponent, gridLookup = "stencil", dynamic = "receivers";
  SceneOptions sceneOptions;
  std::uint32_t samples = 4, shadowSize = 2048;
  LiveRequest liveRequest;
  float falloff = kOcclusionFalloff;
  RsmFlags rsm;
  bool live = false, hasLiveOptions = false;
  std::vector<std::string> moves;
  bool allowStale = false, json = false;
  TerminalOptions terminal;
};

Result<std::vector<Aov>> chooseAovs(const RenderArguments& arguments, RenderRequest& request) {
  auto aovs = aovsByName(arguments.aovs);
  if (!aovs) return aovs.error();
  for (std::size_t i = 0; i < aovs->size(); ++i) {
    const Aov aov = (*aovs)[i];
    const std::string& name = arguments.aovs[i];
    if (needsBake(aov) && arguments.bake.empty() && !arguments.live)
      return usage("--aov " + name +
                   " needs --bake, or --live; without one there are direct, albedo, normal, position, depth");
    if ((aov == Aov::voxels || aov == Aov::occlusion) && !arguments.live)
      return usage("--aov " + name + " needs --live");
    if (aov == Aov::occlusion) request.occlusionFalloff = arguments.falloff;
    if (aov == Aov::voxels) request.voxels = true;
    if (aov == Aov::records || aov == Aov::weight)
      return usage("--aov " + name + ": `relume preview` alone has records");
    if (aov == Aov::bounced || aov == Aov::unbounced) request.straight = true;
    if (Status ok = checkGloss(aov == Aov::glossy, request.exponent.has_value(), request.gloss); !ok) return ok.error();
    if (aov == Aov::unbounced && request.gloss)
      return usage("--aov unbounced is of diffuse surfaces: leave out --gloss");
    if (aov == Aov::normal || aov == Aov::position || aov == Aov::depth) request.centres = true;
  }
  if (Status ok = checkFalloff(request.occlusionFalloff.has_value(), arguments.falloff); !ok) return ok.error();
  if (request.exponent && std::find(aovs->begin(), aovs->end(), Aov::glossy) == aovs->end())
    return usage("--exponent needs --aov glossy");
  if (request.live)
    request.live->lit =
        std::any_of(aovs->begin(), aovs->end(), [](Aov aov) { return needsBake(aov) || aov == Aov::voxels; });
  return aovs;
}

// Light without a bake: what it is not combined with.
Status checkLive(const RenderArguments& arguments, RenderRequest& request) {
  if (!arguments.live) return done();
  auto rsm = readRsm(arguments.rsm, arguments.bake.empty() ? request.bands : Bands{}, request.bounces);
  if (!rsm) return rsm.error();
  if (*rsm && arguments.backend != "cpu") return usage("--live-transport rsm runs on the CPU: --backend cpu");
  if (*rsm && !arguments.bake.empty()) return usage("--live-transport rsm lights without a bake: leave out --bake");
  if (arguments.liveRequest.cascades > 1) {
    if (!arguments.bake.empty()) return usage("--live-cascades lights without a bake: leave out --bake");
    if (*rsm) return usage("--live-cascades: --live-transport rsm lights one volume; leave out one of the two");
  }
  if (*rsm && arguments.liveRequest.rays != LiveRequest().rays)
    return usage("--live-rays: --live-transport rsm casts none; leave out one of the two");
  request.live = arguments.liveRequest;
  request.live->rsm = *rsm;
  return done();
}

// What can be checked without the scene, but for the view.
Status readOptions(const RenderArguments& arguments, RenderRequest& request) {
  if (arguments.bounces != "converged") {
    const auto bounces = wholeNumber(arguments.bounces, 1, 1000);
    if (!bounces) return usage("--bounces: 1..1000 or \"converged\" expected, \"" + arguments.bounces + "\" found");
    request.bounces = *bounces;
  }
  request.samples = arguments.samples;
  request.shadowSize = arguments.shadowSize;
  if (!arguments.bands.empty()) {
    const std::optional<Bands> bands = bandsByName(arguments.bands);
    if (!bands)
      return usage("--bands: a name such as Y3Co1Cg1 expected, bands 1..8, chroma's at most luma's, \"" +
                   arguments.bands + "\" found");
    request.bands = *bands;
  }
  request.gridLookup = arguments.gridLookup == "smooth"    ? GridLookup::smooth
                       : arguments.gridLookup == "texture" ? GridLookup::texture
                                                           : GridLookup::stencil;
  if (Status ok = checkImageName(arguments.output); !ok) return ok;
  const auto exponent = readExponent(arguments.exponent);
  if (!exponent) return exponent.error();
  request.exponent = *exponent;
  request.gloss = arguments.sceneOptions.gloss;
  if (arguments.allowStale && arguments.bake.empty()) return usage("--allow-stale needs --bake");
  if (!arguments.editedFrom.empty() && arguments.bake.empty())
    return usage("--edited-from needs --bake, the bake of that level");
  if (arguments.editedFrom.empty() && (arguments.edit.reach > 0.0f || arguments.edit.fade > 0.0f))
    return usage("--edit-reach and --edit-fade need --edited-from");
  if (arguments.hasLiveOptions && !arguments.live && arguments.editedFrom.empty())
    return usage("--live-cells and --live-rays need --live or --edited-from");
  if (arguments.dynamic == "solid" && arguments.bake.empty()) return usage("--dynamic solid needs --bake");
  return checkLive(arguments, request);
}

// The bands that a bake recommends, but at least those that carry the lobes of rough surfaces (docs/notes/gloss.md).
Bands bandsOfGloss(const Bake& bake) {
  const bool isSh = bake.links.kind == LinkKind::sh;
  const int most = isSh ? static_cast<int>(bake.links.bands) : kMaxBands, enough = std::min(4, most);
  const int luma = std::clamp(static_cast<int>(bake.provenance.lumaBands), enough, most);
  return {luma, std::clamp(static_cast<int>(bake.provenance.chromaBands), enough, luma)};
}

void printReport(const RenderedFrame& frame, const std::vector<std::string>& written, const std::vector<Aov>& aovs,
                 const PictureScale* scale, double drawMs, std::span<const PartChange> edits,
                 const RenderArguments& arguments) {
  if (arguments.json) {
    nlohmann::json report{
        {"images", written}, {"renderer", frame.renderer}, {"relightFrames", frame.frames}, {"totalMs", drawMs}};
    if (scale != nullptr) report["png"] = describeScale(aovs, *scale);
    if (!frame.bands.empty()) report["bands"] = frame.bands;
    if (!arguments.editedFrom.empty()) report["edits"] = nlohmann::json::array();
    for (const PartChange& edit : edits) report["edits"].push_back(toString(edit));
    report["passMs"] = nlohmann::json::object();
    for (const PassTime& pass : frame.passTimes) report["passMs"][pass.pass] = pass.ms;
    report["bufferBytes"] = nlohmann::json::object();
    for (const auto& [name, bytes] : frame.bufferBytes) report["bufferBytes"][name] = bytes;
    std::printf("%s\n", jsonText(report, -1).c_str());
    return;
  }
  for (const std::string& path : written) std::printf("wrote %s\n", printable(path).c_str());
  for (const PartChange& edit : edits) std::printf("since the bake: %s\n", printable(toString(edit)).c_str());
  if (!arguments.editedFrom.empty() && edits.empty())
    std::printf("since the bake: no baked part has changed: drawn by the bake alone\n");
  if (scale != nullptr) printScale(aovs, *scale, arguments.exposure == "auto");
  if (frame.passTimes.empty()) return;
  std::printf("%d relight frames of %s on %s; the last, ms a pass:", frame.frames, frame.bands.c_str(),
              frame.renderer.c_str());
  for (const PassTime& pass : frame.passTimes) std::printf("  %s %.2f", pass.pass, pass.ms);
  std::printf("\n");
}

// The sums of a frame, and a layer composed and converted on its way to a file.
Status reserveFrame(const View& view, std::size_t aovs, const RenderArguments& arguments, Context& context) {
  constexpr double kSumBytes = 7 * 12 + 28, kLayerBytes = 12 + 12 + 12;
  const double pixels = static_cast<double>(view.width) * view.height;
  const double wide = arguments.sideBySide ? 12.0 * static_cast<double>(aovs) : 0.0;
  return reserveMemory(context, "render", pixels * (kSumBytes + kLayerBytes + wide),
                       std::to_string(view.width) + " x " + std::to_string(view.height) + " pixels", "lower --size");
}

Result<RenderedFrame> drawWith(const std::string& backend, const Scene& scene, const RenderRequest& request,
                               Context& context) {
  // In OpenGL a bake lights voxels by rays as well.
  if (backend != "gl" || (request.live && request.bake != nullptr)) {
    if (Status ok = reserveRays(scene, RayStructure::thorough, context, RayGeometry::drawn); !ok) return ok.error();
  }
  if (backend == "gl") {
#ifdef RELUME_RENDER_GL
    return renderGl(scene, request, context);
#else
    return Error{ErrorCode::unsupported, "--backend gl: this relume was built without OpenGL"};
#endif
  }
  auto tracer = RayTracer::create(scene, BakeOptions{}.embreeIsa, context, RayStructure::thorough, RayGeometry::drawn);
  if (!tracer) return tracer.error();
  return renderCpu(*tracer, request, context);
}

int runRender(const RenderArguments& arguments) {
  // 1. What is asked for
  RenderRequest request;
  auto view = readView(arguments.view);
  if (!view) return fail(view.error());
  if (Status ok = readOptions(arguments, request); !ok) return fail(ok.error());
  auto aovs = chooseAovs(arguments, request);
  if (!aovs) return fail(aovs.error());
  const auto stops = readExposure(arguments.exposure);
  if (!stops) return fail(stops.error());

  Terminal terminal(arguments.terminal);
  Context& context = terminal.context();
  if (Status ok = reserveFrame(*view, aovs->size(), arguments, context); !ok) return fail(ok.error());

  const LayerFiles layers{arguments.output, *aovs, arguments.sideBySide};
  CommandFiles files = filesOf(arguments, layers);
  if (Status ok = checkOutputs(files, context); !ok) return fail(ok.error());

  // 2. The scene, and a bake of it
  auto scene = loadScene(arguments.scene, context, toImportOptions(arguments.sceneOptions));
  if (!scene) return fail(scene.error());
  files.read("a file of the scene", scene->files);
  if (Status ok = checkApart(files); !ok) return fail(ok.error());
  if (Status ok = checkDrawnTriangles(*scene); !ok) return fail(ok.error());
  std::optional<Scene> before;
  if (!arguments.editedFrom.empty()) {
    auto loaded = loadScene(arguments.editedFrom, context, toImportOptions(arguments.sceneOptions));
    if (!loaded) return fail(loaded.error());
    before.emplace(std::move(*loaded));
    files.read("a file of the level as it was baked", before->files);
    if (Status ok = checkApart(files); !ok) return fail(ok.error());
  }
  std::optional<Bake> bake;
  if (!arguments.bake.empty()) {
    auto loaded = before ? readBakeOf(*before, arguments.bake, arguments.editedFrom, arguments.allowStale, context)
                         : readBakeOf(*scene, arguments.bake, arguments.scene, arguments.allowStale, context);
    if (!loaded) return fail(loaded.error());
    bake.emplace(std::move(*loaded));
    if (before) fitToScene(*scene, *bake);
    request.bake = &*bake;
    if (request.gloss && request.bands.luma == 0) request.bands = bandsOfGloss(*bake);
  }

  // Cameras and lights move as well: choose them after.
  const MovedParts movable = bake && !before ? MovedParts::dynamic : MovedParts::all;
  if (Status ok = moveNodes(arguments.moves, movable, *scene); !ok) return fail(ok.error());
  if (Status ok = completeView(arguments.view, *scene, context, *view); !ok) return fail(ok.error());
  setView(*view, request);
  if (bake && !request.sky.isDark() && bake->hierarchy.skyDirection.empty())
    context.message(Severity::warning, arguments.bake +
                                           ": has no patches of sky, so the sky lights nothing here; bake "
                                           "with --sky-patches 64");
  std::optional<FoundEdits> edits;
  if (before) {
    edits.emplace(findEdits(*before, *scene));
    edits->level.blend = arguments.edit;
    edits->level.live = arguments.liveRequest;
    if (!edits->none()) request.edited = &edits->level;
  }
  auto driven = readEmissions(arguments.emissions, context);
  if (!driven) return fail(driven.error());
  if (Status ok = driveScene(*scene, *driven, request.emissive || driven->empty()); !ok) return fail(ok.error());
  if (edits) {
    if (Status ok = driveScene(edits->level.before, *driven, request.emissive || driven->empty()); !ok)
      return fail(ok.error());
  }
  if (bake) {
    if (Status ok = checkDriven(before ? *before : *scene, *driven, bake->emitters, arguments.bake); !ok)
      return fail(ok.error());
  }
  request.driven = std::move(*driven);
  std::optional<MovingShapes> shapes;
  if (arguments.dynamic == "solid") {
    auto made = movingShapes(*scene);  // which shine as they are driven
    if (!made) return fail(made.error());
    shapes.emplace(std::move(*made));
    request.movingShapes = &*shapes;
    request.movingParts = movingParts(*scene);
  }

  // 3. Draw and write
  const auto begin = std::chrono::steady_clock::now();
  auto frame = drawWith(arguments.backend, *scene, request, context);
  terminal.finish();
  if (!frame) return fail(frame.error());
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  const PictureScale scale = scaleOf(*frame, *aovs, *stops, boundsOf(*scene));
  std::vector<std::string> written;
  if (Status ok = writeLayers(*frame, layers, scale, written); !ok) return fail(ok.error());
  printReport(*frame, written, *aovs, layers.isPng() ? &scale : nullptr, ms,
              edits ? std::span<const PartChange>(edits->changes) : std::span<const PartChange>(), arguments);
  return 0;
}

}  // namespace

void addRenderCommand(CLI::App& app, Action& action) {
  auto a = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "Relight a camera's view with a bake, without a window");
  command->add_option("SCENE", a->scene, "glTF scene (.glb, .gltf) the bake was made from")
      ->type_name("FILE")
      ->required();
  command->add_option("--bake", a->bake, "bake of that scene (.relume); without one, only direct light is known")
      ->type_name("FILE");
  command->add_flag("--allow-stale", a->allowStale,
                    "render with a bake of another state of the scene: parts are found by name, the others read the "
                    "grid; a warning says so");
  command
      ->add_option("--edited-from", a->editedFrom,
                   "the level that --bake was made from, where SCENE is a later state of it: near parts that were "
                   "moved, changed, added or taken away, light without a bake (--live-cells, --live-rays) says what "
                   "that did to the bake's light, which all else keeps")
      ->type_name("FILE");
  command
      ->add_option("--edit-reach", a->edit.reach,
                   "metres from such a part within which its change counts in full, with --edited-from; 0 = three "
                   "times half of its diagonal, two cells at least, and of a part that emits the whole level")
      ->check(numberFrom(0.0, kMaxLevelCoordinate))
      ->capture_default_str();
  command
      ->add_option("--edit-fade", a->edit.fade,
                   "metres beyond that within which it fades to nothing; 0 = as many as the reach")
      ->check(numberFrom(0.0, kMaxLevelCoordinate))
      ->capture_default_str();
  addViewOptions(*command, a->view);
  addMoveOption(*command, a->moves);
  command
      ->add_option("--dynamic", a->dynamic,
                   "dynamic nodes, which no bake knows: receivers (they are lit and cast the punctual lights' shadows) "
                   "or solid (they also shadow and re-colour light over the links of --bake)")
      ->check(CLI::IsMember({"receivers", "solid"}))
      ->capture_default_str();
  addEmissionOption(*command, a->emissions);
  addSceneOptions(*command, a->sceneOptions);
  CLI::Option* const live = command->add_flag(
      "--live", a->live,
      "light without a bake: the level as voxels, and caches in its cells that gather from them; coarser "
      "than a bake, and there at once");
  CLI::Option* const cells = command
                                 ->add_option("--live-cells", a->liveRequest.cells,
                                              "cells on the longest side of the level, with --live or --edited-from")
                                 ->check(CLI::Range(kMinCells, kMaxCells))
                                 ->capture_default_str();
  CLI::Option* const rays = command
                                ->add_option("--live-rays", a->liveRequest.rays,
                                             "rays that a cell gathers by in each frame, with --live or --edited-from")
                                ->check(CLI::Range(8, 4096))
                                ->capture_default_str();
  command
      ->add_option("--live-cascades", a->liveRequest.cascades,
                   "volumes in one another about the camera, each with cells half as large as the one around it, with "
                   "--live")
      ->check(CLI::Range(1u, kMaxCascades))
      ->needs(live)
      ->capture_default_str();
  addRsmFlags(*command, live, a->rsm);
  command->add_option("--bounces", a->bounces, "how often light is reflected at most: 1..1000 or converged")
      ->capture_default_str();
  command
      ->add_option("--aov", a->aovs,
                   "what to draw, separated by commas; indirect, bounced and direct are irradiance / pi without "
                   "albedo, full and unbounced radiance, glossy the mean radiance in a lobe about the reflected "
                   "direction, with --gloss what surfaces mirror of it. Several go to several files: "
                   "out.NAME.exr. As PNG, light is exposed; normals are 0.5 n + 0.5, positions go from black to white "
                   "over the level's bounds, depths from white (nearest in the image) to dark grey (farthest); "
                   "with --live occlusion is 1 where nothing around hides a surface, and voxels the radiance of the "
                   "voxels that light "
                   "[indirect|bounced|direct|glossy|full|unbounced|albedo|normal|position|depth|occlusion|voxels]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  addExponentOption(*command, a->exponent);
  addGlossOption(*command, a->sceneOptions.gloss);
  addFalloffOption(*command, a->falloff);
  command->add_option("--samples", a->samples, "sub-pixels along a pixel's side, box filtered")
      ->check(CLI::Range(1, 16))
      ->capture_default_str();
  command->add_option("--backend", a->backend, "cpu (Embree) or gl (OpenGL 4.3 through EGL)")
      ->check(CLI::IsMember({"cpu", "gl"}))
      ->capture_default_str();
  command->add_option("--shadow-size", a->shadowSize, "texels along a side of a shadow map, gl only")
      ->check(CLI::Range(64, 8192))
      ->capture_default_str();
  command->add_option("--bands", a->bands,
                      "spherical harmonics bands of luminance and chrominance, as Y3Co1Cg1; default: as the bake "
                      "recommends, with --gloss at least Y4Co4Cg4, with --live-transport rsm Y3Co2Cg2");
  command
      ->add_option(
          "--grid-lookup", a->gridLookup,
          "what reads the grid does so by the caches around (stencil), or where that is as good by a texture of "
          "irradiance vectors, trilinear (texture) or by a cubic B-spline (smooth)")
      ->check(CLI::IsMember({"stencil", "texture", "smooth"}))
      ->capture_default_str();
  addPictureOptions(*command, *a);
  command->add_flag("--json", a->json, "print what was written and what each pass cost as JSON");
  addTerminalOptions(*command, a->terminal);
  command->callback([a, cells, rays, &action] {
    a->hasLiveOptions = cells->count() + rays->count() > 0;
    action = [a] { return runRender(*a); };
  });
}

}  // namespace relume
