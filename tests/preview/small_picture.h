// SPDX-License-Identifier: MIT
// Pictures that a test has time for.
#pragma once

#include "bake/preview/preview.h"

#include <cstdint>

namespace relume::test {

inline PreviewOptions pictureOf(std::uint32_t width, std::uint32_t height, std::uint32_t samples, std::uint32_t rays) {
  PreviewOptions options;
  options.width = width;
  options.height = height;
  options.samples = samples;
  options.rays = rays;
  return options;
}

}  // namespace relume::test
