// SPDX-License-Identifier: MIT
// See join_rows.h.
#include "bake/links/join_rows.h"

#include <limits>
#include <string>
#include <utility>

namespace relume {
namespace {

template <class T, class Part>
void append(std::vector<T>& all, const Part& part) {
  all.insert(all.end(), part.begin(), part.end());
}

}  // namespace

RowJoiner::RowJoiner(LinkKind kind, std::uint32_t bands, std::uint64_t links, std::uint64_t caches)
    : kind_(kind), bands_(kind == LinkKind::sh ? bands : 0) {
  rowBegin_.reserve(caches + 1);
  if (kind == LinkKind::sh) {
    shNode_.reserve(links);
    shCoefficients_.reserve(links * bands * bands);
  } else if (kind == LinkKind::cone) {
    cone_.reserve(links);
  } else {
    head_.reserve(links);
    shape6_.reserve(kind == LinkKind::oct6 ? links : 0);
  }
}

void RowJoiner::append(const LinkRowBuilder& rows) {
  for (const std::uint32_t length : rows.length) rowBegin_.push_back(rowBegin_.back() + length);
  relume::append(shNode_, rows.shNode);
  relume::append(shCoefficients_, rows.shCoefficients);
  relume::append(cone_, rows.cone);
  relume::append(head_, rows.compact.head);
  relume::append(shape8_, rows.compact.shape8);
  relume::append(shape6_, rows.compact.shape6);
}

void RowJoiner::append(const Links& links) {
  for (std::uint32_t i = 0; i < links.cacheCount(); ++i)
    rowBegin_.push_back(rowBegin_.back() + links.rowBegin[i + 1] - links.rowBegin[i]);
  relume::append(shNode_, links.shNode);
  relume::append(shCoefficients_, links.shCoefficients);
  relume::append(cone_, links.cone);
  relume::append(head_, links.head);
  if (kind_ != LinkKind::oct6) return relume::append(shape8_, links.shape);
  // Two links share a word, and a part may end in the middle of one.
  for (std::uint32_t i = 0; i < links.count(); ++i)
    shape6_.push_back(static_cast<std::uint16_t>(links.shape[i / 2] >> (16 * (i % 2))));
}

Links RowJoiner::finish() {
  Links links;
  links.kind = kind_;
  links.bands = bands_;
  links.rowBegin = std::move(rowBegin_);
  links.shNode = std::move(shNode_);
  links.shCoefficients = std::move(shCoefficients_);
  links.cone = std::move(cone_);
  links.head = std::move(head_);
  links.shape = kind_ == LinkKind::oct6 ? joinHalves(shape6_) : std::move(shape8_);
  return links;
}

Status checkLinkCount(std::uint64_t links) {
  if (links <= std::numeric_limits<std::uint32_t>::max()) return done();
  return Error{ErrorCode::failed,
               "links: " + std::to_string(links) + " links are more than 2^32 - 1; use fewer caches or links"};
}

Result<Links> joinRows(std::span<LinkRowBuilder> parts, const LinkOptions& options) {
  std::uint64_t links = 0, caches = 0;
  for (const LinkRowBuilder& rows : parts) {
    links += rows.shNode.size() + rows.cone.size() + rows.compact.head.size();
    caches += rows.length.size();
  }
  if (const Status status = checkLinkCount(links); !status) return status.error();
  RowJoiner joiner(options.kind, options.bands, links, caches);
  for (LinkRowBuilder& rows : parts) {
    joiner.append(rows);
    rows = LinkRowBuilder(options.kind);
  }
  return joiner.finish();
}

}  // namespace relume
