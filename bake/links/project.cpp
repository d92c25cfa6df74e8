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

// Note for every visible leaf which link carries its light.
void assignLeaves(const VisibleSubtree& tree, std::span<const CutLink> cut, std::vector<std::uint32_t>& linkOf) {
  linkOf.resize(tree.leaves().size());
  for (std::uint32_t link = 0; link < cut.size(); ++link) {
    const VisibleNode& node = tree[cut[link].slot];
    std::fill(linkOf.begin() + node.firstLeaf, linkOf.begin() + node.endLeaf, link);
  }
}

// Sum every ray's basis functions into its link's coefficients, which are stored link by link.
void sumBasis(const VisibleSubtree& tree, std::span<const Arrival> arrivals, std::uint32_t bands,
              ProjectScratch& scratch) {
  const std::uint32_t size = bands * bands;
  std::array<float, kMaxCoefficients> y;
  for (std::size_t a = 0; a < arrivals.size(); ++a) {
    evaluateSh(static_cast<int>(bands), arrivals[a].direction, y);
    float* c = scratch.coefficients.data() + std::size_t{scratch.linkOf[tree.slotOfArrival()[a]]} * size;
    for (std::uint32_t i = 0; i < size; ++i) c[i] += arrivals[a].weight * y[i];
  }
}

// The same for four bands, which are linear in the monomials of a unit direction up to x³: fewer operations per ray.
constexpr std::uint32_t kMomentBands = 4;

void sumMoments(const VisibleSubtree& tree, std::span<const Arrival> arrivals, std::size_t links,
                ProjectScratch& scratch) {
  scratch.moments.assign(links, {});
  for (std::size_t a = 0; a < arrivals.size(); ++a) {
    const float x = arrivals[a].direction.x, y = arrivals[a].direction.y, z = arrivals[a].direction.z;
    const Moments::Four p = Moments::Four{x, y, z, 1.0f} * arrivals[a].weight, px = p * x, py = p * y;
    Moments& m = scratch.moments[scratch.linkOf[tree.slotOfArrival()[a]]];
    m.one += p, m.z += p * z, m.xx += px * x, m.xy += px * y, m.yy += py * y;
  }
  for (std::size_t i = 0; i < links; ++i) {
    const auto [one, z, xx, xy, yy] = scratch.moments[i];
    const Moments::Four zz = one - xx - yy;
    float* c = scratch.coefficients.data() + i * kMomentBands * kMomentBands;
    c[0] = 0.28209479177387814f * one[3];
    c[1] = 0.48860251190291992f * one[1];
    c[2] = 0.48860251190291992f * one[2];
    c[3] = 0.48860251190291992f * one[0];
    c[4] = 1.0925484305920791f * xy[3];
    c[5] = 1.0925484305920791f * z[1];
    c[6] = 0.31539156525252000f * (3.0f * z[2] - one[3]);
    c[7] = 1.0925484305920791f * z[0];
    c[8] = 0.54627421529603953f * (xx[3] - yy[3]);
    c[9] = 0.59004358992664351f * (3.0f * xx[1] - yy[1]);
    c[10] = 2.8906114426405540f * xy[2];
    c[11] = 0.45704579946446574f * (5.0f * zz[1] - one[1]);
    c[12] = 0.37317633259011540f * (5.0f * zz[2] - 3.0f * one[2]);
    c[13] = 0.45704579946446574f * (5.0f * zz[0] - one[0]);
    c[14] = 1.4453057213202770f * (xx[2] - yy[2]);
    c[15] = 0.59004358992664351f * (xx[0] - 3.0f * xy[1]);
  }
}

}  // namespace

void appendConeRow(const VisibleSubtree& tree, std::span<const CutLink> cut, LinkKind kind, LinkRowBuilder& rows) {
  rows.compact.beginRow();
  for (const auto [slot, reads] : cut) {
    const VisibleNode& node = tree[slot];
    const std::uint32_t sender = tree[reads].node;
    // Band 1 of the rays is |mean direction| times that of a single direction; the cone's is (1 + cos alpha) / 2.
    const float length = glm::length(node.direction);
    const float mean = std::clamp(length / node.weight, 0.0f, 1.0f);
    const LinkDirection d{length > 0.0f ? node.direction / length : glm::vec3(0.0f, 0.0f, 1.0f), 2.0f * mean - 1.0f};
    if (kind == LinkKind::cone) {
      rows.cone.push_back({sender, packHalf(kY0 * node.weight), packHalf(d.cosAlpha), packOctahedral(d.direction)});
    } else {
      rows.compact.add(sender, kY0 * node.weight, d);
    }
  }
  rows.length.push_back(static_cast<std::uint32_t>(cut.size()));
}

void appendShRow(const VisibleSubtree& tree, std::span<const CutLink> cut, std::span<const Arrival> arrivals,
                 LinkKind kind, std::uint32_t bands, ProjectScratch& scratch, LinkRowBuilder& rows) {
  assignLeaves(tree, cut, scratch.linkOf);
  const std::uint32_t size = bands * bands;
  scratch.coefficients.assign(cut.size() * size, 0.0f);
  if (bands == kMomentBands) {
    sumMoments(tree, arrivals, cut.size(), scratch);
  } else {
    sumBasis(tree, arrivals, bands, scratch);
  }
  rows.length.push_back(static_cast<std::uint32_t>(cut.size()));
  if (kind == LinkKind::sh) {
    for (const CutLink& link : cut) rows.shNode.push_back(tree[link.reads].node);
    for (const float c : scratch.coefficients) rows.shCoefficients.push_back(packHalf(c));
    return;
  }
  rows.compact.beginRow();
  for (std::size_t i = 0; i < cut.size(); ++i) {
    rows.compact.add(tree[cut[i].reads].node, std::span<const float>(scratch.coefficients).subspan(i * size, size));
  }
}

void appendIrradianceRow(const VisibleSubtree& tree, std::span<const CutLink> cut, LinkRowBuilder& rows) {
  rows.compact.beginRow();
  for (const auto [slot, reads] : cut) rows.compact.add(tree[reads].node, 2.0f * kY0 * tree[slot].received);
  rows.length.push_back(static_cast<std::uint32_t>(cut.size()));
}

void appendRow(const VisibleSubtree& tree, std::span<const CutLink> cut, std::span<const Arrival> arrivals,
               bool onSurface, LinkKind kind, std::uint32_t bands, ProjectScratch& scratch, LinkRowBuilder& rows) {
  if (kind == LinkKind::sh) return appendShRow(tree, cut, arrivals, kind, bands, scratch, rows);
  if (kind == LinkKind::oct6) return appendShRow(tree, cut, arrivals, kind, LinkShaper::kBands, scratch, rows);
  if (kind == LinkKind::irradiance && onSurface) return appendIrradianceRow(tree, cut, rows);
  appendConeRow(tree, cut, kind, rows);
}

}  // namespace relume
