// SPDX-License-Identifier: MIT
// A level of a file, for tests that cannot go on without it.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <utility>

namespace relume::test {

inline Scene loadLevel(const std::filesystem::path& path) {
  Context context;
  Result<Scene> scene = importGltf(path, context);
  EXPECT_TRUE(scene) << scene.error().message;
  return scene ? std::move(*scene) : Scene{};
}

}  // namespace relume::test
