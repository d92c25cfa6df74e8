// SPDX-License-Identifier: MIT
// See view_state.h.
#include "tools/view/view_state.h"

#include "relume/bake/context.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/render/default_view.h"
#include "tools/render/drive_scene.h"
#include "tools/render/read_sky_map.h"
#include "tools/render/render_frame.h"
#include "tools/render/view_options.h"
#include "tools/view/light_set.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

namespace relume {
namespace {

bool isNamed(const std::vector<std::string>& names, const char* name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Which lights of the scene are on at the start.
Status switchLights(const Scene& scene, const std::vector<std::string>& parts, ViewState& state) {
  const std::vector<std::string> names = lightNames(parts, scene);
  state.emission = isNamed(names, "all") || isNamed(names, "emissive") ? 1.0f : 0.0f;
  state.lights = lightsOf(scene, parts);
  for (const std::string& name : names) {
    const bool known = name == "all" || name == "none" || name == "emissive" || !allCalled(scene.lights, name).empty();
    if (!known)
      return Error{ErrorCode::usage, "--lights: no light \"" + name + "\" in the scene; there are: " +
                                         namesForPeople(scene.lights) + ", and emissive, all, none"};
  }
  return done();
}

// The lights of a file are on.
Status addFileLights(const std::string& path, ViewState& state) {
  if (path.empty()) return done();
  Result<std::vector<ViewedLight>> lights = loadLightSet(path, state.lights.size());
  if (!lights) return lights.error();
  state.lights.insert(state.lights.end(), lights->begin(), lights->end());
  return done();
}

Result<FlyCamera> initialCamera(const Scene& scene, const ViewerOptions& options) {
  if (const Camera* const camera = cameraCalled(scene, options.camera).camera) return FlyCamera::from(*camera);
  if (!options.camera.empty())
    return Error{ErrorCode::usage, "--camera: no camera \"" + options.camera +
                                       "\" in the scene; there are: " + namesForPeople(scene.cameras)};
  const float aspect = static_cast<float>(options.width) / static_cast<float>(options.height);
  Context context;
  const Result<FramedView> framed = frameLevel(scene, FlyCamera().yfovRad, aspect, context);
  if (!framed) return framed.error();
  return FlyCamera::from(lookAt(framed->eye, framed->target, FlyCamera().yfovRad));
}

}  // namespace

bool ViewedLight::operator==(const ViewedLight& other) const {
  const Light &a = light, &b = other.light;
  return name == other.name && on == other.on && orbits == other.orbits && home == other.home && a.kind == b.kind &&
         a.intensity == b.intensity && a.range == b.range && a.innerConeRad == b.innerConeRad &&
         a.outerConeRad == b.outerConeRad &&
         (orbits || (a.positionWorld == b.positionWorld && a.direction == b.direction));
}

std::vector<ViewedLight> lightsOf(const Scene& scene, const std::vector<std::string>& on) {
  const std::vector<std::string> names = lightNames(on, scene);
  std::vector<ViewedLight> lights;
  for (const SceneLight& light : scene.lights)
    lights.push_back({light.name, toRuntimeLight(light), isNamed(names, "all"), false, light.positionWorld});
  for (const std::string& name : names) {
    for (const SceneLight* const light : allCalled(scene.lights, name))
      lights[static_cast<std::size_t>(light - scene.lights.data())].on = true;
  }
  return lights;
}

std::vector<ViewedEmitter> emittersOf(const Scene& scene, const std::vector<DrivenMaterial>& driven) {
  std::vector<ViewedEmitter> emitters;
  for (const Material& material : scene.materials) {
    const auto named = [&](const auto& other) { return other.name == material.name; };
    if (std::any_of(emitters.begin(), emitters.end(), named)) continue;
    const auto found = std::find_if(driven.begin(), driven.end(), named);
    if (found != driven.end()) {
      emitters.push_back({material.name, true, found->radiance, found->width, found->height, found->image});
    } else if (isDrivable(material)) {
      emitters.push_back({material.name, false, material.emission, 0, 0, {}});
    }
  }
  return emitters;
}

std::vector<ViewedObject> objectsOf(const Scene& scene, Movable movable) {
  std::vector<ViewedObject> objects;
  for (const MovingNode& node : movingNodes(scene, movable))
    objects.push_back({node.name, node.centreWorld, node.centreWorld});
  return objects;
}

Result<ViewState> initialState(const Scene& scene, const ViewerOptions& options) {
  ViewState state;
  const Result<FlyCamera> camera = initialCamera(scene, options);
  if (!camera) return camera.error();
  state.camera = *camera;
  if (Status ok = switchLights(scene, options.lights, state); !ok) return ok.error();
  if (Status ok = addFileLights(options.lightsFile, state); !ok) return ok.error();
  state.objects = objectsOf(scene, options.isLive() || options.edit ? Movable::all : Movable::dynamic);
  if (!options.skyMap.empty()) {
    Context context;
    auto map = readSkyMap(options.skyMap, context);
    if (!map) return map.error();
    state.sky.map = std::make_shared<const SkyMap>(std::move(*map));
    state.sky.rotationDeg = options.skyRotationDeg;
  }
  state.emitters = emittersOf(scene, options.driven);
  state.relightBy.bands = options.bands;
  state.live = options.live;
  if (options.isLive() && !options.driven.empty()) state.emission = 1.0f;
  state.records = options.records;
  state.exposure = options.exposure.value_or(0.0f);
  state.gloss = options.sceneOptions.gloss;
  state.cones = options.cones;
  state.reflectance = options.reflectance;
  state.roughness = options.roughness;
  state.mode =
      static_cast<ViewMode>(std::find(kViewNames.begin(), kViewNames.end(), options.view) - kViewNames.begin());
  for (std::size_t i = 0; i < kOverlayNames.size(); ++i)
    state.overlays[i] =
        std::find(options.overlays.begin(), options.overlays.end(), kOverlayNames[i]) != options.overlays.end();
  return state;
}

std::optional<std::string> cameraWarning(const Scene& scene, const ViewerOptions& options) {
  const auto [camera, ambiguous] = cameraCalled(scene, options.camera);
  if (camera == nullptr) return std::nullopt;
  std::string text = ambiguous;
  if (camera->orthographic)
    text += (text.empty() ? "" : "; ") + ("camera \"" + camera->name) +
            "\" is orthographic, and the viewer shows it in perspective; relume render draws it as it is";
  return text.empty() ? std::nullopt : std::optional(std::move(text));
}

std::vector<glm::mat4> movesOf(const ViewState& state) {
  std::vector<glm::mat4> moved;
  for (const ViewedObject& object : state.objects)
    moved.push_back(glm::translate(glm::mat4(1.0f), object.position - object.home));
  return moved;
}

std::vector<Light> activeLights(const ViewState& state) {
  std::vector<Light> lights;
  for (const ViewedLight& viewed : state.lights) {
    if (viewed.on) lights.push_back(viewed.light);
  }
  return lights;
}

void animate(ViewState& state, double seconds, float levelSize) {
  const float radius = std::min(0.8f, 0.1f * levelSize);
  for (ViewedLight& viewed : state.lights) {
    if (!viewed.orbits) continue;
    const auto angle = static_cast<float>(seconds);
    if (viewed.light.kind == LightKind::directional) {
      viewed.light.direction = glm::normalize(glm::vec3(0.8f * std::cos(angle), -0.75f, 0.8f * std::sin(angle)));
    } else {
      viewed.light.positionWorld = viewed.home + glm::vec3(std::cos(angle) - 1.0f, 0.0f, std::sin(angle)) * radius;
    }
  }
}

}  // namespace relume
