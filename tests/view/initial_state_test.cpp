// SPDX-License-Identifier: MIT
// What the viewer begins with, as far as it reads files for it.
#include "bake/base/memory_budget.h"
#include "tools/images/image_io.h"
#include "tools/view/view_state.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace relume {
namespace {

namespace fs = std::filesystem;

// An OpenEXR of one pixel that says it shows 16,384 x 16,384.
fs::path hugeSky() {
  fs::path path = fs::path(testing::TempDir()) / "relume_huge_sky.exr";
  ChannelImage image{1, 1, {}};
  image.setLayer("", std::vector<glm::vec3>{glm::vec3(1.0f)});
  EXPECT_TRUE(writeExr(path, image));
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const std::string name("displayWindow\0box2i\0", 20);
  const std::size_t at = bytes.find(name);
  EXPECT_NE(at, std::string::npos);
  const std::int32_t last[] = {16383, 16383};
  std::memcpy(&bytes[at + name.size() + 12], last, sizeof last);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

TEST(InitialState, aSkyMapBeyondTheMemoryIsRefused) {
  ViewerOptions options;
  options.skyMap = hugeSky().string();
  rlimit before{};
  ::getrlimit(RLIMIT_AS, &before);
  // Of which three quarters are the budget; a sanitizer's terabytes of addresses are more.
  std::ifstream statm("/proc/self/statm");
  std::size_t pages = 0;
  ASSERT_TRUE(statm >> pages);
  const rlimit small{std::max<rlim_t>(3u << 30, pages * 4096 + (1u << 30)), before.rlim_max};
  ::setrlimit(RLIMIT_AS, &small);
  const bool isSmall = machineMemoryBudget() < std::uint64_t{3} << 30;
  const auto state = isSmall ? initialState(Scene(), options) : Error{ErrorCode::failed, ""};
  ::setrlimit(RLIMIT_AS, &before);
  fs::remove(options.skyMap);
  if (!isSmall) GTEST_SKIP() << "this build has too many addresses in use for a small budget";
  ASSERT_FALSE(state);
  EXPECT_NE(state.error().message.find("sky map needs about "), std::string::npos) << state.error().message;
}

}  // namespace
}  // namespace relume
