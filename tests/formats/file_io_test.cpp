// SPDX-License-Identifier: MIT
// Atomic writes: whatever fails, the old file stays whole and nothing is left beside it.
#include "formats/file_io.h"

#include <gtest/gtest.h>

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <future>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

namespace relume {
namespace {

namespace fs = std::filesystem;

class FileIo : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / ("relume_file_io_" + std::string(info->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    path_ = folder_ / "a.relume";
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::vector<std::string> names() const {
    std::vector<std::string> list;
    for (const auto& entry : fs::directory_iterator(folder_)) list.push_back(entry.path().filename().string());
    return list;
  }
  fs::path folder_, path_;
};

std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

Status writeText(const fs::path& path, const std::string& text) {
  return writeFileAtomically(path, [&](const ByteSink& sink) { return sink(std::as_bytes(std::span(text))); });
}

TEST_F(FileIo, writesAndReplaces) {
  ASSERT_TRUE(writeText(path_, "old"));
  ASSERT_TRUE(writeText(path_, "new"));
  EXPECT_EQ(contents(path_), "new");
  EXPECT_EQ(names(), std::vector<std::string>{"a.relume"});
}

TEST_F(FileIo, modeAndGroupOfTheReplacedFileStay) {
  ASSERT_TRUE(writeText(path_, "old"));
  const auto modeOf = [](const fs::path& path) { return static_cast<unsigned>(fs::status(path).permissions()); };
  for (const unsigned mode : {0664u, 0600u, 0444u}) {
    fs::permissions(path_, fs::perms(mode));
    ASSERT_TRUE(writeText(path_, std::to_string(mode)));
    EXPECT_EQ(modeOf(path_), mode);
    EXPECT_EQ(contents(path_), std::to_string(mode));
  }
  if (::geteuid() != 0) GTEST_SKIP() << "files of two groups take root";
  struct stat status {};
  fs::permissions(path_, fs::perms(0664));
  ASSERT_EQ(::chown(path_.c_str(), 0, 12345), 0);
  ASSERT_TRUE(writeText(path_, "shared"));
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_gid, 12345u);
  EXPECT_EQ(modeOf(path_), 0664u);

  // A user who is not of the group makes the file his own: his group may do what all may.
  fs::permissions(folder_, fs::perms(0777));
  ASSERT_EQ(::setegid(65534), 0);
  ASSERT_EQ(::seteuid(65534), 0);
  const Status written = writeText(path_, "a stranger's");
  ASSERT_EQ(::seteuid(0), 0);
  ASSERT_EQ(::setegid(0), 0);
  ASSERT_TRUE(written) << written.error().message;
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_NE(status.st_gid, 12345u);
  EXPECT_EQ(modeOf(path_), 0644u);
}

TEST_F(FileIo, failureInTheMiddleKeepsTheOldFile) {
  ASSERT_TRUE(writeText(path_, "old"));
  const std::string half = "half";
  const Status status = writeFileAtomically(path_, [&](const ByteSink& sink) {
    sink(std::as_bytes(std::span(half)));
    return false;
  });
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::io);
  EXPECT_EQ(contents(path_), "old");
  EXPECT_EQ(names(), std::vector<std::string>{"a.relume"});
}

TEST_F(FileIo, fullDiskKeepsTheOldFile) {
  ASSERT_TRUE(writeText(path_, "old"));
  // A limit on the size of files stands for a full disk: write() fails half way.
  struct rlimit before {};
  getrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, SIG_IGN);
  struct rlimit small {
    1000, before.rlim_max
  };
  setrlimit(RLIMIT_FSIZE, &small);
  const Status status = writeText(path_, std::string(100000, 'x'));
  setrlimit(RLIMIT_FSIZE, &before);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::io);
  EXPECT_NE(status.error().message.find("File too large"), std::string::npos) << status.error().message;
  EXPECT_EQ(contents(path_), "old");
  EXPECT_EQ(names(), std::vector<std::string>{"a.relume"});
}

TEST_F(FileIo, staleTemporariesOfTheSameFileAreRemoved) {
  std::ofstream(folder_ / "a.relume.12345-0.tmp") << "left by a killed run";
  std::ofstream(folder_ / "b.relume.12345-0.tmp") << "of another file";
  std::ofstream(folder_ / "a.relume.notes.tmp") << "not ours";
  ASSERT_TRUE(writeText(path_, "new"));
  EXPECT_FALSE(fs::exists(folder_ / "a.relume.12345-0.tmp"));
  EXPECT_TRUE(fs::exists(folder_ / "b.relume.12345-0.tmp"));
  EXPECT_TRUE(fs::exists(folder_ / "a.relume.notes.tmp"));
}

