// SPDX-License-Identifier: MIT
// A headless debug context for a test, skipped with the reason where there is none; relighters of either backend in it;
// compute shaders run over floats; and how far two backends' results are apart.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "tests/runtime/synthetic_bake.h"
#include "tools/gl_scene/egl_context.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace relume::test {

// A test with a context, which must end without a complaint of the driver.
class GlTest : public testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;
  std::optional<EglContext> context_;
};

// Whether a processor draws. Hardware filters textures by weights of 8 bits, and its compilers contract and reorder.
bool isSoftware();

// A relighter that must come about. 0 bands: all that the bake has.
Relighter makeRelighter(const Bake& bake, BackendKind backend, int luma = 0, int chroma = 0,
                        const std::string& visibility = {}, bool glossy = false);

// Enough surfels for levels of the tree that fill many work groups, and sky.
SyntheticOptions manySurfels(LinkKind kind, std::uint32_t bands);

// Link a program, anew if it was linked before, of one compute shader that must compile.
bool linkCompute(std::uint32_t program, const std::string& source);

// Run `body` on `count` threads of a compute shader. `text` follows #version 430 and may declare functions; `body`
// knows its thread `i`, reads float inData[] (binding 0) and writes float outData[] (binding 1). prepare: given the
// program before it runs.
std::vector<float> runCompute(const std::string& text, const std::string& body, const std::vector<float>& in,
                              std::size_t count, std::size_t outFloats,
                              const std::function<void(std::uint32_t program)>& prepare = {});

// Largest difference of two lists of numbers, relative to the root mean square of the first.
double difference(const std::vector<float>& a, const std::vector<float>& b);

// Largest difference of two lists of coefficients, relative to coefficient 0 of their cache.
double coefficientDifference(const std::vector<float>& a, const std::vector<float>& b, int perCache);

}  // namespace relume::test
