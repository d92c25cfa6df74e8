// SPDX-License-Identifier: MIT
// Stores that are slow, and stores of several users: what is out of reach is passed over, and what is made is for all.
#include "tests/store/store_fixture.h"

#include <map>
#include <set>

namespace relume {
namespace {

// A store in memory, of which some entries are closed.
class Shelf : public Store {
 public:
  Result<std::optional<Bytes>> get(const EntryName& name, std::uint64_t) override {
    ++asked_;
    const std::string text = toString(name);
    if (closed_.contains(text)) return Error{ErrorCode::unsupported, text + ": closed"};
    const auto found = entries_.find(text);
    return found == entries_.end() ? std::nullopt : std::optional(found->second);
  }
  Status put(const EntryName& name, std::span<const std::byte> bytes) override {
    ++asked_;
    const std::string text = toString(name);
    if (closed_.contains(text)) return Error{ErrorCode::unsupported, text + ": closed"};
    entries_[text] = Bytes(bytes.begin(), bytes.end());
    return done();
  }
  Status hold(std::uint64_t) override { return done(); }
  std::string name() const override { return "shelf"; }

  std::map<std::string, Bytes> entries_;
  std::set<std::string> closed_;
  int asked_ = 0;
};

TEST(SlowStores, oneThatCostsMoreThanItMaySpareIsDoneWithout) {
  Context context;
  for (const bool keeps : {false, true}) {
    auto shelf = std::make_unique<Shelf>();
    const Shelf& asked = *shelf;
    EntryCache cache(std::move(shelf), 0, {0.0, 0.0, 0.0});
    const Listener heard(cache);
    if (keeps) cache.keep(nameOf(1), someBytes(100), context);
    for (unsigned i = 2; i < 6; ++i) {
      EXPECT_FALSE(cache.find(nameOf(i), context));
      cache.keep(nameOf(i), someBytes(100), context);
    }
    EXPECT_EQ(asked.asked_, 1) << keeps;
    EXPECT_EQ(heard.count_, 1) << heard.text_;
    EXPECT_NE(heard.text_.find("too slow, done without from here: "), std::string::npos) << heard.text_;
    EXPECT_EQ(cache.statistics().written, keeps ? 1u : 0u);
  }
}

TEST(SlowStores, workAndWhatIsFoundBuyTime) {
  Context context;
  constexpr double kMuch = 1e15;
  for (const StorePatience& patience : {StorePatience{0.0, kMuch, 0.0}, StorePatience{0.0, 0.0, kMuch}}) {
    auto shelf = std::make_unique<Shelf>();
    shelf->entries_[toString(nameOf(1))] = sealed(nameOf(1), someBytes(100));
    EntryCache cache(std::move(shelf), 0, patience);
    const Listener heard(cache);
    EXPECT_TRUE(cache.find(nameOf(1), context));
    EXPECT_FALSE(cache.find(nameOf(2), context));
    cache.keep(nameOf(2), someBytes(100), context);
    EXPECT_TRUE(cache.find(nameOf(2), context));
    EXPECT_EQ(heard.count_, 0) << heard.text_;
  }
}

// One transfer does not outlast what is left.
TEST(SlowStores, serversThatHangAreGivenUp) {
  ::setenv("no_proxy", "127.0.0.1", 1);
  Context context;
  const Answers beginning("HTTP/1.0 200 OK\r\nContent-Length: 1000\r\n\r\n", true), silent("", true);
  for (const Answers* server : {&beginning, &silent}) {
    for (const bool keeps : {false, true}) {
      if (keeps && server == &beginning) continue;  // it has answered
      EntryCache cache(std::move(*openStore(server->url())), 0, {0.05, 0.0, 0.0});
      const Listener heard(cache);
      if (keeps) {
        cache.keep(nameOf(1), someBytes(1 << 20), context);
      } else {
        EXPECT_FALSE(cache.find(nameOf(1), context));
      }
      EXPECT_FALSE(cache.readable());
      EXPECT_EQ(heard.count_, 1) << heard.text_;
      EXPECT_NE(heard.text_.find("too slow, done without"), std::string::npos) << heard.text_;
    }
  }
}

TEST(ClosedEntries, arePassedOverWithOneWarning) {
  Context context;
  auto shelf = std::make_unique<Shelf>();
  for (const unsigned closed : {1u, 2u}) shelf->closed_.insert(toString(nameOf(closed)));
  EntryCache cache(std::move(shelf), 0);
  const Listener heard(cache);
  for (unsigned i = 1; i <= 3; ++i) EXPECT_FALSE(cache.find(nameOf(i), context));
  EXPECT_EQ(heard.count_, 1) << heard.text_;
  EXPECT_NE(heard.text_.find("entries that may not be read are made again"), std::string::npos) << heard.text_;
  for (unsigned i = 1; i <= 3; ++i) cache.keep(nameOf(i), someBytes(100), context);
  EXPECT_EQ(heard.count_, 2) << heard.text_;
  EXPECT_NE(heard.text_.find("entries that may not be written are not kept"), std::string::npos) << heard.text_;
  EXPECT_TRUE(cache.find(nameOf(3), context));
  EXPECT_EQ(cache.statistics().missing, 3u);
  EXPECT_EQ(cache.statistics().written, 1u);
}

// Somebody whom permissions stop, which root is not.
class SomebodyElse {
 public:
  SomebodyElse() : isRoot_(::geteuid() == 0), isOne_(!isRoot_ || ::seteuid(65534) == 0) {}
  ~SomebodyElse() {
    if (isRoot_ && isOne_) {
      EXPECT_EQ(::seteuid(0), 0);
    }
  }
  SomebodyElse(const SomebodyElse&) = delete;
  SomebodyElse& operator=(const SomebodyElse&) = delete;
  bool isOne() const { return isOne_; }

