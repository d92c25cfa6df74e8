// SPDX-License-Identifier: MIT
// See voxel_layer.h. Each pair of a triangle and a voxel that it overlaps adds the triangle's share of area there; a
// first sum finds the voxel's axis, a second one what is outermost on each side of it, a third one what faces it. All
// are of integers, so that threads change nothing.
#include "runtime/voxels/voxel_layer.h"

#include "runtime/shared/chunks.h"
#include "runtime/voxels/overlap.h"
#include "runtime/voxels/side_columns.h"
#include "runtime/voxels/summed_surfaces.h"
#include "runtime/voxels/voxel_pairs.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>

namespace relume {
namespace {

constexpr std::uint32_t kTriangles = 512, kVoxels = 1024, kCells = 64;  // of a chunk
constexpr std::uint32_t kBatch = 1u << 22;  // triangles, about, whose pairs are held at once
constexpr double kEmissionSteps = 0x1p+20;

// Of n n^T over the voxel's triangles: xx, yy, zz, xy, yz, zx.
using Moment = std::array<std::int64_t, 6>;

struct SideSums {
  std::int64_t weight = 0, area = 0;
  std::int64_t visible = 0;             // of the weight, what nothing before it in the voxel hides
  std::int64_t within = 0;              // triangles that do not merely touch the voxel
  std::int64_t facing = 0, across = 0;  // area of triangles that face the axis more or less, and that stand across
  std::int64_t emitting = 0, backEmitting = 0;  // weight of triangles that emit, from their front and their back
  std::array<std::int64_t, 3> normal{}, position{}, albedo{}, emission{}, backEmission{};
  // For each of kSubCentres the nearest triangle: squared distance, then its number.
  std::array<std::int64_t, 4> nearest{INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX};
  std::uint8_t litFaces = 0;                                  // that triangles that emit face
  std::int64_t outermost = INT64_MIN, innermost = INT64_MAX;  // of positions along the axis
};

glm::ivec3 normalOf(const SnappedTriangle& t) { return {t.normal[0], t.normal[1], t.normal[2]}; }

glm::ivec3 subCentre(std::size_t i) { return {kSubCentres[i][0], kSubCentres[i][1], kSubCentres[i][2]}; }

// [1/64 voxel from the voxel's centre]
glm::ivec3 cornerIn(const SnappedTriangle& t, const glm::ivec3& v) {
  return glm::ivec3(t.corner[0][0], t.corner[0][1], t.corner[0][2]) - (v * kVoxelSteps + kVoxelSteps / 2);
}

// Where a triangle is in a voxel.
class PlacesIn {
 public:
  PlacesIn(const SnappedTriangle& t, const glm::ivec3& v) : corner_(cornerIn(t, v)), normal_(normalOf(t)) {
    constexpr int kHalf = kVoxelSteps / 2;
    const glm::ivec3 toSecond(t.corner[1][0] - t.corner[0][0], t.corner[1][1] - t.corner[0][1],
                              t.corner[1][2] - t.corner[0][2]),
        toThird(t.corner[2][0] - t.corner[0][0], t.corner[2][1] - t.corner[0][1], t.corner[2][2] - t.corner[0][2]);
    low_ = glm::clamp(corner_ + glm::min(glm::ivec3(0), glm::min(toSecond, toThird)), -kHalf, kHalf);
    high_ = glm::clamp(corner_ + glm::max(glm::ivec3(0), glm::max(toSecond, toThird)), -kHalf, kHalf);
  }

  // That nearest to one in the voxel, about: it is moved onto the triangle's plane, within its bounds and the voxel's.
  // Both [1/64 voxel from the voxel's centre]
  glm::ivec3 nearest(const glm::ivec3& wanted) const {
    const glm::ivec3 from = wanted - corner_;
    const int distance = normal_.x * from.x + normal_.y * from.y + normal_.z * from.z;
    return glm::clamp(wanted - normal_ * distance / (127 * 127), low_, high_);
  }

