// SPDX-License-Identifier: MIT
// Entries and the folders that hold them: what is damaged, forged or not an entry at all is told from one that is
// whole, nothing outside of the store is touched, and what was used last is what stays.
#include "tests/store/store_fixture.h"

#include <xxhash.h>

#include <sys/file.h>
#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <cstring>
#include <fstream>

namespace relume {
namespace {

// Make the checksum of a file fit what stands in it.
void sealAgain(Bytes& file) {
  Bytes hashed(file.begin(), file.begin() + 48);
  hashed.insert(hashed.end(), file.begin() + 64, file.end());
  const XXH128_hash_t hash = XXH3_128bits(hashed.data(), hashed.size());
  std::memcpy(file.data() + 48, &hash.high64, 8);
  std::memcpy(file.data() + 56, &hash.low64, 8);
}

TEST(Entries, holdWhatWasSealed) {
  for (const std::size_t size : {0u, 1u, 7u, 8u, 100'000u}) {
    const Bytes bytes = someBytes(size), file = sealed(nameOf(1), bytes);
    const auto stated = checkEntry(nameOf(1), file);
    ASSERT_TRUE(stated) << stated.error().message;
    EXPECT_EQ(*stated, size);
    const auto opened = openEntry(file);
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_TRUE(Bytes(opened->bytes.begin(), opened->bytes.end()) == bytes) << size;
  }
}

TEST(Entries, anyFlippedBitAndAnyCutIsFound) {
  const Bytes file = sealed(nameOf(1), someBytes(600));
  for (std::size_t at = 0; at < file.size(); ++at) {
    Bytes flipped = file;
    flipped[at] ^= std::byte{static_cast<unsigned char>(1u << at % 8)};
    EXPECT_FALSE(checkEntry(nameOf(1), flipped)) << at;
    EXPECT_FALSE(checkEntry(nameOf(1), std::span(file).first(at))) << at;
  }
}

TEST(Entries, thoseOfAnotherNameOrVersionAreNotTaken) {
  Bytes file = sealed(nameOf(1), someBytes(600));
  EXPECT_NE(checkEntry(nameOf(2), file).error().message.find("of another name"), std::string::npos);
  file[8] = std::byte{9};
  sealAgain(file);
  EXPECT_EQ(checkEntry(nameOf(1), file).error().message, "of version 9, expected 1");
}

// With a checksum that fits: sizes that would take all memory, frames that are none.
TEST(Entries, forgedSizesAllocateNothing) {
  for (const std::uint64_t size : {std::uint64_t{0}, std::uint64_t{599}, std::uint64_t{1} << 33, ~std::uint64_t{0}}) {
    Bytes file = sealed(nameOf(1), someBytes(600));
    std::memcpy(file.data() + 32, &size, 8);
    sealAgain(file);
    ASSERT_TRUE(checkEntry(nameOf(1), file));
    EXPECT_EQ(openEntry(file).error().code, ErrorCode::invalidFile) << size;
  }
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    Bytes file = sealed(nameOf(1), someBytes(600));
    file[64 + random() % (file.size() - 64)] = std::byte{static_cast<unsigned char>(random())};
    sealAgain(file);
    const auto opened = openEntry(file);
    EXPECT_TRUE(!opened || opened->bytes.size() == 600u);
  }
}

TEST_F(Folder, givesBackWhatWasPut) {
  DirectoryStore store(folder_);
  const auto none = store.get(nameOf(1), 1000);
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_FALSE(none->has_value());
  const Bytes file = sealed(nameOf(1), someBytes(200));
  ASSERT_TRUE(store.put(nameOf(1), sealed(nameOf(1), someBytes(100))));
  ASSERT_TRUE(store.put(nameOf(1), file));
  const auto got = store.get(nameOf(1), 1000);
  ASSERT_TRUE(got && *got);
  EXPECT_TRUE(**got == file);
  EXPECT_EQ(store.get(nameOf(1), file.size() - 1).error().code, ErrorCode::memory) << "larger than may be read";
}

// Files of 1 GiB that take no room: what their headers say is looked at before anything is allocated.
TEST_F(Folder, hugeFilesThatAreNoEntriesAreNotRead) {
  DirectoryStore store(folder_);
  const fs::path path = pathOf(nameOf(1));
  const Bytes whole = sealed(nameOf(1), someBytes(600));
  Bytes zeros(100), vast = whole;
  const std::uint64_t size = ~std::uint64_t{0};
  std::memcpy(vast.data() + 32, &size, 8);
  for (const Bytes& file : {zeros, whole, vast}) {
    ASSERT_TRUE(store.put(nameOf(1), file));
    std::error_code failed;
    fs::resize_file(path, std::uint64_t{1} << 30, failed);
    if (failed) GTEST_SKIP() << failed.message();
    const auto got = store.get(nameOf(1), file == vast ? std::uint64_t{1} << 20 : kMaxEntryBytes);
    ASSERT_FALSE(got);
    EXPECT_EQ(got.error().code, file == vast ? ErrorCode::memory : ErrorCode::invalidFile) << got.error().message;
  }
}

TEST_F(Folder, linksPipesAndFoldersInPlaceOfEntriesAreNotFollowed) {
  DirectoryStore store(folder_);
  const fs::path secret = folder_ / "secret", path = pathOf(nameOf(1));
  std::ofstream(secret) << "mine";
  fs::create_directories(path.parent_path());
  for (const int kind : {0, 1, 2}) {
    if (kind == 0) fs::create_symlink(secret, path);
    if (kind == 1) {
      ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    }
    if (kind == 2) fs::create_directory(path);
    EXPECT_EQ(store.get(nameOf(1), 1000).error().code, ErrorCode::invalidFile) << kind;
    ASSERT_TRUE(store.put(nameOf(1), someBytes(100))) << kind;
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(path)));
    EXPECT_EQ(fs::file_size(secret), 4u) << "written through a link";
    fs::remove(path);
  }
  // A folder of the store that leads elsewhere.
  fs::remove(path.parent_path());
  fs::create_directory(folder_ / "elsewhere");
  fs::create_directory_symlink(folder_ / "elsewhere", path.parent_path());
  EXPECT_EQ(store.put(nameOf(1), someBytes(100)).error().code, ErrorCode::io);
  EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
}

