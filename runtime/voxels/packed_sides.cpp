// SPDX-License-Identifier: MIT
// See packed_sides.h.
#include "runtime/voxels/packed_sides.h"

#include "formats/octahedron.h"

#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

namespace relume {
namespace {

constexpr std::uint32_t kSecondsBits = 8;
constexpr std::uint32_t kPlaceBits = 10, kNormalBits = 11, kAlbedoBits = 12;
// Of a voxel: two places, a surface, and which sides are faced.
constexpr std::uint32_t kSurface = 6 * kPlaceBits, kSurfaceBits = 2 * kNormalBits + 3 * kAlbedoBits,
                        kFaced = kSurface + kSurfaceBits, kVoxelBits = kFaced + 2;
static_assert(kVoxelBits == 120);
enum class Faced : std::uint8_t { both, front, back };

constexpr float kPlaceSteps = 256.0f, kAlbedoRange = 4095.0f;
constexpr float kNormalRange = static_cast<float>((1u << (kNormalBits - 1)) - 1);

// Areas in faces of a voxel: a float's upper bits, from 2^-18 on.
constexpr std::uint32_t kAreaBits = 14, kAreaShift = 14, kLeastPackedArea = (127u - 18u) << (23 - kAreaShift);
// Places of light: a normal along an axis, or any; a plane by where it crosses the axis, or by its product.
constexpr int kAxialLength = 127;
constexpr std::uint32_t kAxialBits = 3, kAnyBits = 8, kAxialPlaneBits = 7, kPlaneBits = 14, kStepBits = 7;

float rounded(float v, float low, float high) { return glm::clamp(glm::floor(v + 0.5f), low, high); }
std::uint32_t inBits(int v, std::uint32_t width) { return static_cast<std::uint32_t>(v) & ((1u << width) - 1); }
int fromBits(std::uint64_t v, std::uint32_t width) {
  return static_cast<int>(static_cast<std::uint32_t>(v) << (32 - width)) >> (32 - width);
}
// To the nearest integer that there is room for.
std::uint32_t toSigned(float v, std::uint32_t width) {
  const auto most = static_cast<float>((1 << (width - 1)) - 1);
  return inBits(static_cast<int>(rounded(v, -most, most)), width);
}

void addPlace(const glm::vec3& place, PackedBits& to) {
  for (int k = 0; k < 3; ++k) to.add(toSigned(place[k] * kPlaceSteps, kPlaceBits), kPlaceBits);
}
glm::vec3 placeOfBits(std::uint64_t bits) {
  return glm::vec3(fromBits(bits, kPlaceBits), fromBits(bits >> kPlaceBits, kPlaceBits),
                   fromBits(bits >> 2 * kPlaceBits, kPlaceBits)) /
         kPlaceSteps;
}

void addSurface(const VoxelSide& side, PackedBits& to) {
  const glm::vec2 direction = toOctahedron(side.normal);
  for (int k = 0; k < 2; ++k) to.add(toSigned(direction[k] * kNormalRange, kNormalBits), kNormalBits);
  for (int k = 0; k < 3; ++k)
    to.add(static_cast<std::uint32_t>(rounded(side.albedo[k] * kAlbedoRange, 0.0f, kAlbedoRange)), kAlbedoBits);
}
void readSurface(const PackedBits& bits, std::size_t at, VoxelSide& side) {
  const std::uint64_t normal = bits.at(at, 2 * kNormalBits), albedo = bits.at(at + 2 * kNormalBits, 3 * kAlbedoBits);
  side.normal = fromOctahedron(glm::vec2(fromBits(normal, kNormalBits), fromBits(normal >> kNormalBits, kNormalBits)) /
                               kNormalRange);
  constexpr std::uint64_t kMask = (1u << kAlbedoBits) - 1;
  side.albedo = glm::vec3(static_cast<float>(albedo & kMask), static_cast<float>(albedo >> kAlbedoBits & kMask),
                          static_cast<float>(albedo >> 2 * kAlbedoBits)) /
                kAlbedoRange;
}

// Whether it is 127 along an axis.
bool isAxial(const glm::ivec3& normal) {
  return (normal.x == 0 ? 1 : 0) + (normal.y == 0 ? 1 : 0) + (normal.z == 0 ? 1 : 0) == 2 &&
         std::abs(normal.x + normal.y + normal.z) == kAxialLength;
}

void addNormal(const glm::ivec3& normal, PackedBits& to) {
  const bool axial = isAxial(normal);
  to.add(axial ? 1 : 0, 1);
  if (axial) {
    const int axis = normal.x != 0 ? 0 : normal.y != 0 ? 1 : 2;
    to.add(static_cast<std::uint32_t>(2 * axis + (normal[axis] < 0 ? 1 : 0)), kAxialBits);
    return;
  }
  for (int k = 0; k < 3; ++k) to.add(inBits(normal[k], kAnyBits), kAnyBits);
}
glm::ivec3 readNormal(PackedBitsReader& from) {
  glm::ivec3 normal(0);
  if (from.next(1) != 0) {
    const auto way = static_cast<int>(from.next(kAxialBits));
    normal[way / 2] = way % 2 != 0 ? -kAxialLength : kAxialLength;
    return normal;
  }
  for (int k = 0; k < 3; ++k) normal[k] = fromBits(from.next(kAnyBits), kAnyBits);
  return normal;
}

bool fits(const SubPlace& place) {
  const std::int64_t plane = isAxial(place.normal) ? place.plane / kAxialLength : place.plane;
  return std::abs(plane) < 1 << ((isAxial(place.normal) ? kAxialPlaneBits : kPlaneBits) - 1);
}
void addPlane(const SubPlace& place, PackedBits& to) {
  const auto plane = static_cast<int>(place.plane);
  if (isAxial(place.normal)) {
    to.add(inBits(plane / kAxialLength, kAxialPlaneBits), kAxialPlaneBits);
  } else {
    to.add(inBits(plane, kPlaneBits), kPlaneBits);
  }
}
int readPlane(const glm::ivec3& normal, PackedBitsReader& from) {
  return isAxial(normal) ? kAxialLength * fromBits(from.next(kAxialPlaneBits), kAxialPlaneBits)
                         : fromBits(from.next(kPlaneBits), kPlaneBits);
}

bool isOn(const SubPlace& place, std::size_t i, std::int64_t plane) {
  return subPlaceOn(i, place.normal, static_cast<int>(plane)) == place.place;
}

// Whose plane tells of place `i`, and of most of those after it with its normal; null where none does.
const SubPlace* planeFor(const std::array<SubPlace, 4>& places, std::size_t i) {
  const SubPlace* best = nullptr;
  std::size_t most = 0;
  for (std::size_t j = i; j < 4 && places[j].normal == places[i].normal; ++j) {
    if (!fits(places[j]) || !isOn(places[i], i, places[j].plane)) continue;
    std::size_t last = i + 1;
    while (last < 4 && places[last].normal == places[i].normal && isOn(places[last], last, places[j].plane)) ++last;
    if (last - i <= most) continue;
    most = last - i;
    best = &places[j];
    if (last == 4) break;
  }
  return best;
}

// Of each place: whether its normal is that of the one before, or else that; whether it lies on the plane of those
// before, or else that plane, or the place itself.
void addPlaces(const std::array<SubPlace, 4>& places, PackedBits& to) {
  const SubPlace* plane = nullptr;
  for (std::size_t i = 0; i < 4; ++i) {
    const SubPlace& own = places[i];
    const bool isSame = i > 0 && own.normal == places[i - 1].normal;
    if (i > 0) to.add(isSame ? 1 : 0, 1);
    if (!isSame) {
      addNormal(own.normal, to);
      plane = nullptr;
    }
    if (plane != nullptr) {
      const bool on = isOn(own, i, plane->plane);
      to.add(on ? 1 : 0, 1);
      if (on) continue;
    }
    const SubPlace* const found = planeFor(places, i);
    to.add(found != nullptr ? 1 : 0, 1);
    if (found != nullptr) {
      plane = found;
      addPlane(*plane, to);
    } else {
      for (int k = 0; k < 3; ++k) to.add(inBits(own.place[k], kStepBits), kStepBits);
    }
  }
}

SideSamples readPlaces(PackedBitsReader& from) {
  SideSamples samples;
  std::array<std::uint32_t, 4> counts{};
  std::size_t used = 0;
  glm::ivec3 normal(0);
  int plane = 0;
  bool hasPlane = false;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == 0 || from.next(1) == 0) {
      normal = readNormal(from);
      hasPlane = false;
    }
    glm::ivec3 place;
    if (hasPlane && from.next(1) != 0) {
      place = subPlaceOn(i, normal, plane);
    } else if (from.next(1) != 0) {
      hasPlane = true;
      plane = readPlane(normal, from);
      place = subPlaceOn(i, normal, plane);
    } else {
      for (int k = 0; k < 3; ++k) place[k] = fromBits(from.next(kStepBits), kStepBits);
    }
    std::size_t same = 0;
    while (same < used && !(samples[same].place() == place && samples[same].normal() == normal)) ++same;
    samples[same] = SideSample(place, normal, ++counts[same]);
    used = std::max(used, same + 1);
  }
  return samples;
}

