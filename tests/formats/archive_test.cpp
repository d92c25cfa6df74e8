// SPDX-License-Identifier: MIT
// What an archive says when there is no memory for it: that, and not that the file is broken.
#include "formats/archive.h"

#include <gtest/gtest.h>

#include <sys/resource.h>

#include <cstdlib>
#include <fstream>

namespace relume {
namespace {

TEST(Archive, noMemoryIsNotTheFilesFault) {
#ifdef RELUME_EMULATED
  GTEST_SKIP() << "run by an emulator, which limits no memory";
#endif
  if (std::string(RELUME_SANITIZE) != "")
    GTEST_SKIP() << "built with " RELUME_SANITIZE ", which needs its own addresses";
  Provenance provenance;
  provenance.optionsJson.assign(std::size_t{64} << 20, 'x');
  const Result<std::vector<std::byte>> bytes = saveArchive(provenance);
  ASSERT_TRUE(bytes);
  const auto load = [&] {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlimit limit{(pages << 12) + (std::size_t{8} << 20), RLIM_INFINITY};
    ::setrlimit(RLIMIT_AS, &limit);
    Provenance loaded;
    const Status status = loadArchive(*bytes, loaded);
    std::_Exit(!status && status.error().code == ErrorCode::memory && status.error().message == "out of memory" ? 0
                                                                                                                : 1);
  };
  EXPECT_EXIT(load(), ::testing::ExitedWithCode(0), "");
  Provenance loaded;
  EXPECT_TRUE(loadArchive(*bytes, loaded));
}

}  // namespace
}  // namespace relume
