// SPDX-License-Identifier: MIT
// See compare_pictures.h.
#include "tools/compare/compare_pictures.h"

#include "bake/base/printed.h"
#include "formats/color.h"
#include "tools/images/diverging.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr std::uint32_t kMaxPixels = 1024;  // a side; larger maps are drawn by every n-th texel
constexpr glm::vec3 kHole(0.80f, 0.82f, 0.84f), kUnmatched(0.95f, 0.80f, 0.20f);

void put(RgbImage& image, std::size_t pixel, const glm::vec3& color) {
  for (int c = 0; c < 3; ++c)
    image.rgb[3 * pixel + static_cast<std::size_t>(c)] =
        static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(color[c], 0.0f, 1.0f)));
}

// Dark blue, purple, orange, yellow: even steps of lightness.
glm::vec3 heat(float t) {
  static constexpr std::array<glm::vec3, 6> kStops = {{{0.00f, 0.00f, 0.02f},
                                                       {0.25f, 0.04f, 0.41f},
                                                       {0.58f, 0.15f, 0.40f},
                                                       {0.87f, 0.32f, 0.23f},
                                                       {0.99f, 0.65f, 0.04f},
                                                       {0.99f, 1.00f, 0.64f}}};
  const float at = std::clamp(t, 0.0f, 1.0f) * static_cast<float>(kStops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  return glm::mix(kStops[i], kStops[i + 1], at - static_cast<float>(i));
}

// Draw every n-th texel of a light map; color(cache) says how.
template <class Color>
RgbImage drawTexels(const Lightmap& map, const Color& color) {
  RgbImage image;
  if (map.cache.empty()) return image;
  const std::uint32_t step = (std::max(map.width, map.height) + kMaxPixels - 1) / kMaxPixels;
  image.width = (map.width + step - 1) / step;
  image.height = (map.height + step - 1) / step;
  image.rgb.resize(std::size_t{3} * image.width * image.height);
  for (std::uint32_t y = 0; y < image.height; ++y) {
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const std::uint32_t cache = map.cache[std::size_t{y} * step * map.width + std::size_t{x} * step];
      put(image, std::size_t{y} * image.width + x, cache == kNoCache ? kHole : color(cache));
    }
  }
  return image;
}

}  // namespace

RgbImage drawLightmap(const Bake& bake, std::span<const glm::vec3> irradiance, double white) {
  return drawTexels(bake.caches.lightmap, [&](std::uint32_t cache) {
    return heat(std::sqrt(std::max(0.0f, static_cast<float>(luminance(irradiance[cache]) / white))));
  });
}

RgbImage drawLightmapDifference(const Bake& b, const LightDifference& light, const LightingDifference& lighting,
                                double scale) {
  return drawTexels(b.caches.lightmap, [&](std::uint32_t cache) {
    const std::uint32_t pair = light.match.partnerOfB[cache];
    if (pair == PointIndex::kNothing) return kUnmatched;
    const double before = luminance(lighting.irradianceA[light.match.pairs[pair].a]);
    const double now = luminance(lighting.irradianceB[cache]);
    return diverging(static_cast<float>((now - before) / (std::abs(before) + lighting.floor) / scale));
  });
}

PlanView drawPlan(const Bake& a, const LightDifference& light, double scale) {
  PlanView plan;
  if (light.match.pairs.empty()) return plan;
  glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
  for (const glm::vec3& p : a.caches.positionWorld) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const float splat = std::max(0.5f * light.match.surfaceTolerance, 1e-3f);
  low -= glm::vec3(2.0f * splat);
  high += glm::vec3(2.0f * splat);
  plan.left = low.x;
  plan.top = low.z;
  plan.metresPerPixel = std::max(high.x - low.x, high.z - low.z) / 480.0f;
  plan.image.width = std::max(1u, static_cast<std::uint32_t>((high.x - low.x) / plan.metresPerPixel));
  plan.image.height = std::max(1u, static_cast<std::uint32_t>((high.z - low.z) / plan.metresPerPixel));

  // The greatest change at each pixel; a cache covers a square of its spacing.
  std::vector<float> change(std::size_t{plan.image.width} * plan.image.height, -1.0f);
  const int reach = std::clamp(static_cast<int>(splat / plan.metresPerPixel + 0.5f), 1, 12);
  for (std::size_t i = 0; i < light.match.pairs.size(); ++i) {
    const glm::vec3& p = a.caches.positionWorld[light.match.pairs[i].a];
    const int x = static_cast<int>((p.x - plan.left) / plan.metresPerPixel);
    const int y = static_cast<int>((p.z - plan.top) / plan.metresPerPixel);
    for (int v = std::max(0, y - reach); v < std::min(static_cast<int>(plan.image.height), y + reach); ++v) {
      for (int u = std::max(0, x - reach); u < std::min(static_cast<int>(plan.image.width), x + reach); ++u) {
        float& there = change[static_cast<std::size_t>(v) * plan.image.width + static_cast<std::size_t>(u)];
        there = std::max(there, light.greatestChange[i]);
      }
    }
  }
  plan.image.rgb.resize(3 * change.size());
  for (std::size_t i = 0; i < change.size(); ++i)
    put(plan.image, i, change[i] < 0.0f ? kHole : diverging(static_cast<float>(change[i] / scale)));
  return plan;
}

