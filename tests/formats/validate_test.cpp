// SPDX-License-Identifier: MIT
// One corruption a finding: the small bake is valid, and each damaged field gives the finding of its number.
#include "formats/validate.h"

#include "tests/formats/small_bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <set>

namespace relume {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Corruption {
  Check check;
  const char* name;
  LinkKind kind;
  std::function<void(Bake&)> corrupt;
};

template <class T>
void shorten(Array<T>& array) {
  std::vector<T> copy = array.toVector();
  copy.pop_back();
  array = copy;
}

template <class T>
void set(Array<T>& array, std::size_t index, T value) {
  array = withElement(array, index, value);
}

void editCone(Bake& b, std::size_t i, const std::function<void(ConeLink&)>& change) {
  std::vector<ConeLink> links = b.links.cone.toVector();
  change(links.at(i));
  b.links.cone = links;
}

void editMaterial(Bake& b, const std::function<void(DrivableMaterial&)>& change) {
  std::vector<DrivableMaterial> materials = b.emitters.materials.toVector();
  change(materials.back());
  b.emitters.materials = materials;
}

const std::vector<Corruption>& corruptions() {
  using V = glm::vec3;
  constexpr LinkKind cone = LinkKind::cone, sh = LinkKind::sh, oct6 = LinkKind::oct6, irradiance = LinkKind::irradiance;
  static const std::vector<Corruption> list = {
      {Check::surfelArraySize, "normals", cone, [](Bake& b) { shorten(b.surfels.normal); }},
      {Check::surfelArraySize, "receivers", cone, [](Bake& b) { shorten(b.surfels.receiver); }},
      {Check::surfelInstance, "range", cone, [](Bake& b) { set(b.surfels.instance, 3, 2u); }},
      {Check::noSenders, "none", cone,
       [](Bake& b) {
         b.surfels = Surfels{};
         b.hierarchy.skyDirection = {};
       }},
      {Check::hierarchyArraySize, "weights", cone, [](Bake& b) { shorten(b.hierarchy.firstWeight); }},
      {Check::hierarchyArraySize, "sky", cone, [](Bake& b) { shorten(b.hierarchy.skyDirection); }},
      {Check::levelRange, "descending", cone, [](Bake& b) { set(b.hierarchy.levelBegin, 2, 8u); }},
      {Check::levelRange, "end", cone, [](Bake& b) { set(b.hierarchy.levelBegin, 4, 16u); }},
      {Check::levelRange, "begin", cone, [](Bake& b) { set(b.hierarchy.levelBegin, 0, 1u); }},
      {Check::levelRange, "missing", cone, [](Bake& b) { b.hierarchy.levelBegin = {}; }},
      {Check::childLevel, "cycle", cone, [](Bake& b) { set(b.hierarchy.child, 3, 1u); }},
      {Check::childLevel, "sibling beyond the level", cone, [](Bake& b) { set(b.hierarchy.child, 6, 14u); }},
      {Check::childLevel, "far", cone, [](Bake& b) { set(b.hierarchy.child, 6, 0x7FFFFFFFu); }},
      {Check::childShared, "two parents", cone, [](Bake& b) { set(b.hierarchy.child, 4, 7u); }},
      {Check::childOrder, "swapped", cone, [](Bake& b) {
         set(b.hierarchy.child, 3, 9u);
         set(b.hierarchy.child, 4, 7u);
       }},
      {Check::cacheArraySize, "many", cone, [](Bake& b) { b.caches.positionWorld = std::vector<glm::vec3>(kMaxCaches + 1); }},
      {Check::leafSender, "range", cone, [](Bake& b) { set(b.hierarchy.child, 14, kLeafBit | 8u); }},
      {Check::leafNodeMismatch, "swapped", cone, [](Bake& b) { set(b.hierarchy.leafNode, 2, 8u); }},
      {Check::leafNodeMismatch, "range", cone, [](Bake& b) { set(b.hierarchy.leafNode, 2, 99u); }},
      {Check::groupRootRange, "range", cone, [](Bake& b) { set(b.hierarchy.groupRoot, 2, 15u); }},
      {Check::groupRootRange, "order", cone, [](Bake& b) { set(b.hierarchy.groupRoot, 2, 5u); }},
      {Check::groupRootRange, "none", cone, [](Bake& b) { b.hierarchy.groupRoot = {}; }},
      {Check::cacheArraySize, "normals", cone, [](Bake& b) { shorten(b.caches.normal); }},
      {Check::gridSize, "resolution", cone, [](Bake& b) { b.caches.grid.resolution.y = 2; }},
      {Check::gridSize, "overflow", cone, [](Bake& b) { b.caches.grid.resolution = glm::uvec3(0x80000000u, 2, 2); }},
      {Check::gridCacheIndex, "range", cone, [](Bake& b) { set(b.caches.grid.cache, 1, 6u); }},
      {Check::gridPlacement, "nan", cone, [](Bake& b) { b.caches.grid.originWorld.x = kNan; }},
      {Check::gridPlacement, "zero", cone, [](Bake& b) { b.caches.grid.spacing.z = 0.0f; }},
      {Check::gridBrickSize, "cells", cone, [](Bake& b) { b.caches.grid.brick = std::vector<std::uint32_t>{0, 0}; }},
      {Check::gridBrickSize, "no cells", cone, [](Bake& b) { b.caches.grid.brick = {}; }},
      {Check::gridBrickSize, "half a brick", cone, [](Bake& b) { shorten(b.caches.grid.fine); }},
      {Check::gridBrickIndex, "range", cone, [](Bake& b) { set(b.caches.grid.brick, 0, 1u); }},
      {Check::gridFineIndex, "range", cone, [](Bake& b) { set(b.caches.grid.fine, 26, 6u); }},
      {Check::gridDepthSize, "words", cone, [](Bake& b) { shorten(b.caches.grid.depth); }},
      {Check::gridDepthSize, "few", cone, [](Bake& b) { b.caches.grid.depth = std::vector<std::uint32_t>(kDepthWords); }},
      {Check::gridDepthSize, "fine", cone, [](Bake& b) { set(b.caches.grid.fine, 5, 2u); }},
      {Check::gridAfterLightmap, "lattice", cone, [](Bake& b) { set(b.caches.grid.cache, 1, 3u); }},
      {Check::gridAfterLightmap, "brick", cone, [](Bake& b) { set(b.caches.grid.fine, 5, 2u); }},
      {Check::lightmapSize, "width", cone, [](Bake& b) { b.caches.lightmap.width = 5; }},
      {Check::lightmapSize, "flat", cone, [](Bake& b) { b.caches.lightmap.height = 0; }},
      {Check::lightmapCacheIndex, "range", cone, [](Bake& b) { set(b.caches.lightmap.cache, 15, 6u); }},
      {Check::lightmapPartCount, "few", cone, [](Bake& b) { shorten(b.caches.lightmap.parts); }},
      {Check::lightmapPartRange, "count", cone,
       [](Bake& b) { set(b.caches.lightmap.parts, 1, LightmapPart{0, 0, 0, 2, 6}); }},
      {Check::lightmapPartRange, "overflow", cone,
       [](Bake& b) { set(b.caches.lightmap.parts, 1, LightmapPart{0, 0, 0, 1, ~std::uint64_t{0} - 1}); }},
      {Check::linkKind, "unknown", cone, [](Bake& b) { b.links.kind = static_cast<LinkKind>(6); }},
      {Check::linkBands, "cone", cone, [](Bake& b) { b.links.bands = 4; }},
      {Check::linkBands, "nine", sh, [](Bake& b) { b.links.bands = 9; }},
      {Check::linkBands, "none", sh, [](Bake& b) { b.links.bands = 0; }},
      {Check::linkArraySize, "rows", cone, [](Bake& b) { shorten(b.links.rowBegin); }},
      {Check::linkArraySize, "coefficients", sh, [](Bake& b) { shorten(b.links.shCoefficients); }},
      {Check::linkArraySize, "both kinds", cone, [](Bake& b) { b.links.shNode = std::vector<std::uint32_t>{1}; }},
      {Check::linkArraySize, "shapes", oct6, [](Bake& b) { shorten(b.links.shape); }},
      {Check::linkArraySize, "shapes", oct6, [](Bake& b) { shorten(b.links.shape); }},
      {Check::linkArraySize, "grid", irradiance, [](Bake& b) { shorten(b.links.shape); }},
      {Check::linkBands, "oct6", oct6, [](Bake& b) { b.links.bands = 4; }},
      {Check::linkBands, "sh", sh, [](Bake& b) { b.links.bands = 0; }},
      {Check::linkGridFirst, "late", irradiance, [](Bake& b) { set(b.caches.normal, 4, V(0, 0, 0)); }},
      {Check::linkNode, "head", oct6, [](Bake& b) { set(b.links.head, 3, b.links.head[3] | 15u); }},
      {Check::linkOrder, "head", oct6, [](Bake& b) { set(b.links.head, 1, b.links.head[0]); }},
      {Check::linkRows, "first", cone, [](Bake& b) { set(b.links.rowBegin, 0, 1u); }},
      {Check::linkRows, "descending", cone, [](Bake& b) { set(b.links.rowBegin, 2, 3u); }},
      {Check::linkRows, "last", cone, [](Bake& b) { set(b.links.rowBegin, 6, 26u); }},
      {Check::linkRows, "beyond", cone, [](Bake& b) { set(b.links.rowBegin, 3, 0xFFFFFFFFu); }},
      {Check::linkNode, "cone", cone, [](Bake& b) { editCone(b, 3, [](ConeLink& l) { l.node = 15; }); }},
      {Check::linkNode, "sh", sh, [](Bake& b) { set(b.links.shNode, 3, 15u); }},
      {Check::linkOrder, "twice", cone, [](Bake& b) { editCone(b, 1, [](ConeLink& l) { l.node = 3; }); }},
      {Check::recommendedBands, "luma", cone, [](Bake& b) { b.provenance.lumaBands = 9; }},
      {Check::recommendedBands, "chroma", cone, [](Bake& b) { b.provenance.chromaBands = 3; }},
      {Check::recommendedBands, "beyond the links", sh, [](Bake& b) { b.provenance.lumaBands = 3; }},
      {Check::receiverWithoutLightmap, "dropped map", cone, [](Bake& b) { b.caches.lightmap = Lightmap{}; }},
      {Check::shapeRange, "beyond", cone, [](Bake& b) { editInstance(b, 1, [](BakedInstance& i) { i.shapeCount = 2; }); }},
      {Check::shapeRange, "overflow", cone, [](Bake& b) { editInstance(b, 0, [](BakedInstance& i) { i.firstShape = 0xFFFFFFFFu; }); }},
      {Check::emitterArraySize, "taps", cone, [](Bake& b) { shorten(b.emitters.tap); }},
      {Check::emitterArraySize, "widths", cone, [](Bake& b) { shorten(b.emitters.tapWidth); }},
      {Check::emitterEntries, "hole", cone, [](Bake& b) { editMaterial(b, [](DrivableMaterial& m) { ++m.firstEntry; }); }},
      {Check::emitterEntries, "overflow", cone,
       [](Bake& b) { editMaterial(b, [](DrivableMaterial& m) { m.entryCount = 0xFFFFFFFFu; }); }},
      {Check::emitterEntries, "entries of no material", cone, [](Bake& b) { b.emitters.materials = {}; }},
      {Check::emitterSurfel, "range", cone, [](Bake& b) { set(b.emitters.surfel, 1, 6u); }},
      {Check::emitterSurfel, "twice", cone, [](Bake& b) { set(b.emitters.surfel, 1, 5u); }},
      {Check::emitterTapWidth, "nan", cone, [](Bake& b) { set(b.emitters.tapWidth, 0, kNan); }},
      {Check::emitterTapWidth, "negative", cone, [](Bake& b) { set(b.emitters.tapWidth, 0, -1.0f); }},
      {Check::emitterTapWidth, "huge", cone, [](Bake& b) { set(b.emitters.tapWidth, 1, 1e6f); }},
      {Check::certificateArraySize, "errors", cone, [](Bake& b) { shorten(b.certificate.squaredError); }},
      {Check::certificateArraySize, "deviations", cone, [](Bake& b) { shorten(b.certificate.standardError); }},
      {Check::certificateArraySize, "receivers", cone, [](Bake& b) { shorten(b.certificate.partReceivers); }},
      {Check::certificateArraySize, "parts of no lights", cone, [](Bake& b) {
         b.certificate.lightKind = {};
         b.certificate.squaredError = b.certificate.standardError = {};
       }},
      {Check::certificateNumber, "nan", cone, [](Bake& b) { set(b.certificate.squaredError, 1, kNan); }},
      {Check::certificateNumber, "infinite", cone, [](Bake& b) { set(b.certificate.partError, 0, kInfinity); }},
      {Check::certificateNumber, "negative", cone, [](Bake& b) { set(b.certificate.standardError, 2, -1.0f); }},
      {Check::certificateNumber, "kind", cone, [](Bake& b) { set(b.certificate.lightKind, 2, 3u); }},
      {Check::lightmapSightSize, "short", cone,
       [](Bake& b) { b.caches.lightmap.sight = std::vector<std::uint32_t>(15, 0); }},
      {Check::lightmapSightMove, "near", cone,
       [](Bake& b) { b.caches.lightmap.sight = std::vector<std::uint32_t>(16, 3u << 26); }},
      {Check::lightmapSightMove, "beyond", cone,
       [](Bake& b) { b.caches.lightmap.sight = std::vector<std::uint32_t>(16, 3u << 28); }},
      {Check::backCornerSize, "short", cone, [](Bake& b) { shorten(b.caches.lightmap.backCornerUv); }},

      {Check::coordinate, "surfel nan", cone, [](Bake& b) { set(b.surfels.positionWorld, 2, V(0, kNan, 0)); }},
      {Check::coordinate, "surfel far", cone, [](Bake& b) { set(b.surfels.positionWorld, 2, V(0, 0, 2e9f)); }},
      {Check::surfelEmission, "bright", cone, [](Bake& b) { set(b.surfels.emission, 4, V(2e9f, 0, 0)); }},
      {Check::surfelNormal, "length", cone, [](Bake& b) { set(b.surfels.normal, 2, V(0, 1.1f, 0)); }},
      {Check::surfelAlbedo, "above", cone, [](Bake& b) { set(b.surfels.albedo, 2, V(0, 1.5f, 0)); }},
      {Check::surfelEmission, "negative", cone, [](Bake& b) { set(b.surfels.emission, 5, V(1, -1, 0)); }},
      {Check::surfelEmission, "infinite", cone, [](Bake& b) { set(b.surfels.emission, 5, V(1, kInfinity, 0)); }},
      {Check::surfelArea, "zero", cone, [](Bake& b) { b.surfels.areaEach = 0.0f; }},
      {Check::surfelArea, "huge", cone, [](Bake& b) { b.surfels.areaEach = 1e30f; }},
      {Check::surfelReceiverUnfilled, "hole", cone,
       [](Bake& b) {
         set(b.caches.lightmap.cache, 9, kNoCache);
         b.surfels.receiver = std::vector<std::uint32_t>(6, packUnorm16x2({0.375f, 0.625f}));
       }},

      {Check::firstWeightRange, "above", cone, [](Bake& b) { set(b.hierarchy.firstWeight, 0, 1.5f); }},
      {Check::firstWeightRange, "nan", cone, [](Bake& b) { set(b.hierarchy.firstWeight, 0, kNan); }},
      {Check::firstWeightLeaf, "leaf", cone, [](Bake& b) { set(b.hierarchy.firstWeight, 9, 0.5f); }},
      {Check::firstWeightArea, "share", cone, [](Bake& b) { set(b.hierarchy.firstWeight, 1, 0.4f); }},
      {Check::groupsOverlap, "below", cone, [](Bake& b) { set(b.hierarchy.groupRoot, 1, 3u); }},
      {Check::groupsIncomplete, "dropped", cone, [](Bake& b) { shorten(b.hierarchy.groupRoot); }},
      {Check::groupMixed, "emitter", cone, [](Bake& b) { set(b.surfels.emission, 1, V(1, 1, 1)); }},
      {Check::skyDirection, "length", cone, [](Bake& b) { set(b.hierarchy.skyDirection, 1, V(0, 0, 0)); }},

      {Check::coordinate, "cache nan", cone, [](Bake& b) { set(b.caches.positionWorld, 1, V(kNan, 0, 0)); }},
      {Check::coordinate, "cache infinite", cone, [](Bake& b) { set(b.caches.positionWorld, 1, V(0, -kInfinity, 0)); }},
      {Check::coordinate, "cache far", cone, [](Bake& b) { set(b.caches.positionWorld, 1, V(0, 0, 3e38f)); }},
      {Check::cacheNormal, "length", cone, [](Bake& b) { set(b.caches.normal, 3, V(0, 0.5f, 0)); }},
      {Check::cacheUnused, "grid", cone, [](Bake& b) {
         set(b.caches.grid.cache, 0, kNoCache);
         set(b.caches.grid.fine, 0, kNoCache);
       }},
      {Check::gridCacheNormal, "normal", cone, [](Bake& b) { set(b.caches.normal, 0, V(0, 1, 0)); }},
      {Check::gridCacheNormal, "fine", cone, [](Bake& b) {
         set(b.caches.grid.cache, 1, kNoCache);
         set(b.caches.normal, 1, V(0, 1, 0));
       }},
      {Check::lightmapCacheNormal, "zero", cone, [](Bake& b) { set(b.caches.normal, 5, V(0, 0, 0)); }},
      {Check::cornerMixed, "one", cone, [](Bake& b) { set(b.caches.lightmap.cornerUv, 4, kGridLit); }},
      {Check::cornerMixed, "back", cone, [](Bake& b) { set(b.caches.lightmap.backCornerUv, 7, kGridLit); }},
      {Check::partOccurrence, "ahead", cone,
       [](Bake& b) { set(b.caches.lightmap.parts, 1, LightmapPart{1, 0, 0, 1, 6}); }},
      {Check::partOccurrence, "one name", cone, [](Bake& b) { editInstance(b, 1, [&b](BakedInstance& i) { i.node = b.instances[0].node; }); }},
      {Check::partsOverlap, "shared", cone,
       [](Bake& b) { set(b.caches.lightmap.parts, 1, LightmapPart{0, 0, 0, 1, 5}); }},
      {Check::texelUnfilled, "hole", cone, [](Bake& b) { set(b.caches.lightmap.cache, 5, kNoCache); }},

      {Check::linkTransfer, "negative", cone,
       [](Bake& b) { editCone(b, 7, [](ConeLink& l) { l.transfer = packHalf(-0.1f); }); }},
      {Check::linkTransfer, "nan", cone, [](Bake& b) { editCone(b, 7, [](ConeLink& l) { l.transfer = packHalf(kNan); }); }},
      {Check::linkTransfer, "infinite", cone,
       [](Bake& b) { editCone(b, 7, [](ConeLink& l) { l.transfer = packHalf(kInfinity); }); }},
      {Check::linkTransfer, "sh", sh, [](Bake& b) { set(b.links.shCoefficients, 4, packHalf(-0.1f)); }},
      {Check::linkCosAlpha, "above", cone,
       [](Bake& b) { editCone(b, 7, [](ConeLink& l) { l.cosAlpha = packHalf(1.25f); }); }},
      {Check::linkCosAlpha, "nan", cone, [](Bake& b) { editCone(b, 7, [](ConeLink& l) { l.cosAlpha = packHalf(kNan); }); }},
      {Check::linkCosAlpha, "below", cone,
       [](Bake& b) { editCone(b, 7, [](ConeLink& l) { l.cosAlpha = packHalf(-1.25f); }); }},
      {Check::linkDirection, "none", cone,
       [](Bake& b) { editCone(b, 7, [](ConeLink& l) { l.direction = kNoDirection; }); }},
      {Check::linkCoefficient, "infinite", sh, [](Bake& b) { set(b.links.shCoefficients, 5, packHalf(kInfinity)); }},
      {Check::linkAncestor, "leaf", cone, [](Bake& b) { editCone(b, 3, [](ConeLink& l) { l.node = 7; }); }},
      {Check::linkAboveGroups, "join", cone, [](Bake& b) { editCone(b, 0, [](ConeLink& l) { l.node = 2; }); }},
      {Check::linkEnergySphere, "much", cone,
       [](Bake& b) { editCone(b, 0, [](ConeLink& l) { l.transfer = packHalf(1.0f); }); }},
      {Check::linkEnergyHemisphere, "surface", cone,
       [](Bake& b) { editCone(b, 9, [](ConeLink& l) { l.transfer = packHalf(0.4f); }); }},
      {Check::cacheWithoutLinks, "empty row", cone,
       [](Bake& b) {
         set(b.links.rowBegin, 6, b.links.rowBegin[5]);
         while (b.links.cone.size() > b.links.rowBegin[5]) shorten(b.links.cone);
       }},

      {Check::optionsMissing, "empty", cone, [](Bake& b) { b.provenance.optionsJson.clear(); }},
      {Check::toolVersionMissing, "empty", cone, [](Bake& b) { b.provenance.toolVersion.clear(); }},
      {Check::instanceUnnamed, "empty", cone, [](Bake& b) { editInstance(b, 1, [](BakedInstance& i) { i.node.clear(); }); }},
  };
  return list;
}

bool has(const std::vector<Finding>& findings, Check check) {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding& f) { return f.check == check; });
}

