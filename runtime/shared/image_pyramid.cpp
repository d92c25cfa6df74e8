// SPDX-License-Identifier: MIT
// See image_pyramid.h.
#include "runtime/shared/image_pyramid.h"

#include "runtime/shared/chunks.h"

#include <glm/common.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

namespace relume {
namespace {

constexpr std::uint32_t kTexelsPerTask = 16384;

// Which texels of `from` along an axis a texel of `to` = max(from / 2, 1) covers: two, three where `from` is odd, or
// one; and their shares, which add up to 1.
struct Covered {
  std::uint32_t first = 0, count = 1;
  std::array<float, 3> share{1.0f, 0.0f, 0.0f};
};

Covered coveredBy(std::uint32_t i, std::uint32_t from, std::uint32_t to) {
  if (from == 1) return {};
  if (from % 2 == 0) return {2 * i, 2, {0.5f, 0.5f, 0.0f}};
  // from = 2 to + 1: the texel covers [i from / to, (i + 1) from / to), of which its middle texel lies wholly inside.
  const float each = static_cast<float>(to) / static_cast<float>(from), share = 1.0f / static_cast<float>(from);
  return {2 * i, 3, {share * static_cast<float>(to - i), each, share * static_cast<float>(i + 1)}};
}

// Two neighbouring texels along an axis and the weight of the second.
struct Pair {
  std::uint32_t first, second;
  float weight;
};

Pair pairAt(float at, std::uint32_t size, bool clamp) {
  const float x = at * static_cast<float>(size) - 0.5f, low = std::floor(x);
  const auto last = static_cast<std::int32_t>(size) - 1;
  auto first = static_cast<std::int32_t>(low), second = first + 1;
  if (first < 0) first = clamp ? 0 : last;
  if (second > last) second = clamp ? last : 0;
  return {static_cast<std::uint32_t>(std::min(first, last)), static_cast<std::uint32_t>(second), x - low};
}

}  // namespace

ImagePyramid::ImagePyramid(std::uint32_t width, std::uint32_t height, std::pmr::memory_resource* memory)
    : width_(width), height_(height), below_(memory) {
  levels_ = static_cast<std::uint32_t>(std::bit_width(std::max(width, height)));
  std::size_t texels = 0;
  for (std::uint32_t level = 1; level < levels_; ++level) {
    first_[level] = texels;
    texels += std::size_t{size(level).x} * size(level).y;
  }
  below_.resize(texels);
}

glm::uvec2 ImagePyramid::size(std::uint32_t level) const {
  return {std::max(width_ >> level, 1u), std::max(height_ >> level, 1u)};
}

std::span<const glm::vec3> ImagePyramid::texels(std::uint32_t level) const {
  if (level == 0) return image_;
  return {below_.data() + first_[level], std::size_t{size(level).x} * size(level).y};
}

void ImagePyramid::set(std::span<const glm::vec3> image, const ParallelFor& parallelFor) {
  image_ = image;
  for (std::uint32_t level = 1; level < levels_; ++level) {
    const glm::uvec2 from = size(level - 1), to = size(level);
    const std::span<const glm::vec3> source = texels(level - 1);
    glm::vec3* const target = below_.data() + first_[level];
    forChunks(parallelFor, to.y, std::max(kTexelsPerTask / to.x, 1u), [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t y = begin; y < end; ++y) {
        const Covered rows = coveredBy(y, from.y, to.y);
        for (std::uint32_t x = 0; x < to.x; ++x) {
          const Covered columns = coveredBy(x, from.x, to.x);
          glm::vec3 sum(0.0f);
          for (std::uint32_t j = 0; j < rows.count; ++j) {
            const glm::vec3* row = &source[std::size_t{rows.first + j} * from.x + columns.first];
            glm::vec3 along(0.0f);
            for (std::uint32_t i = 0; i < columns.count; ++i) along += columns.share[i] * row[i];
            sum += rows.share[j] * along;
          }
          target[std::size_t{y} * to.x + x] = sum;
        }
      }
    });
  }
}

glm::vec3 ImagePyramid::bilinear(const glm::vec2& at, std::uint32_t level, bool clampU, bool clampV) const {
  const glm::uvec2 n = size(level);
  const std::span<const glm::vec3> t = texels(level);
  const Pair x = pairAt(at.x, n.x, clampU), y = pairAt(at.y, n.y, clampV);
  const auto texel = [&](std::uint32_t i, std::uint32_t j) { return t[std::size_t{j} * n.x + i]; };
  return glm::mix(glm::mix(texel(x.first, y.first), texel(x.second, y.first), x.weight),
                  glm::mix(texel(x.first, y.second), texel(x.second, y.second), x.weight), y.weight);
}

glm::vec3 ImagePyramid::sample(const glm::vec2& at, float level, bool clampU, bool clampV) const {
  const float clamped = glm::clamp(level, 0.0f, static_cast<float>(levels_ - 1));
  const auto low = static_cast<std::uint32_t>(clamped);
  const float share = clamped - static_cast<float>(low);
  const glm::vec3 fine = bilinear(at, low, clampU, clampV);
  return share > 0.0f ? glm::mix(fine, bilinear(at, low + 1, clampU, clampV), share) : fine;
}

float levelOfTap(float tapWidth, std::uint32_t width, std::uint32_t height) {
  const float texels = tapWidth * std::sqrt(static_cast<float>(width) * static_cast<float>(height));
  return texels > 1.0f ? std::log2(texels) : 0.0f;
}

}  // namespace relume
