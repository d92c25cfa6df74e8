// SPDX-License-Identifier: MIT
// See parallel.h.
#include "bake/base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <memory>
#include <new>
#include <optional>

namespace relume {
namespace {

// The system's words tell it from memory that has run out.
struct NoThread : std::bad_alloc {
  const char* what() const noexcept override { return std::strerror(EAGAIN); }
};

void runChunks(Context& context, tbb::task_arena& arena, std::string_view stage, std::size_t count, std::size_t grain,
               const std::function<void(std::size_t, std::size_t)>& body) {
  if (count == 0) return;
  grain = std::max<std::size_t>(grain, 1);
  const std::size_t chunks = (count + grain - 1) / grain;
  std::atomic<std::size_t> finished{0};
  std::atomic<bool> bodyThrew{false};

  const auto run = [&](std::size_t chunk) {
    if (context.cancelled()) return;
    try {
      body(chunk * grain, std::min(count, (chunk + 1) * grain));
    } catch (...) {
      bodyThrew = true;
      throw;
    }
    const std::size_t n = finished.fetch_add(1) + 1;
    // Report about a hundred times a stage.
    if (!stage.empty() && (n * 100 / chunks != (n - 1) * 100 / chunks)) {
      context.progress(stage, static_cast<double>(n) / static_cast<double>(chunks));
    }
  };

  if (chunks == 1) return run(0);

  // An arena is no larger than what oneTBB allows the process, which is a thread for each core; more are asked for
  // here.
  std::optional<tbb::global_control> more;
  if (context.threads > coresOfProcess())
    more.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(context.threads));
  try {
    arena.execute([&] { tbb::parallel_for(std::size_t{0}, chunks, run, tbb::simple_partitioner()); });
  } catch (...) {
    if (bodyThrew) throw;
    // oneTBB cannot start its threads: there is no memory for their stacks, or no more threads are allowed.
    throw NoThread();
  }
}

int arenaSize(const Context& context) { return context.threads > 0 ? context.threads : tbb::task_arena::automatic; }

}  // namespace

void parallelChunks(Context& context, std::string_view stage, std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t, std::size_t)>& body) {
  tbb::task_arena arena(arenaSize(context));
  runChunks(context, arena, stage, count, grain, body);
}

struct KeptThreads::Arena {
  explicit Arena(const Context& context) : arena(arenaSize(context)) {}
  tbb::task_arena arena;
};

KeptThreads::KeptThreads(Context& context) : context_(context), arena_(std::make_unique<Arena>(context)) {}

KeptThreads::~KeptThreads() = default;

void KeptThreads::parallelChunks(std::size_t count, std::size_t grain,
                                 const std::function<void(std::size_t, std::size_t)>& body) {
  runChunks(context_, arena_->arena, "", count, grain, body);
}

int coresOfProcess() { return tbb::info::default_concurrency(); }

void mapByThreads(Context& context, void* begin, std::size_t bytes) {
  constexpr std::size_t kPage = 4096, kMuch = std::size_t{4} << 20, kAtOnce = std::size_t{1} << 20;
  if (bytes < kMuch || context.threads == 1) return;
  auto* const memory = static_cast<volatile std::byte*>(begin);
  parallelChunks(context, "", bytes, kAtOnce, [&](std::size_t first, std::size_t last) {
    for (std::size_t at = first; at < last; at += kPage) memory[at] = std::byte{0};
  });
}

void runOnOneThread(const std::function<void()>& work) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  work();
}

}  // namespace relume
