// SPDX-License-Identifier: MIT
// `relume reference`: ground truth of a camera's view by path tracing, with the channels that the accuracy tests read.
#include "bake/options.h"
#include "bake/reference/path_tracer.h"
#include "bake/scene/ray_tracer.h"
#include "bake/scene/scene.h"
#include "bake/tools/commands.h"
#include "bake/tools/image_io.h"
#include "bake/tools/load_scene.h"
#include "bake/tools/terminal.h"

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <memory>

namespace relume {
namespace {

struct ReferenceArguments {
  std::string scene, output, camera, size = "320x180";
  std::vector<std::string> lights{"all"};
  std::vector<float> sky{0.0f, 0.0f, 0.0f};
  ReferenceOptions options;
  bool half = false;
  TerminalOptions terminal;
};

Error usage(std::string message) { return {ErrorCode::usage, std::move(message)}; }

template <class Items>
std::string namesOf(const Items& items) {
  std::string text;
  for (const auto& item : items) text += (text.empty() ? "\"" : ", \"") + item.name + "\"";
  return text.empty() ? "none" : text;
}

// What can be checked without the scene.
Status readOptions(ReferenceArguments& a) {
  char rest = 0;
  if (std::sscanf(a.size.c_str(), "%5ux%5u%c", &a.options.width, &a.options.height, &rest) != 2)
    return usage("--size: WIDTHxHEIGHT of 1..16384 pixels each expected, \"" + a.size + "\" found");
  if (std::filesystem::path(a.output).extension() != ".exr")
    return usage("-o: a name that ends in .exr expected, \"" + a.output + "\" found");
  for (const float c : a.sky) {
    if (!std::isfinite(c) || c < 0.0f) return usage("--sky: three finite numbers of at least 0 expected");
  }
  a.options.skyRadiance = {a.sky[0], a.sky[1], a.sky[2]};
  return done();
}

Result<Camera> chooseCamera(const Scene& scene, const std::string& name) {
  if (scene.cameras.empty()) return usage("--camera: the scene has no camera");
  for (const Camera& camera : scene.cameras) {
    if (name.empty() || camera.name == name) return camera;
  }
  return usage("--camera: no camera \"" + name + "\" in the scene; there are: " + namesOf(scene.cameras));
}

// A name may stand for several lights: one glTF light on two nodes.
Result<std::vector<SceneLight>> chooseLights(const Scene& scene, const std::vector<std::string>& names,
                                             bool& emissive) {
  std::vector<SceneLight> chosen;
  emissive = false;
  for (const std::string& name : names) {
    if (names.size() > 1 && (name == "all" || name == "none")) return usage("--lights: \"" + name + "\" stands alone");
    const bool all = name == "all";
    bool known = all || name == "none" || name == "emissive";
    if (all || name == "emissive") emissive = true;
    for (const SceneLight& light : scene.lights) {
      if (!all && light.name != name) continue;
      chosen.push_back(light);
      known = true;
    }
    if (!known) {
      return usage("--lights: no light \"" + name + "\" in the scene; there are: " + namesOf(scene.lights) +
                   ", and emissive, all, none");
    }
  }
  return chosen;
}

ChannelImage toChannels(const ReferenceImage& image) {
  ChannelImage file{image.width, image.height, {}};
  file.setLayer("DiffInd", image.indirect);
  file.setLayer("DiffDir", image.direct);
  file.setLayer("DiffIndErr", image.indirectError);
  file.setLayer("DiffDirErr", image.directError);
  file.setLayer("DiffCol", image.albedo);
  file.setLayer("Emit", image.emission);
  file.setLayer("Position", image.position, "XYZ");
  file.setLayer("Normal", image.normal, "XYZ");
  file.channels["Depth.Z"] = image.depth;
  return file;
}

int runReference(ReferenceArguments& arguments) {
  // 1. What is asked for
  if (Status ok = readOptions(arguments); !ok) return fail(ok.error());
  Terminal terminal(arguments.terminal);
  Context& context = terminal.context();
  auto scene = loadScene(arguments.scene, context);
  if (!scene) return fail(scene.error());
  auto camera = chooseCamera(*scene, arguments.camera);
  if (!camera) return fail(camera.error());
  auto lights = chooseLights(*scene, arguments.lights, arguments.options.emissive);
  if (!lights) return fail(lights.error());

  // 2. Trace
  auto tracer = RayTracer::create(*scene, BakeOptions{}.embreeIsa, context);
  if (!tracer) return fail(tracer.error());
  auto image = renderReference(*tracer, *camera, *lights, arguments.options, context);
  terminal.finish();
  if (!image) return fail(image.error());

  // 3. Write
  if (Status ok = writeExr(arguments.output, toChannels(*image), arguments.half); !ok) return fail(ok.error());
  std::printf("wrote %s\n", arguments.output.c_str());
  return 0;
}

}  // namespace

void addReferenceCommand(CLI::App& app, Action& action) {
  auto a = std::make_shared<ReferenceArguments>();
  CLI::App* command =
      app.add_subcommand("reference", "Path-trace a camera's view: ground truth for the accuracy tests");
  command->add_option("SCENE", a->scene, "glTF scene (.glb, .gltf)")->required();
  command->add_option("--camera", a->camera, "camera by name; default: the scene's first");
  command
      ->add_option(
          "--lights", a->lights,
          "lights that are on, by name, separated by commas; \"emissive\" = all emitting surfaces; or all, none")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--sky", a->sky, "radiance of a constant sky as R,G,B [W/m^2/sr]")
      ->delimiter(',')
      ->expected(3)
      ->capture_default_str();
  command->add_option("--size", a->size, "pixels of the image, WIDTHxHEIGHT, 1..16384 each")->capture_default_str();
  command->add_option("--spp", a->options.samplesPerPixel, "paths a pixel")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command->add_option("--bounces", a->options.maxBounces, "how often light is reflected before it arrives, at most")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  command->add_option("--seed", a->options.seed, "seed of the random numbers")->capture_default_str();
  command
      ->add_option("-o,--output", a->output,
                   "OpenEXR to write: DiffInd, DiffDir (irradiance / pi), DiffCol, Emit, Position, Normal, Depth, and "
                   "half the difference of two half renders as DiffIndErr, DiffDirErr")
      ->required();
  command->add_flag("--half", a->half, "write 16-bit floats, except depth and position");
  addTerminalOptions(*command, a->terminal);
  command->callback([a, &action] { action = [a] { return runReference(*a); }; });
}

}  // namespace relume