// What has an area keeps some.
std::uint32_t packArea(float faces) {
  const std::uint32_t bits = (std::bit_cast<std::uint32_t>(faces) + (1u << (kAreaShift - 1))) >> kAreaShift;
  return std::clamp(bits, kLeastPackedArea, kLeastPackedArea + (1u << kAreaBits) - 1) - kLeastPackedArea;
}
float unpackArea(std::uint64_t bits) {
  return std::bit_cast<float>((static_cast<std::uint32_t>(bits) + kLeastPackedArea) << kAreaShift);
}

Faced facedOf(const std::array<VoxelSide, 2>& side) {
  return side[0].isFaced && side[1].isFaced ? Faced::both : side[1].isFaced ? Faced::back : Faced::front;
}
Faced facedAt(const PackedBits& bits, std::size_t voxel) { return static_cast<Faced>(bits.at(voxel + kFaced, 2)); }

void copyBits(const PackedBits& from, std::size_t begin, std::size_t end, PackedBits& to) {
  while (begin < end) {
    const auto width = static_cast<std::uint32_t>(std::min<std::size_t>(PackedBits::kWidest, end - begin));
    to.add(from.at(begin, width), width);
    begin += width;
  }
}

}  // namespace

void PackedSides::addCell(std::span<const MadeSides> voxels) {
  bits_.alignToByte();
  firstByte_.push_back(static_cast<std::uint32_t>(bits_.size() / 8));
  if (voxels.empty()) return;
  const auto hasTwo = [](const MadeSides& made) { return made.side[0].isFaced && made.side[1].isFaced; };
  bits_.add(static_cast<std::uint64_t>(std::count_if(voxels.begin(), voxels.end(), hasTwo)), kSecondsBits);
  for (const MadeSides& made : voxels) {
    for (const VoxelSide& side : made.side) addPlace(side.place, bits_);
    const Faced faced = facedOf(made.side);
    addSurface(made.side[faced == Faced::back ? 1 : 0], bits_);
    bits_.add(static_cast<std::uint64_t>(faced), 2);
  }
  for (const MadeSides& made : voxels) {
    if (hasTwo(made)) addSurface(made.side[1], bits_);
  }
  for (const MadeSides& made : voxels) {
    for (std::size_t s = 0; s < 2; ++s) {
      if (!made.side[s].isFaced) continue;
      bits_.add(packArea(made.area[s] / face_), kAreaBits);
      addPlaces(made.places[s], bits_);
    }
  }
}