std::string textOf(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& f : findings) text += toString(f) + "\n";
  return text;
}

TEST(Validate, smallBakeHasNoFindings) {
  for (const LinkKind kind : kLinkKinds) {
    EXPECT_EQ(textOf(validateBake(makeSmallBake(kind))), "");
    EXPECT_EQ(textOf(validateBake(makeSmallDrivableBake(kind))), "");
    EXPECT_EQ(textOf(validateBake(makeSmallCertifiedBake(kind))), "");
  }
}

TEST(Validate, eachCorruptionGivesItsFinding) {
  for (const Corruption& c : corruptions()) {
    SCOPED_TRACE(std::to_string(static_cast<int>(c.check)) + " " + c.name);
    Bake bake = makeSmallCertifiedBake(c.kind);
    c.corrupt(bake);
    const std::vector<Finding> findings = validateBake(bake);
    EXPECT_TRUE(has(findings, c.check)) << textOf(findings);
    for (const Finding& f : findings) {
      EXPECT_FALSE(f.where.empty());
      EXPECT_FALSE(f.expected.empty());
      EXPECT_FALSE(f.found.empty());
    }
  }
}

TEST(Validate, structureCheckRefusesExactlyTheHundreds) {
  for (const Corruption& c : corruptions()) {
    SCOPED_TRACE(std::to_string(static_cast<int>(c.check)) + " " + c.name);
    Bake bake = makeSmallCertifiedBake(c.kind);
    c.corrupt(bake);
    const Status status = checkStructure(bake);
    const bool structural = static_cast<int>(c.check) < 200;
    EXPECT_EQ(static_cast<bool>(status), !structural);
    if (!status) {
      EXPECT_EQ(status.error().code, ErrorCode::invalidFile);
    }
  }
}

