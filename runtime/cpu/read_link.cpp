// SPDX-License-Identifier: MIT
// See read_link.h.
#include "runtime/cpu/read_link.h"

#include "formats/compact_links.h"
#include "formats/pack.h"

#include <bit>

namespace relume::cpu {
namespace {

bool is(const LinkRows& rows, LinkKind kind) { return rows.kind == static_cast<std::uint32_t>(kind); }

}  // namespace

RowReader::RowReader(const LinkRows& rows, std::uint32_t cache) : rows_(rows), next_(rowBegin(rows, cache)) {
  if (rows.kind != kRepackedLinks) return;
  step_ = rows.nodeStep + std::size_t{rows.nodeSteps} * cache;
  stepEnd_ = step_ + rows.nodeSteps;
  if (step_ != stepEnd_) next_ += *step_;
}

std::uint32_t RowReader::node(std::uint32_t link) {
  if (rows_.kind == kRepackedLinks) {
    while (step_ != stepEnd_ && next_ <= link) {
      if (*step_ != kNoGrowth) high_ += 1u << 16;
      if (++step_ != stepEnd_) next_ += *step_;
    }
    return (rows_.word[link] & 0xFFFFu) | high_;
  }
  if (is(rows_, LinkKind::sh)) return rows_.shNode[link];
  if (is(rows_, LinkKind::cone)) return rows_.cone[3 * std::size_t{link}];
  return rows_.head[link] & 0xFFFFFu;
}

float RowReader::transfer(std::uint32_t link) const {
  // Bits 6 to 13 of a half that never is denormal (runtime/shared/link_set.cpp): a float's, 2^112 too small.
  if (rows_.kind == kRepackedLinks) return std::bit_cast<float>(std::uint32_t{rows_.transfer[link]} << 19) * 0x1p112f;
  if (is(rows_, LinkKind::sh)) return unpackHalf(rows_.shCoefficients[std::size_t{rows_.shStride} * link]);
  if (is(rows_, LinkKind::cone))
    return unpackHalf(static_cast<std::uint16_t>(rows_.cone[3 * std::size_t{link} + 1] & 0xFFFFu));
  return unpackTransfer(rows_.head[link] >> 20);
}

}  // namespace relume::cpu