void PackedSides::append(const PackedSides& other) {
  bits_.alignToByte();
  const auto begin = static_cast<std::uint32_t>(bits_.size() / 8);
  for (const std::uint32_t first : other.firstByte_) firstByte_.push_back(begin + first);
  bits_.addBytes(other.bits_, 0, other.bits_.size());
}

void PackedSides::copyCell(const PackedSides& from, std::size_t cell) {
  bits_.alignToByte();
  firstByte_.push_back(static_cast<std::uint32_t>(bits_.size() / 8));
  bits_.addBytes(from.bits_, from.blockOf(cell), from.endOf(cell));
}

void PackedSides::mergeCell(std::span<const Source> voxels) {
  bits_.alignToByte();
  firstByte_.push_back(static_cast<std::uint32_t>(bits_.size() / 8));
  if (voxels.empty()) return;
  const auto hasTwo = [](const Source& v) {
    return facedAt(v.from->bits_, v.from->blockOf(v.cell) + kSecondsBits + std::size_t{kVoxelBits} * v.voxel) ==
           Faced::both;
  };
  bits_.add(static_cast<std::uint64_t>(std::count_if(voxels.begin(), voxels.end(), hasTwo)), kSecondsBits);
  for (const Source& v : voxels) {
    const std::size_t at = v.from->blockOf(v.cell) + kSecondsBits + std::size_t{kVoxelBits} * v.voxel;
    copyBits(v.from->bits_, at, at + kVoxelBits, bits_);
  }
  for (const Source& v : voxels) {
    if (!hasTwo(v)) continue;
    CellSides sides(*v.from, v.cell, v.voxels);
    sides.skip(v.voxel);
    copyBits(v.from->bits_, sides.second(), sides.second() + kSurfaceBits, bits_);
  }
  // Those of one source come in their order
  struct Walk {
    const PackedSides* from;
    CellSurfaces surfaces;
    std::uint32_t voxel = 0;
  };
  std::vector<Walk> walks;
  for (const Source& v : voxels) {
    auto walk = std::find_if(walks.begin(), walks.end(), [&](const Walk& w) { return w.from == v.from; });
    if (walk == walks.end()) walk = walks.insert(walk, {v.from, CellSurfaces(*v.from, v.cell, v.voxels)});
    for (; walk->voxel < v.voxel; ++walk->voxel) static_cast<void>(walk->surfaces.next());
    const std::size_t begin = walk->surfaces.place();
    static_cast<void>(walk->surfaces.next());
    ++walk->voxel;
    copyBits(v.from->bits_, begin, walk->surfaces.place(), bits_);
  }
}

