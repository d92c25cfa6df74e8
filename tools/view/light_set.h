// SPDX-License-Identifier: MIT
// The lights of the window as a set that can be added to, saved and loaded.
#pragma once

#include "relume/result.h"
#include "tools/view/view_state.h"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace relume {

// Lights that can be on at once: as many as there are shadow maps.
inline constexpr std::size_t kMaxLightsOn = 32;

std::size_t lightsOn(std::span<const ViewedLight> lights);
std::string countOfLights(std::size_t lights);  // in words: "1 light", "3 lights"

std::vector<SceneLight> sceneLightsOn(std::span<const ViewedLight> lights);

// Switch off what is on beyond kMaxLightsOn. Returns how many that are.
std::size_t limitLightsOn(std::span<ViewedLight> lights);
std::string switchedOffText(std::size_t lights);  // that so many were

// What a new light has room in.
struct RoomAhead {
  float levelSize = 0.0f;                // [m] the level's diagonal
  std::optional<float> surfaceDistance;  // [m] of what is in the middle of the view; nothing for the sky
};
// A new light of that kind before the camera, in front of what is seen there: a white one that a room is lit well by,
// or a level that is less than one; spots and suns aimed along the view and down. It is on unless kMaxLightsOn are.
ViewedLight newLight(LightKind kind, const FlyCamera& camera, std::span<const ViewedLight> lights,
                     const RoomAhead& around);
// `base`, or with a number behind it when there is a light of that name.
std::string freeName(const std::string& base, std::span<const ViewedLight> lights);

// Lights of the window once the level's file, which had the lights `before`, has `now`: those that are as the file had
// them follow it, on and orbiting as they are, and keep their ids; those that were edited, added or removed in the
// window stay so. The first of a name in one list is the first in the others.
std::vector<ViewedLight> followFile(std::span<const ViewedLight> lights, std::span<const ViewedLight> before,
                                    std::span<const ViewedLight> now);

// The lights of a file, all of them on; one without a name is "light <number>", counted from `before` + 1. Errors of
// readLightsFile(); unsupported: more than kMaxLightsOn.
Result<std::vector<ViewedLight>> loadLightSet(const std::filesystem::path& path, std::size_t before = 0);

// The lights that are on, for `relume render --lights none --lights-file`. Errors of writeLightsFile(), and usage where
// there is no name.
Status saveLightSet(const std::filesystem::path& path, std::span<const ViewedLight> lights);

}  // namespace relume
