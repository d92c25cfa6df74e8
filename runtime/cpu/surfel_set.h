// SPDX-License-Identifier: MIT
// The surfels as the CPU backend keeps them: packed (runtime/shared/pack_surfel.h), in the order of their leaves in the
// hierarchy, which lie near each other in space when they are near in order. So neighbours read the same caches, and
// leaves are written in order.
#pragma once

#include "relume/bake_data.h"
#include "runtime/cpu/light_surfels_job.h"
#include "runtime/cpu/node_set.h"
#include "runtime/shared/pack_surfel.h"

#include <array>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume::cpu {

// Surfels by ascending leaf. [Size n_S]
std::pmr::vector<std::uint32_t> leafOrder(const Hierarchy& hierarchy, std::uint32_t surfels,
                                          std::pmr::memory_resource* memory);

class SurfelSet {
 public:
  struct Emitter {
    std::uint32_t surfel;  // in leaf order
    glm::vec3 emission;    // [W/m²/sr]
  };

  // keepOrder: whether bakedSurfel() will be asked for. memory: keeps the set; `order` is of it as well.
  SurfelSet(const Surfels& surfels, const Hierarchy& hierarchy, std::pmr::vector<std::uint32_t> order, bool keepOrder,
            std::pmr::memory_resource* memory);
  SurfelSet(const SurfelSet&) = delete;
  SurfelSet& operator=(const SurfelSet&) = delete;

  std::uint32_t count() const { return leaf_.size(); }
  // Places and words of `job`.
  void describe(LightSurfelsJob& job) const;
  // Nodes of the surfels of a block. [Size at >= count + kAtRoom]
  void leaves(const LightSurfelsKernel& kernel, std::uint32_t block, std::uint32_t count, std::uint32_t* at) const {
    leaf_.read(kernel, block * kSurfelBlock, count, at);
  }
  // Emitters among the surfels [begin, end), ascending.
  std::span<const Emitter> emitters(std::uint32_t begin, std::uint32_t end) const;
  // Surfel of the bake by place in leaf order. Only with keepOrder.
  std::uint32_t bakedSurfel(std::uint32_t i) const { return order_[i]; }
  std::span<const std::uint32_t> skyLeaves() const { return skyLeaf_; }  // [Size sky patches]
  std::size_t bytes() const;

 private:
  SurfelBox box_;
  std::array<std::pmr::vector<std::uint32_t>, 4> word_;  // [Size n_S, padded to whole blocks]
  NodeSet leaf_;
  std::pmr::vector<std::uint32_t> order_;  // [Size n_S], or 0
  std::pmr::vector<Emitter> emitter_;
  std::pmr::vector<std::uint32_t> skyLeaf_;
};

// Where surfel `i` is, and its normal, as the kernels unpack them.
glm::vec3 surfelPosition(const LightSurfelsJob& job, std::uint32_t i);
glm::vec3 unpackSurfelNormal(std::uint32_t word);

}  // namespace relume::cpu