 private:
  glm::ivec3 corner_, normal_;  // 127 times the unit vector
  glm::ivec3 low_, high_;       // bounds
};

glm::dvec3 axisOf(const Moment& m) {
  const double xx = static_cast<double>(m[0]), yy = static_cast<double>(m[1]), zz = static_cast<double>(m[2]),
               xy = static_cast<double>(m[3]), yz = static_cast<double>(m[4]), zx = static_cast<double>(m[5]);
  const glm::dvec3 column = xx >= yy && xx >= zz ? glm::dvec3(xx, xy, zx)
                            : yy >= zz           ? glm::dvec3(xy, yy, yz)
                                                 : glm::dvec3(zx, yz, zz);
  const double length = glm::length(column);
  return length > 0.0 ? column / length : glm::dvec3(0.0, 1.0, 0.0);
}

glm::dvec3 toDouble(const std::array<std::int64_t, 3>& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// 127 times a unit vector, to the nearest integers.
glm::ivec3 signedBytes(const glm::vec3& axis) {
  return {static_cast<int>(std::floor(127.0f * axis.x + 0.5f)), static_cast<int>(std::floor(127.0f * axis.y + 0.5f)),
          static_cast<int>(std::floor(127.0f * axis.z + 0.5f))};
}

// faceBit() of the faces of a cube toward which more than a sixteenth of a triangle's normal goes. [127 times the unit
// vector]
unsigned facesOf(const glm::ivec3& normal, bool bothSides) {
  unsigned faces = 0;
  for (int a = 0; a < 3; ++a) {
    if (normal[a] > 8 || (bothSides && normal[a] < -8)) faces |= 1u << faceBit(a, false);
    if (normal[a] < -8 || (bothSides && normal[a] > 8)) faces |= 1u << faceBit(a, true);
  }
  return faces;
}

void addEmission(SideSums& sums, const SurfaceEmission& surface, const glm::ivec3& normal, std::int64_t seen,
                 double unit) {
  sums.litFaces |= static_cast<std::uint8_t>(facesOf(normal, surface.doubleSided));
  sums.emitting += seen;
  if (surface.doubleSided) sums.backEmitting += seen;
  for (int k = 0; k < 3; ++k) {
    if (!(surface.emission[k] > 0.0f)) continue;
    const auto emission = static_cast<std::int64_t>(std::floor(double{surface.emission[k]} / unit + 0.5));
    sums.emission[static_cast<std::size_t>(k)] += seen * emission;
    if (surface.doubleSided) sums.backEmission[static_cast<std::size_t>(k)] += seen * emission;
  }
}

void addMoment(const SnappedTriangle& t, std::int64_t share, Moment& m) {
  const glm::ivec3 n = normalOf(t);
  m[0] += share * n.x * n.x;
  m[1] += share * n.y * n.y;
  m[2] += share * n.z * n.z;
  m[3] += share * n.x * n.y;
  m[4] += share * n.y * n.z;
  m[5] += share * n.z * n.x;
}

// 127 squared times the cosine between a triangle's normal and an axis.
int cosineOf(const SnappedTriangle& t, const glm::ivec3& axis) {
  const glm::ivec3 n = normalOf(t);
  return n.x * axis.x + n.y * axis.y + n.z * axis.z;
}

// The side of a voxel that it faces.
std::size_t sideOf(int cosine) { return cosine >= 0 ? 0 : 1; }

// What a triangle adds to both sides of a voxel with this axis. [127 times the unit vector]
void addSides(const SnappedTriangle& t, std::uint32_t triangle, const SummedSurfaces& surfaces, const glm::ivec3& v,
              const glm::ivec3& axis, const VoxelPair& pair, const SideColumns& columns, double emissionUnit,
              std::span<SideSums, 2> sides) {
  const std::int64_t share = pair.share;
  const PlacesIn places(t, v);
  const glm::ivec3 n = normalOf(t), place = places.nearest(glm::ivec3(0)), albedo = surfaces.albedo(t.surface);
  const int cosine = cosineOf(t, axis);
  const std::size_t side = sideOf(cosine);
  SideSums &s = sides[side], &other = sides[1 - side];
  const std::int64_t weight = std::max<std::int64_t>(share * std::abs(cosine) / (127 * 127), 1);
  const std::int64_t visible = columns.seenOf(weight, t, side);
  s.weight += weight;
  s.visible += visible;
  s.area += share;
  if (pair.touches == 0) ++s.within;
  // Where two walls meet one hides nothing of the other; of a lamp's small triangles half are behind others.
  constexpr std::int64_t kWall = 4 * kVoxelSteps * kVoxelSteps;  // an eighth of a voxel's face
  const std::int64_t seen = share >= kWall ? share : weight;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    s.normal[i] += weight * n[k];
    s.position[i] += weight * place[k];
    s.albedo[i] += visible * albedo[k];
  }
  // What stands across is seen from both sides.
  const bool isAcross = 8 * std::abs(cosine) < 127 * 127;
  (isAcross ? s.across : s.facing) += share;
  if (isAcross) other.across += share;
  if (const SurfaceEmission* const emits = surfaces.emission(t.surface)) {
    addEmission(s, *emits, n, seen, emissionUnit);
    if (isAcross) addEmission(other, *emits, n, seen, emissionUnit);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::ivec3 wanted = subCentre(i), off = places.nearest(wanted) - wanted;
    s.nearest[i] = std::min(s.nearest[i],
                            std::int64_t{off.x * off.x + off.y * off.y + off.z * off.z} << 32 | std::int64_t{triangle});
  }
  const std::int64_t along = place.x * axis.x + place.y * axis.y + place.z * axis.z;
  s.outermost = std::max(s.outermost, along);
  s.innermost = std::min(s.innermost, along);
}

// The places at which direct light is found.
std::array<SubPlace, 4> subPlacesOf(std::span<const SnappedTriangle> triangles, const glm::ivec3& voxel,
                                    const SideSums& sums) {
  std::array<SubPlace, 4> places;
  for (std::size_t i = 0; i < 4; ++i) {
    const SnappedTriangle& t = triangles[static_cast<std::size_t>(sums.nearest[i] & 0xFFFFFFFF)];
    const glm::ivec3 n = normalOf(t), corner = cornerIn(t, voxel);
    places[i] = {PlacesIn(t, voxel).nearest(subCentre(i)), n, n.x * corner.x + n.y * corner.y + n.z * corner.z};
  }
  return places;
}

// The sums as numbers. `own`: of triangles that face this side, `other`: of those that face the opposite one. emission:
// what it emits. [W/m²/sr]
VoxelSide finish(const glm::vec3& axis, const SideSums& own, const SideSums& other, bool front, double emissionUnit,
                 glm::vec3& emission) {
  const bool isBack = own.weight == 0;
  const SideSums& s = isBack ? other : own;
  const double weight = static_cast<double>(s.weight);
  const glm::dvec3 outward = (front ? 1.0 : -1.0) * glm::dvec3(axis);
  const glm::dvec3 sum = toDouble(s.normal);
  const double length = glm::length(sum);
  const glm::vec3 normal = length > 0.0 ? glm::vec3((isBack ? -1.0 : 1.0) * sum / length) : glm::vec3(outward);
  const glm::vec3 albedo(toDouble(s.albedo) / (static_cast<double>(s.visible) * kAlbedoSteps));
  // Emitters lie before other surfaces or beside them, so their flux is kept: spread over a plane through the voxel. In
  // a corner walls hide all that is not theirs, be they ever so small. Shares of area are counted in sixteenths of a
  // voxel: a quarter too much here is missing next door.
  const auto emitting = static_cast<double>(isBack ? s.backEmitting : s.emitting);
  if (emitting > 0.0) {
    const double plane =
        32.0 * kVoxelSteps * kVoxelSteps / std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)});
    const double walls = s.across > 0 ? std::min(static_cast<double>(s.facing + s.across), plane) : plane;
    // What lies on the face of a voxel has its area in the next one, and may be met here first.
    const double all = s.within > 0 ? std::max(0.8 * emitting, walls) : emitting;
    emission = glm::vec3(toDouble(isBack ? s.backEmission : s.emission) * (emissionUnit / all));
  }
  // From the mean out to the outermost place, and a little farther: places are rounded.
  glm::dvec3 place = toDouble(s.position) / weight;
  const double reach = static_cast<double>(front ? s.outermost : -s.innermost) / 127.0;
  place += outward * (std::max(reach - glm::dot(place, outward), 0.0));
  place += glm::dvec3(normal) * (kVoxelSteps / 16.0);
  return {glm::vec3(place / double{kVoxelSteps}), normal, albedo, !isBack};
}

