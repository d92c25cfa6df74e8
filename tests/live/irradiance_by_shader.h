// SPDX-License-Identifier: MIT
// What a shader of the host's reads of live light, at places all over a box.
#pragma once

#include "runtime/live_gl/live_caches_gl.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/voxels/boxes.h"

#include <cstddef>
#include <random>
#include <vector>

namespace relume::test {

// [Size 6 count] positions in the box and unit normals, one after the other.
inline std::vector<float> placesInBox(std::size_t count, const glm::vec3& low, const glm::vec3& high) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> in(0.0f, 1.0f);
  std::vector<float> places;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 p = low + (high - low) * glm::vec3(in(random), in(random), in(random)), n = unit(random);
    places.insert(places.end(), {p.x, p.y, p.z, n.x, n.y, n.z});
  }
  return places;
}

// [Size 3 for each place] [W/m²]
inline std::vector<float> irradianceByShader(const LiveCachesGl& light, const std::vector<float>& places) {
  const std::size_t count = places.size() / 6;
  light.bind();
  return runCompute(
      light.glsl(),
      "  vec3 e = relumeLiveIrradiance(vec3(inData[6u * i], inData[6u * i + 1u], inData[6u * i + 2u]),\n"
      "                                vec3(inData[6u * i + 3u], inData[6u * i + 4u], inData[6u * i + 5u]));\n"
      "  outData[3u * i] = e.r;\n  outData[3u * i + 1u] = e.g;\n  outData[3u * i + 2u] = e.b;\n",
      places, count, 3 * count, [&](unsigned int program) { light.setUniforms(program); });
}

}  // namespace relume::test
