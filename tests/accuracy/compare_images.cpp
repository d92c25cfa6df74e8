// SPDX-License-Identifier: MIT
// See compare_images.h.
#include "tests/accuracy/compare_images.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace relume {
namespace {

constexpr double kPlaneTolerance = 0.02;  // of the nearer depth
constexpr double kCosTolerance = 0.9;
constexpr double kTrimmedShare = 0.01;
constexpr double kPercentileFloor = 0.05;  // of the mean, added to b

// Three channels interleaved, in double.
using Layer = std::vector<double>;

Result<Layer> layerOf(const ChannelImage& image, const std::string& name, const char* suffixes, const char* which) {
  const auto pixels = image.layer(name, suffixes);
  if (pixels.empty()) {
    return Error{ErrorCode::invalidFile, std::string(which) + ": channels \"" + (name.empty() ? "" : name + ".") +
                                             suffixes[0] + "\" and its two neighbours expected, not found"};
  }
  Layer layer(3 * pixels.size());
  for (std::size_t i = 0; i < layer.size(); ++i) layer[i] = pixels[i / 3][static_cast<int>(i % 3)];
  return layer;
}

double linearPercentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const double at = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const auto above = std::min(below + 1, values.size() - 1);
  return values[below] + (values[above] - values[below]) * (at - static_cast<double>(below));
}

double relative(double meanSquare, double mean) { return std::sqrt(std::max(0.0, meanSquare)) / mean; }

// What both images and the mask hold, prepared for sums.
struct Pixels {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> ok;  // [Size 3 width height]
  Layer a, b, v;                 // 0 where not ok
  double mean = 0.0;             // of b where ok

  std::size_t count() const { return std::size_t{width} * height; }
};

// rmseClean without the worst share of the pixels; a pixel's badness is the mean over its valid channels.
double trimmed(const Pixels& p) {
  struct Pixel {
    double badness, square, variance;
    std::uint32_t channels;
  };
  std::vector<Pixel> pixels;
  for (std::size_t i = 0; i < p.count(); ++i) {
    Pixel pixel{0, 0, 0, 0};
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
      if (!p.ok[c]) continue;
      pixel.square += (p.a[c] - p.b[c]) * (p.a[c] - p.b[c]);
      pixel.variance += p.v[c];
      ++pixel.channels;
    }
    if (pixel.channels == 0) continue;
    pixel.badness = pixel.square / pixel.channels;
    pixels.push_back(pixel);
  }
  std::stable_sort(pixels.begin(), pixels.end(), [](const Pixel& x, const Pixel& y) { return x.badness < y.badness; });
  const auto keep = static_cast<std::size_t>(static_cast<double>(pixels.size()) * (1.0 - kTrimmedShare));
  double excess = 0.0, channels = 0.0;
  for (std::size_t i = 0; i < std::max<std::size_t>(1, keep); ++i) {
    excess += pixels[i].square - pixels[i].variance;
    channels += pixels[i].channels;
  }
  return relative(excess / channels, p.mean);
}

// The block figures: means over blocks of pixels, per channel, where at least half of a block counts.
void compareBlocks(const Pixels& p, std::uint32_t size, ImageDifference& d) {
  double square = 0.0, variance = 0.0;
  std::vector<double> relativeErrors;
  for (std::uint32_t y = 0; y + size <= p.height; y += size) {
    for (std::uint32_t x = 0; x + size <= p.width; x += size) {
      for (std::size_t c = 0; c < 3; ++c) {
        double n = 0, a = 0, b = 0, v = 0;
        for (std::uint32_t k = 0; k < size * size; ++k) {
          const std::size_t i = 3 * (std::size_t{y + k / size} * p.width + x + k % size) + c;
          n += p.ok[i];
          a += p.a[i];
          b += p.b[i];
          v += p.v[i];
        }
        if (n < std::max(1u, size * size / 2)) continue;
        const double difference = std::abs(a - b) / n;
        square += difference * difference;
        variance += v / (n * n);
        relativeErrors.push_back(difference / (b / n + kPercentileFloor * p.mean));
      }
    }
  }
  if (relativeErrors.empty()) return;
  const double n = static_cast<double>(relativeErrors.size());
  d.blockRmse = relative(square / n, p.mean);
  d.blockNoise = relative(variance / n, p.mean);
  d.blockRmseClean = relative((square - variance) / n, p.mean);
  d.blockP50 = linearPercentile(relativeErrors, 0.50);
  d.blockP95 = linearPercentile(relativeErrors, 0.95);
}

ImageDifference comparePixels(const Pixels& p, const CompareOptions& options, ImageDifference d) {
  double n = 0, sumA = 0, sumB = 0, square = 0, variance = 0, rgbA[3] = {}, rgbB[3] = {};
  for (std::size_t i = 0; i < p.ok.size(); ++i) {
    n += p.ok[i];
    sumA += p.a[i];
    sumB += p.b[i];
    rgbA[i % 3] += p.a[i];
    rgbB[i % 3] += p.b[i];
    square += (p.a[i] - p.b[i]) * (p.a[i] - p.b[i]);
    variance += p.v[i];
  }
  d.mean = p.mean;
  d.rmse = relative(square / n, p.mean);
  d.noise = relative(variance / n, p.mean);
  d.rmseClean = relative((square - variance) / n, p.mean);
  d.rmseTrimmed = trimmed(p);
  d.energy = sumA / sumB;
  for (int c = 0; c < 3; ++c) d.energyRgb[c] = rgbA[c] / std::max(1e-30, rgbB[c]);
  compareBlocks(p, options.block, d);
  return d;
}

}  // namespace

