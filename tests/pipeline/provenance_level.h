// SPDX-License-Identifier: MIT
// A small level with every attribute and extra that the baker reads, and its bake, for the tests of provenance.
#pragma once

#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "tests/import/gltf_builder.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace relume::test {

// Options that bake it in milliseconds.
BakeOptions tinyOptions();

// A floor and a screen above it, a camera, a lamp, one texture with holes, and materials nobody uses.
testing::GltfBuilder makeBase();

// A bake, and the bytes of its file.
struct Baked {
  Bake bake;
  std::vector<std::byte> bytes;
};

// Nothing, and a failed test, when the level does not bake.
std::optional<Baked> bakeLevel(const Scene& scene);

// Whether two bakes have the same light. The provenance in the file has the hash of cameras that decide nothing.
bool sameButCameras(Bake a, const Baked& b);

// What exporters add: up to `metres` to each coordinate of a position, up to `ofNormal` to each of a normal.
Mesh withNoise(Mesh mesh, double metres, double ofNormal, std::uint32_t seed);

}  // namespace relume::test
