// SPDX-License-Identifier: MIT
// See surfel_set.h.
#include "runtime/cpu/surfel_set.h"

#include "runtime/direct_light.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/pack_color.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume::cpu {

std::pmr::vector<std::uint32_t> leafOrder(const Hierarchy& hierarchy, std::uint32_t surfels,
                                          std::pmr::memory_resource* memory) {
  std::pmr::vector<std::uint32_t> order(memory);
  order.reserve(surfels);
  for (std::uint32_t node = 0; node < hierarchy.nodeCount(); ++node) {
    if (hierarchy.isLeaf(node) && hierarchy.sender(node) < surfels) order.push_back(hierarchy.sender(node));
  }
  return order;
}

namespace {

constexpr std::uint32_t kDriveGrain = 1024;

// Entry of each surfel, by way of which emitters are found again. [Size n_S, or 0 without entries]
std::pmr::vector<std::uint32_t> entryOfSurfel(const Emitters& emitters, std::uint32_t surfels,
                                              std::pmr::memory_resource* memory) {
  std::pmr::vector<std::uint32_t> entry(memory);
  if (emitters.count() == 0) return entry;
  entry.assign(surfels, SurfelSet::kNotDrivable);
  for (std::uint32_t e = 0; e < emitters.count(); ++e) entry[emitters.surfel[e]] = e;
  return entry;
}

// The material that has an entry.
std::uint32_t materialOf(const Emitters& emitters, std::uint32_t entry) {
  const auto* const next =
      std::upper_bound(emitters.materials.begin(), emitters.materials.end(), entry,
                       [](std::uint32_t e, const DrivableMaterial& material) { return e < material.firstEntry; });
  return static_cast<std::uint32_t>(next - emitters.materials.begin()) - 1;
}

}  // namespace

SurfelSet::SurfelSet(const Surfels& surfels, const Hierarchy& hierarchy, const Emitters& emitters,
                     std::pmr::vector<std::uint32_t> order, bool keepOrder, std::pmr::memory_resource* memory)
    : box_(boxOf(surfels.positionWorld)),
      radius_(discRadius(surfels.areaEach)),
      word_{std::pmr::vector<std::uint32_t>(memory), std::pmr::vector<std::uint32_t>(memory),
            std::pmr::vector<std::uint32_t>(memory), std::pmr::vector<std::uint32_t>(memory)},
      leaf_(
          hierarchy.nodeCount(), kSurfelBlock,
          [&](std::uint32_t node) { return hierarchy.isLeaf(node) && hierarchy.sender(node) < surfels.count(); },
          memory),
      order_(std::move(order), memory),
      emitter_(memory),
      driven_(memory),
      skyLeaf_(hierarchy.leafNode.begin() + surfels.count(), hierarchy.leafNode.end(), memory) {
  const std::size_t padded = (order_.size() + kSurfelBlock - 1) / kSurfelBlock * kSurfelBlock;
  for (auto& word : word_) word.assign(padded, 0);
  const std::pmr::vector<std::uint32_t> entries = entryOfSurfel(emitters, surfels.count(), memory);
  for (std::uint32_t i = 0; i < order_.size(); ++i) {
    const std::uint32_t s = order_[i];
    const SurfelWords words = packSurfel(box_, surfels.positionWorld[s], surfels.normal[s], surfels.albedo[s],
                                         surfels.receiver[s], ditherOf(i));
    for (std::size_t k = 0; k < 4; ++k) word_[k][i] = words[k];
    const std::uint32_t entry = entries.empty() ? kNotDrivable : entries[s];
    const std::uint32_t material = entry == kNotDrivable ? kNotDrivable : materialOf(emitters, entry);
    if (entry != kNotDrivable || surfels.emission[s] != glm::vec3(0.0f))
      emitter_.push_back({i, material, entry, surfels.emission[s]});
  }
  emitter_.shrink_to_fit();
  if (emitters.count() > 0) driven_.resize(emitter_.size());
  if (!keepOrder) std::pmr::vector<std::uint32_t>(memory).swap(order_);
}

void SurfelSet::describe(LightSurfelsJob& job) const {
  for (int k = 0; k < 3; ++k) {
    job.origin[k] = box_.origin[k];
    job.step[k] = box_.step[k];
  }
  job.radius = radius_;
  job.discReach2 = kDiscReach * kDiscReach * radius_ * radius_;
  job.inverseRadius2 = 1.0f / (radius_ * radius_);
  for (std::size_t k = 0; k < 4; ++k) job.word[k] = word_[k].data();
}

void SurfelSet::drive(const DrivenEmission& driven, const glm::vec3& scale, const ParallelFor& parallelFor) {
  forChunks(parallelFor, static_cast<std::uint32_t>(emitter_.size()), kDriveGrain,
            [&](std::uint32_t begin, std::uint32_t end) {
              for (std::uint32_t i = begin; i < end; ++i) {
                const Emitter& e = emitter_[i];
                const bool drives = e.material != kNotDrivable && driven.drives(e.material);
                driven_[i] = drives ? driven.radiance(e.material, e.entry) : scale * e.emission;
              }
            });
}

std::span<const SurfelSet::Emitter> SurfelSet::emitters(std::uint32_t begin, std::uint32_t end) const {
  const auto before = [](const Emitter& e, std::uint32_t surfel) { return e.surfel < surfel; };
  const Emitter* const all = emitter_.data();
  const Emitter* const first = std::lower_bound(all, all + emitter_.size(), begin, before);
  return {first, std::lower_bound(first, all + emitter_.size(), end, before)};
}

std::size_t SurfelSet::bytes() const {
  return 4 * sizeof(std::uint32_t) * word_[0].size() + leaf_.bytes() +
         sizeof(std::uint32_t) * (order_.size() + skyLeaf_.size()) + sizeof(Emitter) * emitter_.size() +
         sizeof(glm::vec3) * driven_.size();
}

glm::vec3 surfelPosition(const LightSurfelsJob& job, std::uint32_t i) {
  const std::uint32_t xy = job.word[0][i], z = job.word[1][i];
  const glm::vec3 q(static_cast<float>(xy & 0xFFFFu), static_cast<float>(xy >> 16), static_cast<float>(z & 0xFFFFu));
  return glm::vec3(job.origin[0], job.origin[1], job.origin[2]) + glm::vec3(job.step[0], job.step[1], job.step[2]) * q;
}

glm::vec3 unpackSurfelNormal(std::uint32_t word) {
  const auto part = [word](int shift) {
    return static_cast<float>(static_cast<std::int32_t>(word << (20 - shift)) >> 20) * (1.0f / 2047.0f);
  };
  glm::vec3 d(part(0), part(12), 0.0f);
  d.z = 1.0f - std::abs(d.x) - std::abs(d.y);
  const float fold = std::max(-d.z, 0.0f);
  d.x -= d.x < 0.0f ? -fold : fold;
  d.y -= d.y < 0.0f ? -fold : fold;
  return glm::normalize(d);
}

}  // namespace relume::cpu
