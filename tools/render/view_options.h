// SPDX-License-Identifier: MIT
// What `render` and `reference` draw: camera, size, lights and sky, the same options in both.
#pragma once

#include "bake/scene/sky.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace relume {

// As on the command line.
struct ViewOptions {
  std::string camera, eye, target, fov, size = "320x180", sky = "0,0,0", skyMap, skyRotation = "0", lightsFile;
  std::vector<std::string> lights{"all"};
};

struct View {
  Camera camera;
  std::uint32_t width = 320, height = 180;  // [1..16384]
  std::vector<SceneLight> lights;           // punctual lights that are on
  bool emissive = false;                    // emitting surfaces are on
  Sky sky;
};

void addViewOptions(CLI::App& command, ViewOptions& options);

// What a message says there is: "a, b, c", with nodes of other names; "none".
std::string namesForPeople(std::span<const Camera> cameras);
std::string namesForPeople(std::span<const SceneLight> lights);

// The camera that --camera names, or the first where `name` is empty; null where there is none.
struct NamedCamera {
  const Camera* camera = nullptr;
  std::string warning{};  // that the name is that of several, of which this is the first; empty = it is not
};
NamedCamera cameraCalled(const Scene& scene, const std::string& name);

// The names of --lights, which a comma parts: parts that together are the name of a light, which has commas, are one.
std::vector<std::string> lightNames(const std::vector<std::string>& parts, const Scene& scene);

// --exponent, of the lobes of glossy light: the number that `text` is, nothing where it is empty. usage: another text.
void addExponentOption(CLI::App& command, std::string& text);
Result<std::optional<float>> readExponent(const std::string& text);

// --gloss: surfaces mirror as their materials say.
void addGlossOption(CLI::App& command, bool& gloss);

// --occlusion-falloff [1/m].
inline constexpr float kOcclusionFalloff = 1.0f;
void addFalloffOption(CLI::App& command, float& falloff);
// usage: another than the default, and no --aov occlusion.
Status checkFalloff(bool occlusionIsDrawn, float falloff);
// usage: --aov glossy without a lobe, or with both kinds.
Status checkGloss(bool glossyIsDrawn, bool hasExponent, bool gloss);

// Everything that can be known without the scene: size and sky. usage: the option that cannot be read.
Result<View> readView(const ViewOptions& options);

// Camera, lights of the scene and sky map. Where there is no camera, neither there nor in the options, the level is
// framed, and a message says how to ask for the same view. usage: a name that the scene does not know, with those it
// knows; errors of readLightsFile() and readSkyMap().
Status completeView(const ViewOptions& options, const Scene& scene, Context& context, View& view);

// A camera at `eye` that looks at `target`, upright. They must differ.
Camera lookAt(const glm::vec3& eye, const glm::vec3& target, float yfovRad);

}  // namespace relume