float areaOf(const VolumeGrid& grid, const SideSums& sums) {  // [m²]
  const double step = double{grid.voxel} / kVoxelSteps;
  return static_cast<float>(static_cast<double>(sums.area) / 32.0 * step * step);
}

// Number the occupied voxels of a layer's bits; none has sides as yet.
void number(VoxelLayer& layer) {
  layer.occupied = numberBits(layer.bits, layer.first);
  layer.kept = 0;
  layer.axis.clear();
  layer.sides = PackedSides();
  layer.emission.clear();
  layer.emitters.clear();
}

// VoxelLayer::emitters, from what emits.
void markEmitters(VoxelLayer& layer) {
  layer.emitters.assign(layer.emission.empty() ? 0 : layer.kept, 0);
  for (const SideEmission& each : layer.emission) {
    std::uint8_t& bits = layer.emitters[each.side / 2];
    bits = static_cast<std::uint8_t>(bits | (~each.litFaces & kDarkFaces) |
                                     (each.side % 2 == 0 ? kFrontEmits : kBackEmits));
  }
}

void makeRoom(VoxelLayer& layer, std::uint32_t kept) {
  layer.kept = kept;
  layer.axis.resize(kept);
}

}  // namespace

void addBits(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, const ParallelFor& parallelFor,
             std::vector<std::uint64_t>& bits) {
  forChunks(parallelFor, static_cast<std::uint32_t>(triangles.size()), kTriangles,
            [&](std::uint32_t begin, std::uint32_t end) {
              for (std::uint32_t t = begin; t < end; ++t) {
                TriangleOverlap(triangles[t]).visit(grid, [&](const glm::ivec3& v) {
                  const std::uint64_t bit = std::uint64_t{1} << brickBit(v);
                  std::atomic_ref<std::uint64_t> brick(bits[grid.cellOf(v)]);
                  if ((brick.load(std::memory_order_relaxed) & bit) == 0)
                    brick.fetch_or(bit, std::memory_order_relaxed);
                });
              }
            });
}

