// SPDX-License-Identifier: MIT
// See compact_links.h.
#include "formats/compact_links.h"

#include "formats/octahedron.h"
#include "formats/pack.h"
#include "formats/sh.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string>

namespace relume {
namespace {

// Direction and cone in 2 kUvBits + kConeBits bits.
template <int kUvBits, int kConeBits>
struct Shape {
  static constexpr int kMax = (1 << (kUvBits - 1)) - 1, kCones = (1 << kConeBits) - 1;

  static std::uint32_t code(int u, int v) {
    constexpr std::uint32_t kMask = (1u << kUvBits) - 1;
    return (static_cast<std::uint32_t>(u) & kMask) | (static_cast<std::uint32_t>(v) & kMask) << kUvBits;
  }
  static glm::vec3 direction(int u, int v) {
    return fromOctahedron(glm::vec2(static_cast<float>(u), static_cast<float>(v)) / static_cast<float>(kMax));
  }
  static std::uint32_t pack(const LinkDirection& d) {
    // The nearest of the four directions around.
    const glm::vec2 p = toOctahedron(d.direction) * static_cast<float>(kMax);
    const int u = static_cast<int>(std::floor(p.x)), v = static_cast<int>(std::floor(p.y));
    std::uint32_t best = 0;
    float bestCosine = -2.0f;
    for (int corner = 0; corner < 4; ++corner) {
      const int cu = std::clamp(u + (corner & 1), -kMax, kMax), cv = std::clamp(v + corner / 2, -kMax, kMax);
      const float cosine = glm::dot(direction(cu, cv), d.direction);
      if (cosine > bestCosine) {
        bestCosine = cosine;
        best = code(cu, cv);
      }
    }
    const float q = std::sqrt(std::clamp(0.5f - 0.5f * d.cosAlpha, 0.0f, 1.0f)) * static_cast<float>(kCones);
    return best | static_cast<std::uint32_t>(std::lrint(q)) << (2 * kUvBits);
  }
  static LinkDirection unpack(std::uint32_t bits) {
    const auto part = [bits](int shift) {
      return std::max(static_cast<std::int32_t>(bits << (32 - kUvBits - shift)) >> (32 - kUvBits), -kMax);
    };
    const float q =
        static_cast<float>((bits >> (2 * kUvBits)) & static_cast<std::uint32_t>(kCones)) / static_cast<float>(kCones);
    return {direction(part(0), part(kUvBits)), 1.0f - 2.0f * q * q};
  }
};

using Shape8 = Shape<12, 8>;
using Shape6 = Shape<6, 4>;

// Coefficients of a cone link (PIC Eq. (5), (6)).
void coneCoefficients(float f, const LinkDirection& d, int bands, std::span<float> c) {
  std::array<float, kMaxBands> ratio;
  evaluateSh(bands, d.direction, c);
  coneBandRatios(bands, d.cosAlpha, ratio);
  constexpr float kY0 = 0.28209479177387814f;
  for (int l = 0; l < bands; ++l) {
    for (int i = l * l; i < (l + 1) * (l + 1); ++i) {
      c[static_cast<std::size_t>(i)] *= f * ratio[static_cast<std::size_t>(l)] / kY0;
    }
  }
}

}  // namespace

std::uint32_t packTransfer(float f) {
  if (!(f > 0.0f)) return 0;
  f = std::min(f, 2.0f);
  // Round to eight bits after the leading one, or to multiples of 2^-22 below 2^-14, to even where two are as near;
  // then the half is exact.
  constexpr std::uint32_t kDropped = 15, kHalf = 1u << (kDropped - 1);
  const auto bits = std::bit_cast<std::uint32_t>(f);
  const float rounded =
      f < 0x1p-14f ? std::nearbyint(f * 0x1p22f) * 0x1p-22f
                   : std::bit_cast<float>((bits + kHalf - 1 + (bits >> kDropped & 1u)) >> kDropped << kDropped);
  return packHalf(std::min(rounded, 1.99609375f)) >> 2;
}

float unpackTransfer(std::uint32_t bits) { return unpackHalf(static_cast<std::uint16_t>((bits & 0xFFFu) << 2)); }

std::uint32_t packShape8(const LinkDirection& d) { return Shape8::pack(d); }
std::uint32_t packShape6(const LinkDirection& d) { return Shape6::pack(d); }
LinkDirection unpackShape8(std::uint32_t bits) { return Shape8::unpack(bits); }
LinkDirection unpackShape6(std::uint32_t bits) { return Shape6::unpack(bits); }

std::uint64_t shapeWords(LinkKind kind, std::uint64_t links, std::uint64_t gridLinks) {
  switch (kind) {
    case LinkKind::oct6:
      return (links + 1) / 2;
    case LinkKind::irradiance:
      return gridLinks;
    default:
      return 0;
  }
}

std::uint64_t countGridLinks(const Caches& caches, const Links& links) {
  for (std::uint32_t c = 0; c < links.cacheCount() && c < caches.normal.size(); ++c) {
    if (caches.normal[c] != glm::vec3(0.0f)) return links.rowBegin[c];
  }
  return links.count();
}

float CompactLinkWriter::addHead(std::uint32_t node, float f) {
  const float wanted = f + error_;
  const std::uint32_t bits = packTransfer(wanted);
  const float got = unpackTransfer(bits);
  error_ = wanted - got;
  head.push_back(node | bits << 20);
  return got;
}

void CompactLinkWriter::add(std::uint32_t node, float f, const LinkDirection& direction) {
  addHead(node, f);
  if (kind_ == LinkKind::oct6) {
    shape6.push_back(static_cast<std::uint16_t>(packShape6(direction)));
  } else {
    shape8.push_back(packShape8(direction));
  }
}

void CompactLinkWriter::add(std::uint32_t node, float f) { addHead(node, f); }

void CompactLinkWriter::add(std::uint32_t node, std::span<const float> c) {
  shape6.push_back(static_cast<std::uint16_t>(shaper_.choose(c, addHead(node, c[0]))));
}

std::vector<std::uint32_t> joinHalves(std::span<const std::uint16_t> halves) {
  std::vector<std::uint32_t> words((halves.size() + 1) / 2, 0);
  for (std::size_t i = 0; i < halves.size(); ++i) words[i / 2] |= std::uint32_t{halves[i]} << (16 * (i % 2));
  return words;
}

void linkCoefficients(const Links& links, std::uint32_t i, bool surface, int bands, std::span<float> c) {
  const auto wanted = static_cast<std::size_t>(bands * bands);
  std::fill_n(c.begin(), wanted, 0.0f);
  const std::size_t stored = std::min(wanted, std::size_t{links.bands} * links.bands);
  if (links.kind == LinkKind::sh) {
    const std::size_t first = std::size_t{i} * links.bands * links.bands;
    for (std::size_t k = 0; k < stored; ++k) c[k] = unpackHalf(links.shCoefficients[first + k]);
    return;
  }
  if (links.kind == LinkKind::cone) {
    const ConeLink& link = links.cone[i];
    return coneCoefficients(unpackHalf(link.transfer), {unpackOctahedral(link.direction), unpackHalf(link.cosAlpha)},
                            bands, c);
  }
  const float f = unpackTransfer(links.head[i] >> 20);
  if (links.kind == LinkKind::irradiance && surface) {
    c[0] = f;
  } else if (links.kind == LinkKind::oct6) {
    coneCoefficients(f, unpackShape6(links.shape[i / 2] >> (16 * (i % 2))), bands, c);
  } else {
    coneCoefficients(f, unpackShape8(links.shape[i]), bands, c);
  }
}

Result<Links> irradianceLinks(const Caches& caches, const Links& sh, const Links& cone) {
  if (sh.kind != LinkKind::sh || sh.bands < 2 || cone.kind != LinkKind::cone || sh.count() != cone.count() ||
      sh.cacheCount() != caches.count() || cone.cacheCount() != caches.count()) {
    return Error{ErrorCode::unsupported,
                 "irradiance links need the same links as SH of two bands or more and as cones"};
  }
  constexpr float kTwoPiY0 = 1.7724538509055159f;  // sqrt(pi)
  CompactLinkWriter writer(LinkKind::irradiance);
  std::array<float, kMaxCoefficients> c;
  for (std::uint32_t cache = 0; cache < caches.count(); ++cache) {
    writer.beginRow();
    const glm::vec3 n = caches.normal[cache];
    for (std::uint32_t i = sh.rowBegin[cache]; i < sh.rowBegin[cache + 1]; ++i) {
      const std::uint32_t node = sh.node(i);
      if (node != cone.node(i) || node >= kMaxCompactNodes) {
        return Error{ErrorCode::unsupported, "link " + std::to_string(i) + " names node " + std::to_string(node) +
                                                 ", expected the same as cone and below " +
                                                 std::to_string(kMaxCompactNodes)};
      }
      if (n != glm::vec3(0.0f)) {
        linkCoefficients(sh, i, true, 2, c);
        writer.add(node, irradianceLinear(c, n) / kTwoPiY0);
      } else {
        const ConeLink& link = cone.cone[i];
        writer.add(node, unpackHalf(link.transfer), {unpackOctahedral(link.direction), unpackHalf(link.cosAlpha)});
      }
    }
  }
  Links packed;
  packed.kind = LinkKind::irradiance;
  packed.rowBegin = sh.rowBegin;
  packed.head = std::move(writer.head);
  packed.shape = std::move(writer.shape8);
  return packed;
}

Result<Links> compactLinks(const Links& links) {
  const bool fromSh = links.kind == LinkKind::sh && links.bands >= LinkShaper::kBands;
  if (links.kind != LinkKind::cone && !fromSh) {
    return Error{ErrorCode::unsupported,
                 "links of kind " + std::string(linkKindName(links.kind)) + " and " + std::to_string(links.bands) +
                     " bands cannot be packed as oct6, expected cone, or sh of 4 bands or more"};
  }
  CompactLinkWriter writer(LinkKind::oct6);
  std::array<float, kMaxCoefficients> c;
  for (std::uint32_t cache = 0; cache < links.cacheCount(); ++cache) {
    writer.beginRow();
    for (std::uint32_t i = links.rowBegin[cache]; i < links.rowBegin[cache + 1]; ++i) {
      const std::uint32_t node = links.node(i);
      if (node >= kMaxCompactNodes) {
        return Error{ErrorCode::unsupported, "link " + std::to_string(i) + " names node " + std::to_string(node) +
                                                 ", compact links reach up to " + std::to_string(kMaxCompactNodes - 1)};
      }
      if (fromSh) {
        linkCoefficients(links, i, false, static_cast<int>(links.bands), c);
        writer.add(node, c);
      } else {
        const ConeLink& link = links.cone[i];
        writer.add(node, unpackHalf(link.transfer), {unpackOctahedral(link.direction), unpackHalf(link.cosAlpha)});
      }
    }
  }
  Links packed;
  packed.kind = LinkKind::oct6;
  packed.rowBegin = links.rowBegin;
  packed.head = std::move(writer.head);
  packed.shape = joinHalves(writer.shape6);
  return packed;
}

}  // namespace relume