double pictureScale(const LightDifference& light) {
  std::vector<float> all = light.greatestChange;
  if (all.empty()) return 0.01;
  const auto at = static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(all.size() - 1));
  std::nth_element(all.begin(), all.begin() + at, all.end());
  for (const double scale : {0.01, 0.05, 0.25}) {
    if (all[static_cast<std::size_t>(at)] <= scale) return scale;
  }
  return 1.0;
}

std::string histogramSvg(std::span<const float> values, bool logarithmic, double top, const std::string& label) {
  constexpr int kBins = 30;
  std::array<std::size_t, kBins> bins{};
  for (const float v : values) {
    const double at = logarithmic ? (std::log10(std::max<double>(v, 1e-9)) + 5.0) / 6.0 : v / top;
    ++bins[static_cast<std::size_t>(std::clamp(static_cast<int>(at * kBins), 0, kBins - 1))];
  }
  const double max = static_cast<double>(std::max<std::size_t>(*std::max_element(bins.begin(), bins.end()), 1));
  std::string svg = "<svg viewBox=\"0 0 340 170\" role=\"img\" aria-label=\"" + label + "\">";
  for (int i = 0; i < kBins; ++i) {
    const double height = 120.0 * static_cast<double>(bins[static_cast<std::size_t>(i)]) / max;
    svg += printed("<rect x=\"%.1f\" y=\"%.1f\" width=\"9.5\" height=\"%.1f\" class=\"bar\"/>", 20.0 + 10.0 * i,
                   130.0 - height, height);
  }
  svg += "<path d=\"M20 130H320\" class=\"axis\"/>";
  const std::array<const char*, 4> decades = {"0.001%", "0.1%", "10%", "1000%"};
  for (int k = 0; k < 4; ++k) {
    const double x = 20.0 + 100.0 * k;
    svg += printed("<text x=\"%.0f\" y=\"145\" text-anchor=\"middle\">", x) +
           (logarithmic ? std::string(decades[static_cast<std::size_t>(k)]) : printed("%.3g", top * k / 3.0)) +
           "</text>";
  }
  return svg + "<text x=\"170\" y=\"163\" text-anchor=\"middle\">" + label + "</text></svg>";
}

std::string planMarksSvg(const PlanView& plan, const LightDifference& light) {
  std::string svg = printed("<svg viewBox=\"0 0 %u %u\" class=\"marks\">", plan.image.width, plan.image.height);
  for (std::size_t i = 0; i < light.worst.size(); ++i) {
    const double x = (light.worst[i].positionWorld.x - plan.left) / plan.metresPerPixel;
    const double y = (light.worst[i].positionWorld.z - plan.top) / plan.metresPerPixel;
    svg += printed("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"9\"/>", x, y) +
           printed("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%.0f</text>", x, y + 4.0,
                   static_cast<double>(i + 1));
  }
  // A bar of 1, 2 or 5 times a power of ten, about a quarter of the width.
  const double quarter = 0.25 * plan.image.width * plan.metresPerPixel;
  double metres = std::pow(10.0, std::floor(std::log10(std::max(quarter, 1e-9))));
  for (const double factor : {5.0, 2.0}) {
    if (metres * factor <= quarter) {
      metres *= factor;
      break;
    }
  }
  const double y = plan.image.height - 8.0;
  svg += printed("<path d=\"M8 %.1fh%.1f\" class=\"scale\"/>", y, metres / plan.metresPerPixel) +
         printed("<text x=\"8\" y=\"%.1f\">%g m</text>", y - 4.0, metres);
  return svg + "</svg>";
}

}  // namespace relume
