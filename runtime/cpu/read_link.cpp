// SPDX-License-Identifier: MIT
// See read_link.h.
#include "runtime/cpu/read_link.h"

#include "formats/compact_links.h"
#include "formats/pack.h"

#include <algorithm>
#include <array>

namespace relume::cpu {
namespace {

bool is(const LinkRows& rows, LinkKind kind) { return rows.kind == static_cast<std::uint32_t>(kind); }

// f and the cone of a link that has one.
struct Cone {
  float transfer = 0.0f;
  LinkDirection to{};
};

Cone coneOf(const LinkRows& rows, std::uint32_t link) {
  if (rows.kind == kRepackedLinks)
    return {unpackTransfer(std::uint32_t{rows.transfer[link]} << 4), unpackShape6(rows.word[link] >> 16)};
  if (is(rows, LinkKind::cone)) {
    const std::uint32_t* words = rows.cone + 3 * std::size_t{link};
    return {unpackHalf(static_cast<std::uint16_t>(words[1] & 0xFFFFu)),
            {unpackOctahedral(words[2]), unpackHalf(static_cast<std::uint16_t>(words[1] >> 16))}};
  }
  const float transfer = unpackTransfer(rows.head[link] >> 20);
  if (is(rows, LinkKind::oct6)) return {transfer, unpackShape6((rows.shape[link / 2] >> (16 * (link % 2))) & 0xFFFFu)};
  return {transfer, unpackShape8(rows.shape[link])};
}

}  // namespace

RowReader::RowReader(const LinkRows& rows, std::uint32_t cache) : rows_(rows), begin_(rows.rowBegin[cache]) {
  if (rows.kind != kRepackedLinks) return;
  step_ = rows.nodeStep + std::size_t{rows.nodeSteps} * cache;
  stepEnd_ = step_ + rows.nodeSteps;
}

std::uint32_t RowReader::node(std::uint32_t link) {
  if (rows_.kind == kRepackedLinks) {
    for (; step_ != stepEnd_ && *step_ <= link - begin_; ++step_) high_ += 1u << 16;
    return (rows_.word[link] & 0xFFFFu) | high_;
  }
  if (is(rows_, LinkKind::sh)) return rows_.shNode[link];
  if (is(rows_, LinkKind::cone)) return rows_.cone[3 * std::size_t{link}];
  return rows_.head[link] & 0xFFFFFu;
}

void RowReader::coefficients(std::uint32_t link, int bands, std::span<float> c) const {
  const std::size_t count = static_cast<std::size_t>(bands * bands);
  if (is(rows_, LinkKind::sh)) {
    const std::uint16_t* from = rows_.shCoefficients + std::size_t{rows_.shStride} * link;
    for (std::size_t i = 0; i < count; ++i) c[i] = unpackHalf(from[i]);
    return;
  }
  if (is(rows_, LinkKind::irradiance) && link >= rows_.gridLinks) {
    std::fill_n(c.begin(), count, 0.0f);
    c[0] = unpackTransfer(rows_.head[link] >> 20);
    return;
  }
  const Cone cone = coneOf(rows_, link);
  std::array<float, kMaxBands> ratio;
  coneBandRatios(bands, cone.to.cosAlpha, ratio);
  evaluateSh(bands, cone.to.direction, c);
  const float scale = cone.transfer / c[0];
  for (int l = 0; l < bands; ++l) {
    for (int i = l * l; i < (l + 1) * (l + 1); ++i)
      c[static_cast<std::size_t>(i)] *= scale * ratio[static_cast<std::size_t>(l)];
  }
}

}  // namespace relume::cpu
