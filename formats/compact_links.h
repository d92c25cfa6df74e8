// SPDX-License-Identifier: MIT
// Links with a head of four bytes (LinkKind oct6, irradiance): how they are packed and what they mean.
//
//   head   bits  0..19  node
//          bits 20..31  f: the twelve bits of a half below the sign and the highest bit of the exponent, without the
//                       two last of the mantissa; [0..2), steps of 1/256 of the power of two, down to 2^-22
//   shape, oct6: bits 0..5 and 6..11 octahedral direction, signed normalised; 12..15 cone q
//          irradiance, grid: 0..11 and 12..23; 24..31
//          cos alpha = 1 - 2 (q / largest q)²: fine where cones are narrow
//   irradiance, map: f = 2 y_0 * (share of the light that a white furnace would send), so that the cache's coefficient
//   0 is
//          E / (2 pi y_0): what one band of a surface cache means anyway (formats/sh.h, irradianceAtSurface())
//
// f is rounded so that a row's sum is kept: what one link loses the next gains.
#pragma once

#include "formats/shape_links.h"
#include "relume/caches.h"
#include "relume/links.h"
#include "relume/result.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kMaxCompactNodes = 1u << 20;

struct LinkDirection {
  glm::vec3 direction{0.0f, 0.0f, 1.0f};
  float cosAlpha = 1.0f;
};

// f [0..2) as twelve bits, rounded to nearest; larger ones become the largest, NaN and negative ones 0.
std::uint32_t packTransfer(float f);
float unpackTransfer(std::uint32_t bits);

// Direction (unit) and cone; the nearest of the grid's directions.
std::uint32_t packShape8(const LinkDirection& d);
std::uint32_t packShape6(const LinkDirection& d);
LinkDirection unpackShape8(std::uint32_t bits);
LinkDirection unpackShape6(std::uint32_t bits);

// Size of Links::shape; `gridLinks` counts only for kind irradiance.
std::uint64_t shapeWords(LinkKind kind, std::uint64_t links, std::uint64_t gridLinks);
// Links of the caches before the first that lies on a surface. [Size rowBegin = caches + 1]
std::uint64_t countGridLinks(const Caches& caches, const Links& links);

// Writes rows of one kind, a link at a time.
class CompactLinkWriter {
 public:
  explicit CompactLinkWriter(LinkKind kind) : kind_(kind) {}
  void beginRow() {
    error_ = 0.0f;
    shaper_.beginRow();
  }
  // oct6; irradiance: grid caches.
  void add(std::uint32_t node, float f, const LinkDirection& direction);
  // irradiance: caches on a surface.
  void add(std::uint32_t node, float f);
  // oct6, in whose rows errors cancel (shape_links.h). [Size c >= 16]
  void add(std::uint32_t node, std::span<const float> c);

  std::vector<std::uint32_t> head;
  std::vector<std::uint32_t> shape8;  // irradiance: of the grid's links
  std::vector<std::uint16_t> shape6;  // oct6

 private:
  float addHead(std::uint32_t node, float f);
  LinkKind kind_;
  float error_ = 0.0f;  // of f, diffused from the links before
  LinkShaper shaper_;
};

// Halves in a row as words, even ones low.
std::vector<std::uint32_t> joinHalves(std::span<const std::uint16_t> halves);

// The coefficients c_{s,i} that link i of any kind stands for; those past a stored link's bands are zero, and so are
// all but the first of an irradiance link. `surface`: whether its cache lies on a surface. [Size c >= bands²]
// [bands 1..8]
void linkCoefficients(const Links& links, std::uint32_t i, bool surface, int bands, std::span<float> c);

// The same links as oct6: cone links one by one, SH links of four bands and more so that a row's errors cancel
// (shape_links.h), as the baker makes them. unsupported: other links, or nodes past kMaxCompactNodes.
Result<Links> compactLinks(const Links& links);

// SH links of two bands or more as irradiance links: those of caches on a surface by irradianceLinear(), exact because
// all their light comes from above; those of the grid, which come first, from `cone`, the same links as cones.
// unsupported: other kinds, links that are not the same, nodes past kMaxCompactNodes.
Result<Links> irradianceLinks(const Caches& caches, const Links& sh, const Links& cone);

}  // namespace relume
