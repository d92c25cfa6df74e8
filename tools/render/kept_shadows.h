// SPDX-License-Identifier: MIT
// Shadows of surfels in frames of the same lights: asked for once, kept for the frames after.
#pragma once

#include "relume/lights.h"

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace relume {

// A VisibilityBatch that asks `visibility`, whose answers must not change, for each batch of surfels it has not been
// asked for yet. Batches are told apart by 128 bits of a hash of their surfels and light. Thread-safe.
class KeptShadows {
 public:
  explicit KeptShadows(Visibility visibility) : visibility_(std::move(visibility)) {}
  KeptShadows(const KeptShadows&) = delete;
  KeptShadows& operator=(const KeptShadows&) = delete;

  void operator()(std::uint32_t light, std::span<const glm::vec3> positionWorld, std::span<const glm::vec3> normal,
                  std::span<float> visible);

 private:
  using Key = std::array<std::uint64_t, 2>;
  const Visibility visibility_;
  std::mutex growth_;  // of kept_
  std::map<Key, std::vector<float>> kept_;
};

}  // namespace relume
