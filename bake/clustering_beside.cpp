// SPDX-License-Identifier: MIT
// See clustering_beside.h.
#include "bake/clustering_beside.h"

#include "bake/base/memory_budget.h"
#include "bake/base/parallel.h"
#include "bake/hierarchy/hierarchy.h"
#include "bake/stage_memory.h"

#include <chrono>
#include <system_error>
#include <utility>

namespace relume {

ClusteringBeside::ClusteringBeside(const RayTracer& tracer, const Surfels& surfels, const BakeOptions& options,
                                   Context& context)
    : tracer_(tracer),
      surfels_(surfels),
      options_(options),
      context_(context),
      maxMemory_(context.maxMemory),
      threads_(context.threads) {
  constexpr double kShare = 0.25;  // of the memory that may be held
  const double budget = static_cast<double>(maxMemory_ > 0 ? maxMemory_ : machineMemoryBudget());
  const double needed = hierarchyBytes(surfels, options);
  const Threads threads = shareThreads(threads_, coresOfProcess());
  if (!threads.beside || surfels.count() < kMany) return;
  const double held = static_cast<double>(heldMemory());
  if (held + needed > kShare * budget) return;
  own_.threads = threads.tree;
  try {
    made_ = std::async(std::launch::async, [this, estimate = (held + needed) / 1048576.0] {
      const Context::Stage entry(own_, "hierarchy");
      own_.figure("memory_estimate_mib", estimate);
      return clusterSurfels(tracer_, surfels_, options_.links.skyPatches, options_.clustering, own_);
    });
  } catch (const std::system_error&) {
    return;  // no more threads are to be had
  }
  context_.maxMemory = static_cast<std::uint64_t>(budget - needed);
  context_.threads = threads.rest;
}

ClusteringBeside::Threads ClusteringBeside::shareThreads(int threads, int ofMachine) {
  if (threads == 1) return {};
  if (threads == 0 || threads >= ofMachine) return {true, threads, threads};
  // The tree has one thread busy most of the time; with three, caches alone by two would take as long as one after the
  // other by all.
  if (threads < 4) return {};
  const int tree = threads / 4;
  return {true, tree, threads - tree};
}

ClusteringBeside::~ClusteringBeside() {
  own_.cancel();
  wait();
}

void ClusteringBeside::wait() {
  if (!made_.valid()) return;
  constexpr std::chrono::milliseconds kAsk{20};
  while (made_.wait_for(kAsk) != std::future_status::ready) {
    if (context_.cancelled()) own_.cancel();
  }
  context_.maxMemory = maxMemory_;
  context_.threads = threads_;
}

Result<Hierarchy> ClusteringBeside::take() {
  if (!made_.valid()) {
    if (const Status reserved = reserveHierarchy(surfels_, options_, context_); !reserved) return reserved.error();
    return clusterSurfels(tracer_, surfels_, options_.links.skyPatches, options_.clustering, context_);
  }
  wait();
  Result<Hierarchy> made = made_.get();
  for (const auto& [name, value] : own_.report().back().figures) context_.figure(name, value);
  return made;
}

}  // namespace relume
