// SPDX-License-Identifier: MIT
// PNGs of what `relume render` draws, such as a person can see: light is exposed and sRGB encoded, normals, positions
// and depths are mapped to [0..1] and stored as they are. (OpenEXR images hold the raw values.)
#pragma once

#include "tools/render/render_frame.h"
#include "tools/render/scene_bounds.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relume {

// How values become colours; what a reader needs to get them back.
struct PictureScale {
  float exposureStops = 0.0f;               // of light
  SceneBounds bounds;                       // of positions: min is black, max is white, an axis a channel
  float nearestM = 0.0f, farthestM = 0.0f;  // [m] of depths: white and dark grey (0.1)
};

// Whether a layer is light, which is exposed. Albedo is not, nor what centres hold.
bool isLight(Aov aov);

// Weight w of a pixel's records is drawn as the grey w / (w + kGreyWeight).
inline constexpr float kGreyWeight = 10.0f;

// The scale of a frame's layers. Without stops, the exposure is taken from all light layers together, so that they can
// be told apart by eye.
PictureScale scaleOf(const RenderedFrame& frame, std::span<const Aov> aovs, const std::optional<float>& stops,
                     const SceneBounds& bounds);

// One layer. Where nothing is hit, normal, position and depth are black. Records are white dots on what is seen. [Size
// 3 * width * height]
std::vector<std::uint8_t> drawPicture(const RenderedFrame& frame, Aov aov, const PictureScale& scale);

}  // namespace relume
