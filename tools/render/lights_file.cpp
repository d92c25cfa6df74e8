// SPDX-License-Identifier: MIT
// See lights_file.h.
#include "tools/render/lights_file.h"

#include "bake/base/read_json.h"
#include "bake/scene/unit_vector.h"
#include "formats/decimal.h"
#include "formats/file_io.h"
#include "formats/limits.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

namespace relume {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxLights = 4096, kMaxBytes = 16 << 20;

// Reads the fields of one light; the first that is wrong is told.
class LightReader {
 public:
  LightReader(const json& object, std::string where) : object_(object), where_(std::move(where)) {}

  Result<SceneLight> read() {
    if (!object_.is_object()) return wrong("is not an object");
    for (const auto& field : object_.items()) {
      const std::string& name = field.key();
      static const std::array<const char*, 9> kKnown = {
          "type", "name", "position", "direction", "color", "intensity", "range", "innerConeAngle", "outerConeAngle"};
      if (std::none_of(kKnown.begin(), kKnown.end(), [&](const char* known) { return name == known; })) {
        return wrong("has an unknown field \"" + name.substr(0, 40) + "\"");
      }
    }
    const std::string type = text("type");
    SceneLight light;
    light.name = text("name");
    if (type == "point")
      light.kind = LightKind::point;
    else if (type == "spot")
      light.kind = LightKind::spot;
    else if (type == "directional")
      light.kind = LightKind::directional;
    else
      return wrong("has a \"type\" other than point, spot and directional");
    const bool placed = light.kind != LightKind::directional, aimed = light.kind != LightKind::point;

    light.positionWorld = glm::vec3(vector("position", placed));
    const glm::dvec3 direction = aimed ? vector("direction", true) : glm::dvec3(0, 0, -1);
    light.intensity =
        glm::vec3(static_cast<double>(number("intensity", 1.0f)) * vector("color", false, glm::dvec3(1.0)));
    light.range = number("range", 0.0f);
    light.innerConeRad = number("innerConeAngle", 0.0f);
    light.outerConeRad = number("outerConeAngle", light.outerConeRad);
    if (!error_.empty()) return wrong(error_);
    if (direction == glm::dvec3(0.0)) return wrong("has a \"direction\" of no length");
    // One that was written by writeLightsFile() comes back to the bit.
    const bool isUnit = std::abs(glm::length(direction) - 1.0) <= 1e-6;
    light.direction = glm::vec3(isUnit ? direction : unitVector(direction));
    for (int c = 0; c < 3; ++c) {
      if (!(light.intensity[c] >= 0.0f) || !std::isfinite(light.intensity[c]))
        return wrong("is less than dark, or endless");
    }
    if (!isWithin(light.intensity, kMaxIntensity)) return wrong("has an intensity above 1e20");
    if (!isWithin(light.positionWorld, kMaxLevelCoordinate)) return wrong("has a \"position\" beyond 1e8 m");
    if (light.range < 0.0f) return wrong("has a negative \"range\"");
    if (!(light.innerConeRad >= 0.0f && light.innerConeRad <= light.outerConeRad &&
          light.outerConeRad <= glm::half_pi<float>())) {
      return wrong("breaks 0 <= innerConeAngle <= outerConeAngle <= pi/2");
    }
    return light;
  }

 private:
  Error wrong(const std::string& what) const { return {ErrorCode::invalidFile, where_ + " " + what}; }

  std::string text(const char* name) const {
    const auto at = object_.find(name);
    return at != object_.end() && at->is_string() ? at->get<std::string>() : std::string();
  }
  float number(const char* name, float otherwise) {
    const auto at = object_.find(name);
    if (at == object_.end()) return otherwise;
    return static_cast<float>(finite(*at, name));
  }
  glm::dvec3 vector(const char* name, bool required, const glm::dvec3& otherwise = glm::dvec3(0.0)) {
    const auto at = object_.find(name);
    if (at == object_.end()) {
      if (required) error_ = std::string("has no \"") + name + "\"";
      return otherwise;
    }
    if (!at->is_array() || at->size() != 3) {
      error_ = std::string("has a \"") + name + "\" that is not three numbers";
      return otherwise;
    }
    return {finite((*at)[0], name), finite((*at)[1], name), finite((*at)[2], name)};
  }
  // As double: what a float flushes to zero still points somewhere.
  double finite(const json& value, const char* name) {
    const double v = value.is_number() ? value.get<double>() : std::nan("");
    if (!(std::abs(v) <= static_cast<double>(std::numeric_limits<float>::max())))
      error_ = std::string("has a \"") + name + "\" that is no finite number";
    return v;
  }

