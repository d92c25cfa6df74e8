// SPDX-License-Identifier: MIT
// The surfels as the CPU backend keeps them: packed (runtime/shared/pack_surfel.h), in the order of their leaves in the
// hierarchy, which lie near each other in space when they are near in order. So neighbours read the same caches, and
// leaves are written in order.
#pragma once

#include "relume/bake_data.h"
#include "runtime/cpu/light_surfels_job.h"
#include "runtime/cpu/node_set.h"
#include "runtime/shared/driven_emission.h"
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
    std::uint32_t surfel;           // in leaf order
    std::uint32_t material, entry;  // of Emitters; kNotDrivable and anything = none
    glm::vec3 emission;             // [W/m²/sr] baked
  };
  static constexpr std::uint32_t kNotDrivable = 0xFFFFFFFFu;

  // keepOrder: whether bakedSurfel() will be asked for. memory: keeps the set; `order` is of it as well.
  SurfelSet(const Surfels& surfels, const Hierarchy& hierarchy, const Emitters& emitters,
            std::pmr::vector<std::uint32_t> order, bool keepOrder, std::pmr::memory_resource* memory);
  SurfelSet(const SurfelSet&) = delete;
  SurfelSet& operator=(const SurfelSet&) = delete;

  std::uint32_t count() const { return leaf_.size(); }
  // Fill in what `job` says of surfels.
  void describe(LightSurfelsJob& job) const;
  // Nodes of the surfels of a block. [Size at >= count + kAtRoom]
  void leaves(const LightSurfelsKernel& kernel, std::uint32_t block, std::uint32_t count, std::uint32_t* at) const {
    leaf_.read(kernel, block * kSurfelBlock, count, at);
  }
  // What a frame drives, in place of the baked emission, which `scale` scales: driven() until the next call.
  void drive(const DrivenEmission& driven, const glm::vec3& scale, const ParallelFor& parallelFor);
  // Emitters among the surfels [begin, end), ascending.
  std::span<const Emitter> emitters(std::uint32_t begin, std::uint32_t end) const;
  // [W/m²/sr] Emission of one of emitters() in a frame that drives some.
  const glm::vec3& driven(const Emitter& emitter) const {
    return driven_[static_cast<std::size_t>(&emitter - emitter_.data())];
  }
  // Surfel of the bake by its slot in leaf order. Only with keepOrder.
  std::uint32_t bakedSurfel(std::uint32_t i) const { return order_[i]; }
  std::span<const std::uint32_t> skyLeaves() const { return skyLeaf_; }  // [Size sky patches]
  std::size_t bytes() const;

 private:
  SurfelBox box_;
  float radius_ = 0.0f;                                  // [m] of a disc of a surfel's area
  std::array<std::pmr::vector<std::uint32_t>, 4> word_;  // [Size n_S, padded to whole blocks]
  NodeSet leaf_;
  std::pmr::vector<std::uint32_t> order_;  // [Size n_S], or 0
  std::pmr::vector<Emitter> emitter_;      // those with emission, and those that can be driven
  std::pmr::vector<glm::vec3> driven_;     // [Size emitter_, or 0 where none can be driven]
  std::pmr::vector<std::uint32_t> skyLeaf_;
};

// Where surfel `i` is, and its normal, as the kernels unpack them.
glm::vec3 surfelPosition(const LightSurfelsJob& job, std::uint32_t i);
glm::vec3 unpackSurfelNormal(std::uint32_t word);

}  // namespace relume::cpu
