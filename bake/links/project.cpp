// SPDX-License-Identifier: MIT
// See project.h.
#include "bake/links/project.h"

#include "formats/pack.h"
#include "formats/sh.h"

#include <glm/geometric.hpp>

#include <algorithm>

namespace relume {
namespace {

constexpr float kY0 = 0.28209479177387814f;

// Note for every leaf which link reads it.
void assignLeaves(const TouchedTree& tree, std::span<const std::uint32_t> cut, std::vector<std::uint32_t>& linkOf) {
  linkOf.resize(tree.leaves().size());
  for (std::uint32_t link = 0; link < cut.size(); ++link) {
    const TouchedNode& node = tree[cut[link]];
    std::fill(linkOf.begin() + node.firstLeaf, linkOf.begin() + node.endLeaf, link);
  }
}

}  // namespace

void appendConeRow(const TouchedTree& tree, std::span<const std::uint32_t> cut, LinkKind kind, LinkRows& rows) {
  rows.compact.beginRow();
  for (const std::uint32_t slot : cut) {
    const TouchedNode& node = tree[slot];
    // Band 1 of the rays is |mean direction| times that of a single direction; the cone's is (1 + cos alpha) / 2.
    const float length = glm::length(node.direction);
    const float mean = std::clamp(length / node.weight, 0.0f, 1.0f);
    const LinkDirection d{length > 0.0f ? node.direction / length : glm::vec3(0.0f, 0.0f, 1.0f), 2.0f * mean - 1.0f};
    if (kind == LinkKind::cone) {
      rows.cone.push_back({node.node, packHalf(kY0 * node.weight), packHalf(d.cosAlpha), packOctahedral(d.direction)});
    } else {
      rows.compact.add(node.node, kY0 * node.weight, d);
    }
  }
  rows.length.push_back(static_cast<std::uint32_t>(cut.size()));
}

void appendShRow(const TouchedTree& tree, std::span<const std::uint32_t> cut, std::span<const Arrival> arrivals,
                 LinkKind kind, std::uint32_t bands, ProjectScratch& scratch, LinkRows& rows) {
  assignLeaves(tree, cut, scratch.linkOf);
  const std::uint32_t size = bands * bands;
  scratch.coefficients.assign(cut.size() * size, 0.0f);
  // Some rays at a time: what was stored float by float is read in registers, for which processors wait.
  constexpr std::size_t kTogether = 8;
  std::array<std::array<float, kMaxCoefficients>, kTogether> y;
  for (std::size_t first = 0; first < arrivals.size(); first += kTogether) {
    const std::span some = arrivals.subspan(first, std::min(kTogether, arrivals.size() - first));
    for (std::size_t k = 0; k < some.size(); ++k) evaluateSh(static_cast<int>(bands), some[k].direction, y[k]);
    for (std::size_t k = 0; k < some.size(); ++k) {
      float* c = scratch.coefficients.data() + std::size_t{scratch.linkOf[tree.slotOfArrival()[first + k]]} * size;
      for (std::uint32_t i = 0; i < size; ++i) c[i] += some[k].weight * y[k][i];
    }
  }
  rows.length.push_back(static_cast<std::uint32_t>(cut.size()));
  if (kind == LinkKind::sh) {
    for (const std::uint32_t slot : cut) rows.shNode.push_back(tree[slot].node);
    for (const float c : scratch.coefficients) rows.shCoefficients.push_back(packHalf(c));
    return;
  }
  rows.compact.beginRow();
  for (std::size_t i = 0; i < cut.size(); ++i) {
    rows.compact.add(tree[cut[i]].node, std::span<const float>(scratch.coefficients).subspan(i * size, size));
  }
}

void appendIrradianceRow(const TouchedTree& tree, std::span<const std::uint32_t> cut, LinkRows& rows) {
  rows.compact.beginRow();
  for (const std::uint32_t slot : cut) rows.compact.add(tree[slot].node, 2.0f * kY0 * tree[slot].received);
  rows.length.push_back(static_cast<std::uint32_t>(cut.size()));
}

void appendRow(const TouchedTree& tree, std::span<const std::uint32_t> cut, std::span<const Arrival> arrivals,
               bool onSurface, LinkKind kind, std::uint32_t bands, ProjectScratch& scratch, LinkRows& rows) {
  if (linkHasBands(kind)) return appendShRow(tree, cut, arrivals, kind, bands, scratch, rows);
  if (kind == LinkKind::oct6) return appendShRow(tree, cut, arrivals, kind, LinkShaper::kBands, scratch, rows);
  if (kind == LinkKind::irradiance && onSurface) return appendIrradianceRow(tree, cut, rows);
  appendConeRow(tree, cut, kind, rows);
}

}  // namespace relume
