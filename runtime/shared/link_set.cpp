// SPDX-License-Identifier: MIT
// See link_set.h.
#include "runtime/shared/link_set.h"

#include "formats/compact_links.h"

#include <algorithm>
#include <bit>

namespace relume {
namespace {

// Links that the widest vector may read behind the last one.
constexpr std::size_t kRoom = 15;
constexpr std::uint32_t kMaxRowShift = 6;

// Whether nodes ascend in all rows, and rows are short enough to count their links in 16 bits.
bool canPackAgain(const Links& links) {
  if (links.kind != LinkKind::oct6 || links.count() == 0) return false;
  for (std::uint32_t c = 0; c < links.cacheCount(); ++c) {
    const std::uint32_t begin = links.rowBegin[c], end = links.rowBegin[c + 1];
    if (end - begin > 0xFFFFu) return false;
    for (std::uint32_t i = begin + 1; i < end; ++i) {
      if (links.node(i) < links.node(i - 1)) return false;
    }
  }
  return true;
}

// Codes of eight bits: nothing, or the five low bits of a half's exponent and the four high ones of its mantissa, from
// 2^-14 on. (Below that are denormal halves, which kernels need not know then.)
constexpr std::uint32_t kMinTransfer8 = 16, kMaxTransfer8 = 255, kHalfBias = 0x38000000u;
constexpr int kDropped = 19;  // bits of a float's mantissa

// unpackTransfer() of the code, which is all that is left of twelve bits.
float unpackTransfer8(std::uint32_t code) {
  return code < kMinTransfer8 ? 0.0f : std::bit_cast<float>((code << kDropped) + kHalfBias);
}

// The nearest; of two that are as near, the larger.
std::uint32_t packTransfer8(float f) {
  constexpr float kMin = 0x1p-14f;
  if (!(f >= kMin)) return f < kMin - f ? 0 : kMinTransfer8;
  const std::uint32_t code = (std::bit_cast<std::uint32_t>(f) - kHalfBias + (1u << (kDropped - 1))) >> kDropped;
  return std::min(code, kMaxTransfer8);
}

// visit(step) for each step of a row, as LinkRows::nodeStep has them.
template <class Visit>
void forSteps(const Links& links, std::uint32_t cache, const Visit& visit) {
  const std::uint32_t end = links.rowBegin[cache + 1];
  std::uint32_t at = links.rowBegin[cache], high = 0;
  for (std::uint32_t i = at; i < end; ++i) {
    for (; high < links.node(i) >> 16; ++high) {
      for (; i - at >= kNoGrowth; at += kNoGrowth) visit(kNoGrowth);
      visit(i - at);
      at = i;
    }
  }
}

}  // namespace

LinkSet::LinkSet(const Links& links, std::pmr::memory_resource* memory)
    : links_(links), rowBase_(memory), rowOffset_(memory), word_(memory), transfer_(memory), nodeStep_(memory) {
  packRows();
  if (canPackAgain(links)) packAgain();
  links_.rowBegin = {};
}

void LinkSet::packRows() {
  const std::uint32_t caches = links_.cacheCount();
  count_ = links_.count();
  const auto beginOf = [&](std::uint32_t c) { return links_.rowBegin.empty() ? 0u : links_.rowBegin[c]; };
  const auto baseOf = [&](std::uint32_t c) { return beginOf(c >> rowShift_ << rowShift_); };
  // The most rows to a base of which none begins too far behind it; one always does.
  rowShift_ = kMaxRowShift;
  for (std::uint32_t c = 0; c <= caches; ++c) {
    while (beginOf(c) - baseOf(c) > 0xFFFFu) --rowShift_;
  }
  rowBase_.reserve((caches >> rowShift_) + 1);
  rowOffset_.reserve(std::size_t{caches} + 1);
  for (std::uint32_t c = 0; c <= caches; ++c) {
    if (c >> rowShift_ << rowShift_ == c) rowBase_.push_back(beginOf(c));
    rowOffset_.push_back(static_cast<std::uint16_t>(beginOf(c) - baseOf(c)));
  }
}

void LinkSet::packAgain() {
  steps_ = 0;
  for (std::uint32_t c = 0; c < links_.cacheCount(); ++c) {
    std::uint32_t steps = 0;
    forSteps(links_, c, [&](std::uint32_t) { ++steps; });
    steps_ = std::max(steps_, steps);
  }
  word_.reserve(links_.count() + kRoom);
  transfer_.reserve(links_.count() + kRoom);
  nodeStep_.reserve(std::size_t{links_.cacheCount()} * steps_);
  for (std::uint32_t c = 0; c < links_.cacheCount(); ++c) {
    const std::uint32_t begin = links_.rowBegin[c], end = links_.rowBegin[c + 1];
    float error = 0.0f;
    forSteps(links_, c, [&](std::uint32_t step) { nodeStep_.push_back(static_cast<std::uint8_t>(step)); });
    nodeStep_.resize((std::size_t{c} + 1) * steps_, kNoGrowth);
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint32_t node = links_.node(i);
      word_.push_back((node & 0xFFFFu) | ((links_.shape[i / 2] >> (16 * (i % 2))) & 0xFFFFu) << 16);
      // A link that carries nothing stays that way.
      const float baked = unpackTransfer(links_.head[i] >> 20);
      const std::uint32_t f = baked > 0.0f ? packTransfer8(baked + error) : 0u;
      error = baked + error - unpackTransfer8(f);
      transfer_.push_back(static_cast<std::uint8_t>(f));
    }
  }
  word_.resize(word_.size() + kRoom, 0);
  transfer_.resize(transfer_.size() + kRoom, 0);
  links_.head = {};
  links_.shape = {};
}

LinkRows LinkSet::rows() const {
  LinkRows rows;
  rows.rowBase = rowBase_.data();
  rows.rowOffset = rowOffset_.data();
  rows.rowShift = rowShift_;
  rows.kind = word_.empty() ? static_cast<std::uint32_t>(links_.kind) : kRepackedLinks;
  rows.cone = reinterpret_cast<const std::uint32_t*>(links_.cone.data());
  rows.shNode = links_.shNode.data();
  rows.shCoefficients = links_.shCoefficients.data();
  rows.shHalfCount = links_.shCoefficients.size();
  rows.shStride = links_.bands * links_.bands;
  rows.head = links_.head.data();
  rows.shape = links_.shape.data();
  rows.shapeBytes = 4 * links_.shape.size();
  rows.gridLinks = static_cast<std::uint32_t>(links_.kind == LinkKind::irradiance ? links_.shape.size() : 0);
  rows.word = word_.data();
  rows.transfer = transfer_.data();
  rows.nodeStep = nodeStep_.data();
  rows.nodeSteps = steps_;
  return rows;
}

float LinkSet::rounding(const Links& baked, std::uint32_t i) const {
  if (word_.empty()) return 1.0f;
  const float f = unpackTransfer(baked.head[i] >> 20);
  return f > 0.0f ? unpackTransfer(std::uint32_t{transfer_[i]} << 4) / f : 0.0f;
}

std::size_t LinkSet::bytes() const {
  const auto bytes = [](const auto& array) { return array.size() * sizeof(*array.data()); };
  return bytes(rowBase_) + bytes(rowOffset_) + bytes(links_.cone) + bytes(links_.shNode) +
         bytes(links_.shCoefficients) + bytes(links_.head) + bytes(links_.shape) + bytes(word_) + bytes(transfer_) +
         bytes(nodeStep_);
}

}  // namespace relume
