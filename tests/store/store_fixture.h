// SPDX-License-Identifier: MIT
// A folder of its own for a store, entries, and a server that answers one thing.
#pragma once

#include "bake/store/directory_store.h"
#include "bake/store/entry_cache.h"

#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <random>
#include <thread>

namespace relume {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;

inline Bytes someBytes(std::size_t size, unsigned seed = 1) {
  std::mt19937 random(seed);
  Bytes bytes(size);
  for (std::byte& b : bytes) b = std::byte{static_cast<unsigned char>(random() % 16)};
  return bytes;
}

inline EntryName nameOf(unsigned number) { return {number * 0x9E3779B97F4A7C15ull, number}; }

inline Bytes sealed(const EntryName& name, const Bytes& bytes) {
  const auto file = sealEntry(name, bytes);
  EXPECT_TRUE(file);
  return *file;
}

class Folder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              (std::string("relume_store_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path pathOf(const EntryName& name) const { return folder_ / folderOf(toString(name)) / toString(name); }
  void touchAt(const EntryName& name, int seconds) const {
    const timespec times[2] = {{seconds, 0}, {seconds, 0}};
    ASSERT_EQ(::utimensat(AT_FDCWD, pathOf(name).c_str(), times, 0), 0);
  }

  fs::path folder_;
};

// Counts what a bake is warned of its store.
struct Listener {
  explicit Listener(EntryCache& cache) {
    cache.reportTo([this](Severity, std::string_view text) {
      text_ += text;
      ++count_;
    });
  }
  std::string text_;
  int count_ = 0;
};

// A server that gives one answer to whatever it is asked, a connection each time.
class Answers {
 public:
  // hangs: it says no more then, and listens until the other side closes.
  explicit Answers(const std::string& answer, bool hangs = false) : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(listener_, 8), 0);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this, answer, hangs] {
      for (int peer = 0; (peer = ::accept(listener_, nullptr, nullptr)) >= 0; ::close(peer)) {
        char asked[4096];
        if (::recv(peer, asked, sizeof asked, 0) > 0) ::send(peer, answer.data(), answer.size(), MSG_NOSIGNAL);
        while (hangs && ::recv(peer, asked, sizeof asked, 0) > 0) {
        }
      }
    });
  }
  ~Answers() {
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
  }
  Answers(const Answers&) = delete;
  Answers& operator=(const Answers&) = delete;
  std::string url(const std::string& user = "") const {
    return "http://" + user + "127.0.0.1:" + std::to_string(port_) + "/bakes";
  }

 private:
  int listener_;
  int port_ = 0;
  std::thread thread_;
};

}  // namespace relume
