// SPDX-License-Identifier: MIT
// `relume render`: relight a camera's view headlessly, with Embree and the CPU backend, or with OpenGL through EGL.
#include "bake/provenance.h"
#include "bake/scene/ray_tracer.h"
#include "bake/scene/scene.h"
#include "bake/tools/commands.h"
#include "bake/tools/image_io.h"
#include "bake/tools/lights_file.h"
#include "bake/tools/load_scene.h"
#include "bake/tools/render_cpu.h"
#include "bake/tools/render_frame.h"
#include "bake/tools/terminal.h"
#include "formats/bake_file.h"
#include "runtime/bands.h"
#ifdef RELUME_RENDER_GL
#include "bake/tools/render_gl.h"
#endif

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>

namespace relume {
namespace {

struct RenderArguments {
  std::string scene, bake, output, camera, bounces = "converged", size = "320x180", backend = "cpu", bands, lightsFile;
  std::vector<std::string> lights{"all"}, aovs{"full"};
  std::vector<float> sky{0.0f, 0.0f, 0.0f};
  float exposure = 0.0f;
  std::uint32_t samples = 4, shadowSize = 2048;
  float deringing = 0.0f;
  bool sideBySide = false, json = false;
  TerminalOptions terminal;
};

Error usage(std::string message) { return {ErrorCode::usage, std::move(message)}; }

// "a, b, c" of the names in a list; "none" when it is empty.
template <class Items>
std::string namesOf(const Items& items) {
  std::string text;
  for (const auto& item : items) text += (text.empty() ? "\"" : ", \"") + item.name + "\"";
  return text.empty() ? "none" : text;
}

// A whole number of [low, high], or nothing.
std::optional<int> wholeNumber(std::string_view text, int low, int high) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < low || value > high) return std::nullopt;
  return value;
}

Status parseSize(const std::string& text, RenderRequest& request) {
  const std::size_t x = text.find('x');
  if (x != std::string::npos) {
    const auto width = wholeNumber(std::string_view(text).substr(0, x), 1, 16384);
    const auto height = wholeNumber(std::string_view(text).substr(x + 1), 1, 16384);
    if (width && height) {
      request.width = static_cast<std::uint32_t>(*width);
      request.height = static_cast<std::uint32_t>(*height);
      return done();
    }
  }
  return usage("--size: WIDTHxHEIGHT of 1..16384 pixels each expected, \"" + text + "\" found");
}

Status chooseCamera(const Scene& scene, const std::string& name, RenderRequest& request) {
  for (const Camera& camera : scene.cameras) {
    if (camera.name != name && !name.empty()) continue;
    request.camera = camera;
    return done();
  }
  if (scene.cameras.empty()) return usage("--camera: the scene has no camera");
  return usage("--camera: no camera \"" + name + "\" in the scene; there are: " + namesOf(scene.cameras));
}

// Which lights are on. A name may stand for several lights: one glTF light on two nodes.
Status chooseLights(const Scene& scene, const std::vector<std::string>& names, RenderRequest& request) {
  for (const std::string& name : names) {
    if (name == "none") continue;
    if (name == "all" || name == "emissive") request.emissive = true;
    bool known = name == "all" || name == "emissive";
    for (const SceneLight& light : scene.lights) {
      if (name != "all" && light.name != name) continue;
      request.lights.push_back(light);
      known = true;
    }
    if (!known) {
      return usage("--lights: no light \"" + name + "\" in the scene; there are: " + namesOf(scene.lights) +
                   ", and emissive, all, none");
    }
  }
  if (names.size() > 1 &&
      (std::count(names.begin(), names.end(), "none") || std::count(names.begin(), names.end(), "all")))
    return usage("--lights: \"all\" and \"none\" stand alone");
  return done();
}

Result<std::vector<Aov>> chooseAovs(const RenderArguments& arguments, RenderRequest& request) {
  std::vector<Aov> aovs;
  for (const std::string& name : arguments.aovs) {
    const auto& names = aovNames();
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      std::string known;
      for (const std::string& n : names) known += (known.empty() ? "" : ", ") + n;
      return usage("--aov: \"" + name + "\" found; there are: " + known);
    }
    const Aov aov = static_cast<Aov>(found - names.begin());
    if (needsBake(aov) && arguments.bake.empty())
      return usage("--aov " + name + " needs --bake; without one there are direct, albedo, normal, position, depth");
    if (aov == Aov::bounced || aov == Aov::unbounced) request.straight = true;
    if (aov == Aov::normal || aov == Aov::position || aov == Aov::depth) request.centres = true;
    aovs.push_back(aov);
  }
  return aovs;
}

