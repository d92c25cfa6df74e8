// SPDX-License-Identifier: MIT
// See kept_shadows.h.
#include "tools/render/kept_shadows.h"

#include "bake/base/random.h"

#include <algorithm>
#include <bit>

namespace relume {
namespace {

// Of each number in its place.
std::uint64_t hashOf(std::uint64_t seed, std::span<const glm::vec3> vectors) {
  std::uint64_t hash = seed;
  for (const glm::vec3& v : vectors) {
    const auto bits = [&v](int k) { return std::uint64_t{std::bit_cast<std::uint32_t>(v[k])}; };
    hash = hashCombine(hash ^ bits(2), bits(0) << 32 | bits(1));
  }
  return hash;
}

}  // namespace

void KeptShadows::operator()(std::uint32_t light, std::span<const glm::vec3> positionWorld,
                             std::span<const glm::vec3> normal, std::span<float> visible) {
  const std::uint64_t seed = std::uint64_t{light} << 32 | positionWorld.size();
  const Key key{hashOf(mix64(seed), positionWorld), hashOf(~mix64(seed), normal)};
  const std::vector<float>* known = nullptr;
  {
    const std::lock_guard lock(growth_);
    if (const auto found = kept_.find(key); found != kept_.end()) known = &found->second;
  }
  if (known != nullptr) {
    std::copy(known->begin(), known->end(), visible.begin());
    return;
  }
  for (std::size_t i = 0; i < positionWorld.size(); ++i) visible[i] = visibility_(light, positionWorld[i], normal[i]);
  std::vector<float> answers(visible.begin(), visible.end());
  const std::lock_guard lock(growth_);
  kept_.emplace(key, std::move(answers));
}

}  // namespace relume
