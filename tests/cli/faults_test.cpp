// SPDX-License-Identifier: MIT
// What a bake leaves behind when something fails around it: the old file or the new one, whole; and nothing else once
// the next run is through.
#include "tests/cli/cli_fixture.h"

#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <random>

namespace relume {
namespace {

namespace fs = std::filesystem;

class Faults : public CliFixture {
 protected:
  // The bytes of two bakes of the room, by seed.
  void SetUp() override {
    CliFixture::SetUp();
    bake(room_, out_);
    old_ = readAll(out_);
    bake(room_, at("new.relume"), {"--seed", "2"});
    new_ = readAll(at("new.relume"));
    ASSERT_NE(old_, new_);
  }
  std::vector<std::string> rebake() const { return bakeArguments(room_, out_, {"--seed", "2", "--force"}); }
  void expectWhole(const std::string& where) const {
    const std::string bytes = readAll(out_);
    EXPECT_TRUE(bytes == old_ || bytes == new_)
        << where << ": " << bytes.size() << " bytes, neither the old nor the new bake";
  }
  void expectOldAlone() const {
    EXPECT_TRUE(readAll(out_) == old_);
    EXPECT_EQ(filesIn(folder_ / "out"), 1u);
  }

  std::string old_, new_;
};

TEST_F(Faults, killedAtFiftyMoments) {
  const ProgramResult whole = run(rebake());
  ASSERT_EQ(whole.status, 0) << whole.err;
  std::ofstream(out_, std::ios::binary) << old_;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0.0, 1.1);
  double seconds = whole.seconds;
  int killed = 0;
  // Where the machine has less to do by and by, runs end before they are killed: then sooner, and some more.
  for (int i = 0; i < 50 || (killed <= 5 && i < 500); ++i) {
    Program program(rebake(), folder_);
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds * share(random)));
    program.send(SIGKILL);
    const bool isKilled = program.wait().status == 128 + SIGKILL;
    killed += isKilled ? 1 : 0;
    if (!isKilled && 2 * killed < i) seconds *= 0.9;
    expectWhole("kill " + std::to_string(i));
  }
  EXPECT_GT(killed, 5) << "hardly any run was still alive";
  EXPECT_EQ(run(rebake()).status, 0);
  EXPECT_TRUE(readAll(out_) == new_);
  EXPECT_EQ(filesIn(folder_ / "out"), 1u) << "temporaries of killed runs were left";
}

TEST_F(Faults, filesMayNotGrow) {
  const ProgramResult result = runProgram(rebake(), folder_, [] {
    const rlimit limit{4096, 4096};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  });
  EXPECT_EQ(result.status, 2) << result.err;
  EXPECT_NE(result.err.find("File too large"), std::string::npos) << result.err;
  expectOldAlone();
}

// A file system of its own on `folder_`/disk, gone with the test.
class Disk {
 public:
  Disk(fs::path path, const std::string& options) : path_(std::move(path)) {
    fs::create_directories(path_);
    mounted_ = ::mount("tmpfs", path_.c_str(), "tmpfs", 0, options.c_str()) == 0;
    error_ = errno;
  }
  ~Disk() {
    if (mounted_) ::umount(path_.c_str());
  }
  bool mounted() const { return mounted_; }
  std::string reason() const { return std::string("a tmpfs cannot be mounted here: ") + std::strerror(error_); }
  bool makeReadOnly() { return ::mount("tmpfs", path_.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, nullptr) == 0; }

 private:
  fs::path path_;
  bool mounted_ = false;
  int error_ = 0;
};

TEST_F(Faults, theDiskIsFull) {
  Disk disk(folder_ / "disk", "size=" + std::to_string(old_.size() + old_.size() / 2));
  if (!disk.mounted()) GTEST_SKIP() << disk.reason();
  out_ = at("disk/room.relume");
  std::ofstream(out_, std::ios::binary) << old_;
  const ProgramResult result = run(rebake());
  EXPECT_EQ(result.status, 2) << result.err;
  EXPECT_NE(result.err.find("No space left on device"), std::string::npos) << result.err;
  EXPECT_TRUE(readAll(out_) == old_);
  EXPECT_EQ(filesIn(folder_ / "disk"), 1u);
}

TEST_F(Faults, theDiskIsReadOnly) {
  Disk disk(folder_ / "disk", "size=4m");
  if (!disk.mounted()) GTEST_SKIP() << disk.reason();
  out_ = at("disk/room.relume");
  std::ofstream(out_, std::ios::binary) << old_;
  if (!disk.makeReadOnly()) GTEST_SKIP() << "a tmpfs cannot be remounted read-only here";
  const ProgramResult result = run(rebake());
  EXPECT_EQ(result.status, 2) << result.err;
  EXPECT_NE(result.err.find("Read-only file system"), std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("links"), std::string::npos) << "found out only after the bake";
  EXPECT_TRUE(readAll(out_) == old_);
}