  const json& object_;
  std::string where_, error_;
};

std::string vectorText(const glm::vec3& v) {
  return "[" + decimal(v.x) + ", " + decimal(v.y) + ", " + decimal(v.z) + "]";
}

// Colour [0..1] and intensity whose product is the light's, as the reader multiplies: in double precision, then
// rounded.
std::string intensityText(const glm::vec3& intensity) {
  const float most = std::max({intensity.x, intensity.y, intensity.z});
  if (!(most > 0.0f)) return "\"color\": [1, 1, 1], \"intensity\": 0";
  std::string color;
  for (int c = 0; c < 3; ++c) {
    const double share = static_cast<double>(intensity[c]) / static_cast<double>(most);
    const std::string brief = decimal(static_cast<float>(share));
    double read = 0.0;
    std::from_chars(brief.data(), brief.data() + brief.size(), read);
    const bool same = static_cast<float>(static_cast<double>(most) * read) == intensity[c];
    color += (c > 0 ? ", " : "") + (same ? brief : decimal(share));
  }
  return "\"color\": [" + color + "], \"intensity\": " + decimal(most);
}

std::string lightText(const SceneLight& light) {
  const char* type = light.kind == LightKind::point ? "point" : light.kind == LightKind::spot ? "spot" : "directional";
  std::string text = std::string("{\"type\": \"") + type + "\"";
  if (!light.name.empty())
    text += ", \"name\": " + json(light.name).dump(-1, ' ', false, json::error_handler_t::replace);
  // A directional light's position says where tools draw it.
  text += ", \"position\": " + vectorText(light.positionWorld);
  if (light.kind != LightKind::point) text += ", \"direction\": " + vectorText(light.direction);
  text += ", " + intensityText(light.intensity);
  if (light.range > 0.0f) text += ", \"range\": " + decimal(light.range);
  if (light.kind == LightKind::spot) {
    text +=
        ", \"innerConeAngle\": " + decimal(light.innerConeRad) + ", \"outerConeAngle\": " + decimal(light.outerConeRad);
  }
  return text + "}";
}

// A file that is there may be replaced when it is a list of lights, or empty.
Status checkReplaceable(const std::filesystem::path& path) {
  std::error_code failed;
  if (!std::filesystem::exists(path, failed) || std::filesystem::is_empty(path, failed)) return done();
  const auto there = readLightsFile(path);
  if (there) return done();
  if (there.error().code == ErrorCode::io) return there.error();
  return Error{ErrorCode::usage, "\"" + path.string() + "\" exists and is not a list of lights; choose another name"};
}

}  // namespace

std::string lightsFileText(std::span<const SceneLight> lights) {
  std::string text = "[";
  for (std::size_t i = 0; i < lights.size(); ++i) text += (i > 0 ? ",\n  " : "\n  ") + lightText(lights[i]);
  return text + (lights.empty() ? "]\n" : "\n]\n");
}

Status writeLightsFile(const std::filesystem::path& path, std::span<const SceneLight> lights) {
  if (lights.size() > kMaxLights) {
    return Error{ErrorCode::usage,
                 std::to_string(lights.size()) + " lights, at most " + std::to_string(kMaxLights) + " in a file"};
  }
  if (Status ok = checkWritable(path); !ok) return ok;
  if (Status ok = checkReplaceable(path); !ok) return ok;
  const std::string text = lightsFileText(lights);
  return writeFileAtomically(path, [&](const ByteSink& sink) { return sink(std::as_bytes(std::span(text))); });
}

Result<std::vector<SceneLight>> readLightsFile(const std::filesystem::path& path) {
  const Result<FileBytes> file = readFile(path, kMaxBytes);
  if (!file) return file.error();
  const std::string name = "\"" + path.string() + "\": ";
  const auto* begin = reinterpret_cast<const char*>(file->bytes.data());
  const Result<json> list = readJson({begin, file->bytes.size()}, JsonComments::skip);
  if (!list) return Error{ErrorCode::invalidFile, name + list.error().message + "; a JSON list of lights expected"};
  if (!list->is_array()) return Error{ErrorCode::invalidFile, name + "a JSON list of lights expected"};
  if (list->size() > kMaxLights) {
    return Error{ErrorCode::invalidFile,
                 name + std::to_string(list->size()) + " lights, at most " + std::to_string(kMaxLights)};
  }
  std::vector<SceneLight> lights;
  for (std::size_t i = 0; i < list->size(); ++i) {
    Result<SceneLight> light = LightReader((*list)[i], name + "light " + std::to_string(i)).read();
    if (!light) return light.error();
    lights.push_back(std::move(*light));
  }
  return lights;
}

}  // namespace relume
