// SPDX-License-Identifier: MIT
// Small files that ask for much (make_levels.py) bake within bounds of processor time and memory. The bounds are
// several times what the levels take: what they catch is the square of a count.
#include "tests/cli/cli_fixture.h"

#include <sys/resource.h>

#include <cstdlib>

namespace relume {
namespace {

struct Costly {
  const char* level;
  rlim_t seconds;    // of processor time
  rlim_t mebibytes;  // of address space
};

void PrintTo(const Costly& costly, std::ostream* out) { *out << costly.level; }

class SmallFiles : public CliFixture, public testing::WithParamInterface<Costly> {};

TEST_P(SmallFiles, bakeWithinBounds) {
  if (std::string(RELUME_PYTHON).empty()) GTEST_SKIP() << "no Python to write the level with";
  const Costly& costly = GetParam();
  const std::string command =
      std::string(RELUME_PYTHON) + " " + RELUME_MAKE_LEVELS + " \"" + folder_.string() + "\" " + costly.level;
  ASSERT_EQ(std::system(command.c_str()), 0) << command;

  // Sanitizers reserve terabytes of addresses and take several times as long.
  const bool sanitized = !std::string(RELUME_SANITIZE).empty();
  const ProgramResult result =
      runProgram({"bake", at(std::string(costly.level) + ".glb"), "-o", out_, "--preset", "draft", "--threads", "2"},
                 folder_, [&] {
                   const rlim_t seconds = costly.seconds * (sanitized ? 20 : 1);
                   const rlimit time{seconds, seconds};
                   ::setrlimit(RLIMIT_CPU, &time);
                   const rlimit memory{costly.mebibytes << 20, costly.mebibytes << 20};
                   if (!sanitized) ::setrlimit(RLIMIT_AS, &memory);
                 });
  EXPECT_EQ(result.status, 0) << result.err;
}

INSTANTIATE_TEST_SUITE_P(cost, SmallFiles,
                         testing::Values(Costly{"coincident_instances", 30, 1024}, Costly{"one_extension", 30, 1024},
                                         Costly{"layer_nodes", 30, 1024}, Costly{"layers", 90, 1536},
                                         Costly{"big_image", 30, 1536}),
                         [](const auto& costly) { return std::string(costly.param.level); });

}  // namespace
}  // namespace relume
