// SPDX-License-Identifier: MIT
// KHR_lights_punctual, and the unit of its lights. KHR_lights_punctual says candela and lux, and Blender's exporter
// writes them by default (its watts, or watts by 4 pi sr, times 683 lm/W); levels made for Relume have W/sr and W/m².
// Nothing in a file tells the two apart but the sizes of its numbers.
#include "bake/base/printed.h"
#include "bake/import/gltf_import.h"
#include "formats/decimal.h"
#include "formats/limits.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace relume {
namespace {

// Intensities beyond these are taken to be photometric. For files of Blender: a lamp of 200 W/sr emits 2.5 kW, while
// one of 200 cd emits 4 W. For other files: more than the sun sends to the top of the atmosphere (1361 W/m²), or a lamp
// of 125 kW.
struct Suspicious {
  float pointOrSpot, directional;  // [W/sr], [W/m²]
};
constexpr Suspicious kOfBlender{200.0f, 200.0f}, kOfOthers{10000.0f, 2000.0f};

bool isFromBlender(const GltfDocument& document) {
  return document.model.asset.generator.find("Blender") != std::string::npos;
}

// extras.relume.lightUnit of one element; nothing when it says none.
Result<std::optional<LightUnit>> readUnit(const GltfDocument& document, const tinygltf::Value& extras,
                                          const std::string& where) {
  if (!extras.IsObject() || !extras.Has("relume")) return std::optional<LightUnit>();
  const std::string path = where + ".extras.relume";
  const tinygltf::Value& relume = extras.Get("relume");
  if (!relume.IsObject()) return document.invalid(path, "expected an object");
  if (!relume.Has("lightUnit")) return std::optional<LightUnit>();
  const tinygltf::Value& unit = relume.Get("lightUnit");
  const std::string name = unit.IsString() ? unit.Get<std::string>() : "";
  if (name == "radiometric") return std::optional(LightUnit::radiometric);
  if (name == "photometric") return std::optional(LightUnit::photometric);
  return document.invalid(path + ".lightUnit", "'" + name + "'; expected \"radiometric\" or \"photometric\"");
}

// What the file itself says: its scene, else its asset.
Result<std::optional<LightUnit>> statedUnit(const GltfDocument& document) {
  const auto& model = document.model;
  if (!model.scenes.empty()) {
    const int index = std::max(model.defaultScene, 0);
    auto unit = readUnit(document, model.scenes[static_cast<std::size_t>(index)].extras, jsonPath("scenes", index));
    if (!unit || *unit) return unit;
  }
  return readUnit(document, model.asset.extras, "asset");
}

// The light that exceeds its limit by the largest factor; null when none does.
const SceneLight* suspiciousLight(const std::vector<SceneLight>& lights, const Suspicious& bounds) {
  const SceneLight* found = nullptr;
  float farthest = 1.0f;
  for (const SceneLight& light : lights) {
    const float bound = light.kind == LightKind::directional ? bounds.directional : bounds.pointOrSpot;
    const float share = std::max({light.intensity.x, light.intensity.y, light.intensity.z}) / bound;
    if (share <= farthest) continue;
    farthest = share;
    found = &light;
  }
  return found;
}

std::string warningOf(const SceneLight& light, bool fromBlender) {
  const float intensity = std::max({light.intensity.x, light.intensity.y, light.intensity.z});
  const bool directional = light.kind == LightKind::directional;
  const std::string size =
      directional ? printed("%.4g, which would be %.3g times the sun above the air as W/m^2 and %.3g W/m^2 as lux",
                            intensity, intensity / 1361.0, intensity / kLumensPerWatt)
                  : printed("%.4g, which would be a lamp of %.3g kW as W/sr and one of %.3g W as candela", intensity,
                            intensity * 12.566 / 1000.0, intensity * 12.566 / kLumensPerWatt);
  return "the lights look photometric" + std::string(fromBlender ? ", as Blender writes them" : "") +
         ", and are read as radiometric: \"" + light.name + "\" has " + size +
         ". Say --light-unit photometric (or \"radiometric\", if the numbers are meant), or for good "
         "extras.relume.lightUnit on the file's scene or asset";
}

}  // namespace

Result<SceneLight> readLight(const GltfDocument& document, int index) {
  const tinygltf::Light& source = document.model.lights[static_cast<std::size_t>(index)];
  const std::string path = jsonPath("lights", index) + (source.name.empty() ? "" : " '" + source.name + "'");
  SceneLight light;
  light.name = source.name;
  if (source.type == "directional") {
    light.kind = LightKind::directional;
  } else if (source.type == "spot") {
    light.kind = LightKind::spot;
  } else if (source.type != "point") {
    return document.invalid(path, "type '" + source.type + "'; expected directional, point or spot");
  }
  for (int i = 0; i < 3; ++i) {
    const double color = source.color.size() == 3 ? source.color[static_cast<std::size_t>(i)] : 1.0;
    light.intensity[i] = static_cast<float>(color * source.intensity);
    if (!(light.intensity[i] >= 0.0f) || !std::isfinite(light.intensity[i]))
      return document.invalid(path, "intensity or colour is negative or not finite");
  }
  light.range = static_cast<float>(source.range);
  light.innerConeRad = static_cast<float>(source.spot.innerConeAngle);
  light.outerConeRad = static_cast<float>(source.spot.outerConeAngle);
  if (!(light.range >= 0.0f)) return document.invalid(path, "range is negative");
  if (light.range >= kMaxCoordinate) light.range = 0.0f;  // farther than any surface: no limit
  const bool cone = light.innerConeRad >= 0.0f && light.innerConeRad <= light.outerConeRad &&
                    light.outerConeRad > 0.0f && light.outerConeRad <= 1.5707964f;
  if (light.kind == LightKind::spot && !cone)
    return document.invalid(path, "cone angles " + decimal(light.innerConeRad) + " and " + decimal(light.outerConeRad) +
                                      "; expected 0 <= inner <= outer <= pi / 2");
  return light;
}

Status convertLights(const GltfDocument& document, std::optional<LightUnit> asked, Scene& scene, Context& context) {
  const auto stated = statedUnit(document);
  if (!stated) return stated.error();
  const std::optional<LightUnit> said = asked ? asked : *stated;
  if (!said) {
    const bool fromBlender = isFromBlender(document);
    const SceneLight* light = suspiciousLight(scene.lights, fromBlender ? kOfBlender : kOfOthers);
    if (light != nullptr) context.message(Severity::warning, document.at(warningOf(*light, fromBlender)));
  }
  scene.lightUnit = said.value_or(LightUnit::radiometric);
  if (scene.lightUnit == LightUnit::radiometric) return done();
  for (SceneLight& light : scene.lights) light.intensity /= static_cast<float>(kLumensPerWatt);
  return done();
}

}  // namespace relume
