// SPDX-License-Identifier: MIT
// Hands a bundle of rays to the walk (bundle_walk.h), and returns its hits in the order of the rays.
#include "bake/rays/bundle/ray_bundle.h"

#include "bake/rays/ray_tracer_state.h"

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

constexpr double kRaysPerBlock = 48.0;  // aimed at: six registers

std::uint32_t blocksFor(std::size_t rays, bool hemisphere) {
  const double all = static_cast<double>(rays) * (hemisphere ? 2.0 : 1.0);
  const double side = std::round(std::sqrt(all / (6.0 * kRaysPerBlock)));
  return static_cast<std::uint32_t>(std::clamp(side, 1.0, static_cast<double>(kMaxBundleBlocks)));
}

void walk(const BundleJob& job, [[maybe_unused]] RayBundle::Simd simd) {
#if defined(RELUME_X86_BUNDLES)
  if (simd == RayBundle::Simd::best && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("popcnt") &&
      __builtin_cpu_supports("bmi")) {
    return traceBundleAvx2(job);
  }
#endif
  traceBundleBaseline(job);
}

}  // namespace

void RayBundle::trace(const RayTracer& tracer, const glm::vec3& origin, const glm::vec3& axis,
                      std::span<const glm::vec3> directions, std::span<Hit> hits) {
  const RayTracer::State& state = *tracer.state_;
  const std::size_t count = directions.size();
  if (count == 0) return;
  if (state.bundles.nodes.empty()) {
    rays_.resize(count);
    for (std::size_t i = 0; i < count; ++i) rays_[i] = Ray{origin, 0.0f, directions[i]};
    tracer.trace(rays_, hits, RayOrder::coherent);
    return;
  }

  BundleJob job{};
  job.nodes = state.bundles.nodes.data();
  job.leaves = state.bundles.leaves.data();
  job.opaque = [](const void* self, std::uint32_t geometry, std::uint32_t triangle, float b, float c) {
    const auto& s = *static_cast<const RayTracer::State*>(self);
    return opaqueAt(*s.scene, {s.instance[geometry & kBundleGeometry], triangle, {b, c}});
  };
  job.self = &state;
  for (int k = 0; k < 3; ++k) job.origin[k] = origin[k] - state.shift[k], job.axis[k] = axis[k];
  job.count = static_cast<std::uint32_t>(count);
  job.direction = &directions.data()->x;
  job.blocks = blocksFor(count, axis != glm::vec3(0.0f));
  // Lay out the arrays twice: first to learn how much memory they need, then to place them.
  const std::size_t bins = 6 * std::size_t{job.blocks} * job.blocks * kBundleStrip * kBundleStrip;
  const std::size_t padded = (count + kBundleLanes - 1) / kBundleLanes * kBundleLanes, depth = state.bundles.depth;
  for (const bool counting : {true, false}) {
    std::size_t lines = 0;
    const auto take = [&]<class T>(T*& array, std::size_t size) {
      if (!counting) array = reinterpret_cast<T*>(memory_.data() + lines);
      lines += (size * sizeof(T) + sizeof(Line) - 1) / sizeof(Line);
    };
    for (float** array : {&job.faceU, &job.faceV, &job.x, &job.y, &job.z, &job.u, &job.v, &job.t, &job.b, &job.c}) {
      take(*array, padded);
    }
    take(job.slot, padded);
    take(job.hit, padded);
    take(job.block, padded);
    take(job.begin, bins + 1);
    take(job.cursor, bins);
    take(job.farthest, bundlePyramidSize(job.blocks));
    take(job.frames, depth);
    take(job.stack, 7 * depth + kBundleLanes);
    if (counting && memory_.size() < lines) memory_.resize(lines);
  }

  walk(job, simd_);

  // Turn what was hit into hits.
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t at = job.slot[i], word = job.hit[at];
    if (word == kBundleNone) {
      hits[i] = {};
      continue;
    }
    const std::uint32_t lane = word & ~kBundleBack;
    const BundleLeaf& leaf = state.bundles.leaves[lane / kBundleLanes];
    const std::uint32_t flags = leaf.geometry[lane % kBundleLanes], triangle = leaf.triangle[lane % kBundleLanes];
    const std::uint32_t id = flags & kBundleGeometry;
    if ((flags & kBundleOverlaps) != 0) {
      const FlushDenormals flush;
      hits[i] = state.resolveTie(Ray{origin, 0.0f, directions[i]}, id, triangle, job.t[at]);
    } else {
      const float b = std::clamp(job.b[at], 0.0f, 1.0f), c = std::clamp(job.c[at], 0.0f, 1.0f - b);
      hits[i] = {job.t[at], state.instance[id], triangle, {b, c}, (word & kBundleBack) != 0};
    }
  }
}

}  // namespace relume
