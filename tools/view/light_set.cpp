// SPDX-License-Identifier: MIT
// See light_set.h.
#include "tools/view/light_set.h"

#include "tools/render/lights_file.h"
#include "tools/render/render_frame.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <map>

namespace relume {
namespace {

// Of a new light, before the camera: in a room, [m]; in any level; and of the way to what is seen there.
constexpr float kAhead = 2.0f, kAheadOfLevel = 0.2f, kAheadOfSurface = 0.8f;

SceneLight toSceneLight(const ViewedLight& viewed) {
  const Light& light = viewed.light;
  SceneLight scene;
  scene.name = viewed.name;
  scene.kind = light.kind;
  scene.intensity = light.intensity;
  scene.positionWorld = light.positionWorld;
  scene.direction = light.direction;
  scene.range = light.range;
  scene.innerConeRad = light.innerConeRad;
  scene.outerConeRad = light.outerConeRad;
  return scene;
}

// The one of that name and number among those of the name, or null.
const ViewedLight* lightNamed(std::span<const ViewedLight> lights, const std::string& name, std::size_t number) {
  for (const ViewedLight& light : lights) {
    if (light.name == name && number-- == 0) return &light;
  }
  return nullptr;
}

// `light` in place of `like`: on and orbiting as that is, and with its id.
ViewedLight switchedAs(ViewedLight light, const ViewedLight& like) {
  light.on = like.on;
  light.orbits = like.orbits;
  light.id = like.id;
  return light;
}

const char* kindName(LightKind kind) {
  return kind == LightKind::point ? "point" : kind == LightKind::spot ? "spot" : "sun";
}

}  // namespace

std::size_t lightsOn(std::span<const ViewedLight> lights) {
  return static_cast<std::size_t>(
      std::count_if(lights.begin(), lights.end(), [](const ViewedLight& l) { return l.on; }));
}

std::string countOfLights(std::size_t lights) { return std::to_string(lights) + (lights == 1 ? " light" : " lights"); }

std::vector<SceneLight> sceneLightsOn(std::span<const ViewedLight> lights) {
  std::vector<SceneLight> on;
  for (const ViewedLight& viewed : lights) {
    if (viewed.on) on.push_back(toSceneLight(viewed));
  }
  return on;
}

std::size_t limitLightsOn(std::span<ViewedLight> lights) {
  std::size_t on = 0, switchedOff = 0;
  for (ViewedLight& light : lights) {
    if (!light.on || ++on <= kMaxLightsOn) continue;
    light.on = false;
    ++switchedOff;
  }
  return switchedOff;
}

std::string switchedOffText(std::size_t lights) {
  return countOfLights(lights) + " switched off: " + std::to_string(kMaxLightsOn) + " are on, and no more can be";
}

std::string freeName(const std::string& base, std::span<const ViewedLight> lights) {
  const auto taken = [&](const std::string& name) {
    return std::any_of(lights.begin(), lights.end(), [&](const ViewedLight& l) { return l.name == name; });
  };
  std::string name = base;
  for (int i = 2; taken(name); ++i) name = base + " " + std::to_string(i);
  return name;
}

ViewedLight newLight(LightKind kind, const FlyCamera& camera, std::span<const ViewedLight> lights,
                     const RoomAhead& around) {
  const float roomy = std::min(kAhead, kAheadOfLevel * around.levelSize);
  const float ahead = around.surfaceDistance ? std::min(roomy, kAheadOfSurface * *around.surfaceDistance) : roomy;
  // What is so many times as small is lit as well by the square of that.
  const float power = 10.0f * (roomy / kAhead) * (roomy / kAhead);
  ViewedLight viewed;
  viewed.name = freeName(kindName(kind), lights);
  viewed.light.kind = kind;
  viewed.light.intensity = glm::vec3(kind == LightKind::directional ? 3.0f : power);
  viewed.light.positionWorld = viewed.home = camera.position + ahead * camera.forward();
  viewed.light.direction = glm::normalize(camera.forward() + glm::vec3(0.0f, -1.5f, 0.0f));
  viewed.light.innerConeRad = 0.3f;
  viewed.light.outerConeRad = 0.6f;
  viewed.on = lightsOn(lights) < kMaxLightsOn;
  return viewed;
}

std::vector<ViewedLight> followFile(std::span<const ViewedLight> lights, std::span<const ViewedLight> before,
                                    std::span<const ViewedLight> now) {
  std::vector<ViewedLight> followed;
  std::map<std::string, std::size_t> shown, added;  // so far, by name
  for (const ViewedLight& light : lights) {
    const std::size_t number = shown[light.name]++;
    const ViewedLight* const was = lightNamed(before, light.name, number);
    if (was == nullptr || !(switchedAs(*was, light) == light)) {
      followed.push_back(light);
    } else if (const ViewedLight* const is = lightNamed(now, light.name, number)) {
      followed.push_back(switchedAs(*is, light));
    }
  }
  for (const ViewedLight& light : now) {
    if (lightNamed(before, light.name, added[light.name]++) == nullptr) followed.push_back(light);
  }
  return followed;
}

Result<std::vector<ViewedLight>> loadLightSet(const std::filesystem::path& path, std::size_t before) {
  if (path.empty()) return Error{ErrorCode::usage, "the name of a file of lights is expected"};
  const auto read = readLightsFile(path);
  if (!read) return read.error();
  if (read->size() > kMaxLightsOn) {
    return Error{ErrorCode::unsupported, "\"" + path.string() + "\": " + std::to_string(read->size()) +
                                             " lights, of which the viewer lights at most " +
                                             std::to_string(kMaxLightsOn)};
  }
  std::vector<ViewedLight> lights;
  for (const SceneLight& light : *read) {
    const std::string name = light.name.empty() ? "light " + std::to_string(before + lights.size() + 1) : light.name;
    lights.push_back({name, toRuntimeLight(light), true, false, light.positionWorld});
  }
  return lights;
}

Status saveLightSet(const std::filesystem::path& path, std::span<const ViewedLight> lights) {
  if (path.empty()) return Error{ErrorCode::usage, "the name of a file to save lights in is expected"};
  return writeLightsFile(path, sceneLightsOn(lights));
}

}  // namespace relume
