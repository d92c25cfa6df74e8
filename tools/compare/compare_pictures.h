// SPDX-License-Identifier: MIT
// The pictures of a comparison: light maps and a plan view as images, histograms and the plan's marks as SVG.
#pragma once

#include "tools/compare/compare_light.h"
#include "tools/compare/compare_report.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {

struct RgbImage {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // [Size 3 width height] row 0 on top; empty = no picture
};

// Irradiance of each texel's cache as luminance over `white`, dark to bright; texels without a cache in grey.
RgbImage drawLightmap(const Bake& bake, std::span<const glm::vec3> irradiance, double white);

// (B - A) / (|A| + floor) of luminance on B's light map, blue (less) over white to red (more), full colour at +-scale;
// caches without a partner in A in yellow.
RgbImage drawLightmapDifference(const Bake& b, const LightDifference& light, const LightingDifference& lighting,
                                double scale);

// The level from above (x to the right, z down): the greatest change of the caches at each place, white to red at
// scale.
struct PlanView {
  RgbImage image;
  float left = 0.0f, top = 0.0f, metresPerPixel = 1.0f;
};
PlanView drawPlan(const Bake& a, const LightDifference& light, double scale);

// A number that most changes lie below: 0.01, 0.05, 0.25 or 1.
double pictureScale(const LightDifference& light);

// Bars of how many values fall into each bin. [log: decades 1e-5..10; else 0..top]
std::string histogramSvg(std::span<const float> values, bool logarithmic, double top, const std::string& label);

// Marks of the worst places, numbered, and a scale bar, to lie over the plan.
std::string planMarksSvg(const PlanView& plan, const LightDifference& light);

}  // namespace relume
