// SPDX-License-Identifier: MIT
// See exposure.h. The geometric mean is the key of Reinhard et al., Photographic Tone Reproduction for Digital Images
// (2002).
#include "tools/render/exposure.h"

#include "bake/base/printed.h"
#include "formats/color.h"
#include "tools/base/parse_numbers.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace relume {
namespace {

constexpr float kMaxStops = 30.0f;
constexpr double kMiddleGrey = 0.18;
constexpr double kClipped = 0.05;   // share of the pixels that may come out white
constexpr double kBlackest = 1e-3;  // of the luminance that may clip: what is darker counts as that

}  // namespace

Result<std::optional<float>> readExposure(const std::string& text) {
  if (text == "auto") return std::optional<float>();
  const std::optional<float> stops = finiteNumber(text);
  if (!stops || std::abs(*stops) > kMaxStops) {
    return Error{ErrorCode::usage, "--exposure: auto or stops of -30..30 expected, \"" + text + "\" found"};
  }
  return stops;
}

float autoExposure(std::span<const glm::vec3> pixels) {
  std::vector<double> lit;
  lit.reserve(pixels.size());
  for (const glm::vec3& pixel : pixels) {
    const double light = luminance(pixel);
    if (light > 0.0 && std::isfinite(light)) lit.push_back(light);
  }
  if (lit.empty()) return 0.0f;
  std::sort(lit.begin(), lit.end());
  const double white = lit[static_cast<std::size_t>((1.0 - kClipped) * static_cast<double>(lit.size() - 1))];
  double logarithms = 0.0;
  for (const double light : lit) logarithms += std::log(std::max(light, kBlackest * white));
  const double middle = std::exp(logarithms / static_cast<double>(lit.size()));
  const double stops = std::min(std::log2(kMiddleGrey / middle), std::log2(1.0 / white));
  return std::clamp(static_cast<float>(std::round(100.0 * stops) / 100.0), -kMaxStops, kMaxStops);
}

double roundedStops(float stops) { return std::round(100.0 * static_cast<double>(stops)) / 100.0; }

std::string stopsText(float stops) { return printed("%+.2f", stops); }

}  // namespace relume