// The relighter looks at numbers that light is computed with, and at no other: what they are is checkBake()'s.
TEST(Validate, numbersAreThoseThatLightIsComputedWith) {
  const std::set<Check> numbers = {
      Check::surfelNormal, Check::surfelAlbedo, Check::surfelEmission, Check::emitterTapWidth, Check::firstWeightRange,
      Check::skyDirection, Check::cacheNormal,  Check::linkTransfer,   Check::linkCosAlpha,    Check::linkCoefficient};
  for (const Corruption& corruption : corruptions()) {
    Bake bake = makeSmallCertifiedBake(corruption.kind);
    corruption.corrupt(bake);
    const bool isStructure = static_cast<int>(corruption.check) < 200;
    const bool isArea = corruption.check == Check::surfelArea && !(bake.surfels.areaEach > 0.0f);
    EXPECT_EQ(static_cast<bool>(checkBake(bake)), !(isStructure || isArea || numbers.contains(corruption.check)))
        << static_cast<int>(corruption.check) << ", " << corruption.name;
  }
  // Numbers at their bounds are good ones.
  Bake bake = makeSmallBake(LinkKind::cone);
  editCone(bake, 7, [](ConeLink& l) { l.cosAlpha = packHalf(-1.0f), l.transfer = packHalf(-0.0f); });
  editCone(bake, 8, [](ConeLink& l) { l.cosAlpha = packHalf(1.0f), l.transfer = 0x7BFF; });
  EXPECT_TRUE(checkBake(bake));
}

