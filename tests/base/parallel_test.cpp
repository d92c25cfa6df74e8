// SPDX-License-Identifier: MIT
// Chunks of work run on as many threads as were asked for, whatever the machine has.
#include "bake/base/parallel.h"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

namespace relume {
namespace {

// Threads that are in a chunk at once, where each chunk waits for `awaited` of them, but not for ever.
std::size_t threadsAtOnce(int threads, std::size_t awaited) {
  Context context;
  context.threads = threads;
  std::mutex mutex;
  std::condition_variable arrived;
  std::set<std::thread::id> ids;
  parallelChunks(context, "", 4 * awaited, 1, [&](std::size_t, std::size_t) {
    std::unique_lock lock(mutex);
    ids.insert(std::this_thread::get_id());
    arrived.notify_all();
    arrived.wait_for(lock, std::chrono::seconds(20), [&] { return ids.size() >= awaited; });
  });
  return ids.size();
}

TEST(ParallelChunks, sevenThreadsAreSeven) { EXPECT_EQ(threadsAtOnce(7, 7), 7u); }

TEST(ParallelChunks, oneThreadIsTheCallers) { EXPECT_EQ(threadsAtOnce(1, 1), 1u); }

TEST(ParallelChunks, moreThreadsLastNoLongerThanTheWork) {
  EXPECT_EQ(threadsAtOnce(7, 7), 7u);
  EXPECT_LE(threadsAtOnce(2, 2), 2u);
}

TEST(ParallelChunks, librariesOnOneThreadStayOnOne) {
  std::size_t most = 0;
  runOnOneThread([&] {
    Context context;
    context.threads = 7;
    std::mutex mutex;
    std::set<std::thread::id> ids;
    parallelChunks(context, "", 64, 1, [&](std::size_t, std::size_t) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      const std::lock_guard lock(mutex);
      ids.insert(std::this_thread::get_id());
    });
    most = ids.size();
  });
  EXPECT_EQ(most, 1u);
}

}  // namespace
}  // namespace relume
