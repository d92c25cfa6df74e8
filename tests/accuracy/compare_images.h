// SPDX-License-Identifier: MIT
// How far an image is from a path-traced reference, with the reference's own noise removed. The definitions are those
// of the script that made the reference images, to the last detail, so that figures can be compared.
#pragma once

#include "relume/result.h"
#include "tools/images/image_io.h"

#include <cstdint>
#include <string>
#include <vector>

namespace relume {

struct CompareOptions {
  std::vector<std::string> layers{"DiffInd"};  // of the reference, summed
  std::string candidateLayer;                  // "" = channels R, G, B
  double minAlbedo = 0.02;                     // [0..1] channels of a darker DiffCol do not count
  std::uint32_t block = 4;                     // [1..64] pixels a side of the blocks
  bool keepEdges = false;                      // count pixels beside discontinuities of depth and normal
  bool keepEmitters = false;                   // count pixels that show emitters
};

// a = candidate, b = reference, v = variance of b estimated from its halves; means over all channels of valid pixels.
struct ImageDifference {
  double validShare = 0;      // of the pixels
  std::size_t nonfinite = 0;  // pixels of the candidate
  double mean = 0;            // of b
  double rmse = 0;            // sqrt(mean (a-b)²) / mean b
  double noise = 0;           // sqrt(mean v) / mean b: what a perfect image would get
  double rmseClean = 0;       // sqrt(max(0, mean ((a-b)² - v))) / mean b
  double rmseTrimmed = 0;     // rmseClean without the worst 1 % of the pixels ("t1")
  double energy = 0;          // sum a / sum b
  double energyRgb[3] = {0, 0, 0};
  // After averaging blocks of at least half valid pixels:
  double blockRmse = 0, blockNoise = 0, blockRmseClean = 0;
  double blockP50 = 0, blockP95 = 0;  // percentiles of |a-b| / (b + 0.05 mean b)
};

// Which pixels count: x width + y, 3 channels. [Size 3 width height] Hit, albedo high enough, no edge, no emitter.
std::vector<std::uint8_t> validChannels(const ChannelImage& reference, const CompareOptions& options);

// True where a 4-neighbour is on another surface: beyond 2 % of the depth off the plane, normals' cosine under 0.9, or
// only one of the two hit. [Size width height]
std::vector<std::uint8_t> edgePixels(const ChannelImage& reference);

// invalidFile: a layer is missing, sizes differ, or no valid pixel is left.
Result<ImageDifference> compareImages(const ChannelImage& reference, const ChannelImage& candidate,
                                      const CompareOptions& options);

}  // namespace relume
