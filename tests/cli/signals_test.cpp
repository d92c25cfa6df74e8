// SPDX-License-Identifier: MIT
// Signals at any moment: a command ends with 130, or has done its work, and leaves nothing half written.
#include "tests/cli/cli_fixture.h"

#include <fcntl.h>

namespace relume {
namespace {

class Signals : public CliFixture {
 protected:
  std::vector<std::string> bakeCommand() const { return bakeArguments(room_, out_, {"--force"}); }
  std::vector<std::string> benchCommand() const {
    std::vector<std::string> list = bakeArguments(room_, "");
    list[0] = "bench";
    list.erase(list.begin() + 2, list.begin() + 4);
    list.insert(list.end(), {"--backend", "cpu", "--preset", "draft,draft", "--repeat", "20"});
    return list;
  }
  // Two signals, as `timeout` sends them, at moments all over the command's time.
  void expectEnds(const std::vector<std::string>& command) {
    const ProgramResult whole = run(command);
    ASSERT_EQ(whole.status, 0) << whole.err;
    constexpr int kMoments = 12;
    for (int i = 0; i < kMoments; ++i) {
      Program program(command, folder_);
      program.waitForHandler(SIGTERM);
      std::this_thread::sleep_for(std::chrono::duration<double>(whole.seconds * i / kMoments));
      program.send(SIGTERM);
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      program.send(SIGTERM);
      const ProgramResult ended = program.wait();
      EXPECT_TRUE(ended.status == 130 || ended.status == 0) << "moment " << i << ": " << ended.status << "\n"
                                                            << ended.err;
      for (const auto& each : std::filesystem::directory_iterator(folder_ / "out"))
        EXPECT_NE(each.path().extension(), ".tmp") << "moment " << i;
    }
  }
};

TEST_F(Signals, twoInARowAreOneToABake) { expectEnds(bakeCommand()); }

TEST_F(Signals, twoInARowAreOneToABench) { expectEnds(benchCommand()); }

// It has measured, and waits for a reader of what it prints.
TEST_F(Signals, aCommandThatIsDoneEndsWithItsStatus) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  ::fcntl(ends[1], F_SETFL, O_NONBLOCK);
  const std::string page(4096, ' ');
  while (::write(ends[1], page.data(), page.size()) > 0) {
  }
  ::fcntl(ends[1], F_SETFL, 0);
  Program program(benchCommand(), folder_, [&] { ::dup2(ends[1], STDOUT_FILENO); });
  ASSERT_TRUE(program.waitForHandler(SIGTERM));
  double before = 0.0, now = program.cpuSeconds();
  while (now != before) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    before = now;
    now = program.cpuSeconds();
  }
  program.send(SIGTERM);
  EXPECT_EQ(program.wait().status, 130);
  ::close(ends[0]);
  ::close(ends[1]);
}

}  // namespace
}  // namespace relume
