// SPDX-License-Identifier: MIT
// See rsm_image.h.
#include "runtime/live/rsm_image.h"

#include "formats/color.h"
#include "formats/halton.h"
#include "formats/limits.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace relume {
namespace {

constexpr std::uint32_t kMaxSide = 4096;

Error mapError(std::size_t map, const std::string& what) {
  return {ErrorCode::usage, "reflective shadow map " + std::to_string(map) + ": " + what};
}

// What is wrong with a texel, or null.
const char* faultOf(const RsmTexel& texel) {
  if (!(texel.area >= 0.0f && texel.area <= kMaxRsmFlux)) return "its area is negative or not finite";
  if (texel.area == 0.0f) return nullptr;
  if (!isWithin(texel.positionWorld, kMaxCoordinate)) return "its position is not within 1e9 m";
  if (!(std::abs(glm::dot(texel.normal, texel.normal) - 1.0f) < 0.02f)) return "its normal is not of length 1";
  if (!isWithin(texel.flux, kMaxRsmFlux) || texel.flux.x < 0.0f || texel.flux.y < 0.0f || texel.flux.z < 0.0f)
    return "its flux has a channel that is negative or not finite";
  return nullptr;
}

double fluxOf(const RsmTexel& texel) {
  return texel.area > 0.0f ? static_cast<double>(texel.flux.x) + texel.flux.y + texel.flux.z : 0.0;
}

// P_k by bases of their own, so that a part of the cell does not always receive the same part of the map.
glm::vec3 placeOf(std::uint64_t index) {
  return {static_cast<float>(radicalInverse(5, index)), static_cast<float>(radicalInverse(7, index)),
          static_cast<float>(radicalInverse(11, index))};
}

// The texel of a point of the sequence: faces lie side by side.
std::size_t texelOf(const RsmImage& image, std::uint64_t index) {
  const double u = radicalInverse(2, index) * image.faces, v = radicalInverse(3, index);
  const auto face = static_cast<std::size_t>(u);
  const std::size_t side = image.side, x = static_cast<std::size_t>((u - std::floor(u)) * image.side),
                    y = static_cast<std::size_t>(v * image.side);
  return (face * side + y) * side + x;
}

// `count` of the map's samples.
void drawFrom(const RsmImage& image, std::uint64_t count, std::uint32_t set, std::vector<RsmSample>& samples) {
  const std::size_t texels = image.texel.size();
  const bool takesAll = count >= texels;
  const std::uint64_t drawn = takesAll ? texels : count;
  const double share = static_cast<double>(texels) / static_cast<double>(drawn);
  for (std::uint64_t k = 0; k < drawn; ++k) {
    const std::uint64_t index = set * drawn + k + 1;
    const RsmTexel& texel = image.texel[takesAll ? k : texelOf(image, index)];
    if (fluxOf(texel) == 0.0) continue;
    RsmSample sample;
    sample.positionWorld = texel.positionWorld;
    sample.normal = texel.normal;
    sample.power = rgbToYCoCg(static_cast<float>(share / std::numbers::pi) * texel.flux);
    sample.softening = static_cast<float>(share / std::numbers::pi) * texel.area;
    sample.place = glm::min(placeOf(index), glm::vec3(0x1.fffffep-1f));
    samples.push_back(sample);
  }
}

}  // namespace

Status checkRsmSize(std::size_t map, std::uint32_t side, std::uint32_t faces) {
  if (side < 1 || side > kMaxSide)
    return mapError(map, std::to_string(side) + " texels along its side, expected 1 to " + std::to_string(kMaxSide));
  if (faces != 1 && faces != 6) return mapError(map, std::to_string(faces) + " faces, expected 1 or the 6 of a cube");
  return done();
}

Status checkRsm(std::span<const RsmImage> images) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    const RsmImage& image = images[i];
    if (Status ok = checkRsmSize(i, image.side, image.faces); !ok) return ok;
    const std::size_t expected = std::size_t{image.faces} * image.side * image.side;
    if (image.texel.size() != expected)
      return mapError(i, std::to_string(image.texel.size()) + " texels, expected faces times the square of its side, " +
                             std::to_string(expected));
    for (std::size_t t = 0; t < expected; ++t) {
      if (const char* fault = faultOf(image.texel[t])) return mapError(i, "texel " + std::to_string(t) + ": " + fault);
    }
  }
  return done();
}

std::vector<RsmSample> drawSamples(std::span<const RsmImage> images, std::uint32_t count, std::uint32_t set) {
  std::vector<double> flux(images.size(), 0.0);
  double all = 0.0;
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (const RsmTexel& texel : images[i].texel) flux[i] += fluxOf(texel);
    all += flux[i];
  }
  std::vector<RsmSample> samples;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (flux[i] == 0.0) continue;
    const auto share = static_cast<std::uint64_t>(std::llround(count * flux[i] / all));
    drawFrom(images[i], std::max<std::uint64_t>(share, 1), set, samples);
  }
  return samples;
}

}  // namespace relume