TEST_F(Folder, whatWasUsedLongestAgoGoesFirst) {
  DirectoryStore store(folder_);
  const std::uint64_t size = sealed(nameOf(1), someBytes(100)).size();
  for (unsigned i = 1; i <= 6; ++i) {
    ASSERT_TRUE(store.put(nameOf(i), sealed(nameOf(i), someBytes(100))));
    touchAt(nameOf(i), 1'000'000 + static_cast<int>(i));
  }
  // A clock that was far ahead once changes the order, and nothing else.
  touchAt(nameOf(2), 2'000'000'000);
  ASSERT_TRUE(store.get(nameOf(1), 1000));
  auto report = collectGarbage(folder_, 4 * size - 1);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->removedEntries, 3u);
  EXPECT_EQ(report->entries, 3u);
  EXPECT_EQ(report->bytes, 3 * size);
  for (const unsigned kept : {1u, 2u, 6u}) EXPECT_TRUE(fs::exists(pathOf(nameOf(kept)))) << kept;
  report = collectGarbage(folder_, 0);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->entries, 0u);
}

TEST_F(Folder, collectionsTouchNothingButEntries) {
  DirectoryStore store(folder_);
  ASSERT_TRUE(store.put(nameOf(1), sealed(nameOf(1), someBytes(100))));
  const std::string entry = toString(nameOf(1));
  const fs::path beside = pathOf(nameOf(1)).parent_path();
  const fs::path mine[] = {folder_ / "thesis.txt", folder_ / entry, beside / "notes", beside / (entry + "0"),
                           beside / (entry.substr(0, 31) + "G"),
                           // As caches of others name their files, by MD5.
                           beside / (entry.substr(0, 31) + (entry[31] == '0' ? "1" : "0"))};
  for (const fs::path& path : mine) std::ofstream(path) << "mine";
  // Of a writer that died, and of one that is at work.
  const fs::path dead = beside / (entry + ".77-0.tmp"), alive = beside / (entry + ".78-0.tmp");
  std::ofstream(dead) << "half";
  std::ofstream(alive) << "half";
  const int writer = ::open(alive.c_str(), O_RDONLY);
  ASSERT_EQ(::flock(writer, LOCK_EX), 0);
  const auto report = collectGarbage(folder_, 0);
  ::close(writer);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->removedEntries, 1u);
  EXPECT_EQ(report->entries, 0u);
  EXPECT_EQ(report->bytes, 0u) << "of others";
  EXPECT_EQ(report->temporaries, 1u);
  for (const fs::path& path : mine) EXPECT_TRUE(fs::exists(path)) << path;
  EXPECT_TRUE(fs::exists(alive));
  EXPECT_FALSE(fs::exists(dead));
}