 private:
  bool isRoot_, isOne_;
};

class SharedStore : public Folder {
 protected:
  void TearDown() override {
    for (const fs::path& closed : closed_) fs::permissions(closed, fs::perms(0777));
    Folder::TearDown();
  }
  fs::path beside(unsigned number) const { return pathOf(nameOf(number)).parent_path(); }
  void close(const fs::path& path, unsigned mode) {
    fs::permissions(path, fs::perms(mode));
    closed_.push_back(path);
  }
  static unsigned modeOf(const fs::path& path) {
    struct stat info {};
    EXPECT_EQ(::stat(path.c_str(), &info), 0) << path;
    return info.st_mode & 07777;
  }

  std::vector<fs::path> closed_;
};

TEST_F(SharedStore, whatIsMadeIsForWhomTheFolderIs) {
  DirectoryStore store(folder_);
  const mode_t before = ::umask(0077);
  unsigned number = 0;
  for (const unsigned mode : {02775u, 0777u, 0755u, 0750u, 0700u}) {
    ++number;
    ASSERT_EQ(::chmod(folder_.c_str(), mode), 0);
    ASSERT_TRUE(store.put(nameOf(number), sealed(nameOf(number), someBytes(100))));
    EXPECT_EQ(modeOf(beside(number)), modeOf(folder_));
    EXPECT_EQ(modeOf(pathOf(nameOf(number))), mode & 0666);
  }
  // One that was kept before the folder was opened to others.
  ASSERT_EQ(::chmod(folder_.c_str(), 0775), 0);
  ASSERT_TRUE(store.put(nameOf(number), sealed(nameOf(number), someBytes(100))));
  EXPECT_EQ(modeOf(pathOf(nameOf(number))), 0664u);
  ::umask(before);
}

TEST_F(SharedStore, whatOthersKeptForThemselvesIsPassedOver) {
  fs::permissions(folder_, fs::perms(0777));
  Context context;
  EntryCache cache(std::make_unique<DirectoryStore>(folder_), 0);
  const Listener heard(cache);
  for (unsigned i = 1; i <= 3; ++i) cache.keep(nameOf(i), someBytes(100), context);
  close(pathOf(nameOf(1)), 0000);
  close(beside(2), 0555);
  const SomebodyElse somebody;
  if (!somebody.isOne()) GTEST_SKIP() << "cannot become another user";
  EXPECT_FALSE(cache.find(nameOf(1), context));
  EXPECT_EQ(heard.count_, 1) << heard.text_;
  EXPECT_TRUE(cache.find(nameOf(2), context)) << heard.text_;
  cache.keep(nameOf(2), someBytes(100), context);
  EXPECT_EQ(heard.count_, 2) << heard.text_;
  for (const unsigned number : {1u, 3u, 4u}) {
    cache.keep(nameOf(number), someBytes(100), context);
    EXPECT_TRUE(cache.find(nameOf(number), context)) << number << heard.text_;
  }
  EXPECT_EQ(heard.count_, 2) << heard.text_;
}

TEST_F(SharedStore, aCollectionGoesOnPastWhatItMayNotRemove) {
  fs::permissions(folder_, fs::perms(0777));
  DirectoryStore store(folder_);
  const std::uint64_t size = sealed(nameOf(1), someBytes(100)).size();
  for (unsigned i = 1; i <= 5; ++i) {
    ASSERT_TRUE(store.put(nameOf(i), sealed(nameOf(i), someBytes(100))));
    touchAt(nameOf(i), 1'000'000 + static_cast<int>(i));
  }
  close(beside(1), 0555);
  close(pathOf(nameOf(2)), 0000);
  const SomebodyElse somebody;
  if (!somebody.isOne()) GTEST_SKIP() << "cannot become another user";
  auto report = collectGarbage(folder_, 3 * size);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->keptEntries, 2u);
  EXPECT_EQ(report->removedEntries, 2u);
  EXPECT_TRUE(checkHeld(*report, folder_, 3 * size)) << "others went in their place";
  report = collectGarbage(folder_, size);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->bytes, 2 * size);
  const Status held = checkHeld(*report, folder_, size);
  ASSERT_FALSE(held);
  EXPECT_EQ(held.error().code, ErrorCode::io);
  EXPECT_TRUE(held.error().message.starts_with(
      folder_.string() + ": " + std::to_string(2 * size) + " bytes are left, " + std::to_string(size) +
      " more than the limit; entries that may not be removed: 2; the first: " + folder_.string()))
      << held.error().message;
}

TEST_F(SharedStore, aCollectionSaysWhatItMayNotList) {
  fs::permissions(folder_, fs::perms(0777));
  DirectoryStore store(folder_);
  for (unsigned i = 1; i <= 2; ++i) ASSERT_TRUE(store.put(nameOf(i), sealed(nameOf(i), someBytes(100))));
  close(beside(1), 0000);
  const SomebodyElse somebody;
  if (!somebody.isOne()) GTEST_SKIP() << "cannot become another user";
  const auto report = collectGarbage(folder_, 0);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->removedEntries, 1u);
  EXPECT_EQ(report->closedFolders, 1u);
  const Status held = checkHeld(*report, folder_, 0);
  ASSERT_FALSE(held);
  EXPECT_NE(held.error().message.find("may not be listed and are not counted: 1; the first: " + beside(1).string()),
            std::string::npos)
      << held.error().message;
}

}  // namespace
}  // namespace relume