std::vector<std::uint8_t> edgePixels(const ChannelImage& reference) {
  const auto position = reference.layer("Position", "XYZ"), normal = reference.layer("Normal", "XYZ");
  const auto depth = reference.channels.find("Depth.Z");
  std::vector<std::uint8_t> edge(std::size_t{reference.width} * reference.height, 0);
  if (position.empty() || normal.empty() || depth == reference.channels.end()) return edge;

  const auto compare = [&](std::size_t a, std::size_t b) {
    const glm::dvec3 step = glm::dvec3(position[b]) - glm::dvec3(position[a]);
    const double depthA = depth->second[a], depthB = depth->second[b];
    const double off =
        std::max(std::abs(glm::dot(step, glm::dvec3(normal[a]))), std::abs(glm::dot(step, glm::dvec3(normal[b]))));
    const bool differ = off > kPlaneTolerance * std::min(depthA, depthB) ||
                        glm::dot(glm::dvec3(normal[a]), glm::dvec3(normal[b])) < kCosTolerance ||
                        (depthA > 0) != (depthB > 0);
    if (differ) edge[a] = edge[b] = 1;
  };
  for (std::uint32_t y = 0; y < reference.height; ++y) {
    for (std::uint32_t x = 0; x < reference.width; ++x) {
      const std::size_t i = std::size_t{y} * reference.width + x;
      if (x + 1 < reference.width) compare(i, i + 1);
      if (y + 1 < reference.height) compare(i, i + reference.width);
    }
  }
  return edge;
}

std::vector<std::uint8_t> validChannels(const ChannelImage& reference, const CompareOptions& options) {
  const std::size_t pixels = std::size_t{reference.width} * reference.height;
  const auto albedo = reference.layer("DiffCol"), emission = reference.layer("Emit");
  const auto depth = reference.channels.find("Depth.Z");
  const auto edge = options.keepEdges ? std::vector<std::uint8_t>(pixels, 0) : edgePixels(reference);
  std::vector<std::uint8_t> ok(3 * pixels, 0);
  if (albedo.empty() || depth == reference.channels.end()) return ok;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!(depth->second[i] > 0.0f) || edge[i]) continue;
    if (!options.keepEmitters && !emission.empty() && std::max({emission[i].x, emission[i].y, emission[i].z}) > 0.0f)
      continue;
    for (int c = 0; c < 3; ++c) {
      ok[3 * i + static_cast<std::size_t>(c)] = static_cast<double>(albedo[i][c]) >= options.minAlbedo ? 1 : 0;
    }
  }
  return ok;
}

Result<ImageDifference> compareImages(const ChannelImage& reference, const ChannelImage& candidate,
                                      const CompareOptions& options) {
  if (reference.width != candidate.width || reference.height != candidate.height) {
    return Error{ErrorCode::invalidFile, "sizes differ: reference " + std::to_string(reference.width) + " x " +
                                             std::to_string(reference.height) + ", candidate " +
                                             std::to_string(candidate.width) + " x " +
                                             std::to_string(candidate.height)};
  }
  Pixels p{reference.width, reference.height, validChannels(reference, options), {}, {}, {}, 0.0};
  auto a = layerOf(candidate, options.candidateLayer, "RGB", "candidate");
  if (!a) return a.error();
  p.a = std::move(*a);
  p.b.assign(p.a.size(), 0.0);
  p.v.assign(p.a.size(), 0.0);
  for (const std::string& name : options.layers) {
    auto layer = layerOf(reference, name, "RGB", "reference");
    if (!layer) return layer.error();
    const auto error = layerOf(reference, name + "Err", "RGB", "reference");  // none = no noise
    for (std::size_t i = 0; i < p.b.size(); ++i) {
      p.b[i] += (*layer)[i];
      if (error) p.v[i] += (*error)[i] * (*error)[i];
    }
  }

  // Mask.
  ImageDifference d;
  double n = 0.0, sum = 0.0;
  std::size_t validPixels = 0;
  for (std::size_t i = 0; i < p.count(); ++i) {
    bool bad = false, any = false;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
      if (p.ok[c] && !std::isfinite(p.a[c])) {
        bad = true;
        p.ok[c] = 0;
      }
      if (!p.ok[c]) p.a[c] = p.b[c] = p.v[c] = 0.0;
      any = any || p.ok[c];
      n += p.ok[c];
      sum += p.b[c];
    }
    d.nonfinite += bad;
    validPixels += any;
  }
  if (!(n > 0.0)) return Error{ErrorCode::invalidFile, "no valid pixel to compare"};
  p.mean = sum / n;
  d.validShare = static_cast<double>(validPixels) / static_cast<double>(p.count());
  return comparePixels(p, options, d);
}

}  // namespace relume
