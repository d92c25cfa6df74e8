// SPDX-License-Identifier: MIT
// A layer of a frame that was drawn against layers of a path-traced reference, for programs that measure a view.
#pragma once

#include "tests/accuracy/compare_images.h"
#include "tools/render/render_frame.h"

#include <string>
#include <utility>
#include <vector>

namespace relume::test {

// `layers` of the reference, added up.
inline Result<ImageDifference> compareFrame(const ChannelImage& reference, std::vector<std::string> layers,
                                            const RenderedFrame& frame, Aov aov) {
  ChannelImage found{frame.width, frame.height, {}};
  found.setLayer("", composeAov(frame, aov));
  CompareOptions options;
  options.layers = std::move(layers);
  return compareImages(reference, found, options);
}

}  // namespace relume::test
