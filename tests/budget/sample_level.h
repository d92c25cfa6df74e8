// SPDX-License-Identifier: MIT
// The level that budgets are tried on, and what a bake of it holds in a game.
#pragma once

#include "relume/relighter.h"
#include "tests/load_level.h"

#include <gtest/gtest.h>

namespace relume::test {

inline Scene sampleLevel() { return loadLevel(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb"); }

// [byte]
inline double heldBytes(const Bake& bake) {
  RelightOptions options;
  options.surfelArrays = false;  // the lights are punctual
  const Result<Relighter> relighter = Relighter::create(bake, options);
  EXPECT_TRUE(relighter) << relighter.error().message;
  double bytes = 0.0;
  for (const auto& [name, size] : relighter->bufferSizes()) bytes += static_cast<double>(size);
  return bytes;
}

}  // namespace relume::test
