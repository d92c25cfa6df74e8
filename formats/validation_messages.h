// SPDX-License-Identifier: MIT
// Every finding of `relume validate`, numbered. Numbers are never reused. 1xx: sizes and indices the runtime relies
// upon to stay inside memory (checked by every reader); 2xx surfels; 3xx hierarchy; 4xx caches, grid, light map;
// 5xx links; 6xx provenance.
#pragma once

#include <cstdint>

namespace relume {

enum class FindingSeverity : std::uint8_t { warning, error };

enum class Check : std::uint16_t {
  surfelArraySize = 101,
  surfelInstance = 102,
  noSenders = 103,
  hierarchyArraySize = 104,
  levelRange = 105,
  childLevel = 106,
  childShared = 107,
  leafSender = 108,
  leafNodeMismatch = 109,
  groupRootRange = 110,
  cacheArraySize = 111,
  gridSize = 112,
  gridCacheIndex = 113,
  gridPlacement = 114,
  lightmapSize = 115,
  lightmapCacheIndex = 116,
  lightmapPartCount = 117,
  lightmapPartRange = 118,
  linkKind = 119,
  linkBands = 120,
  linkArraySize = 121,
  linkRows = 122,
  linkNode = 123,
  linkOrder = 124,
  recommendedBands = 125,
  receiverWithoutLightmap = 126,
  backCornerSize = 127,
  linkGridFirst = 128,
  gridBrickSize = 129,
  gridBrickIndex = 130,
  gridFineIndex = 131,
  gridDepthSize = 132,
  childOrder = 133,
  gridAfterLightmap = 134,
  coordinate = 135,
  emitterArraySize = 136,
  emitterEntries = 137,
  emitterSurfel = 138,
  shapeRange = 150,

  // 201 and 401 were positions that are not finite: 135 says so.
  surfelNormal = 202,
  surfelAlbedo = 203,
  surfelEmission = 204,
  surfelArea = 205,
  surfelReceiverUnfilled = 206,
  emitterTapWidth = 207,

  firstWeightRange = 301,
  firstWeightLeaf = 302,
  firstWeightArea = 303,
  groupsOverlap = 304,
  groupsIncomplete = 305,
  groupMixed = 306,
  skyDirection = 307,

  cacheNormal = 402,
  cacheUnused = 403,
  gridCacheNormal = 404,
  lightmapCacheNormal = 405,
  cornerMixed = 406,
  partsOverlap = 407,
  partOccurrence = 420,
  texelUnfilled = 408,

  linkTransfer = 501,
  linkCosAlpha = 502,
  linkDirection = 503,
  linkCoefficient = 504,
  linkAncestor = 505,
  linkAboveGroups = 506,
  linkEnergySphere = 507,
  linkEnergyHemisphere = 508,
  cacheWithoutLinks = 509,

