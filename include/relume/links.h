// SPDX-License-Identifier: MIT
// Links: how much light a node of the hierarchy sends to a cache, and from where (PIC 3.1, 4.5, 4.6). The links of a
// cache are a cut through the hierarchy; with B_s the node's radiosity,
//   L_SH = sum over links of B_s F_SH   (PIC Eq. (3)).
//
// A link's transfer f = c_{s,0} is the SH coefficient 0 of visibility over pi: f = y_0 * visible solid angle / pi.
// Nodes hold radiosity, so transfers are not divided by an area. formats/compact_links.h packs and unpacks the kinds
// that have a head; docs/notes/links.md compares size, error and speed.
#pragma once

#include "relume/array.h"

#include <cstdint>
#include <string_view>

namespace relume {

enum class LinkKind : std::uint32_t {
  sh = 0,    // node + bands² halves: the coefficients c_{s,i} of PIC Eq. (2)
  cone = 1,  // 12 bytes: node, f, cos alpha, direction (PIC 4.6); bands are made at run time
  oct6 = 3,  // 6 bytes: head, direction of 12 bits, cone of 4
  // 4 bytes for caches on a surface, head alone: their irradiance and nothing else. 8 for the grid's: head, direction
  // of 24 bits, cone of 8.
  irradiance = 5,
};
inline constexpr LinkKind kLinkKinds[] = {LinkKind::sh, LinkKind::cone, LinkKind::oct6, LinkKind::irradiance};

// As options, reports and file names have it; "" for a number that is no kind.
constexpr std::string_view linkKindName(LinkKind kind) {
  switch (kind) {
    case LinkKind::sh:
      return "sh";
    case LinkKind::cone:
      return "cone";
    case LinkKind::oct6:
      return "oct6";
    case LinkKind::irradiance:
      return "irradiance";
  }
  return "";
}
constexpr bool linkHasHead(LinkKind kind) { return kind != LinkKind::sh && kind != LinkKind::cone; }

// The paper's link for run-time projection (PIC Fig. 5, buffer 5.1).
// c_l^m = f * ratio_l(cosAlpha) * y_l^m(direction) / y_0^0, ratio of formats/sh.h.
// Deviation: direction is octahedral, not polar: the same bits, no trigonometry, even error.
// Deviation: cosAlpha matches band 1 of the true projection, cosAlpha = 2 |mean direction| - 1, not the solid angle.
struct ConeLink {
  std::uint32_t node = 0;
  std::uint16_t transfer = 0;   // half: f
  std::uint16_t cosAlpha = 0;   // half: [-1..1]
  std::uint32_t direction = 0;  // packOctahedral, cache toward sender
};
static_assert(sizeof(ConeLink) == 12);

// Compressed rows: the links of cache c are rowBegin[c] .. rowBegin[c+1]-1, nodes ascending within a row.
struct Links {
  LinkKind kind = LinkKind::cone;
  std::uint32_t bands = 0;              // [1..8] of SH links; 0 for the others (any number at run time)
  Array<std::uint32_t> rowBegin;        // [Size n_C + 1]
  Array<std::uint32_t> shNode;          // kind sh: [Size links]
  Array<std::uint16_t> shCoefficients;  // kind sh: [Size links * bands²] halves, a link's coefficients together
  Array<ConeLink> cone;                 // kind cone: [Size links]
  Array<std::uint32_t> head;            // kinds with a head: [Size links] node in the low 20 bits, f in the high 12
  Array<std::uint32_t> shape;           // kinds with a head: [Size shapeWords()] what a link has beside its head:
                                        // oct6 half a word (even links in the low half); irradiance a word for the
                                        // grid's links, which come first

  std::uint32_t cacheCount() const { return rowBegin.empty() ? 0u : static_cast<std::uint32_t>(rowBegin.size() - 1); }
  std::uint32_t count() const { return rowBegin.empty() ? 0u : rowBegin.back(); }
  // Node of link i, whatever the kind.
  std::uint32_t node(std::uint32_t i) const {
    return kind == LinkKind::sh ? shNode[i] : (kind == LinkKind::cone ? cone[i].node : head[i] & 0xFFFFFu);
  }
};

}  // namespace relume
