// SPDX-License-Identifier: MIT
// Joins the links of consecutive caches, given in parts, to one set of rows.
#pragma once

#include "bake/links/project.h"
#include "relume/links.h"
#include "relume/result.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

class RowJoiner {
 public:
  // bands: of SH links. links, caches: of all parts together, which memory is taken for.
  RowJoiner(LinkKind kind, std::uint32_t bands, std::uint64_t links, std::uint64_t caches);

  void append(const LinkRowBuilder& rows);
  // Links of the same kind and bands, whose arrays fit each other.
  void append(const Links& links);

  Links finish();

 private:
  LinkKind kind_;
  std::uint32_t bands_;
  std::vector<std::uint32_t> rowBegin_{0}, shNode_, head_, shape8_;
  std::vector<std::uint16_t> shCoefficients_, shape6_;
  std::vector<ConeLink> cone_;
};

// failed: more links than a bake may have.
Status checkLinkCount(std::uint64_t links);

// Join parts in their order, freeing each as it is copied. failed: as checkLinkCount().
Result<Links> joinRows(std::span<LinkRowBuilder> parts, const LinkOptions& options);

}  // namespace relume
