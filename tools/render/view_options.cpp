// SPDX-License-Identifier: MIT
// See view_options.h.
#include "tools/render/view_options.h"

#include "bake/base/printed.h"
#include "bake/scene/unit_vector.h"
#include "formats/limits.h"
#include "relume/glossy.h"
#include "tools/base/number_check.h"
#include "tools/base/parse_numbers.h"
#include "tools/base/usage_message.h"
#include "tools/render/default_view.h"
#include "tools/render/lights_file.h"
#include "tools/render/read_sky_map.h"

#include <CLI/CLI.hpp>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace relume {
namespace {

template <class Item>
std::string namesOf(std::span<const Item> items) {
  std::string text;
  for (const Item& item : items) {
    text += (text.empty() ? "\"" : ", \"") + item.name + "\"";
    if (!item.node.empty() && item.node != item.name) text += " (node \"" + item.node + "\")";
  }
  return text.empty() ? "none" : text;
}

constexpr float kDefaultFovDeg = 60.0f;  // of --eye

Status readSize(const std::string& text, View& view) {
  const std::size_t x = text.find('x');
  if (x != std::string::npos) {
    const auto width = wholeNumber(std::string_view(text).substr(0, x), 1, 16384);
    const auto height = wholeNumber(std::string_view(text).substr(x + 1), 1, 16384);
    if (width && height) {
      view.width = static_cast<std::uint32_t>(*width);
      view.height = static_cast<std::uint32_t>(*height);
      return done();
    }
  }
  return usage("--size: WIDTHxHEIGHT of 1..16384 pixels each expected, \"" + text + "\" found");
}

Result<glm::vec3> readPoint(const char* option, const std::string& text) {
  const std::optional<glm::vec3> point = threeNumbers(text);
  if (!point || !isWithin(*point, kMaxLevelCoordinate))
    return usage(std::string(option) + ": X,Y,Z in metres, within 1e8, expected, \"" + text + "\" found");
  return *point;
}

// Vertical field of view [rad], or nothing when the options leave it to the camera.
Result<std::optional<float>> readFov(const std::string& text) {
  if (text.empty()) return std::optional<float>();
  const std::optional<float> degrees = finiteNumber(text);
  if (!degrees || *degrees < 1.0f || *degrees > 170.0f)
    return usage("--fov: 1..170 degrees expected, \"" + text + "\" found");
  return std::optional(glm::radians(*degrees));
}

Result<Camera> cameraAtEye(const ViewOptions& options, const std::optional<float>& fov) {
  if (options.eye.empty() || options.target.empty()) return usage("--eye and --target go together: one is missing");
  if (!options.camera.empty()) return usage("--camera and --eye exclude each other");
  const auto eye = readPoint("--eye", options.eye), target = readPoint("--target", options.target);
  if (!eye) return eye.error();
  if (!target) return target.error();
  if (unitVector(glm::dvec3(*target) - glm::dvec3(*eye)) == glm::dvec3(0.0))
    return usage("--target: a point other than --eye's expected, both are " + options.eye);
  return lookAt(*eye, *target, fov.value_or(glm::radians(kDefaultFovDeg)));
}

Result<Camera> chooseCamera(const ViewOptions& options, const Scene& scene, const View& view, Context& context) {
  const auto fov = readFov(options.fov);
  if (!fov) return fov.error();
  if (!options.eye.empty() || !options.target.empty()) return cameraAtEye(options, *fov);
  if (scene.cameras.empty() && options.camera.empty()) {
    const float aspect = static_cast<float>(view.width) / static_cast<float>(view.height);
    auto framed = frameLevel(scene, fov->value_or(glm::radians(kDefaultFovDeg)), aspect, context);
    if (!framed) return framed.error();
    context.message(Severity::info,
                    printed("\"%s\" has no camera; the level is framed: --eye %.6g,%.6g,%.6g --target %.6g,%.6g,%.6g",
                            scene.name.c_str(), framed->eye.x, framed->eye.y, framed->eye.z, framed->target.x,
                            framed->target.y, framed->target.z));
    return lookAt(framed->eye, framed->target, fov->value_or(glm::radians(kDefaultFovDeg)));
  }
  const NamedCamera named = cameraCalled(scene, options.camera);
  if (named.camera == nullptr)
    return usage("--camera: no camera \"" + options.camera +
                 "\" in the scene; there are: " + namesForPeople(scene.cameras));
  if (!named.warning.empty()) context.message(Severity::warning, named.warning);
  Camera chosen = *named.camera;
  if (*fov && chosen.orthographic)
    return usage("--fov: camera \"" + chosen.name + "\" is orthographic, which has no field of view");
  chosen.yfovRad = fov->value_or(chosen.yfovRad);
  return chosen;
}

// Which lights are on. A name may stand for several lights: one glTF light on two nodes.
Status chooseLights(const std::vector<std::string>& parts, const Scene& scene, View& view) {
  const std::vector<std::string> names = lightNames(parts, scene);
  for (const std::string& name : names) {
    if (names.size() > 1 && (name == "all" || name == "none")) return usage("--lights: \"" + name + "\" stands alone");
    const bool all = name == "all";
    bool known = all || name == "none" || name == "emissive";
    if (all || name == "emissive") view.emissive = true;
    if (all) view.lights = scene.lights;
    for (const SceneLight* const light : allCalled(scene.lights, name)) {
      if (!all) view.lights.push_back(*light);
      known = true;
    }
    if (!known) {
      return usage("--lights: no light \"" + name + "\" in the scene; there are: " + namesForPeople(scene.lights) +
                   ", and emissive, all, none");
    }
  }
  return done();
}

}  // namespace