// What can be checked without the scene.
Status readOptions(const RenderArguments& arguments, RenderRequest& request) {
  if (Status ok = parseSize(arguments.size, request); !ok) return ok;
  if (arguments.bounces != "converged") {
    const auto bounces = wholeNumber(arguments.bounces, 1, 1000);
    if (!bounces) return usage("--bounces: 1..1000 or \"converged\" expected, \"" + arguments.bounces + "\" found");
    request.bounces = *bounces;
  }
  for (const float c : arguments.sky) {
    if (!std::isfinite(c) || c < 0.0f) return usage("--sky: three finite numbers of at least 0 expected");
  }
  request.skyRadiance = {arguments.sky[0], arguments.sky[1], arguments.sky[2]};
  request.samples = arguments.samples;
  request.shadowSize = arguments.shadowSize;
  if (!arguments.bands.empty()) {
    const std::optional<Bands> bands = bandsByName(arguments.bands);
    if (!bands)
      return usage("--bands: a name such as Y3Co1Cg1 expected, bands 1..8, chroma's at most luma's, \"" +
                   arguments.bands + "\" found");
    request.bands = *bands;
  }
  request.deringing = arguments.deringing;
  const std::string extension = std::filesystem::path(arguments.output).extension().string();
  if (extension != ".exr" && extension != ".png")
    return usage("-o: a name that ends in .exr or .png expected, \"" + arguments.output + "\" found");
  return done();
}

// A bake fits a scene when its parts have the same names in the same order and the same content.
Status checkSameScene(const Scene& scene, const Bake& bake, const RenderArguments& arguments) {
  const std::string pair = "\"" + arguments.bake + "\" was not baked from \"" + arguments.scene + "\": ";
  const std::vector<BakedInstance> now = describeInstances(scene);
  if (now.size() != bake.instances.size()) {
    return Error{ErrorCode::invalidFile, pair + "it has " + std::to_string(bake.instances.size()) +
                                             " instances, the scene " + std::to_string(now.size())};
  }
  for (std::size_t i = 0; i < now.size(); ++i) {
    const BakedInstance& then = bake.instances[i];
    const std::string where = pair + "instance " + std::to_string(i) + " ";
    if (then.node != now[i].node)
      return Error{ErrorCode::invalidFile,
                   where + "is \"" + then.node + "\" in the bake and \"" + now[i].node + "\" in the scene"};
    if (then.contentHash != now[i].contentHash)
      return Error{ErrorCode::invalidFile, where + "(\"" + now[i].node + "\") has changed since; bake again"};
  }
  return done();
}

std::filesystem::path outputName(const std::string& output, const std::string& aov, bool several) {
  std::filesystem::path path(output);
  if (several) path.replace_extension("." + aov + path.extension().string());
  return path;
}

Status writeImages(const RenderedFrame& frame, const std::vector<Aov>& aovs, const RenderArguments& arguments,
                   std::vector<std::string>& written) {
  const float exposure = std::exp2(arguments.exposure);
  if (arguments.sideBySide && aovs.size() > 1) {
    const std::size_t count = aovs.size(), width = frame.width;
    std::vector<glm::vec3> wide(count * width * frame.height);
    for (std::size_t k = 0; k < count; ++k) {
      const std::vector<glm::vec3> image = composeAov(frame, aovs[k]);
      for (std::size_t i = 0; i < image.size(); ++i) wide[(i / width * count + k) * width + i % width] = image[i];
    }
    written.push_back(arguments.output);
    return writeImage(arguments.output, static_cast<std::uint32_t>(count * width), frame.height, wide, exposure);
  }
  for (const Aov aov : aovs) {
    const auto path = outputName(arguments.output, aovNames()[static_cast<std::size_t>(aov)], aovs.size() > 1);
    if (Status ok = writeImage(path, frame.width, frame.height, composeAov(frame, aov), exposure); !ok) return ok;
    written.push_back(path.string());
  }
  return done();
}

void printReport(const RenderedFrame& frame, const std::vector<std::string>& written, double drawMs, bool json) {
  if (json) {
    nlohmann::json report{
        {"images", written}, {"renderer", frame.renderer}, {"relightFrames", frame.frames}, {"totalMs", drawMs}};
    if (!frame.bands.empty()) report["bands"] = frame.bands;
    report["passMs"] = nlohmann::json::object();
    for (const PassTime& pass : frame.passTimes) report["passMs"][pass.pass] = pass.ms;
    report["bufferBytes"] = nlohmann::json::object();
    for (const auto& [name, bytes] : frame.bufferBytes) report["bufferBytes"][name] = bytes;
    std::printf("%s\n", report.dump().c_str());
    return;
  }
  for (const std::string& path : written) std::printf("wrote %s\n", path.c_str());
  if (frame.passTimes.empty()) return;
  std::printf("%d relight frames of %s on %s; the last, ms a pass:", frame.frames, frame.bands.c_str(),
              frame.renderer.c_str());
  for (const PassTime& pass : frame.passTimes) std::printf("  %s %.2f", pass.pass, pass.ms);
  std::printf("\n");
}

