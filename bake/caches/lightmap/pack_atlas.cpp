// SPDX-License-Identifier: MIT
// See pack_atlas.h. The only file that includes stb_rect_pack.
#include "bake/caches/lightmap/pack_atlas.h"

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#define STB_RECT_PACK_IMPLEMENTATION
#define STBRP_STATIC
#include <stb_rect_pack.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

std::uint32_t roundUp(double texels) { return static_cast<std::uint32_t>(std::ceil(texels / 8.0)) * 8; }

// Pack into a square of one size; cutRows: or into what of it is used, if that is half of it or less.
std::optional<AtlasPlan> packInto(std::span<const glm::uvec2> sizes, std::uint32_t singles, std::uint32_t gutter,
                                  std::uint32_t side, bool cutRows) {
  std::vector<stbrp_rect> rects(sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    rects[i].id = static_cast<int>(i);
    rects[i].w = static_cast<stbrp_coord>(sizes[i].x + gutter);
    rects[i].h = static_cast<stbrp_coord>(sizes[i].y + gutter);
    if (sizes[i].x > side || sizes[i].y > side) return std::nullopt;
  }
  // The gutter of the last row and column may hang over the border.
  const int extent = static_cast<int>(side + gutter);
  std::vector<stbrp_node> nodes(static_cast<std::size_t>(extent));
  stbrp_context context;
  stbrp_init_target(&context, extent, extent, nodes.data(), static_cast<int>(nodes.size()));
  if (!rects.empty() && !stbrp_pack_rects(&context, rects.data(), static_cast<int>(rects.size()))) return std::nullopt;

  // Rows that hold something: those of rectangles, and of single texels if they had rows of their own.
  std::uint32_t rows = 0;
  for (const stbrp_rect& r : rects) rows = std::max(rows, static_cast<std::uint32_t>(r.y + r.h));
  rows = std::min(side, roundUp(rows + std::ceil(static_cast<double>(singles) / side)));
  if (!cutRows || rows > side / 2) rows = side;

  AtlasPlan plan;
  plan.size = {side, rows};
  plan.rectangle.resize(sizes.size());
  std::vector<std::uint8_t> taken(std::size_t{rows} * side, 0);
  double used = singles;
  for (const stbrp_rect& r : rects) {
    const auto i = static_cast<std::size_t>(r.id);
    plan.rectangle[i] = {static_cast<std::uint32_t>(r.x), static_cast<std::uint32_t>(r.y)};
    used += static_cast<double>(sizes[i].x) * sizes[i].y;
    for (std::uint32_t y = plan.rectangle[i].y; y < std::min(rows, plan.rectangle[i].y + sizes[i].y + gutter); ++y) {
      for (std::uint32_t x = plan.rectangle[i].x; x < std::min(side, plan.rectangle[i].x + sizes[i].x + gutter); ++x) {
        taken[std::size_t{y} * side + x] = 1;
      }
    }
  }

  // Single texels take what is left, row by row.
  for (std::uint32_t y = 0; y < rows && plan.single.size() < singles; ++y) {
    for (std::uint32_t x = 0; x < side && plan.single.size() < singles; ++x) {
      if (!taken[std::size_t{y} * side + x]) plan.single.emplace_back(x, y);
    }
  }
  if (plan.single.size() < singles) return std::nullopt;
  plan.used = used / (static_cast<double>(side) * rows);
  return plan;
}

}  // namespace

std::optional<AtlasPlan> packAtlas(std::span<const glm::uvec2> sizes, std::uint32_t singles, std::uint32_t gutter,
                                   std::uint32_t side, const Context* context) {
  if (side != 0) return packInto(sizes, singles, gutter, side, false);
  double area = singles;
  std::uint32_t longest = 8;
  for (const glm::uvec2& s : sizes) {
    area += static_cast<double>(s.x + gutter) * (s.y + gutter);
    longest = std::max({longest, s.x, s.y});
  }
  if (area > static_cast<double>(kMaxAtlasSide) * kMaxAtlasSide) return std::nullopt;
  std::uint32_t next = roundUp(std::max(std::sqrt(area), static_cast<double>(longest)));
  for (; next <= kMaxAtlasSide; next = std::max(next + 8, roundUp(next * 1.03))) {
    if (context != nullptr && context->cancelled()) break;
    if (std::optional<AtlasPlan> plan = packInto(sizes, singles, gutter, next, true)) return plan;
  }
  return std::nullopt;
}

}  // namespace relume