void voxelise(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, const ParallelFor& parallelFor,
              VoxelLayer& layer) {
  layer.bits.assign(grid.cellCount(), 0);
  addBits(grid, triangles, parallelFor, layer.bits);
  number(layer);
  layer.subVoxels = findSubVoxels(grid, triangles, parallelFor);
}

VoxelLayer moveLayer(const VoxelLayer& layer, const VolumeGrid& to, const glm::ivec3& by) {
  VoxelLayer moved;
  moved.bits = movedBits(layer.bits, to, by);
  number(moved);
  moved.subVoxels = layer.subVoxels.moved(to, by);
  makeRoom(moved, moved.occupied);
  moved.sides = PackedSides(to.voxel * to.voxel);
  for (std::uint32_t c = 0; c < moved.bits.size(); ++c) {
    const auto count = static_cast<std::ptrdiff_t>(std::popcount(moved.bits[c]));
    if (count == 0) {
      moved.sides.addCell({});
      continue;
    }
    const std::uint32_t from = to.cellIndex(to.cellAt(c) + by);
    std::copy_n(layer.axis.begin() + layer.first[from], count, moved.axis.begin() + moved.first[c]);
    moved.sides.copyCell(layer.sides, from);
  }
  moved.sides.shrinkToFit();
  for (const SideEmission& each : layer.emission) {
    const glm::ivec3 voxel = VoxelCursor(layer, to, each.side / 2).voxel() - kBrickSide * by;
    if (to.holds(voxel))
      moved.emission.push_back({2 * moved.numberOf(to, voxel) + each.side % 2, each.emission, each.litFaces});
  }
  markEmitters(moved);
  return moved;
}