TEST_F(Faults, theOutputIsAFolder) {
  fs::create_directories(at("out/folder.relume"));
  const ProgramResult result = run(bakeArguments(room_, at("out/folder.relume")));
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.err.find("Is a directory"), std::string::npos) << result.err;
  EXPECT_TRUE(fs::is_empty(at("out/folder.relume")));
}

TEST_F(Faults, aReadOnlyFileInAWritableFolderIsReplacedWhole) {
  ::chmod(out_.c_str(), 0444);
  EXPECT_EQ(run(rebake()).status, 0);
  EXPECT_TRUE(readAll(out_) == new_);
}

TEST_F(Faults, twoBakesOfTheSameOutputAtOnce) {
  fs::create_directories(at("second"));
  for (int round = 0; round < 5; ++round) {
    Program first(bakeArguments(room_, out_, {"--force"}), folder_);
    Program second(rebake(), folder_ / "second");
    const ProgramResult a = first.wait(), b = second.wait();
    EXPECT_EQ(a.status, 0) << a.err;
    EXPECT_EQ(b.status, 0) << b.err;
    expectWhole("round " + std::to_string(round));
    EXPECT_EQ(filesIn(folder_ / "out"), 1u);
  }
}

// As a user who may have no more processes, which root is not.
TEST_F(Faults, threadsAreFew) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become a user without other processes";
  if (std::string(RELUME_SANITIZE) != "") GTEST_SKIP() << "built with " RELUME_SANITIZE ", which needs a thread";
  fs::permissions(folder_ / "out", fs::perms::all);
  for (const rlim_t threads : {1, 2, 4}) {
    std::vector<std::string> arguments = rebake();
    arguments.insert(arguments.end(), {"--threads", "8"});
    const ProgramResult result = runProgram(arguments, folder_, [threads] {
      const rlimit limit{threads, threads};
      constexpr unsigned kUser = 54321;
      ::setrlimit(RLIMIT_NPROC, &limit);
      if (::setresgid(kUser, kUser, kUser) != 0 || ::setresuid(kUser, kUser, kUser) != 0) ::_exit(kNotDropped);
    });
    if (result.status == kNotDropped || result.status == 127) GTEST_SKIP() << "another user cannot run the program";
    EXPECT_EQ(result.status, 4) << result.err;
    EXPECT_NE(result.err.find("a thread cannot be started: "), std::string::npos) << result.err;
    expectOldAlone();
  }
}

// Memory runs out at one place after another: an error or a whole bake, never a crash, nor a bake that does not end.
TEST_F(Faults, theAddressSpaceIsSmall) {
  if (std::string(RELUME_SANITIZE) != "")
    GTEST_SKIP() << "built with " RELUME_SANITIZE ", which needs terabytes of addresses";
  int refused = 0, baked = 0;
  for (rlim_t mebibytes = 32; mebibytes <= 1024; mebibytes += mebibytes < 384 ? 8 : 128) {
    std::ofstream(out_, std::ios::binary) << old_;
    std::vector<std::string> arguments = rebake();
    arguments.insert(arguments.end(), {"--threads", mebibytes % 16 == 0 ? "1" : "4"});
    if (mebibytes % 32 < 16) arguments.insert(arguments.end(), {"--store", at("store" + std::to_string(mebibytes))});
    const ProgramResult result = runProgram(arguments, folder_, [mebibytes] {
      const rlimit limit{mebibytes << 20, mebibytes << 20};
      ::setrlimit(RLIMIT_AS, &limit);
      ::alarm(60);  // by which it is killed
    });
    // Not even the program fits: its libraries, or what they make before main() begins (which has a handler of its own
    // for exceptions that nothing catches).
    if (result.status == 127 || result.err.find("error while loading shared libraries") != std::string::npos ||
        result.err.find("terminate called ") == 0)
      continue;
    EXPECT_TRUE(result.status == 0 || result.status == 4) << mebibytes << " MiB: status " << result.status << "\n"
                                                          << result.err;
    EXPECT_EQ(result.err.find("relume: error: ") != std::string::npos, result.status == 4) << mebibytes << " MiB\n"
                                                                                           << result.err;
    (result.status == 0 ? baked : refused) += 1;
    expectWhole(std::to_string(mebibytes) + " MiB");
    EXPECT_EQ(filesIn(folder_ / "out"), 1u) << mebibytes << " MiB";
  }
  EXPECT_GT(baked, 0);
}

}  // namespace
}  // namespace relume