// Parts over the same corners could have any multiple of the triangles that a file has room for.
TEST(Validate, trianglesOfPartsThatOverlapAreNotLookedAt) {
  Bake bake = makeSmallBake(LinkKind::cone);
  set(bake.caches.lightmap.cornerUv, 4, kGridLit);
  EXPECT_TRUE(has(validateBake(bake), Check::cornerMixed));
  set(bake.caches.lightmap.parts, 1, LightmapPart{0, 0, 0, 1, 5});
  EXPECT_TRUE(has(validateBake(bake), Check::partsOverlap));
  EXPECT_FALSE(has(validateBake(bake), Check::cornerMixed));
}

TEST(Validate, everyMessageHasACorruptionAndIsListedOnce) {
  std::set<Check> corrupted, listed;
  for (const Corruption& c : corruptions()) corrupted.insert(c.check);
  for (const ValidationMessage& m : kValidationMessages) {
    EXPECT_TRUE(listed.insert(m.check).second) << static_cast<int>(m.check);
    EXPECT_TRUE(corrupted.count(m.check)) << static_cast<int>(m.check) << " has no test";
  }
  EXPECT_EQ(listed.size(), corrupted.size());
}

// The surfels of a marked material are emitters, also where they are dark; those of another are not.
TEST(Validate, darkSurfelsOfMarkedMaterialsAreEmitters) {
  Bake bake = makeSmallDrivableBake();
  set(bake.surfels.emission, 4, glm::vec3(0.0f));
  EXPECT_EQ(textOf(validateBake(bake)), "");
  set(bake.surfels.emission, 5, glm::vec3(0.0f));
  EXPECT_TRUE(has(validateBake(bake), Check::groupMixed));
}

TEST(Validate, findingNamesPlaceExpectedAndFoundAndCounts) {
  Bake bake = makeSmallBake();
  bake.surfels.normal = std::vector<glm::vec3>(6, glm::vec3(0.0f, 2.0f, 0.0f));
  const std::vector<Finding> findings = validateBake(bake);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(toString(findings[0]),
            "E202 surfel normal is not a unit vector: surfel.normal[0]: expected length 1, found "
            "(0, 2, 0) (6 times)");
}

}  // namespace
}  // namespace relume
