// SPDX-License-Identifier: MIT
// See shape_sums.h. Independent noise adds up with the square root of the number of vertices: 32 normals that differ by
// 1e-7 each move a sum by about 3e-7, a twelfth of what is forgiven.
#include "bake/shape_sums.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace relume {
namespace {

constexpr double kUnit = 1e-9;
constexpr double kPositionMetres = 2e-7, kPositionRelative = 0x1p-20,
                 kNormal = 4e-6;  // largest difference of a sum that counts as noise

std::uint32_t wordOf(double sum) {
  const double units = sum / kUnit;
  // Beyond 2^63 units, take bits of the sum itself: noise in such a level is at least a float's step.
  if (!(std::abs(units) < 9e18)) return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(sum) >> 20);
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(std::llround(units)));
}

bool near(std::uint32_t a, std::uint32_t b, double tolerance) {
  return std::abs(static_cast<double>(static_cast<std::int32_t>(a - b))) * kUnit <= tolerance;
}

}  // namespace

std::uint32_t shapeBlocks(const Mesh& mesh) {
  return static_cast<std::uint32_t>((mesh.position.size() + kShapeBlock - 1) / kShapeBlock);
}

std::vector<std::uint32_t> shapeSums(const Mesh& mesh) {
  std::vector<std::uint32_t> words;
  words.reserve(std::size_t{shapeBlocks(mesh)} * kShapeWords);
  for (std::size_t begin = 0; begin < mesh.position.size(); begin += kShapeBlock) {
    std::array<double, kShapeWords> sum{};
    for (std::size_t i = begin; i < std::min<std::size_t>(begin + kShapeBlock, mesh.position.size()); ++i) {
      const double weight = 0.5 + static_cast<double>(i - begin) / 64.0;
      for (int k = 0; k < 3; ++k) {
        sum[static_cast<std::size_t>(k)] += weight * mesh.position[i][k];
        if (!mesh.normal.empty()) sum[static_cast<std::size_t>(3 + k)] += weight * mesh.normal[i][k];
      }
    }
    for (const double s : sum) words.push_back(wordOf(s));
  }
  return words;
}

bool sameShape(const Mesh& mesh, std::span<const std::uint32_t> then, float metresPerUnit) {
  const std::vector<std::uint32_t> now = shapeSums(mesh);
  if (now.size() != then.size()) return false;
  double largest = 0.0;
  for (const glm::vec3& p : mesh.position)
    largest = std::max<double>({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  // Keep the tolerance far below half of the modulus, which is 2.1 in units of the mesh.
  const double position = std::min(std::max(kPositionMetres / metresPerUnit, kPositionRelative * largest), 1.0);
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (!near(now[i], then[i], i % kShapeWords < 3 ? position : kNormal)) return false;
  }
  return true;
}

}  // namespace relume
