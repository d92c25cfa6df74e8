// SPDX-License-Identifier: MIT
// A host's job system in small, as RelightOptions::parallelFor wants it: threads that wait for work, tasks handed out
// by a counter. For measurements; a game has its own.
#pragma once

#include "relume/relighter.h"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace relume {

class WorkerThreads {
 public:
  // threads [>= 1]: the calling one and threads - 1 more.
  explicit WorkerThreads(unsigned threads) {
    for (unsigned i = 1; i < threads; ++i) threads_.emplace_back([this] { work(); });
  }
  ~WorkerThreads() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  WorkerThreads(const WorkerThreads&) = delete;
  WorkerThreads& operator=(const WorkerThreads&) = delete;

  // Run body(0) .. body(tasks - 1) and wait for all. One caller at a time.
  void run(std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
    {
      const std::lock_guard lock(mutex_);
      body_ = &body;
      tasks_ = tasks;
      next_ = 0;
      busy_ = threads_.size();
      ++generation_;
    }
    wake_.notify_all();
    drain(body, tasks);
    std::unique_lock lock(mutex_);
    idle_.wait(lock, [this] { return busy_ == 0; });
  }

  // run(), as runtime and volumes want it; while this lives.
  ParallelFor parallelFor() {
    return [this](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) { run(tasks, body); };
  }

 private:
  void drain(const std::function<void(std::uint32_t)>& body, std::uint32_t tasks) {
    for (std::uint32_t i = next_++; i < tasks; i = next_++) body(i);
  }
  void work() {
    std::uint64_t seen = 0;
    std::unique_lock lock(mutex_);
    for (;;) {
      wake_.wait(lock, [&] { return stop_ || generation_ != seen; });
      if (stop_) return;
      seen = generation_;
      const auto* body = body_;
      const std::uint32_t tasks = tasks_;
      lock.unlock();
      drain(*body, tasks);
      lock.lock();
      if (--busy_ == 0) idle_.notify_one();
    }
  }

  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable wake_, idle_;
  const std::function<void(std::uint32_t)>* body_ = nullptr;
  std::atomic<std::uint32_t> next_{0};
  std::uint32_t tasks_ = 0;
  std::size_t busy_ = 0;
  std::uint64_t generation_ = 0;
  bool stop_ = false;
};

}  // namespace relume
