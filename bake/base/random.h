// SPDX-License-Identifier: MIT
// Random numbers as functions of (seed, stage, item, index), never of a thread: counter-based hashes.
#pragma once

#include <glm/vec2.hpp>

#include <cstdint>

namespace relume {

// A well-mixed 64-bit hash of a counter (the finaliser of SplitMix64).
constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

constexpr std::uint64_t hashCombine(std::uint64_t a, std::uint64_t b) { return mix64(a ^ mix64(b)); }

// A stream of numbers for one item of one stage.
class RandomStream {
 public:
  constexpr RandomStream(std::uint64_t seed, std::uint32_t stage, std::uint64_t item)
      : key_(hashCombine(hashCombine(seed, stage), item)) {}
  constexpr std::uint32_t bits() { return static_cast<std::uint32_t>(mix64(key_ + ++counter_) >> 32); }
  // [0, 1)
  constexpr float uniform() { return static_cast<float>(bits() >> 8) * 0x1p-24f; }
  constexpr glm::vec2 uniform2() {
    const float x = uniform();
    return {x, uniform()};
  }
  // [0, n)
  constexpr std::uint32_t below(std::uint32_t n) {
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(bits()) * n) >> 32);
  }

 private:
  std::uint64_t key_;
  std::uint64_t counter_ = 0;
};

}  // namespace relume
