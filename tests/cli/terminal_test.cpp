// SPDX-License-Identifier: MIT
// The bar on a terminal: its line is drawn again, so it must not go on in a second one.
#include "tests/cli/cli_fixture.h"

#include <pty.h>

#include <algorithm>
#include <cstdlib>

namespace relume {
namespace {

class TerminalBar : public CliFixture {
 protected:
  // The bars that the command draws on a terminal of so many columns.
  std::vector<std::string> drawn(const std::vector<std::string>& command, unsigned short columns) {
    winsize size{24, columns, 0, 0};
    int ours = -1, its = -1;
    if (::openpty(&ours, &its, nullptr, nullptr, &size) != 0) return {};
    Program program(command, folder_, [&] {
      ::setenv("TERM", "xterm", 1);
      ::dup2(its, STDERR_FILENO);
      ::close(its);
      ::close(ours);
    });
    ::close(its);
    std::string text;
    char some[4096];
    for (ssize_t got = 0; (got = ::read(ours, some, sizeof some)) > 0;)
      text.append(some, static_cast<std::size_t>(got));
    ::close(ours);
    const ProgramResult result = program.wait();
    EXPECT_EQ(result.status, 0) << text;
    std::vector<std::string> lines;
    const std::string begin = "\r\033[K";
    for (std::size_t at = 0; (at = text.find(begin, at)) != std::string::npos;) {
      at += begin.size();
      const std::size_t end = std::min(text.find(begin, at), text.size());
      const std::string line = text.substr(at, end - at);
      if (!line.empty() && !line.starts_with("relume: ")) lines.push_back(line);
    }
    return lines;
  }
  static std::size_t longest(const std::vector<std::string>& lines) {
    std::size_t longest = 0;
    for (const std::string& line : lines) longest = std::max(longest, line.size());
    return longest;
  }
};

TEST_F(TerminalBar, staysInOneLine) {
  const std::vector<std::string> command = bakeArguments(room_, out_, {"--verify"});
  for (const unsigned short columns : {40, 80}) {
    const std::vector<std::string> lines = drawn(command, columns);
    ASSERT_FALSE(lines.empty());
    EXPECT_LT(longest(lines), columns);
    EXPECT_GE(longest(lines), 38u) << "all that fits";
  }
  EXPECT_LT(longest(drawn(command, 10)), 10u);
  EXPECT_GE(longest(drawn(command, 200)), 50u) << "a whole bar";
}

}  // namespace
}  // namespace relume