std::string namesForPeople(std::span<const Camera> cameras) { return namesOf(cameras); }
std::string namesForPeople(std::span<const SceneLight> lights) { return namesOf(lights); }

NamedCamera cameraCalled(const Scene& scene, const std::string& name) {
  if (name.empty()) return {scene.cameras.empty() ? nullptr : &scene.cameras.front()};
  const std::vector<const Camera*> found = allCalled(scene.cameras, name);
  if (found.empty()) return {};
  NamedCamera named{found.front()};
  if (found.size() > 1) {
    std::vector<Camera> cameras;
    for (const Camera* const camera : found) cameras.push_back(*camera);
    named.warning = "--camera: \"" + name +
                    "\" is the name of several cameras, and the first is shown: " + namesForPeople(cameras) +
                    "; give them names of their own, and that of one of their nodes here";
  }
  return named;
}

std::vector<std::string> lightNames(const std::vector<std::string>& parts, const Scene& scene) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < parts.size();) {
    std::string name = parts[i], longer = name;
    std::size_t end = i + 1;
    for (std::size_t k = i + 1; k < parts.size(); ++k) {
      longer += "," + parts[k];
      if (std::none_of(scene.lights.begin(), scene.lights.end(),
                       [&](const SceneLight& light) { return isCalled(light, longer); }))
        continue;
      name = longer;
      end = k + 1;
    }
    names.push_back(std::move(name));
    i = end;
  }
  return names;
}

Camera lookAt(const glm::vec3& eye, const glm::vec3& target, float yfovRad) {
  const glm::dvec3 back = unitVector(glm::dvec3(eye) - glm::dvec3(target));
  // Straight up or down, the top of the image is -Z.
  const glm::dvec3 up = std::abs(back.y) < 0.9999 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, -1);
  const glm::dvec3 right = unitVector(glm::cross(up, back));
  Camera camera;
  camera.name = "eye";
  camera.yfovRad = yfovRad;
  camera.toWorld[0] = glm::vec4(glm::vec3(right), 0.0f);
  camera.toWorld[1] = glm::vec4(glm::vec3(glm::cross(back, right)), 0.0f);
  camera.toWorld[2] = glm::vec4(glm::vec3(back), 0.0f);
  camera.toWorld[3] = glm::vec4(eye, 1.0f);
  return camera;
}

void addViewOptions(CLI::App& command, ViewOptions& options) {
  command.add_option("--camera", options.camera,
                     "camera by its node's name, or else its own; default: the scene's first, or one that frames the "
                     "level when it has none");
  command.add_option("--eye", options.eye, "X,Y,Z [m]: look from here instead of from a camera; with --target");
  command.add_option("--target", options.target, "X,Y,Z [m]: look at this point; with --eye");
  command.add_option("--fov", options.fov,
                     "vertical field of view [degrees], 1..170; default: the camera's, 60 with --eye");
  command
      .add_option(
          "--lights", options.lights,
          "lights that are on, by their nodes' names, or else their own, separated by commas; \"emissive\" = all "
          "emitting surfaces; or all, none")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  command
      .add_option("--lights-file", options.lightsFile,
                  "more lights that are on: a JSON list of {type, position, direction, color, intensity, range, "
                  "innerConeAngle, outerConeAngle}, as KHR_lights_punctual, but in W/sr and W/m^2 whatever "
                  "--light-unit says")
      ->type_name("FILE");
  command
      .add_option("--sky", options.sky,
                  "radiance of a constant sky as R,G,B, or R,G,B,R,G,B of overhead and underfoot [W/m^2/sr]")
      ->capture_default_str();
  command
      .add_option("--sky-map", options.skyMap,
                  "radiance of the sky by direction: an equirectangular OpenEXR or Radiance HDR file [W/m^2/sr], its "
                  "middle toward -Z; a sun in it is better a directional light")
      ->type_name("FILE");
  command
      .add_option("--sky-rotation", options.skyRotation,
                  "turn the sky map about +Y, counter-clockwise seen from above [degrees], -360..360")
      ->capture_default_str();
  command.add_option("--size", options.size, "pixels of the image, WIDTHxHEIGHT, 1..16384 each")->capture_default_str();
}

