// SPDX-License-Identifier: MIT
// Materials that `render` and `reference` light in another way than the level does: --emission MATERIAL=VALUE, the
// runtime's MaterialEmission and the same for whoever reads the scene.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/emitters.h"
#include "relume/result.h"
#include "tools/images/image_io.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace relume {

struct DrivenMaterial {
  std::string name;
  glm::vec3 radiance{1.0f};             // [W/m²/sr] with an image, a factor on it: 1
  std::uint32_t width = 0, height = 0;  // [texel] of `image`; 0 = none
  std::vector<glm::vec3> image;         // [W/m²/sr] row 0 on top
};

// Whether it emits, or may be made to (relume/emitters.h).
inline bool isDrivable(const Material& m) { return m.drivable || m.emission != glm::vec3(0.0f); }

void addEmissionOption(CLI::App& command, std::vector<std::string>& texts);

// Files that the texts name, for checks of what is read and written.
std::vector<std::string> emissionFiles(const std::vector<std::string>& texts);

// usage: not MATERIAL=R,G,B or MATERIAL=FILE, a number out of 0..1e9, a material twice, an image beyond 8192 texels a
// side; invalidFile: a texel that is not within 0..1e9, by its place; errors of readPicture().
// memory: images beyond the context's budget.
Result<std::vector<DrivenMaterial>> readEmissions(const std::vector<std::string>& texts, Context& context);

// Let the scene's materials emit what is asked for; keepOthers: whether the rest emits as it did, or not at all. The
// scene is then no longer that of its bake: look whether it is before. usage: a material that is not in the scene, or
// neither emits nor is marked as drivable, or has no texture coordinates for an image.
Status driveScene(Scene& scene, std::span<const DrivenMaterial> driven, bool keepOthers);

// Whether a bake of the scene, read from that file, can be lit so. usage: a material that a baked part has, but none of
// the bake's emitters.
Status checkDriven(const Scene& scene, std::span<const DrivenMaterial> driven, const Emitters& emitters,
                   const std::string& bakeFile);

}  // namespace relume
