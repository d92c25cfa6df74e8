// SPDX-License-Identifier: MIT
// See direction_coding.h.
#include "formats/direction_coding.h"

#include "formats/field_coding.h"
#include "formats/octahedron.h"
#include "relume/hierarchy.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace relume {
namespace {

constexpr std::uint32_t kNodeMask = 0xFFFFFu;
constexpr std::uint32_t kBits = 6, kMask = (1u << kBits) - 1u;  // of a coordinate
constexpr float kLargest = 31.0f;
constexpr float kSkyDistance = 1e6f;  // [m] where patches of the sky are taken to be

glm::vec3 vectorAt(std::span<const float> values, std::size_t i) {
  return 3 * i + 2 < values.size() ? glm::vec3(values[3 * i], values[3 * i + 1], values[3 * i + 2]) : glm::vec3(0.0f);
}

// The middle of the surfels below each node.
std::pmr::vector<glm::vec3> findMiddles(const LinkEnds& ends, std::pmr::memory_resource* memory) {
  const std::size_t surfels = ends.surfelPosition.size() / 3, nodes = ends.child.size();
  std::pmr::vector<glm::vec3> middle(nodes, glm::vec3(0.0f), memory);
  std::pmr::vector<float> count(nodes, 0.0f, memory);
  for (std::size_t node = nodes; node-- > 0;) {
    const std::uint32_t child = ends.child[node];
    if ((child & kLeafBit) != 0) {
      const std::uint32_t sender = child & ~kLeafBit;
      middle[node] = sender < surfels ? vectorAt(ends.surfelPosition, sender)
                                      : vectorAt(ends.skyDirection, sender - surfels) * kSkyDistance;
      count[node] = 1.0f;
    } else if (child > node && child < nodes - 1) {
      count[node] = count[child] + count[child + 1];
      middle[node] = (middle[child] * count[child] + middle[child + 1] * count[child + 1]) / count[node];
    }
  }
  return middle;
}

// Octahedral coordinates of the links, one after the other.
class Directions {
 public:
  Directions(const LinkEnds& ends, std::pmr::memory_resource* memory)
      : ends_(ends), middle_(findMiddles(ends, memory)) {}

  std::array<std::uint32_t, 2> next() {
    const std::size_t link = link_++;
    if (link >= ends_.head.size()) return {};
    while (cache_ + 2 < ends_.row.size() && ends_.row[cache_ + 1] <= link) ++cache_;
    const std::uint32_t node = ends_.head[link] & kNodeMask;
    if (node >= middle_.size()) return {};
    const glm::vec3 toward = middle_[node] - vectorAt(ends_.cachePosition, cache_);
    const float sum = std::abs(toward.x) + std::abs(toward.y) + std::abs(toward.z);
    if (!(sum <= std::numeric_limits<float>::max())) return {};
    const glm::vec2 p = toOctahedron(toward);
    return {rounded(p.x), rounded(p.y)};
  }

 private:
  static std::uint32_t rounded(float p) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::floor(p * kLargest + 0.5f)));
  }

  const LinkEnds& ends_;
  std::pmr::vector<glm::vec3> middle_;
  std::size_t link_ = 0, cache_ = 0;
};

std::uint32_t coordinate(std::uint32_t shape, std::size_t axis) { return shape >> (axis * kBits) & kMask; }

}  // namespace

std::vector<std::byte> encodeDirections(const LinkEnds& ends, std::span<const std::byte> shapes) {
  const std::size_t count = shapes.size() / sizeof(std::uint16_t);
  std::vector<std::byte> coded(count * kCodedShapeBytes);
  Directions directions(ends, std::pmr::new_delete_resource());
  for (std::size_t i = 0; i < count; ++i) {
    std::uint16_t shape;
    std::memcpy(&shape, shapes.data() + i * sizeof shape, sizeof shape);
    const auto expected = directions.next();
    for (std::size_t axis = 0; axis < 2; ++axis)
      coded[axis * count + i] = static_cast<std::byte>(foldSign(coordinate(shape, axis) - expected[axis], kBits));
    coded[2 * count + i] = static_cast<std::byte>(shape >> (2 * kBits));
  }
  return coded;
}

bool decodeDirections(const LinkEnds& ends, std::span<const std::byte> coded, std::span<std::byte> shapes,
                      std::pmr::memory_resource* memory) {
  const std::size_t count = shapes.size() / sizeof(std::uint16_t);
  const auto planeAt = [&](std::size_t plane, std::size_t i) {
    return std::to_integer<std::uint32_t>(coded[plane * count + i]);
  };
  Directions directions(ends, memory);
  std::uint32_t differences = 0, cones = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto expected = directions.next();
    const std::uint32_t x = planeAt(0, i), y = planeAt(1, i), cone = planeAt(2, i);
    differences |= x | y;
    cones |= cone;
    const auto shape =
        static_cast<std::uint16_t>(((expected[0] + unfoldSign(x, kBits)) & kMask) |
                                   ((expected[1] + unfoldSign(y, kBits)) & kMask) << kBits | cone << (2 * kBits));
    std::memcpy(shapes.data() + i * sizeof shape, &shape, sizeof shape);
  }
  return differences <= kMask && cones < 1u << (16 - 2 * kBits);
}

}  // namespace relume