TEST_F(Folder, manyWritersReadersAndCollectorsGiveWholeEntries) {
  std::vector<std::thread> threads;
  std::atomic<int> whole{0};
  for (unsigned t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      DirectoryStore store(folder_);
      std::mt19937 random(t);
      for (int i = 0; i < 60; ++i) {
        const unsigned number = 1 + random() % 5;
        const Bytes file = sealed(nameOf(number), someBytes(20'000, number));
        if (random() % 2 == 0) {
          EXPECT_TRUE(store.put(nameOf(number), file));
        }
        if (i % 20 == 19) {
          EXPECT_TRUE(collectGarbage(folder_, 40'000));
        }
        const auto got = store.get(nameOf(number), 1 << 20);
        ASSERT_TRUE(got) << got.error().message;
        if (*got) {
          EXPECT_TRUE(**got == file);
        }
        whole += got->has_value();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GT(whole, 0);
}

// As a disk that takes no more than a little of a file, for its lifetime.
class FullDisk {
 public:
  FullDisk() : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{256, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

TEST_F(Folder, aDiskThatIsFullIsOneWarning) {
  Context context;
  EntryCache cache(std::make_unique<DirectoryStore>(folder_), 0);
  const Listener heard(cache);
  cache.keep(nameOf(1), someBytes(1000), context);
  {
    const FullDisk full;
    for (unsigned i = 2; i < 6; ++i) cache.keep(nameOf(i), someBytes(10'000), context);
  }
  EXPECT_EQ(heard.count_, 1) << heard.text_;
  EXPECT_NE(heard.text_.find("nothing more is kept in it"), std::string::npos) << heard.text_;
  EXPECT_EQ(cache.statistics().written, 1u);
  EXPECT_TRUE(cache.find(nameOf(1), context)) << "it is still read";
  EXPECT_FALSE(fs::exists(pathOf(nameOf(2)))) << "nothing half written";
}

// A limit is held by who has only found, and by who has filled the disk.
TEST_F(Folder, theLimitIsHeldWhereNothingWasWritten) {
  Context context;
  DirectoryStore store(folder_);
  const auto fill = [&] {
    for (unsigned i = 1; i <= 6; ++i) ASSERT_TRUE(store.put(nameOf(i), sealed(nameOf(i), someBytes(1000))));
  };
  const std::uint64_t limit = 3 * sealed(nameOf(1), someBytes(1000)).size();
  fill();
  EntryCache finding(std::make_unique<DirectoryStore>(folder_), limit);
  EXPECT_TRUE(finding.find(nameOf(1), context));
  finding.finish(context);
  EXPECT_EQ(collectGarbage(folder_, limit)->removedEntries, 0u);
  EXPECT_TRUE(fs::exists(pathOf(nameOf(1)))) << "used last";
  fill();
  EntryCache filling(std::make_unique<DirectoryStore>(folder_), limit);
  const Listener heard(filling);
  {
    const FullDisk full;
    filling.keep(nameOf(7), someBytes(10'000), context);
  }
  filling.finish(context);
  EXPECT_EQ(collectGarbage(folder_, limit)->removedEntries, 0u);
  EXPECT_EQ(heard.count_, 1) << heard.text_;
}

TEST_F(Folder, oneThatMayNotBeWrittenIsStillRead) {
  Context context;
  EntryCache cache(std::make_unique<DirectoryStore>(folder_), 1);
  const Listener heard(cache);
  cache.keep(nameOf(1), someBytes(1000), context);
  const bool isRoot = ::geteuid() == 0;  // whom no permission stops
  fs::permissions(folder_, fs::perms(0555));
  fs::permissions(pathOf(nameOf(1)).parent_path(), fs::perms(0555));
  if (isRoot) {
    ASSERT_EQ(::seteuid(65534), 0);
  }
  cache.keep(nameOf(2), someBytes(1000), context);
  cache.keep(nameOf(3), someBytes(1000), context);
  const auto found = cache.find(nameOf(1), context);
  cache.finish(context);  // more than the limit, and left to those who write it
  if (isRoot) {
    ASSERT_EQ(::seteuid(0), 0);
  }
  fs::permissions(folder_, fs::perms(0755));
  fs::permissions(pathOf(nameOf(1)).parent_path(), fs::perms(0755));
  EXPECT_TRUE(found);
  EXPECT_EQ(heard.count_, 1) << heard.text_;
  EXPECT_NE(heard.text_.find("ermission denied"), std::string::npos) << heard.text_;
}

TEST_F(Folder, oneThatCannotBeReadIsOneWarningAndNotAskedAgain) {
  Context context;
  std::ofstream(folder_ / "file") << "not a folder";
  EntryCache cache(std::make_unique<DirectoryStore>(folder_ / "file"), 0);
  const Listener heard(cache);
  for (unsigned i = 1; i < 6; ++i) {
    EXPECT_FALSE(cache.find(nameOf(i), context));
    cache.keep(nameOf(i), someBytes(10), context);
  }
  EXPECT_EQ(heard.count_, 1) << heard.text_;
  EXPECT_NE(heard.text_.find("done without"), std::string::npos) << heard.text_;
}

TEST_F(Folder, entriesBeyondTheMemoryBudgetAreMadeAgain) {
  Context context;
  EntryCache cache(std::make_unique<DirectoryStore>(folder_), 0);
  const Listener heard(cache);
  cache.keep(nameOf(1), Bytes(64u << 20), context);
  context.maxMemory = 1u << 20;
  EXPECT_FALSE(cache.find(nameOf(1), context));
  EXPECT_NE(heard.text_.find("raise --max-memory"), std::string::npos) << heard.text_;
}

// Of an entry in a folder hardly more than the header is read: it would not fit into the budget.
TEST_F(Folder, filesBeyondTheMemoryBudgetAreNotRead) {
  Context context;
  EntryCache cache(std::make_unique<DirectoryStore>(folder_), 0);
  const Listener heard(cache);
  std::mt19937 random(1);
  Bytes bytes(8u << 20);
  for (std::byte& b : bytes) b = std::byte{static_cast<unsigned char>(random())};
  cache.keep(nameOf(1), bytes, context);
  context.maxMemory = 1u << 20;
  EXPECT_FALSE(cache.find(nameOf(1), context));
  EXPECT_EQ(heard.count_, 1) << heard.text_;
  EXPECT_NE(heard.text_.find("can be read: bake without --store, or raise --max-memory"), std::string::npos)
      << heard.text_;
  EXPECT_EQ(cache.statistics().missing, 1u);
  EXPECT_TRUE(cache.readable());
}

TEST(Stores, urlsThatAreNoneAreRefused) {
  for (const char* bad : {"ftp://host/x", "http://", "file:///etc", "http://host/x?y=1", "http://host/#x", ""})
    EXPECT_EQ(openStore(bad).error().code, ErrorCode::usage) << bad;
  const auto store = openStore("http://me:secret@host:8080/bakes");
  ASSERT_TRUE(store) << store.error().message;
  EXPECT_EQ((*store)->name(), "http://host:8080/bakes/");
}

// One that lost a slash, or its scheme, is not taken for a folder of that name, and its password is not said.
TEST_F(Folder, urlsWithoutSlashesAreNoFolders) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  for (const char* bad : {"http:/bob:s3cr3t@host/x", "HTTPS:bob:s3cr3t@host/x", "Http:", "http:/a:s3cr3t@b/c://d",
                          "bob:s3cr3t@host/x", "bob:s3cr3t@host", "bob:s:3cr3t@host:8080/x"}) {
    EXPECT_TRUE(isUrl(bad)) << bad;
    const auto store = openStore(bad);
    ASSERT_FALSE(store) << bad;
    EXPECT_EQ(store.error().code, ErrorCode::usage) << bad;
    EXPECT_NE(store.error().message.find("without //"), std::string::npos) << store.error().message;
    EXPECT_EQ(store.error().message.find("s3cr3t"), std::string::npos) << store.error().message;
  }
  EXPECT_TRUE(fs::is_empty(folder_));
  fs::create_directory("a:b@c");
  for (const char* good : {"https_bakes", "a:b@c", "v1@x:y/z", "bakes/a:b@c", "./d:e@f"})
    EXPECT_FALSE(isUrl(good)) << good;
  fs::current_path(before);
}

// What a store says that cannot be read.
std::string whyNot(const std::string& url) {
  const auto store = openStore(url);
  if (!store) return store.error().message;
  const auto got = (*store)->get(nameOf(1), 1000);
  return got ? "" : got.error().message;
}

TEST(Stores, answersSayWhatToDo) {
  ::setenv("no_proxy", "127.0.0.1", 1);
  const std::string entry = toString(nameOf(1)), path = folderOf(entry) + "/" + entry;
  const auto answer = [](const std::string& status) { return "HTTP/1.0 " + status + "\r\nContent-Length: 0\r\n\r\n"; };
  const Answers moved(answer("301 Moved\r\nLocation: http://me:s3cr3t@farm:8080/new/" + path));
  EXPECT_EQ(whyNot(moved.url()),
            "GET: the server answers 301: redirects are not followed; the store's own URL expected, it leads to "
            "http://farm:8080/new/");
  const Answers closed(answer("401 Unauthorized"));
  EXPECT_NE(whyNot(closed.url()).find("401: it asks for a user and a password"), std::string::npos);
  const std::string known = whyNot(closed.url("me:s3cr3t@"));
  EXPECT_NE(known.find("401: it does not take the user and the password"), std::string::npos) << known;
  EXPECT_EQ(known.find("s3cr3t"), std::string::npos) << known;
}

// libcurl quotes a proxy that it cannot use, as the environment has it.
TEST(Stores, passwordsOfProxiesAreNotSaid) {
  for (const char* proxy : {"garbage://u:s3cr3t@proxy", "u:s3 cr3t@proxy:99999999", "http://u:'s3cr3t://@proxy:none"}) {
    ::setenv("http_proxy", proxy, 1);
    const std::string why = whyNot("http://example.invalid/x");
    EXPECT_NE(why.find("proxy"), std::string::npos) << why;
    EXPECT_EQ(why.find("cr3t"), std::string::npos) << why;
  }
  ::unsetenv("http_proxy");
}

}  // namespace
}  // namespace relume