void PackedSides::shrinkToFit() {
  firstByte_.shrink_to_fit();
  bits_.shrinkToFit();
}

CellSides::CellSides(const PackedSides& sides, std::size_t cell, std::uint32_t voxels)
    : bits_(&sides.bits_),
      first_(sides.blockOf(cell) + kSecondsBits),
      second_(first_ + std::size_t{kVoxelBits} * voxels) {}

void CellSides::skip(std::uint32_t voxels) {
  for (; voxels > 0; --voxels, first_ += kVoxelBits)
    second_ += facedAt(*bits_, first_) == Faced::both ? kSurfaceBits : 0;
}

std::array<VoxelSide, 2> CellSides::next() {
  std::array<VoxelSide, 2> side;
  side[0].place = placeOfBits(bits_->at(first_, 3 * kPlaceBits));
  side[1].place = placeOfBits(bits_->at(first_ + 3 * kPlaceBits, 3 * kPlaceBits));
  const Faced faced = facedAt(*bits_, first_);
  VoxelSide &one = side[faced == Faced::back ? 1 : 0], &other = side[faced == Faced::back ? 0 : 1];
  readSurface(*bits_, first_ + kSurface, one);
  one.isFaced = true;
  if (faced == Faced::both) {
    readSurface(*bits_, second_, other);
    second_ += kSurfaceBits;
    other.isFaced = true;
  } else {
    other.normal = -one.normal;
    other.albedo = one.albedo;
  }
  first_ += kVoxelBits;
  return side;
}

bool CellSides::isFaced(const PackedSides& sides, std::size_t cell, std::uint32_t voxel, std::uint32_t side) {
  const Faced faced = facedAt(sides.bits_, sides.blockOf(cell) + kSecondsBits + std::size_t{kVoxelBits} * voxel);
  return faced == Faced::both || (faced == Faced::back) == (side == 1);
}

CellSurfaces::CellSurfaces(const PackedSides& sides, std::size_t cell, std::uint32_t voxels)
    : bits_(&sides.bits_),
      first_(sides.blockOf(cell) + kSecondsBits),
      from_(sides.bits_, first_ + std::size_t{kVoxelBits} * voxels +
                             kSurfaceBits * sides.bits_.at(sides.blockOf(cell), kSecondsBits)),
      face_(sides.face_) {}

std::array<SideSurface, 2> CellSurfaces::next() {
  const Faced faced = facedAt(*bits_, first_);
  first_ += kVoxelBits;
  std::array<SideSurface, 2> surface;
  for (std::size_t s = 0; s < 2; ++s) {
    if (faced != Faced::both && (faced == Faced::back) != (s == 1)) continue;
    surface[s].area = face_ * unpackArea(from_.next(kAreaBits));
    surface[s].samples = readPlaces(from_);
  }
  if (faced == Faced::both) return surface;
  // The backs of the same
  SideSamples& backs = surface[faced == Faced::back ? 0 : 1].samples;
  for (std::size_t i = 0; i < 4; ++i) {
    const SideSample& own = surface[faced == Faced::back ? 1 : 0].samples[i];
    backs[i] = SideSample(own.place(), -own.normal(), own.count());
  }
  return surface;
}

}  // namespace relume
