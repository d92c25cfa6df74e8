// SPDX-License-Identifier: MIT
// Chunks of work run on as many threads as were asked for, whatever the machine has.
#include "bake/base/parallel.h"
#include "bake/base/memory_budget.h"
#include "tools/render/context_threads.h"

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <new>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

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
    arrived.wait_for(lock, std::chrono::seconds(120), [&] { return ids.size() >= awaited; });
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
  std::size_t max = 0;
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
    max = ids.size();
  });
  EXPECT_EQ(max, 1u);
}

// Ends the process with 42 when the caller hears that memory is out.
[[noreturn]] void runWithoutRoomForThreads() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  rlimit limit{};
  limit.rlim_cur = limit.rlim_max = pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + (4u << 20);
  ::setrlimit(RLIMIT_AS, &limit);
  try {
    threadsAtOnce(7, 1);
  } catch (const std::bad_alloc&) {
    std::_Exit(42);
  } catch (const std::exception&) {
    std::_Exit(2);
  }
  std::_Exit(0);
}

// With no addresses left for a thread's stack, and not a word of oneTBB's.
TEST(ParallelChunks, aThreadThatCannotStartIsMemoryThatIsOut) {
  if (!std::string(RELUME_SANITIZE).empty()) GTEST_SKIP() << "sanitizers need terabytes of addresses";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(runWithoutRoomForThreads(), testing::ExitedWithCode(42), "");
}

TEST(KeptThreads, sevenAreSevenEachTime) {
  Context context;
  context.threads = 7;
  KeptThreads threads(context);
  for (int i = 0; i < 3; ++i) {
    std::mutex mutex;
    std::condition_variable arrived;
    std::set<std::thread::id> ids;
    threads.parallelChunks(28, 1, [&](std::size_t, std::size_t) {
      std::unique_lock lock(mutex);
      ids.insert(std::this_thread::get_id());
      arrived.notify_all();
      arrived.wait_for(lock, std::chrono::seconds(120), [&] { return ids.size() >= 7; });
    });
    EXPECT_EQ(ids.size(), 7u);
  }
}

TEST(KeptThreads, loopsAfterOneThatThrewAreWhole) {
  Context context;
  context.threads = 2;
  KeptThreads threads(context);
  EXPECT_THROW(threads.parallelChunks(100, 7, [](std::size_t, std::size_t) { throw std::runtime_error("body"); }),
               std::runtime_error);
  std::atomic<std::size_t> sum{0};
  threads.parallelChunks(100, 7, [&](std::size_t begin, std::size_t end) { sum += end - begin; });
  EXPECT_EQ(sum, 100u);
  context.cancel();
  threads.parallelChunks(100, 7, [&](std::size_t begin, std::size_t end) { sum += end - begin; });
  EXPECT_EQ(sum, 100u);
}

// Frames have many loops, and comparing bakes many frames: with an arena for each loop these took 54 MiB.
TEST(KeptThreads, loopsOfTheRuntimeKeepNoMemory) {
  if (!std::string(RELUME_SANITIZE).empty()) GTEST_SKIP() << "sanitizers keep memory that was freed";
  Context context;
  context.threads = 7;
  const ParallelFor parallelFor = contextParallelFor(context);
  std::atomic<std::size_t> sum{0};
  const auto loop = [&] { parallelFor(8, [&](std::uint32_t i) { sum += i; }); };
  loop();
  const std::uint64_t held = heldMemory();
  for (int i = 0; i < 3000; ++i) loop();
  EXPECT_EQ(sum, 3001u * 28u);
  EXPECT_LE(heldMemory(), held + (16u << 20));
}

// What is there stays, and what comes is as resize() makes it.
TEST(Parallel, memoryMappedByThreadsIsAsResizeMakesIt) {
  for (const int threads : {1, 2, 7}) {
    Context context;
    context.threads = threads;
    std::vector<int> items{1, 2, 3};
    resizeByThreads(context, items, 3'000'000);
    ASSERT_EQ(items.size(), 3'000'000u);
    items.shrink_to_fit();
    resizeByThreads(context, items, 6'000'000);
    EXPECT_EQ(items[0] + items[1] + items[2], 6);
    EXPECT_TRUE(std::all_of(items.begin() + 3, items.end(), [](int i) { return i == 0; }));
    resizeByThreads(context, items, 0);
    EXPECT_TRUE(items.empty());
  }
}

}  // namespace
}  // namespace relume
