// SPDX-License-Identifier: MIT
// See check_limits.h.
#include "bake/scene/check_limits.h"

#include "formats/limits.h"

#include <glm/common.hpp>

#include <array>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace relume {
namespace {

// Largest offsets and factors of a texture transform: beyond, a float has no digits left for a position within the
// image.
constexpr float kMaxTextureTransform = 1e6f;
constexpr float kMaxAspect = 1e4f;  // of a camera, also its inverse

std::string number(float v) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", static_cast<double>(v));
  return text.data();
}

std::string vector(const glm::vec3& v) { return "(" + number(v.x) + ", " + number(v.y) + ", " + number(v.z) + ")"; }

std::string coordinates(float max) { return "; expected finite coordinates within " + number(max) + " m"; }

// True for numbers in [0, max], false for NaN.
bool isBetween(float v, float max) { return v >= 0.0f && v <= max; }
bool isBetween(const glm::vec3& v, float max) {
  return isBetween(v.x, max) && isBetween(v.y, max) && isBetween(v.z, max);
}

// Box of a mesh's positions; nothing when one of them is beyond the limit for meshes.
struct Box {
  glm::vec3 low{std::numeric_limits<float>::max()}, high{-std::numeric_limits<float>::max()};
};

// Describes what is wrong, without the name of the level.
using Finding = std::optional<std::string>;

Finding checkMesh(const Mesh& mesh, Box& box) {
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    const glm::vec3& p = mesh.position[v];
    if (!isWithin(p, kMaxCoordinate))
      return "mesh '" + mesh.name + "': vertex " + std::to_string(v) + " is at " + vector(p) +
             coordinates(kMaxCoordinate);
    box.low = glm::min(box.low, p);
    box.high = glm::max(box.high, p);
  }
  return std::nullopt;
}

glm::vec3 cornerOf(const Box& box, int corner) {
  return {corner & 1 ? box.high.x : box.low.x, corner & 2 ? box.high.y : box.low.y,
          corner & 4 ? box.high.z : box.low.z};
}

Finding checkTransform(const glm::mat4& m, const std::string& who) {
  constexpr const char* kAxes[] = {"x axis", "y axis", "z axis", "origin"};
  for (int c = 0; c < 4; ++c) {
    if (!isWithin(glm::vec3(m[c]), kMaxLevelCoordinate))
      return who + ": its transform to the world takes the " + kAxes[c] + " to " + vector(glm::vec3(m[c])) +
             coordinates(kMaxLevelCoordinate);
  }
  return std::nullopt;
}

// The corners of the mesh's box are within the bound nearly always; only where they are not, look at every vertex.
Finding checkInstance(const Instance& instance, const Mesh& mesh, const Box& box) {
  const std::string who = "nodes[" + std::to_string(instance.nodeIndex) + "] '" + instance.node + "'" +
                          (instance.gpuInstance > 0 ? ", instance " + std::to_string(instance.gpuInstance) : "");
  if (Finding found = checkTransform(instance.toWorld, who)) return found;
  const auto toWorld = [&](const glm::vec3& p) { return glm::vec3(instance.toWorld * glm::vec4(p, 1.0f)); };
  bool within = true;
  for (int corner = 0; corner < 8 && within && !mesh.position.empty(); ++corner)
    within = isWithin(toWorld(cornerOf(box, corner)), kMaxLevelCoordinate);
  for (std::size_t v = 0; v < mesh.position.size() && !within; ++v) {
    const glm::vec3 world = toWorld(mesh.position[v]);
    if (!isWithin(world, kMaxLevelCoordinate))
      return who + ": vertex " + std::to_string(v) + " of mesh '" + mesh.name + "' is at " + vector(world) +
             coordinates(kMaxLevelCoordinate);
  }
  return std::nullopt;
}