Result<RenderedFrame> drawWith(const std::string& backend, const Scene& scene, const RenderRequest& request,
                               Context& context) {
  if (backend == "gl") {
#ifdef RELUME_RENDER_GL
    return renderGl(scene, request, context);
#else
    return Error{ErrorCode::unsupported, "--backend gl: this relume was built without OpenGL"};
#endif
  }
  auto tracer = RayTracer::create(scene, BakeOptions{}.embreeIsa, context);
  if (!tracer) return tracer.error();
  return renderCpu(*tracer, request, context);
}

int runRender(const RenderArguments& arguments) {
  // 1. What is asked for
  RenderRequest request;
  if (Status ok = readOptions(arguments, request); !ok) return fail(ok.error());
  auto aovs = chooseAovs(arguments, request);
  if (!aovs) return fail(aovs.error());

  // 2. The scene, and a bake of it
  Terminal terminal(arguments.terminal);
  Context& context = terminal.context();
  auto scene = loadScene(arguments.scene, context);
  if (!scene) return fail(scene.error());
  if (Status ok = chooseCamera(*scene, arguments.camera, request); !ok) return fail(ok.error());
  if (Status ok = chooseLights(*scene, arguments.lights, request); !ok) return fail(ok.error());
  if (!arguments.lightsFile.empty()) {
    const auto more = readLightsFile(arguments.lightsFile);
    if (!more) return fail(more.error());
    request.lights.insert(request.lights.end(), more->begin(), more->end());
  }
  std::optional<Bake> bake;
  if (!arguments.bake.empty()) {
    auto file = readBake(arguments.bake);
    if (!file) return fail(file.error());
    bake.emplace(std::move(*file));
    if (Status ok = checkSameScene(*scene, *bake, arguments); !ok) return fail(ok.error());
    request.bake = &*bake;
  }

  // 3. Draw and write
  const auto begin = std::chrono::steady_clock::now();
  auto frame = drawWith(arguments.backend, *scene, request, context);
  terminal.finish();
  if (!frame) return fail(frame.error());
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  std::vector<std::string> written;
  if (Status ok = writeImages(*frame, *aovs, arguments, written); !ok) return fail(ok.error());
  printReport(*frame, written, ms, arguments.json);
  return 0;
}

}  // namespace

void addRenderCommand(CLI::App& app, Action& action) {
  auto a = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "Relight a camera's view with a bake, without a window");
  command->add_option("SCENE", a->scene, "glTF scene (.glb, .gltf) the bake was made from")->required();
  command->add_option("--bake", a->bake, "bake of that scene (.relume); without one, only direct light is known");
  command->add_option("--camera", a->camera, "camera by name; default: the scene's first");
  command
      ->add_option("--lights", a->lights,
                   "lights that are on, by name, separated by commas; \"emissive\" = all emitting surfaces")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--lights-file", a->lightsFile,
                      "more lights that are on: a JSON list of {type, position, direction, color, intensity, range, "
                      "innerConeAngle, outerConeAngle}, as KHR_lights_punctual");
  command->add_option("--sky", a->sky, "radiance of a constant sky as R,G,B [W/m^2/sr]")
      ->delimiter(',')
      ->expected(3)
      ->capture_default_str();
  command->add_option("--bounces", a->bounces, "how often light is reflected at most: 1..1000 or converged")
      ->capture_default_str();
  command
      ->add_option("--aov", a->aovs,
                   "what to draw, separated by commas: indirect, bounced, direct (irradiance / pi without albedo), "
                   "full, unbounced (radiance), albedo, normal, position, depth. Several go to several files: "
                   "out.NAME.exr")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--size", a->size, "pixels of the image, WIDTHxHEIGHT, 1..16384 each")->capture_default_str();
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
                      "recommends");
  command
      ->add_option("--deringing", a->deringing,
                   "strength of a window over the bands that receivers off the light map's own normals read")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--exposure", a->exposure, "stops by which a PNG is brightened; above 1 clips")
      ->check(CLI::Range(-30.0, 30.0))
      ->capture_default_str();
  command->add_flag("--side-by-side", a->sideBySide, "put several AOVs into one image, from left to right");
  command->add_option("-o,--output", a->output, "image to write: .exr (linear, 32-bit) or .png (sRGB)")->required();
  command->add_flag("--json", a->json, "print what was written and what each pass cost as JSON");
  addTerminalOptions(*command, a->terminal);
  command->callback([a, &action] { action = [a] { return runRender(*a); }; });
}

}  // namespace relume