void fillSides(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, const SummedSurfaces& surfaces,
               std::uint32_t budget, const ParallelFor& parallelFor, VoxelLayer& layer) {
  makeRoom(layer, std::min(layer.occupied, budget));
  const float brightest = surfaces.brightest();
  const double emissionUnit = brightest > 0.0f ? double{brightest} / kEmissionSteps : 1.0;

  std::vector<glm::u8vec3> voxel(layer.kept);  // grids have up to 256 voxels along a side
  for (std::uint32_t c = 0; c < layer.bits.size(); ++c) {
    std::uint32_t number = layer.first[c];
    for (std::uint64_t rest = layer.bits[c]; rest != 0 && number < layer.kept; rest &= rest - 1, ++number)
      voxel[number] = glm::u8vec3(kBrickSide * grid.cellAt(c) + voxelOfBit(std::countr_zero(rest)));
  }

  std::vector<glm::vec3> axes(layer.kept);
  std::vector<SideSums> sums(2 * std::size_t{layer.kept});
  const auto sumVoxel = [&](std::uint32_t number, std::span<const VoxelPair> found) {
    // 1. The axis: the moment's column with the largest diagonal element
    Moment moment{};
    for (const VoxelPair& pair : found) addMoment(triangles[pair.triangle], pair.share, moment);
    axes[number] = glm::vec3(axisOf(moment));
    const glm::ivec3 axis = signedBytes(axes[number]), at(voxel[number]);
    layer.axis[number] = glm::i8vec3(axis);
    // 2. What is outermost on each side
    SideColumns columns(at, axis);
    for (const VoxelPair& pair : found) {
      const SnappedTriangle& t = triangles[pair.triangle];
      columns.add(t, sideOf(cosineOf(t, axis)));
    }
    // 3. What faces each side
    const std::span<SideSums, 2> sides(&sums[2 * std::size_t{number}], 2);
    for (const VoxelPair& pair : found)
      addSides(triangles[pair.triangle], pair.triangle, surfaces, at, axis, pair, columns, emissionUnit, sides);
  };
  const std::size_t batches = triangles.size() / kBatch + 1;
  const auto each = static_cast<std::uint32_t>(layer.kept / batches + 1);  // voxels of a batch
  for (std::uint32_t first = 0; first < layer.kept; first += each) {
    const std::uint32_t count = std::min(each, layer.kept - first);
    const VoxelPairs pairs = findPairs(grid, triangles, first, first + count, parallelFor, layer);
    forChunks(parallelFor, count, kVoxels, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t number = first + begin; number < first + end; ++number) sumVoxel(number, pairs.of(number));
    });
  }

  // 4. Means
  std::vector<glm::vec3> emission(brightest > 0.0f ? sums.size() : 0, glm::vec3(0.0f));
  const auto cells = static_cast<std::uint32_t>(layer.bits.size());
  const PackedSides none(grid.voxel * grid.voxel);
  std::vector<PackedSides> pieces((cells + kCells - 1) / kCells, none);
  forChunks(parallelFor, static_cast<std::uint32_t>(pieces.size()), 1, [&](std::uint32_t begin, std::uint32_t end) {
    std::vector<MadeSides> made;
    for (std::uint32_t c = begin * kCells; c < std::min(end * kCells, cells); ++c) {
      made.resize(layer.keptOf(c));
      for (std::uint32_t i = 0; i < made.size(); ++i) {
        const std::uint32_t number = layer.first[c] + i;
        const SideSums* const of = &sums[2 * std::size_t{number}];
        for (std::size_t s = 0; s < 2; ++s) {
          glm::vec3 emits(0.0f);
          made[i].side[s] = finish(axes[number], of[s], of[1 - s], s == 0, emissionUnit, emits);
          if (!emission.empty()) emission[2 * std::size_t{number} + s] = emits;
          if (!made[i].side[s].isFaced) continue;
          made[i].area[s] = areaOf(grid, of[s]);
          made[i].places[s] = subPlacesOf(triangles, glm::ivec3(voxel[number]), of[s]);
        }
      }
      pieces[c / kCells].addCell(made);
    }
  });
  layer.sides = none;
  for (const PackedSides& piece : pieces) layer.sides.append(piece);
  layer.sides.shrinkToFit();
  for (std::uint32_t s = 0; s < emission.size(); ++s) {
    if (emission[s] == glm::vec3(0.0f)) continue;
    const unsigned lit = sums[s].litFaces | sums[s ^ 1u].litFaces;
    layer.emission.push_back({s, emission[s], static_cast<std::uint8_t>(lit)});
  }
  markEmitters(layer);
}

