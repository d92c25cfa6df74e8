// SPDX-License-Identifier: MIT
// Lights that a level does not have, for `relume render --lights-file`; relume-view writes what it reads.
#pragma once

#include "relume/bake/scene.h"
#include "relume/result.h"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace relume {

// A JSON list of objects with the fields of KHR_lights_punctual and a place:
//   {"type": "spot", "name": "red", "position": [0, 1, 0], "direction": [1, 0, 0], "color": [1, 0, 0], "intensity":
//   300,
//    "range": 10, "innerConeAngle": 0.3, "outerConeAngle": 0.6}
// type: point, spot or directional. position [m], of point and spot lights; direction the light travels in, of spot and
// directional ones. color [1, 1, 1], intensity 1: candela or lux as glTF has them, taken for W/sr and W/m². Angles
// [rad] 0 and pi/4. range [m] 0 = infinite. io: not readable; invalidFile: not JSON, or a field that is missing,
// unknown or out of range, by name.
Result<std::vector<SceneLight>> readLightsFile(const std::filesystem::path& path);

// Such a list, a light a line, from which readLightsFile() gets the same numbers again; directions may differ in their
// last bit, for the reader makes them unit.
std::string lightsFileText(std::span<const SceneLight> lights);

// Writes it as writeFileAtomically() does. usage: more lights than a file may have, or a file that is there, holds
// something, and is no list of lights; io: not writable.
Status writeLightsFile(const std::filesystem::path& path, std::span<const SceneLight> lights);

}  // namespace relume