void addExponentOption(CLI::App& command, std::string& text) {
  command
      .add_option("--exponent", text,
                  "exponent of the lobes of glossy light on every surface, 0..10000; a roughness r has 0.5 / r^4 - 0.5")
      ->type_name("N");
}

Result<std::optional<float>> readExponent(const std::string& text) {
  if (text.empty()) return std::optional<float>();
  const std::optional<float> exponent = finiteNumber(text);
  if (!exponent || *exponent < 0.0f || *exponent > kMaxExponent)
    return usage("--exponent: a number of 0 to 10000 expected, \"" + text + "\" found");
  return exponent;
}

void addGlossOption(CLI::App& command, bool& gloss) {
  command.add_flag("--gloss", gloss,
                   "surfaces mirror as their materials say, by metalness, roughness and normal maps: in full, and "
                   "alone as --aov glossy; without it all of a surface's base colour is diffuse");
}

void addFalloffOption(CLI::App& command, float& falloff) {
  command
      .add_option("--occlusion-falloff", falloff,
                  "with --aov occlusion: what is d metres away hides by 1 / (1 + this d); 0: at any distance alike")
      ->check(numberFrom(0.0, 1e6))
      ->capture_default_str();
}

Status checkFalloff(bool occlusionIsDrawn, float falloff) {
  if (!occlusionIsDrawn && falloff != kOcclusionFalloff) return usage("--occlusion-falloff needs --aov occlusion");
  return done();
}

Status checkGloss(bool glossyIsDrawn, bool hasExponent, bool gloss) {
  if (hasExponent && gloss) return usage("--exponent and --gloss: one of them expected, both found");
  if (glossyIsDrawn && !hasExponent && !gloss)
    return usage("--aov glossy needs --exponent, of the lobe about the reflected direction, or --gloss");
  return done();
}

// "R,G,B" of a constant sky, or "R,G,B,R,G,B" of what is overhead and what is underfoot.
Status readSky(const std::string& text, Sky& sky) {
  std::size_t comma = text.find(',');  // the third
  for (int i = 0; i < 2 && comma != std::string::npos; ++i) comma = text.find(',', comma + 1);
  const auto color = [](const std::string& part) {
    const std::optional<glm::vec3> c = threeNumbers(part);
    return c && isRadiance(*c) ? c : std::nullopt;
  };
  const std::optional<glm::vec3> above = color(text.substr(0, comma));
  if (comma != std::string::npos) sky.below = color(text.substr(comma + 1));
  if (!above || (comma != std::string::npos && !sky.below)) {
    return usage("--sky: R,G,B, or R,G,B,R,G,B for overhead and underfoot, numbers of 0 to 1e9, expected, \"" + text +
                 "\" found");
  }
  sky.radiance = *above;
  return done();
}

Result<View> readView(const ViewOptions& options) {
  View view;
  if (Status ok = readSize(options.size, view); !ok) return ok.error();
  if (Status ok = readSky(options.sky, view.sky); !ok) return ok.error();
  if (!options.skyMap.empty() && !view.sky.isDark())
    return usage("--sky and --sky-map: one of them expected, both found");
  const std::optional<float> rotation = finiteNumber(options.skyRotation);
  if (!rotation || std::abs(*rotation) > 360.0f)
    return usage("--sky-rotation: degrees of -360 to 360 expected, \"" + options.skyRotation + "\" found");
  if (*rotation != 0.0f && options.skyMap.empty()) return usage("--sky-rotation needs --sky-map");
  view.sky.rotationDeg = *rotation;
  return view;
}

Status completeView(const ViewOptions& options, const Scene& scene, Context& context, View& view) {
  auto camera = chooseCamera(options, scene, view, context);
  if (!camera) return camera.error();
  view.camera = *camera;
  if (Status ok = chooseLights(options.lights, scene, view); !ok) return ok;
  if (!options.skyMap.empty()) {
    auto map = readSkyMap(options.skyMap, context);
    if (!map) return map.error();
    view.sky.map = std::make_shared<const SkyMap>(std::move(*map));
  }
  if (options.lightsFile.empty()) return done();
  const auto more = readLightsFile(options.lightsFile);
  if (!more) return more.error();
  view.lights.insert(view.lights.end(), more->begin(), more->end());
  return done();
}

}  // namespace relume
