// SPDX-License-Identifier: MIT
// The tree over the surfels, made beside the caches: one thread merges clusters, one pair after the other, and what it
// makes is not asked for until links are traced.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/hierarchy.h"
#include "relume/result.h"
#include "relume/surfels.h"

#include <cstdint>
#include <future>

namespace relume {

class ClusteringBeside {
 public:
  // Begins on a thread of its own where there may be two, the surfels are many, and memory is ample: a quarter of what
  // may be held at most. While both are made, context.maxMemory leaves out what the tree may take, and context.threads
  // those that work for it. All must outlive it.
  ClusteringBeside(const RayTracer& tracer, const Surfels& surfels, const BakeOptions& options, Context& context);
  // What still runs is cancelled.
  ~ClusteringBeside();
  ClusteringBeside(const ClusteringBeside&) = delete;
  ClusteringBeside& operator=(const ClusteringBeside&) = delete;

  bool isBeside() const { return made_.valid(); }
  // Wait until what runs is done, or cancelled; then nothing runs beside any more.
  void wait();
  // The tree; made now where it was not made beside. Its figures are noted in the stage that runs now. Once.
  Result<Hierarchy> take();

  // How a context's threads are shared out while both are made. Whoever has all of the machine's keeps them: oneTBB has
  // no more, and gives them to both in turn (one more thread may run then). [threads: 0 = all]
  struct Threads {
    bool beside = false;
    int tree = 0, rest = 0;
  };
  static Threads shareThreads(int threads, int ofMachine);

  static constexpr std::uint32_t kMany = 1u << 16;  // [surfels] with fewer, a thread and a turn gain little

 private:
  const RayTracer& tracer_;
  const Surfels& surfels_;
  const BakeOptions& options_;
  Context& context_;
  Context own_;                    // of the thread beside: its figures are not those of the stage that runs
  const std::uint64_t maxMemory_;  // of the context, as are threads_
  const int threads_;
  std::future<Result<Hierarchy>> made_;
};

}  // namespace relume