bool patchSides(const VolumeGrid& grid, std::span<const std::uint64_t> dirty,
                std::span<const SnappedTriangle> triangles, const SummedSurfaces& surfaces, std::uint32_t budget,
                const ParallelFor& parallelFor, VoxelLayer& layer) {
  VoxelLayer patch, made;
  patch.bits.assign(grid.cellCount(), 0);
  addBits(grid, triangles, parallelFor, patch.bits);
  made.bits.resize(grid.cellCount());
  for (std::size_t c = 0; c < made.bits.size(); ++c) {
    patch.bits[c] &= dirty[c];
    made.bits[c] = (layer.bits[c] & ~dirty[c]) | patch.bits[c];
  }
  number(patch);
  number(made);
  if (std::max(layer.occupied, made.occupied) > budget) return false;
  fillSides(grid, triangles, surfaces, budget, parallelFor, patch);
  made.subVoxels = layer.subVoxels.patched(dirty, findSubVoxels(grid, triangles, parallelFor));
  makeRoom(made, made.occupied);
  made.sides = PackedSides(grid.voxel * grid.voxel);
  std::vector<PackedSides::Source> sources;
  for (std::uint32_t c = 0; c < made.bits.size(); ++c) {
    if (made.bits[c] == 0) {
      made.sides.addCell({});
      continue;
    }
    std::uint32_t to = made.first[c];
    if (dirty[c] == 0) {
      std::copy_n(layer.axis.begin() + layer.first[c], std::popcount(made.bits[c]), made.axis.begin() + to);
      made.sides.copyCell(layer.sides, c);
      continue;
    }
    sources.clear();
    for (std::uint64_t rest = made.bits[c]; rest != 0; rest &= rest - 1, ++to) {
      const glm::ivec3 voxel = voxelOfBit(std::countr_zero(rest));
      const VoxelLayer& from = (dirty[c] & rest & (~rest + 1)) != 0 ? patch : layer;
      const std::uint32_t before = countBefore(from.bits[c], voxel);
      made.axis[to] = from.axis[from.first[c] + before];
      sources.push_back({&from.sides, c, before, from.keptOf(c)});
    }
    made.sides.mergeCell(sources);
  }
  made.sides.shrinkToFit();
  const auto keepEmission = [&](const VoxelLayer& from, bool isDirty) {
    for (const SideEmission& each : from.emission) {
      const glm::ivec3 voxel = VoxelCursor(from, grid, each.side / 2).voxel();
      if (((dirty[grid.cellOf(voxel)] >> brickBit(voxel) & 1u) != 0) == isDirty)
        made.emission.push_back({2 * made.numberOf(grid, voxel) + each.side % 2, each.emission, each.litFaces});
    }
  };
  keepEmission(layer, false);
  keepEmission(patch, true);
  std::sort(made.emission.begin(), made.emission.end(),
            [](const SideEmission& a, const SideEmission& b) { return a.side < b.side; });
  markEmitters(made);
  layer = std::move(made);
  return true;
}

}  // namespace relume