// The longest name that a file system has room for; what a killed run has left of it is known as well.
TEST_F(FileIo, longNamesHaveTemporaries) {
  const std::string name = std::string(120, 'n') + std::string(124, 'm') + ".relume", other(255, 'n');
  fs::path left;
  ASSERT_TRUE(writeFileAtomically(folder_ / name, [&](const ByteSink&) {
    for (const std::string& each : names()) left = each.ends_with(".tmp") ? folder_ / each : left;
    return true;
  }));
  EXPECT_EQ(names(), std::vector<std::string>{name});
  ASSERT_FALSE(left.empty());
  std::ofstream(left) << "left by a killed run";
  ASSERT_TRUE(writeText(folder_ / other, "new"));
  EXPECT_TRUE(fs::exists(left)) << "of another file that begins like this one";
  ASSERT_TRUE(writeText(folder_ / name, "new"));
  EXPECT_FALSE(fs::exists(left));
  EXPECT_EQ(contents(folder_ / name), "new");
}

TEST_F(FileIo, temporaryOfALivingWriterIsLeftAlone) {
  const fs::path neighbour = folder_ / "a.relume.999-0.tmp";
  const int fd = ::open(neighbour.c_str(), O_WRONLY | O_CREAT, 0600);
  ASSERT_EQ(::flock(fd, LOCK_EX), 0);
  ASSERT_TRUE(writeText(path_, "new"));
  EXPECT_TRUE(fs::exists(neighbour));
  ::close(fd);
}

TEST_F(FileIo, writersOfTheSameFileDoNotMeet) {
  // A second writer runs to its end while the first is half way.
  const std::string first = "first";
  const Status status = writeFileAtomically(path_, [&](const ByteSink& sink) {
    EXPECT_TRUE(writeText(path_, "second"));
    EXPECT_EQ(contents(path_), "second");
    return sink(std::as_bytes(std::span(first)));
  });
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(contents(path_), "first");
  EXPECT_EQ(names(), std::vector<std::string>{"a.relume"});
}

TEST_F(FileIo, foldersAndMissingFoldersAreNamed) {
  for (const Status& status : {writeText(folder_, "x"), checkWritable(folder_)}) {
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::io);
    EXPECT_EQ(status.error().message, folder_.string() + ": cannot be written: Is a directory");
  }
  const fs::path lost = folder_ / "missing" / "a.relume";
  for (const Status& status : {writeText(lost, "x"), checkWritable(lost)}) {
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().message,
              lost.string() + ": cannot create a file in its folder: No such file or directory");
  }
  EXPECT_FALSE(checkWritable("/dev/null"));
  EXPECT_TRUE(checkWritable(path_));
  EXPECT_TRUE(names().empty());
}

// Found out before the work: names too long, and another user's file in a folder such as /tmp.
TEST_F(FileIo, filesThatCannotBeReplacedAreToldBeforehand) {
  const fs::path longName = folder_ / std::string(256, 'n');
  EXPECT_EQ(checkWritable(longName).error().message, longName.string() + ": cannot be written: File name too long");
  ASSERT_TRUE(writeText(path_, "old"));
  EXPECT_TRUE(checkWritable(path_));
  EXPECT_EQ(contents(path_), "old");
  if (::geteuid() != 0) GTEST_SKIP() << "files of two users take root";
  fs::permissions(folder_, fs::perms(01777));
  ASSERT_EQ(::seteuid(65534), 0);
  const Status before = checkWritable(path_), after = writeText(path_, "new");
  EXPECT_TRUE(checkWritable(folder_ / "b.relume"));
  ASSERT_EQ(::seteuid(0), 0);
  for (const Status& status : {before, after}) {
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::io);
    EXPECT_EQ(status.error().message, path_.string() +
                                          ": the file that is there cannot be replaced: Operation not permitted; "
                                          "choose another name, or move that file away");
  }
  EXPECT_EQ(contents(path_), "old");
  EXPECT_EQ(names(), std::vector<std::string>{"a.relume"});
}

