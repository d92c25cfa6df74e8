// SPDX-License-Identifier: MIT
// A relighter that must come into being.
#pragma once

#include "relume/relighter.h"

#include <gtest/gtest.h>

#include <utility>

namespace relume::test {

inline Relighter makeRelighter(const Bake& bake, const RelightOptions& options = {}) {
  Result<Relighter> made = Relighter::create(bake, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

}  // namespace relume::test
