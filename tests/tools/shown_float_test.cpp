// SPDX-License-Identifier: MIT
// Floats in JSON: the shortest text, which reads back as the same float.
#include "tools/base/shown_float.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdint>
#include <cstring>
#include <limits>

namespace relume {
namespace {

TEST(ShownFloat, isShortInJson) {
  const nlohmann::json shown = {shownFloat(2.6f), shownFloat(-0.1f), shownFloat(1e-20f), shownFloat(3.0f)};
  EXPECT_EQ(shown.dump(), "[2.6,-0.1,1e-20,3.0]");
  EXPECT_NE(nlohmann::json(2.6f).dump(), "2.6") << "this header has become needless";
}

TEST(ShownFloat, readsBackAsTheSameFloat) {
  std::uint32_t bits = 1;
  for (int i = 0; i < 100000; ++i) {
    bits = bits * 1664525u + 1013904223u;
    float value = 0.0f;
    std::memcpy(&value, &bits, sizeof value);
    if (value != value) continue;
    ASSERT_EQ(static_cast<float>(shownFloat(value)), value) << bits;
  }
  EXPECT_EQ(shownFloat(std::numeric_limits<float>::infinity()), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace relume
