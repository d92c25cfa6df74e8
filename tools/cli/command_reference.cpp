// SPDX-License-Identifier: MIT
// `relume reference`: ground truth of a camera's view by path tracing, with the channels that the accuracy tests read.
#include "bake/base/memory_budget.h"
#include "bake/rays/ray_tracer.h"
#include "bake/reference/path_tracer.h"
#include "bake/scene/check_triangles.h"
#include "bake/stage_memory.h"
#include "relume/bake/load_scene.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "tools/base/number_check.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/base/scene_options.h"
#include "tools/cli/commands.h"
#include "tools/cli/layer_files.h"
#include "tools/cli/terminal.h"
#include "tools/images/image_io.h"
#include "tools/render/drive_scene.h"
#include "tools/render/exposure.h"
#include "tools/render/move_nodes.h"
#include "tools/render/reference_layers.h"
#include "tools/render/view_options.h"

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>

namespace relume {
namespace {

// Dynamic instances: as the level's other surfaces; lit and casting shadows of punctual lights, but neither blocking
// nor reflecting any other light, which is what a bake knows of them; or left out.
enum class DynamicParts { solid, receivers, hidden };

struct ReferenceArguments {
  std::string scene, output, exposure = "auto", aov = "full", exponent;
  ViewOptions view;
  SceneOptions sceneOptions;
  ReferenceOptions options;
  std::vector<std::string> emissions, moves;
  DynamicParts dynamic = DynamicParts::solid;
  float falloff = kOcclusionFalloff;
  bool half = false, force = false;
  TerminalOptions terminal;
};

bool isPng(const ReferenceArguments& arguments) { return imageKind(arguments.output) == FileKind::png; }

// Layers as they are traced, and once more as channels on their way to the file.
Status reserveImage(const View& view, bool glossy, Context& context) {
  const double pixelBytes = 2 * ((glossy ? 12 : 8) * 12 + 4) + 4;
  return reserveMemory(context, "reference", pixelBytes * view.width * view.height,
                       std::to_string(view.width) + " x " + std::to_string(view.height) + " pixels", "lower --size");
}

Result<ReferenceImage> trace(const Scene& scene, const View& view, const std::optional<float>& exponent,
                             const ReferenceArguments& arguments, Context& context) {
  ReferenceOptions options = arguments.options;
  options.exponent = exponent;
  options.gloss = arguments.sceneOptions.gloss;
  if (arguments.aov == "occlusion") options.occlusionFalloff = arguments.falloff;
  options.width = view.width;
  options.height = view.height;
  options.emissive = view.emissive;
  options.sky = view.sky;
  const auto tracerOf = [&](RayGeometry geometry) -> Result<RayTracer> {
    if (Status ok = reserveRays(scene, RayStructure::thorough, context, geometry); !ok) return ok.error();
    return RayTracer::create(scene, BakeOptions{}.embreeIsa, context, RayStructure::thorough, geometry);
  };
  const bool solid = arguments.dynamic == DynamicParts::solid;
  const auto transport = tracerOf(solid ? RayGeometry::drawn : RayGeometry::fixed);
  if (!transport) return transport.error();
  if (arguments.dynamic != DynamicParts::receivers)
    return renderReference(*transport, view.camera, view.lights, options, context);
  const auto drawn = tracerOf(RayGeometry::drawn);
  if (!drawn) return drawn.error();
  return renderReference(*transport, view.camera, view.lights, options, context, &*drawn);
}

// A PNG, or all layers.
Status writeReference(const ReferenceImage& image, const std::optional<float>& stops,
                      const ReferenceArguments& arguments) {
  const std::vector<glm::vec3> radiance = arguments.aov == "glossy"      ? glossyOf(image)
                                          : arguments.aov == "occlusion" ? opennessOf(image)
                                                                         : radianceOf(image);
  if (!isPng(arguments)) {
    if (Status ok = writeExr(arguments.output, toChannels(image, radiance), arguments.half); !ok) return ok;
    std::printf("wrote %s\n", printable(arguments.output).c_str());
    return done();
  }
  const float exposure = stops.value_or(arguments.aov == "occlusion" ? 0.0f : autoExposure(radiance));
  if (Status ok = writePng(arguments.output, image.width, image.height, radiance, std::exp2(exposure)); !ok) return ok;
  std::printf("wrote %s\nexposure: %s stops\n", printable(arguments.output).c_str(), stopsText(exposure).c_str());
  return done();
}

int runReference(const ReferenceArguments& arguments) {
  // 1. What is asked for
  auto view = readView(arguments.view);
  if (!view) return fail(view.error());
  const auto stops = readExposure(arguments.exposure);
  if (!stops) return fail(stops.error());
  const auto exponent = readExponent(arguments.exponent);
  if (!exponent) return fail(exponent.error());
  if (Status ok = checkGloss(arguments.aov == "glossy", exponent->has_value(), arguments.sceneOptions.gloss); !ok)
    return fail(ok.error());
  if (Status ok = checkFalloff(arguments.aov == "occlusion", arguments.falloff); !ok) return fail(ok.error());
  if (Status ok = checkImageName(arguments.output); !ok) return fail(ok.error());
  Terminal terminal(arguments.terminal);
  Context& context = terminal.context();
  CommandFiles files;
  files.read("the scene", arguments.scene);
  files.read("the file of --lights-file", arguments.view.lightsFile);
  files.read("the file of --sky-map", arguments.view.skyMap);
  for (const std::string& image : emissionFiles(arguments.emissions)) files.read("an image of --emission", image);
  files.write("-o", arguments.output, imageKind(arguments.output));
  files.force = arguments.force;
  if (Status ok = checkOutputs(files, context); !ok) return fail(ok.error());
  if (Status ok = reserveImage(*view, exponent->has_value() || arguments.sceneOptions.gloss, context); !ok)
    return fail(ok.error());
  auto scene = loadScene(arguments.scene, context, toImportOptions(arguments.sceneOptions));
  if (!scene) return fail(scene.error());
  files.read("a file of the scene", scene->files);
  if (Status ok = checkApart(files); !ok) return fail(ok.error());
  if (Status ok = checkDrawnTriangles(*scene); !ok) return fail(ok.error());
  if (Status ok = moveNodes(arguments.moves, MovedParts::all, *scene); !ok) return fail(ok.error());
  if (Status ok = completeView(arguments.view, *scene, context, *view); !ok) return fail(ok.error());

  const auto driven = readEmissions(arguments.emissions, context);
  if (!driven) return fail(driven.error());
  if (Status ok = driveScene(*scene, *driven, view->emissive || driven->empty()); !ok) return fail(ok.error());
  view->emissive = view->emissive || !driven->empty();

  // 2. Trace
  auto image = trace(*scene, *view, *exponent, arguments, context);
  terminal.finish();
  if (!image) return fail(image.error());

  // 3. Write
  const Status written = writeReference(*image, *stops, arguments);
  return written ? 0 : fail(written.error());
}

}  // namespace

void addReferenceCommand(CLI::App& app, Action& action) {
  auto a = std::make_shared<ReferenceArguments>();
  CLI::App* command =
      app.add_subcommand("reference", "Path-trace a camera's view: ground truth for the accuracy tests");
  command->add_option("SCENE", a->scene, "glTF scene (.glb, .gltf)")->type_name("FILE")->required();
  addViewOptions(*command, a->view);
  addMoveOption(*command, a->moves);
  addEmissionOption(*command, a->emissions);
  addSceneOptions(*command, a->sceneOptions);
  static const std::map<std::string, DynamicParts> kDynamic = {
      {"solid", DynamicParts::solid}, {"receivers", DynamicParts::receivers}, {"hidden", DynamicParts::hidden}};
  command
      ->add_option("--dynamic", a->dynamic,
                   "dynamic instances: solid (they block and reflect light like all else), receivers (they are lit and "
                   "cast the punctual lights' shadows, and no other light knows of them: what render draws) or hidden "
                   "[solid|receivers|hidden]")
      ->option_text("PARTS [solid]")
      ->transform(CLI::CheckedTransformer(kDynamic).description(""));
  command->add_option("--spp", a->options.samplesPerPixel, "paths a pixel")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command->add_option("--bounces", a->options.maxBounces, "how often light is reflected before it arrives, at most")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  command
      ->add_option("--aov", a->aov,
                   "what R, G, B and a PNG are: full (radiance toward the camera) or glossy (mean radiance in a lobe "
                   "about the reflected direction, with --gloss what surfaces mirror of it) or occlusion (1 where "
                   "nothing around hides a surface) [full|glossy|occlusion]")
      ->check(CLI::IsMember({"full", "glossy", "occlusion"}))
      ->capture_default_str();
  addExponentOption(*command, a->exponent);
  addGlossOption(*command, a->sceneOptions.gloss);
  addFalloffOption(*command, a->falloff);
  command->add_option("--seed", a->options.seed, "seed of the random numbers")->check(count64())->capture_default_str();
  command
      ->add_option("-o,--output", a->output,
                   "image to write. .exr: R, G, B (radiance), DiffInd, DiffDir (irradiance / pi), DiffCol, Emit, "
                   "Position, Normal, Depth, and half the difference of two half renders as DiffIndErr, DiffDirErr; "
                   "with --exponent or --gloss "
                   "GlossInd, GlossDir, GlossIndErr, GlossDirErr, with --aov occlusion Open; .png: the radiance")
      ->type_name("FILE")
      ->required();
  command
      ->add_option("--exposure", a->exposure,
                   "stops by which a PNG is brightened, -30..30, or auto: from the picture; above 1 clips")
      ->capture_default_str();
  command->add_flag("--half", a->half, "write 16-bit floats, except depth and position");
  command->add_flag("--force", a->force,
                    "write over a file that is something else than an image of that kind, or read-only");
  addTerminalOptions(*command, a->terminal);
  command->callback([a, &action] { action = [a] { return runReference(*a); }; });
}

}  // namespace relume
