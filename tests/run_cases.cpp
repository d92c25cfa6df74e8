// SPDX-License-Identifier: MIT
// The main function of programs that hold the cases of several tests (relume_test() of cmake/RelumeTarget.cmake,
// TOGETHER). Each test names its files, `--of NAME.cpp` for each, and runs their cases, less those that
// `--gtest_filter=-...` leaves out. What a filter asks for by name runs alone; without a file, all cases do.
#include <gtest/gtest.h>

#include <cstdio>
#include <set>
#include <string>
#include <string_view>

namespace {

// The filter of the cases that stand in these files; empty where one of the files has none.
std::string filterOf(const std::set<std::string_view>& files) {
  const ::testing::UnitTest& all = *::testing::UnitTest::GetInstance();
  std::set<std::string_view> found;
  std::string filter;
  for (int s = 0; s < all.total_test_suite_count(); ++s) {
    const ::testing::TestSuite& suite = *all.GetTestSuite(s);
    for (int c = 0; c < suite.total_test_count(); ++c) {
      const ::testing::TestInfo& test = *suite.GetTestInfo(c);
      std::string_view file = test.file();
      file.remove_prefix(file.rfind('/') + 1);
      if (!files.contains(file)) continue;
      found.insert(file);
      filter += std::string(filter.empty() ? "" : ":") + suite.name() + "." + test.name();
    }
  }
  return found == files ? filter : "";
}

}  // namespace

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  std::set<std::string_view> files;
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]) != "--of" || i + 1 == argc) {
      std::fprintf(stderr, "%s: unknown argument '%s' (known: --of NAME.cpp, and GoogleTest's)\n", argv[0], argv[i]);
      return 1;
    }
    files.insert(argv[++i]);
  }
  const std::string asked = ::testing::GTEST_FLAG(filter);
  if (!files.empty() && (asked == "*" || asked.starts_with('-'))) {
    const std::string filter = filterOf(files);
    if (filter.empty()) {
      std::fprintf(stderr, "%s: one of the files has no case\n", argv[0]);
      return 1;
    }
    ::testing::GTEST_FLAG(filter) = asked == "*" ? filter : filter + asked;
  }
  return RUN_ALL_TESTS();
}
