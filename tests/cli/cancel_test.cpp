// SPDX-License-Identifier: MIT
// Ctrl-C while a package works that cannot be asked to stop: the parser of one document, which takes several seconds.
// The command does not wait for it, says once that it was cancelled, and leaves nothing.
#include "tests/cli/cli_fixture.h"

namespace relume {
namespace {

namespace fs = std::filesystem;

class Cancel : public CliFixture {
 protected:
  // Start a command, wait until it says `moment` and has worked on for some of `whole`, a run without a signal, and
  // send the signal. Where this thread sleeps until most is done, that says nothing, and it is done again.
  ProgramResult cancelAfter(const std::string& moment, const std::vector<std::string>& command,
                            const ProgramResult& whole, int signal = SIGINT) {
    ProgramResult result;
    for (int i = 0; i < 8; ++i) {
      Program program(command, folder_);
      EXPECT_TRUE(program.waitForStderr(moment)) << readAll(folder_ / "stderr.txt");
      const double said = program.cpuSeconds();
      double worked = said;
      while (said > 0.0 && worked > 0.0 && worked < said + 0.05 * whole.cpuSeconds) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        worked = program.cpuSeconds();
      }
      program.send(signal);
      const bool isEarly = worked > 0.0 && program.cpuSeconds() < 0.4 * whole.cpuSeconds;
      result = program.wait();
      if (isEarly) break;
      fs::remove(out_);
    }
    return result;
  }
  void expectCancelled(const ProgramResult& result, const ProgramResult& whole) const {
    EXPECT_EQ(result.status, 130) << result.err;
    EXPECT_LT(result.cpuSeconds, 0.6 * whole.cpuSeconds) << "it worked on after the signal";
    const std::string message = "relume: error: cancelled\n";
    const std::size_t at = result.err.find(message);
    ASSERT_NE(at, std::string::npos) << result.err;
    EXPECT_EQ(at + message.size(), result.err.size()) << result.err;
    EXPECT_TRUE(fs::is_empty(folder_ / "out"));
  }

  // The room with an extra list of 8 million numbers, which takes seconds to parse.
  std::string putLongDocument() {
    std::string level = readAll(room_);
    std::string list = "{\"extras\":{\"numbers\":[0.5";
    for (int i = 0; i < 8'000'000; ++i) list += ",0.5";
    return put("long.gltf", level.replace(level.find('{'), 1, list + "]},"));
  }
};

TEST_F(Cancel, isHeardWhileADocumentIsParsed) {
  const std::vector<std::string> command = bakeArguments(putLongDocument(), out_, {"--progress", "plain"});
  const ProgramResult whole = run(command);
  ASSERT_EQ(whole.status, 0) << whole.err;
  std::filesystem::remove_all(folder_ / "out");
  std::filesystem::create_directories(folder_ / "out");
  expectCancelled(cancelAfter("import: 0 %", command, whole), whole);
  expectCancelled(cancelAfter("import: 0 %", command, whole, SIGTERM), whole);
  // Nothing stands in the way of the next run.
  EXPECT_EQ(run(bakeArguments(room_, out_)).status, 0);
  EXPECT_EQ(filesIn(folder_ / "out"), 1u);
}

}  // namespace
}  // namespace relume
