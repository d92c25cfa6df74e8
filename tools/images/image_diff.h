// SPDX-License-Identifier: MIT
// How far an image is from a reference of the same view: figures, and a picture of the error. (tests/accuracy measures
// against path-traced references with their masks and noise; this takes any two images.)
#pragma once

#include "relume/result.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {

// Linear RGB, row 0 on top.
struct Picture {
  std::uint32_t width = 0, height = 0;
  std::vector<glm::vec3> pixels;  // [Size width * height]
};

// a = image, b = reference; means over pixels and channels.
struct PictureDifference {
  double rmse = 0.0;                     // sqrt(mean (a - b)²), in the images' unit
  double relativeRmse = 0.0;             // rmse / mean |b|; infinite where b is black and a is not
  double energy = 1.0;                   // sum a / sum b; infinite likewise
  double flip = 0.0;                     // [0..1] mean of FLIP, both images exposed alike
  double mean = 0.0;                     // of |b|
  std::uint32_t worstX = 0, worstY = 0;  // pixel of the largest absolute difference
  double worst = 0.0;                    // that difference, of one channel
};

// `exposure` is a factor on both for FLIP, which sees [0..1]. invalidFile: sizes differ, or a value is not finite; the
// names are for the message.
Result<PictureDifference> comparePictures(const Picture& image, const Picture& reference, float exposure,
                                          const std::string& imageName, const std::string& referenceName);

// The error of each pixel's luminance as share of the reference's (plus a twentieth of its mean, so that noise in the
// dark stays quiet): white where there is none, red where the image is too bright, blue where it is too dark.
struct ErrorPicture {
  double scale = 0.0;             // the share that full red and full blue stand for: 0.01, 0.05, 0.25 or 1
  std::vector<std::uint8_t> rgb;  // [Size 3 * width * height] sRGB
};
ErrorPicture drawError(const Picture& image, const Picture& reference);

}  // namespace relume
