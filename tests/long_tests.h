// SPDX-License-Identifier: MIT
// RELUME_LONG_TESTS=1 in the environment asks for the long runs (tests/run.sh --long).
#pragma once

#include <cstdlib>
#include <string_view>

namespace relume::test {

inline bool longTests() {
  const char* value = std::getenv("RELUME_LONG_TESTS");
  return value != nullptr && std::string_view(value) == "1";
}

}  // namespace relume::test
