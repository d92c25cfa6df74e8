// SPDX-License-Identifier: MIT
// See visible_difference.h. Sections are those of Yee and Newman.
#include "tools/images/visible_difference.h"

#include "tools/images/perceptual.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr int kLevels = 8;
constexpr double kLeastLuminance = 1e-5;  // [cd/m²]
constexpr double kPeakFrequency = 3.248;  // [cycles a degree] where 100 cd/m² are told apart best
constexpr double kMostElevation = 10.0;   // of a threshold
constexpr double kFewColors = 10.0;       // [cd/m²] below, cones see less

using Values = std::vector<double>;

// One step of a pyramid that keeps its size: Burt and Adelson's kernel, its taps so many pixels apart. Pictures go on
// beyond their edges as they are there.
Values smoothed(const Values& from, int width, int height, int apart) {
  constexpr std::array<double, 5> kKernel = {0.05, 0.25, 0.4, 0.25, 0.05};
  const auto along = [&](const Values& plane, int dx, int dy) {
    Values to(plane.size(), 0.0);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double sum = 0.0;
        for (int k = -2; k <= 2; ++k) {
          const int u = std::clamp(x + k * apart * dx, 0, width - 1), v = std::clamp(y + k * apart * dy, 0, height - 1);
          sum += kKernel[static_cast<std::size_t>(k + 2)] * plane[static_cast<std::size_t>(v * width + u)];
        }
        to[static_cast<std::size_t>(y * width + x)] = sum;
      }
    }
    return to;
  };
  return along(along(from, 1, 0), 0, 1);
}

// A picture as the eye takes it apart: luminance [cd/m²], each level an octave smoother than the one before.
struct Seen {
  std::array<Values, kLevels> luminance;
  std::vector<glm::dvec3> lab;

  Seen(int width, int height, std::span<const glm::vec3> picture, double white) {
    lab.reserve(picture.size());
    luminance[0].reserve(picture.size());
    for (const glm::vec3& pixel : picture) {
      const glm::dvec3 linear = glm::clamp(glm::dvec3(pixel), glm::dvec3(0.0), glm::dvec3(1.0));
      lab.push_back(labOf(linear));
      luminance[0].push_back(white * (0.2126729 * linear.r + 0.7151522 * linear.g + 0.0721750 * linear.b));
    }
    for (int l = 1; l < kLevels; ++l)
      luminance[static_cast<std::size_t>(l)] =
          smoothed(luminance[static_cast<std::size_t>(l) - 1], width, height, 1 << (l - 1));
  }
};

// How much a pattern of this contrast, times the eye's sensitivity, raises the threshold of others (Daly 1993).
double elevationByMask(double contrast) {
  const double a = std::pow(392.498 * contrast, 0.7), b = std::pow(0.0153 * a, 4.0);
  return std::pow(1.0 + b, 0.25);
}

}  // namespace

double thresholdOfLuminance(double adaptation) {
  const double a = std::log10(std::max(adaptation, kLeastLuminance));
  double log = a - 1.255;
  if (a < -3.94) {
    log = -2.86;
  } else if (a < -1.44) {
    log = std::pow(0.405 * a + 1.6, 2.18) - 2.86;
  } else if (a < -0.0184) {
    log = a - 0.395;
  } else if (a < 1.9) {
    log = std::pow(0.249 * a + 0.65, 2.7) - 0.72;
  }
  return std::pow(10.0, log);
}

double contrastSensitivity(double frequency, double adaptation) {
  const double l = std::max(adaptation, kLeastLuminance);
  const double a = 440.0 * std::pow(1.0 + 0.7 / l, -0.2), b = 0.3 * std::pow(1.0 + 100.0 / l, 0.15);
  return a * frequency * std::exp(-b * frequency) * std::sqrt(1.0 + 0.06 * std::exp(b * frequency));
}

std::vector<std::uint8_t> visiblyDifferent(std::uint32_t width, std::uint32_t height, std::span<const glm::vec3> a,
                                           std::span<const glm::vec3> b, const ObserverOptions& options) {
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  const Seen one(w, h, a, options.whiteLuminance), two(w, h, b, options.whiteLuminance);

  // 3.1: frequencies of the levels, and the level that is about a degree wide, which the eye adapts to.
  const double degrees =
      2.0 * std::tan(0.5 * options.fieldOfView * std::numbers::pi / 180.0) * 180.0 / std::numbers::pi;
  const double pixelsPerDegree = width / degrees;
  std::array<double, kLevels> frequency{}, elevation{};
  std::size_t adaptationLevel = 0;
  for (std::size_t l = 0; l < kLevels; ++l) {
    frequency[l] = 0.5 * pixelsPerDegree / static_cast<double>(1 << l);
    elevation[l] = contrastSensitivity(kPeakFrequency, 100.0) / contrastSensitivity(frequency[l], 100.0);
    if (static_cast<double>(1 << l) <= pixelsPerDegree) adaptationLevel = l;
  }

  std::vector<std::uint8_t> differs(a.size(), 0);
  for (std::size_t i = 0; i < differs.size(); ++i) {
    const double adaptation =
        std::max(0.5 * (one.luminance[adaptationLevel][i] + two.luminance[adaptationLevel][i]), kLeastLuminance);
    // 3.2: by how much what is around the pixel raises the threshold, a mean over the levels by their contrasts.
    double sum = 0.0, raised = 0.0;
    for (std::size_t l = 0; l + 2 < kLevels; ++l) {
      const auto band = [&](const Seen& seen) { return std::abs(seen.luminance[l][i] - seen.luminance[l + 1][i]); };
      const double ground = std::max({one.luminance[l + 2][i], two.luminance[l + 2][i], kLeastLuminance});
      const double contrast = std::max(band(one), band(two)) / ground;
      sum += contrast;
      raised += contrast * elevation[l] * elevationByMask(contrast * contrastSensitivity(frequency[l], adaptation));
    }
    const double factor = std::clamp(sum > 0.0 ? raised / sum : 1.0, 1.0, kMostElevation);

    // 3.3: luminance, then colour.
    if (std::abs(one.luminance[0][i] - two.luminance[0][i]) > factor * thresholdOfLuminance(adaptation)) {
      differs[i] = 1;
      continue;
    }
    const glm::dvec3 color = one.lab[i] - two.lab[i];
    const double seen = std::min(adaptation / kFewColors, 1.0);
    if (seen * seen * (color.y * color.y + color.z * color.z) > factor) differs[i] = 1;
  }
  return differs;
}

}  // namespace relume
