// SPDX-License-Identifier: MIT
// `relume preview`: what a shot looks like, before any bake or with one at hand, by radiance records.
#include "bake/base/memory_budget.h"
#include "bake/preview/hsh_cells.h"
#include "bake/preview/mirror_surface.h"
#include "bake/rays/ray_tracer.h"
#include "bake/scene/check_triangles.h"
#include "bake/stage_memory.h"
#include "relume/bake/load_scene.h"
#include "relume/bake/scene.h"
#include "tools/base/number_check.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/base/scene_options.h"
#include "tools/base/usage_message.h"
#include "tools/cli/commands.h"
#include "tools/cli/layer_files.h"
#include "tools/cli/preview_level.h"
#include "tools/cli/terminal.h"
#include "tools/render/drive_scene.h"
#include "tools/render/exposure.h"
#include "tools/render/render_pictures.h"
#include "tools/render/render_preview.h"
#include "tools/render/view_options.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <utility>

namespace relume {
namespace {

struct PreviewArguments : PictureOptions {
  std::string source = "auto", gradients = "on", backend = "cpu";
  SceneOptions sceneOptions;
  std::uint32_t samples = 4, shadowSize = 2048;
  PreviewOptions options;
  std::optional<float> accuracy;
  std::optional<std::uint32_t> rays;
  bool hasPlaneOptions = false, allowStale = false, json = false;
  TerminalOptions terminal;
};

Result<std::vector<Aov>> chooseAovs(const PreviewArguments& arguments, RenderRequest& request) {
  auto aovs = aovsByName(arguments.aovs);
  if (!aovs) return aovs.error();
  for (const Aov aov : *aovs) {
    if (aov == Aov::glossy && !request.gloss) return usage("--aov glossy needs --gloss");
    if (aov == Aov::unbounced && request.gloss)
      return usage("--aov unbounced is of diffuse surfaces: leave out --gloss");
    if (aov == Aov::occlusion) return usage("--aov occlusion: a preview has none; `relume render --live` has");
    if (aov == Aov::voxels) return usage("--aov voxels: a preview has no voxels; `relume render --live` has");
    if (aov == Aov::normal || aov == Aov::position || aov == Aov::depth) request.centres = true;
  }
  return aovs;
}

// Receivers, their light, the layers, and one of these on its way to a file; and as many records as there may be.
Status reserveFrame(const View& view, const LayerFiles& layers, const PreviewOptions& options, Context& context) {
  constexpr double kPixelBytes = 40 + 1 + 28 + 11 * 12 + 36 + 8, kRecordBytes = 2 * sizeof(Record) + 4 + 16 + 4 * 64;
  // Two more sets of receivers, what pixels mirror, three layers; and the coefficients of radiance records.
  const double glossyPixel = options.gloss ? 2.0 * sizeof(PixelReceiver) + sizeof(MirrorSurface) + 36 : 0.0;
  const double glossyRecord = options.gloss ? kRecordBytes + 8.0 * hshRecordSize(kMaxHshOrder) : 0.0;
  const double pixels = static_cast<double>(view.width) * view.height;
  const double wide = layers.sideBySide ? 12.0 * static_cast<double>(layers.aovs.size()) : 0.0;
  const double records = std::min(pixels, static_cast<double>(options.maxRecords));
  return reserveMemory(
      context, "preview", pixels * (kPixelBytes + wide + glossyPixel) + records * (kRecordBytes + glossyRecord),
      std::to_string(view.width) + " x " + std::to_string(view.height) + " pixels", "lower --size or --max-records");
}

// Larger pictures cast so many rays that they gain what a thorough structure costs; by surfels fewer a pixel.
RayStructure structureFor(const View& view, const PreviewOptions& options, PreviewSource source) {
  const std::uint64_t many = source == PreviewSource::surfels ? 1u << 17 : 1u << 16;  // [pixels]
  const bool isLarge = std::uint64_t{view.width} * view.height >= many && options.timeLimitSeconds == 0.0;
  return isLarge ? RayStructure::bundles : RayStructure::quickBundles;
}

void printReport(const PreviewReport& report, const std::vector<std::string>& written, const LayerFiles& layers,
                 const PictureScale* scale, double totalMs, const PreviewArguments& arguments) {
  if (arguments.json) {
    nlohmann::json json{{"images", written},
                        {"records", report.records},
                        {"glossyRecords", report.glossyRecords},
                        {"rays", report.rays},
                        {"accuracy", std::stod(std::to_string(report.accuracy))},
                        {"extendedPixels", report.extended},
                        {"hemispheres", report.renderer},
                        {"splats", report.splatsRenderer},
                        {"totalMs", totalMs}};
    json["stageMs"] = {{"relight", 1e3 * report.relightSeconds},
                       {"records", 1e3 * report.recordSeconds},
                       {"firstPicture", 1e3 * report.firstSeconds},
                       {"splat", 1e3 * report.splatSeconds},
                       {"draw", 1e3 * report.drawSeconds}};
    if (scale != nullptr) json["png"] = describeScale(layers.aovs, *scale);
    std::printf("%s\n", jsonText(json, -1).c_str());
    return;
  }
  for (const std::string& path : written) std::printf("wrote %s\n", printable(path).c_str());
  if (scale != nullptr) printScale(layers.aovs, *scale, arguments.exposure == "auto");
  if (arguments.sceneOptions.gloss) std::printf("%u radiance records; ", report.glossyRecords);
  std::printf("%u records of %.1f million rays, accuracy %g; s: records %.2f, draw %.2f\n", report.records,
              1e-6 * static_cast<double>(report.rays), static_cast<double>(report.accuracy), report.recordSeconds,
              report.drawSeconds);
}

// Options that nothing reads beside the others.
Status checkRead(const PreviewArguments& arguments) {
  if (arguments.options.hemisphere == Hemisphere::fan && arguments.hasPlaneOptions)
    return usage("--plane-side and --plane-fov need --hemisphere plane, scaled or border");
  if (arguments.allowStale && arguments.bake.empty()) return usage("--allow-stale needs --bake");
  return done();
}

Result<PreviewSource> chooseSource(const PreviewArguments& arguments) {
  static const std::map<std::string, PreviewSource> kSources = {{"auto", PreviewSource::hits},
                                                                {"direct", PreviewSource::direct},
                                                                {"hits", PreviewSource::hits},
                                                                {"surfels", PreviewSource::surfels}};
  const PreviewSource source = kSources.at(arguments.source);
  if (arguments.backend == "gl" && arguments.options.hemisphere != Hemisphere::fan) {
    if (source != PreviewSource::direct && arguments.source != "auto")
      return usage(
          "--backend gl draws what a plane sees in light that is reflected once: --source direct or "
          "--hemisphere fan, not --source " +
          arguments.source);
    if (!arguments.bake.empty())
      return usage(
          "--backend gl with a plane and --bake exclude each other: it draws direct light; --hemisphere fan "
          "looks around by rays");
    return PreviewSource::direct;
  }
  if (source == PreviewSource::direct && !arguments.bake.empty())
    return usage("--source direct and --bake exclude each other: direct light needs no bake");
  return source;
}

// How fine records are where nothing says so.
void setEffort(const PreviewArguments& arguments, std::uint32_t pixels, PreviewOptions& options) {
  constexpr std::uint32_t kFewRecords = 4800, kPixelsEach = 12;  // or more of each record
  constexpr std::uint32_t kRays = 576, kGlossyRays = 1024;
  options.accuracy = arguments.accuracy.value_or(options.accuracy);
  options.rays = arguments.rays.value_or(arguments.sceneOptions.gloss ? kGlossyRays : kRays);
  const bool free = !arguments.accuracy && !arguments.rays && options.timeLimitSeconds == 0.0 &&
                    options.hemisphere == Hemisphere::fan && !arguments.sceneOptions.gloss;
  options.fewRecords = free ? std::max(kFewRecords, pixels / kPixelsEach) : 0;
}

int runPreview(const PreviewArguments& arguments) {
  // 1. What is asked for
  PreviewRequest request;
  request.options = arguments.options;
  request.options.gradients = arguments.gradients == "on";
  request.options.gloss = request.frame.gloss = arguments.sceneOptions.gloss;
  request.frame.samples = arguments.samples;
  auto view = readView(arguments.view);
  if (!view) return fail(view.error());
  setEffort(arguments, view->width * view->height, request.options);
  if (Status ok = checkImageName(arguments.output); !ok) return fail(ok.error());
  const auto aovs = chooseAovs(arguments, request.frame);
  if (!aovs) return fail(aovs.error());
  const auto stops = readExposure(arguments.exposure);
  if (!stops) return fail(stops.error());
  if (Status ok = checkRead(arguments); !ok) return fail(ok.error());
  const auto source = chooseSource(arguments);
  if (!source) return fail(source.error());
  request.source = *source;
  request.splatted = arguments.backend == "gl";
  request.drawn = request.splatted && request.options.hemisphere != Hemisphere::fan;
  request.frame.shadowSize = arguments.shadowSize;

  Terminal terminal(arguments.terminal);
  Context& context = terminal.context();
  const LayerFiles layers{arguments.output, *aovs, arguments.sideBySide};
  if (Status ok = reserveFrame(*view, layers, request.options, context); !ok) return fail(ok.error());
  CommandFiles files = filesOf(arguments, layers);
  if (Status ok = checkOutputs(files, context); !ok) return fail(ok.error());

  // 2. The scene, its rays, and a bake of it
  const auto begin = std::chrono::steady_clock::now();
  auto scene = loadScene(arguments.scene, context, toImportOptions(arguments.sceneOptions));
  if (!scene) return fail(scene.error());
  files.read("a file of the scene", scene->files);
  if (Status ok = checkApart(files); !ok) return fail(ok.error());
  if (Status ok = checkDrawnTriangles(*scene); !ok) return fail(ok.error());
  if (Status ok = completeView(arguments.view, *scene, context, *view); !ok) return fail(ok.error());
  setView(*view, request.frame);
  auto driven = readEmissions(arguments.emissions, context);
  if (!driven) return fail(driven.error());
  const auto level =
      makePreviewLevel(*scene,
                       {arguments.scene, arguments.bake, arguments.allowStale, arguments.source != "auto",
                        structureFor(*view, request.options, request.source)},
                       request.source, context);
  if (!level) return fail(level.error());
  request.frame.bake = level->bake ? &*level->bake : nullptr;
  if (Status ok = driveScene(*scene, *driven, request.frame.emissive || driven->empty()); !ok) return fail(ok.error());
  request.frame.driven = std::move(*driven);

  // 3. Draw and write
  PreviewReport report;
  const auto frame = renderPreviewFrame(*level->transport, level->drawn(), request, report, context);
  terminal.finish();
  if (!frame) return fail(frame.error());
  const PictureScale scale = layers.isPng() ? scaleOf(*frame, *aovs, *stops, boundsOf(*scene)) : PictureScale{};
  std::vector<std::string> written;
  if (Status ok = writeLayers(*frame, layers, scale, written); !ok) return fail(ok.error());
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  printReport(report, written, layers, layers.isPng() ? &scale : nullptr, ms, arguments);
  return 0;
}

void addRecordOptions(CLI::App& command, PreviewArguments& a) {
  const char* const group = "Records";
  static const std::map<std::string, RecordWeight> kWeights = {
      {"smooth", RecordWeight::smooth}, {"ward", RecordWeight::ward}, {"tabellion", RecordWeight::tabellion}};
  static const std::map<std::string, PlacementOrder> kOrders = {{"waves", PlacementOrder::waves},
                                                                {"linear", PlacementOrder::linear}};
  static const std::map<std::string, RecordReach> kReaches = {{"guarded", RecordReach::guarded},
                                                              {"printed", RecordReach::printed}};
  static const std::map<std::string, Hemisphere> kHemispheres = {{"fan", Hemisphere::fan},
                                                                 {"plane", Hemisphere::plane},
                                                                 {"scaled", Hemisphere::scaled},
                                                                 {"border", Hemisphere::border}};
  command
      .add_option("--source", a.source,
                  "what records' rays find: direct (light that is reflected once), hits (direct light, and a bake's "
                  "light map or grid), surfels (a bake's surfels: faster and coarser), or auto: hits [auto|direct|hits|"
                  "surfels]")
      ->check(CLI::IsMember({"auto", "direct", "hits", "surfels"}))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--accuracy", a.accuracy,
                  "how far records reach, as a share of the distance to what they see: less is more exact and slower; "
                  "by default 0.15, and where few records do for that 0.1 with 1024 to 2048 rays each")
      ->check(numberFrom(0.02, 2.0))
      ->group(group);
  command
      .add_option("--rays", a.rays,
                  "rays that a record casts, eight times as many where light is uneven; by default 576, with --gloss "
                  "1024")
      ->check(CLI::Range(16, 65536))
      ->group(group);
  command
      .add_option("--contrast", a.options.contrast,
                  "by how much records may contradict each other at a pixel, as a share of its light, before more are "
                  "gathered there")
      ->check(numberFrom(0.001, 10.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--rounds", a.options.rounds, "how often that is looked at; 0 = never, as in the paper")
      ->check(CLI::Range(0, 16))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--weight", a.options.weight,
                  "how records are weighed: smooth (Ward's, ending in 0), ward (as the paper prints it) or tabellion "
                  "[smooth|ward|tabellion]")
      ->option_text("WEIGHT [smooth]")
      ->transform(CLI::CheckedTransformer(kWeights).description(""))
      ->group(group);
  command
      .add_option("--reach", a.options.reach,
                  "how far records reach: guarded (no farther than the light's own slope and what pixels show in front "
                  "of surfaces allow) or printed (as the paper prints it: more light leaks, fewer records) "
                  "[guarded|printed]")
      ->option_text("REACH [guarded]")
      ->transform(CLI::CheckedTransformer(kReaches).description(""))
      ->group(group);
  command.add_option("--min-reach", a.options.minPixels, "pixels that every record reaches: more makes fewer records")
      ->check(numberFrom(0.0, 64.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--gradients", a.gradients, "whether records know how their light changes around them")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--order", a.options.order,
                  "in which pixels are asked for records: waves (coarse to fine) or linear (row by row, on one "
                  "thread) [waves|linear]")
      ->option_text("ORDER [waves]")
      ->transform(CLI::CheckedTransformer(kOrders).description(""))
      ->group(group);
  command
      .add_option("--hemisphere", a.options.hemisphere,
                  "how a record looks around: fan (strata of the whole hemisphere), or the pixels of a plane above it: "
                  "plane (what it misses is dark), scaled (all pixels count for more) or border (its border pixels "
                  "do) [fan|plane|scaled|border]")
      ->option_text("HEMISPHERE [fan]")
      ->transform(CLI::CheckedTransformer(kHemispheres).description(""))
      ->group(group);
  command
      .add_option("--backend", a.backend,
                  "what draws records: cpu, or gl (OpenGL 4.3 through EGL), which also looks through the pixels of a "
                  "plane in place of rays, with shadow maps: light of punctual lights that is reflected once [cpu|gl]")
      ->check(CLI::IsMember({"cpu", "gl"}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--shadow-size", a.shadowSize, "texels along a side of a shadow map, gl only")
      ->check(CLI::Range(64, 8192))
      ->capture_default_str()
      ->group(group);
  command.add_option("--plane-side", a.options.planeSide, "pixels along a side of the plane")
      ->check(CLI::Range(2, 256))
      ->capture_default_str()
      ->group(group);
  command.add_option("--plane-fov", a.options.planeFovDeg, "angle that the plane spans [degrees]")
      ->check(numberFrom(10.0, 175.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--max-records", a.options.maxRecords, "the most records; pixels that none reaches read farther")
      ->check(CLI::Range(1, 10000000))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--time-limit", a.options.timeLimitSeconds,
                  "seconds for records: from coarse to fine, and the finest picture that is whole counts; it "
                  "depends on the machine. 0 = none")
      ->check(numberFrom(0.0, 86400.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--seed", a.options.seed, "seed of the random numbers")
      ->check(count64())
      ->capture_default_str()
      ->group(group);
}

}  // namespace

void addPreviewCommand(CLI::App& app, Action& action) {
  auto a = std::make_shared<PreviewArguments>();
  CLI::App* command =
      app.add_subcommand("preview", "Show what a shot looks like, by light gathered where the picture needs it");
  command->add_option("SCENE", a->scene, "glTF scene (.glb, .gltf)")->type_name("FILE")->required();
  command
      ->add_option("--bake", a->bake,
                   "bake of that scene (.relume), whose light the records gather; without one, a draft is baked in "
                   "memory")
      ->type_name("FILE");
  command->add_flag("--allow-stale", a->allowStale,
                    "use a bake of another state of the scene: parts are found by name, the others read the grid; a "
                    "warning says so");
  addViewOptions(*command, a->view);
  addEmissionOption(*command, a->emissions);
  addSceneOptions(*command, a->sceneOptions);
  command
      ->add_option(
          "--aov", a->aovs,
          "what to draw, separated by commas, as `relume render` has it; records: the pixels that have one, "
          "weight: the sum of the records' weights w, as PNG w / (w + 10). Several go to several files: "
          "out.NAME.exr [indirect|bounced|direct|glossy|full|unbounced|albedo|normal|position|depth|records|weight]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  addGlossOption(*command, a->sceneOptions.gloss);
  command->add_option("--samples", a->samples, "sub-pixels along a pixel's side, box filtered")
      ->check(CLI::Range(1, 16))
      ->capture_default_str();
  addRecordOptions(*command, *a);
  addPictureOptions(*command, *a);
  command->add_flag("--json", a->json, "print what was written and what it took as JSON");
  addTerminalOptions(*command, a->terminal);
  command->callback([a, command, &action] {
    a->hasPlaneOptions = command->count("--plane-side") + command->count("--plane-fov") > 0;
    action = [a] { return runPreview(*a); };
  });
}

}  // namespace relume