  optionsMissing = 601,
  toolVersionMissing = 602,
  instanceUnnamed = 603,
};

struct ValidationMessage {
  Check check;
  FindingSeverity severity;
  const char* what;
};

inline constexpr ValidationMessage kValidationMessages[] = {
    {Check::surfelArraySize, FindingSeverity::error, "surfel array has another size than surfel.position"},
    {Check::surfelInstance, FindingSeverity::error, "surfel lies on an instance that does not exist"},
    {Check::noSenders, FindingSeverity::error, "there is no sender, or more than the format can index"},
    {Check::hierarchyArraySize, FindingSeverity::error, "hierarchy array has the wrong size"},
    {Check::levelRange, FindingSeverity::error, "levels do not divide the nodes into ascending, non-empty ranges"},
    {Check::childLevel, FindingSeverity::error, "children do not lie in the level below their parent"},
    {Check::childShared, FindingSeverity::error, "node has no parent, or more than one"},
    {Check::leafSender, FindingSeverity::error, "leaf stands for a sender that does not exist"},
    {Check::leafNodeMismatch, FindingSeverity::error, "node.leaf does not name the leaf of its sender"},
    {Check::groupRootRange, FindingSeverity::error, "group roots are not 1 to 3 ascending nodes"},
    {Check::cacheArraySize, FindingSeverity::error, "cache array has another size than cache.position"},
    {Check::gridSize, FindingSeverity::error, "grid.cache does not have the size of the grid"},
    {Check::gridCacheIndex, FindingSeverity::error, "grid point refers to a cache that does not exist"},
    {Check::gridPlacement, FindingSeverity::error,
     "grid lies beyond the coordinates a bake may have, or spacing is not positive"},
    {Check::lightmapSize, FindingSeverity::error, "map.cache does not have the size of the light map"},
    {Check::lightmapCacheIndex, FindingSeverity::error, "texel refers to a cache that does not exist"},
    {Check::lightmapPartCount, FindingSeverity::error, "there are light-map parts, but not one for each instance"},
    {Check::lightmapPartRange, FindingSeverity::error, "light-map part reaches beyond map.corner"},
    {Check::linkKind, FindingSeverity::error, "unknown kind of links"},
    {Check::linkBands, FindingSeverity::error, "bands of links do not fit their kind"},
    {Check::linkArraySize, FindingSeverity::error, "link array has the wrong size"},
    {Check::linkRows, FindingSeverity::error, "link rows do not ascend from 0 to the number of links"},
    {Check::linkNode, FindingSeverity::error, "link refers to a node that does not exist"},
    {Check::linkOrder, FindingSeverity::error, "nodes of a link row do not ascend"},
    {Check::recommendedBands, FindingSeverity::error, "recommended bands are out of range"},
    {Check::receiverWithoutLightmap, FindingSeverity::error, "surfel reads a light map that does not exist"},
    {Check::backCornerSize, FindingSeverity::error, "map.back is neither empty nor as long as map.corner"},
    {Check::linkGridFirst, FindingSeverity::error, "irradiance links: a grid cache comes after one on a surface"},
    {Check::gridBrickSize, FindingSeverity::error, "grid.brick does not have the size of the grid's cells"},
    {Check::gridBrickIndex, FindingSeverity::error, "grid cell refers to a brick that does not exist"},
    {Check::gridFineIndex, FindingSeverity::error, "brick refers to a cache that does not exist"},
    {Check::gridDepthSize, FindingSeverity::error, "grid.depth does not have the size of the grid's caches"},
    {Check::childOrder, FindingSeverity::error, "children do not follow those of the nodes before"},
    {Check::gridAfterLightmap, FindingSeverity::error, "a cache of the grid comes after one of the light map"},
    {Check::coordinate, FindingSeverity::error, "position is not finite, or beyond the coordinates a bake may have"},
    {Check::emitterArraySize, FindingSeverity::error, "emitter array has another size than emit.surfel"},
    {Check::emitterEntries, FindingSeverity::error, "entries of drivable materials do not follow one another"},
    {Check::emitterSurfel, FindingSeverity::error, "emitter entry names no surfel, or one that another entry names"},

    {Check::surfelNormal, FindingSeverity::error, "surfel normal is not a unit vector"},
    {Check::surfelAlbedo, FindingSeverity::error, "surfel albedo is not within 0 to 1"},
    {Check::surfelEmission, FindingSeverity::error,
     "surfel emission is negative, not finite or beyond what a bake may hold"},
    {Check::surfelArea, FindingSeverity::error, "area of a surfel is not positive and finite"},
    {Check::surfelReceiverUnfilled, FindingSeverity::warning, "surfel reads a light-map texel without a cache"},
    {Check::emitterTapWidth, FindingSeverity::error, "width of an emitter's tap is not within 0 to 65536"},

    {Check::firstWeightRange, FindingSeverity::error, "pull weight is not within 0 to 1"},
    {Check::firstWeightLeaf, FindingSeverity::error, "pull weight of a leaf is not 0"},
    {Check::firstWeightArea, FindingSeverity::error,
     "pull weight is not the first child's share of the area, though "
     "the options ask for pull by area"},
    {Check::groupsOverlap, FindingSeverity::error, "groups of senders overlap"},
    {Check::groupsIncomplete, FindingSeverity::error, "a sender belongs to no group"},
    {Check::groupMixed, FindingSeverity::error, "a group mixes reflectors, emitters or sky"},
    {Check::skyDirection, FindingSeverity::error, "direction of a sky patch is not a unit vector"},

    {Check::cacheNormal, FindingSeverity::error, "cache normal is neither a unit vector nor zero"},
    {Check::cacheUnused, FindingSeverity::warning, "neither grid nor light map uses the cache"},
    {Check::gridCacheNormal, FindingSeverity::error, "cache of a grid point has a normal"},
    {Check::lightmapCacheNormal, FindingSeverity::error, "cache of a texel has no normal"},
    {Check::cornerMixed, FindingSeverity::error, "triangle is half on the light map and half on the grid"},
    {Check::partsOverlap, FindingSeverity::error, "light-map parts share corners"},
    {Check::partOccurrence, FindingSeverity::error, "light-map part does not count those of its name before it"},
    {Check::shapeRange, FindingSeverity::error, "instance refers to blocks beyond mesh.shape"},
    {Check::texelUnfilled, FindingSeverity::warning, "a triangle reads a light-map texel without a cache"},

    {Check::linkTransfer, FindingSeverity::error, "transfer of a link is negative or not finite"},
    {Check::linkCosAlpha, FindingSeverity::error, "cone of a link is not within -1 to 1"},
    {Check::linkDirection, FindingSeverity::error, "link with transfer has no direction"},
    {Check::linkCoefficient, FindingSeverity::error, "coefficient of a link is not finite, or no code of its kind"},
    {Check::linkAncestor, FindingSeverity::error, "a node and its ancestor are linked to the same cache"},
    {Check::linkAboveGroups, FindingSeverity::error, "link to a node above the groups of senders"},
    {Check::linkEnergySphere, FindingSeverity::error, "links of a cache transfer more than a full sphere"},
    {Check::linkEnergyHemisphere, FindingSeverity::warning, "links of a surface cache transfer more than a hemisphere"},
    {Check::cacheWithoutLinks, FindingSeverity::warning, "cache has no links"},

    {Check::optionsMissing, FindingSeverity::warning, "the bake does not say with which options it was made"},
    {Check::toolVersionMissing, FindingSeverity::warning, "the bake does not say by which version it was made"},
    {Check::instanceUnnamed, FindingSeverity::warning, "instance has no node name"},
};

}  // namespace relume