Finding checkCamera(const Camera& camera) {
  const std::string who = "camera '" + camera.name + "'";
  if (Finding found = checkTransform(camera.toWorld, who)) return found;
  const auto length = [&](const char* what, float v) -> Finding {
    if (isBetween(v, kMaxLevelCoordinate)) return std::nullopt;
    return who + ": its " + what + " is " + number(v) + " m; expected 0 to " + number(kMaxLevelCoordinate) + " m";
  };
  if (Finding found = length("znear", camera.znear)) return found;
  if (Finding found = camera.orthographic ? length("ymag", camera.yMag) : std::nullopt) return found;
  const bool shaped = camera.aspect == 0.0f || (camera.aspect >= 1.0f / kMaxAspect && camera.aspect <= kMaxAspect);
  if (!shaped)
    return who + ": it is " + number(camera.aspect) + " times as wide as high; expected " + number(1.0f / kMaxAspect) +
           " to " + number(kMaxAspect);
  return camera.orthographic ? length("xmag", camera.yMag * camera.aspect) : std::nullopt;
}

Finding checkVolume(const PlayVolume& volume) {
  for (int corner = 0; corner < 8; ++corner) {
    const glm::vec3 unit = cornerOf({glm::vec3(-0.5f), glm::vec3(0.5f)}, corner);
    const glm::vec3 world(volume.toWorld * glm::vec4(unit, 1.0f));
    if (!isWithin(world, kMaxLevelCoordinate))
      return "play volume of node '" + volume.name + "': a corner is at " + vector(world) +
             coordinates(kMaxLevelCoordinate);
  }
  return std::nullopt;
}

Finding checkLight(const SceneLight& light) {
  const std::string who = "light '" + light.name + "'";
  if (light.kind != LightKind::directional && !isWithin(light.positionWorld, kMaxLevelCoordinate))
    return who + " is at " + vector(light.positionWorld) + coordinates(kMaxLevelCoordinate);
  if (!isBetween(light.intensity, kMaxIntensity))
    return who + ": its intensity is " + vector(light.intensity) + "; expected 0 to " + number(kMaxIntensity);
  return std::nullopt;
}

Finding checkMaterial(const Material& material) {
  const std::string who = "material '" + material.name + "'";
  if (!isBetween(material.emission, kMaxRadiance))
    return who + ": its emission, factor times strength, is " + vector(material.emission) + "; expected 0 to " +
           number(kMaxRadiance) + " W/m²/sr";
  if (!isBetween(material.albedo, 1.0f) || !isBetween(material.alpha, 1.0f))
    return who + ": its base colour is " + vector(material.albedo) + " and alpha " + number(material.alpha) +
           "; expected 0 to 1";
  for (const TextureRef* texture :
       {&material.albedoTexture, &material.emissionTexture, &material.gloss.texture, &material.gloss.normalTexture}) {
    for (const float v : texture->transform) {
      if (!isBetween(glm::abs(v), kMaxTextureTransform))
        return who + ": its texture transform has a factor or offset of " + number(v) + "; expected at most " +
               number(kMaxTextureTransform);
    }
  }
  return std::nullopt;
}

Finding findBeyond(const Scene& scene) {
  std::vector<Box> boxes(scene.meshes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (Finding found = checkMesh(scene.meshes[i], boxes[i])) return found;
  }
  for (const Instance& instance : scene.instances) {
    if (Finding found = checkInstance(instance, scene.meshes[instance.mesh], boxes[instance.mesh])) return found;
  }
  for (const Camera& camera : scene.cameras) {
    if (Finding found = checkCamera(camera)) return found;
  }
  for (const PlayVolume& volume : scene.volumes) {
    if (Finding found = checkVolume(volume)) return found;
  }
  for (const SceneLight& light : scene.lights) {
    if (Finding found = checkLight(light)) return found;
  }
  for (const Material& material : scene.materials) {
    if (Finding found = checkMaterial(material)) return found;
  }
  return std::nullopt;
}

}  // namespace

Status checkLimits(const Scene& scene) {
  if (const Finding found = findBeyond(scene)) return Error{ErrorCode::invalidFile, scene.name + ": " + *found};
  return done();
}

}  // namespace relume