TEST_F(FileIo, linksStayAndWhatTheyPointToIsWritten) {
  fs::create_directories(folder_ / "far");
  ASSERT_TRUE(writeText(folder_ / "far" / "b.relume", "old"));
  fs::create_symlink("far/b.relume", folder_ / "middle");
  fs::create_symlink("middle", path_);
  ASSERT_TRUE(writeText(path_, "new"));
  EXPECT_TRUE(fs::is_symlink(path_));
  EXPECT_TRUE(fs::is_symlink(folder_ / "middle"));
  EXPECT_EQ(contents(folder_ / "far" / "b.relume"), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "far"), {}), 1);

  fs::create_symlink("far/not_yet.relume", folder_ / "dangling");
  ASSERT_TRUE(writeText(folder_ / "dangling", "first"));
  EXPECT_EQ(contents(folder_ / "far" / "not_yet.relume"), "first");
  fs::create_symlink("circle", folder_ / "circle");
  const Status circle = writeText(folder_ / "circle", "x");
  ASSERT_FALSE(circle);
  EXPECT_NE(circle.error().message.find("Too many levels of symbolic links"), std::string::npos)
      << circle.error().message;
}

TEST_F(FileIo, openFilesOfProcessesAreRefused) {
  ASSERT_TRUE(writeText(path_, "old"));
  const int fd = ::open(path_.c_str(), O_RDONLY);
  const Status status = writeText("/proc/self/fd/" + std::to_string(fd), "new");
  ::close(fd);
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("open file of a process"), std::string::npos) << status.error().message;
  EXPECT_EQ(contents(path_), "old");
}

TEST_F(FileIo, aBodyThatThrowsLeavesNothing) {
  EXPECT_THROW((void)writeFileAtomically(path_, [](const ByteSink&) -> bool { throw std::bad_alloc(); }),
               std::bad_alloc);
  EXPECT_TRUE(names().empty());
}

// Ends the process with 0 where a write that is at its rename leaves the old file and nothing else.
[[noreturn]] void endDuringAWrite(const fs::path& path) {
  std::promise<void> half, removed;
  std::thread([&] {
    (void)writeFileAtomically(path, [&](const ByteSink& sink) {
      const std::string text = "half";
      sink(std::as_bytes(std::span(text)));
      half.set_value();
      removed.get_future().wait();
      return true;
    });
  }).detach();
  half.get_future().wait();
  const auto files = [&] { return std::distance(fs::directory_iterator(path.parent_path()), {}); };
  if (files() != 2) ::_exit(1);
  removeOpenTemporaries();
  if (files() != 1) ::_exit(2);
  removed.set_value();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  ::_exit(files() == 1 && contents(path) == "old" ? 0 : 3);
}

TEST_F(FileIo, openTemporariesAreRemovedAndNotRenamed) {
  ASSERT_TRUE(writeText(path_, "old"));
  EXPECT_EXIT(endDuringAWrite(path_), testing::ExitedWithCode(0), "");
}

TEST_F(FileIo, twoThreadsWriteOneFile) {
  Status other = done();
  const Status status = writeFileAtomically(path_, [&](const ByteSink& sink) {
    // A second temporary, while the first is open.
    std::thread([&] { other = writeText(path_, "other"); }).join();
    const std::string text = "this";
    return names().size() == 2 && sink(std::as_bytes(std::span(text)));
  });
  EXPECT_TRUE(other) << other.error().message;
  EXPECT_TRUE(status) << status.error().message;
  EXPECT_EQ(contents(path_), "this");
  EXPECT_EQ(names(), std::vector<std::string>{"a.relume"});
}

TEST_F(FileIo, readingAndMappingGiveTheSameBytes) {
  const std::string text(100001, 'q');
  ASSERT_TRUE(writeText(path_, text));
  const Result<FileBytes> read = readFile(path_), mapped = mapFile(path_);
  ASSERT_TRUE(read);
  ASSERT_TRUE(mapped);
  EXPECT_TRUE(std::equal(read->bytes.begin(), read->bytes.end(), mapped->bytes.begin(), mapped->bytes.end()));
  EXPECT_EQ(read->bytes.size(), text.size());
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(read->bytes.data()) % 64, 0u);
  EXPECT_FALSE(readFile("/dev/zero"));
}

}  // namespace
}  // namespace relume
