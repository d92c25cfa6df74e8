// SPDX-License-Identifier: MIT
// The level that budgets are tried on, and what a bake of it holds in a game.
#pragma once

#include "relume/bake/load_scene.h"
#include "relume/relighter.h"

#include <gtest/gtest.h>

#include <utility>

namespace relume::test {

inline Scene sampleLevel() {
  Context context;
  Result<Scene> scene = loadScene(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", context, {}, MeshReport::none);
  EXPECT_TRUE(scene) << scene.error().message;
  return std::move(*scene);
}

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
