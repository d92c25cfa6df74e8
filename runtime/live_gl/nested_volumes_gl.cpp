// SPDX-License-Identifier: MIT
// See nested_volumes_gl.h.
#include "runtime/live_gl/nested_volumes_gl.h"

#include "runtime/gl/errors.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/live/cell_texels.h"

#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace relume::gl {
namespace {

std::uint32_t rowsOf(std::size_t items, std::uint32_t aRow) {
  return static_cast<std::uint32_t>((items + aRow - 1) / aRow);
}

std::uint32_t subVoxelsOf(const VoxelVolume& volume) {
  return static_cast<std::uint32_t>(volume.standing().subVoxels.of.size() + volume.moving().subVoxels.of.size());
}

}  // namespace

// What a volume changes to; cells: nothing where it stays.
struct NestedVolumesGl::Next {
  std::optional<CellSet> cells;
  std::uint32_t caches = 0, voxels = 0, subVoxels = 0;
};

NestedVolumesGl::NestedVolumesGl(const Functions& gl)
    : gl_(gl),
      cells_(gl),
      standing_(gl),
      moving_(gl),
      subVoxelTexels_(gl, kWords, RELUME_LIVE_SUB_VOXELS_A_ROW),
      light_(gl, kFloats, kTexelsOfCache * RELUME_LIVE_CACHES_A_ROW),
      otherLight_(gl, kFloats, kTexelsOfCache * RELUME_LIVE_CACHES_A_ROW),
      cacheVoxels_(gl),
      rayCells_(gl),
      subVoxels_(gl),
      carried_(gl) {
  volumes_.push_back(std::make_unique<FollowedVolume>(gl));
}

Status NestedVolumesGl::compile(const std::string& visibilityGlsl) {
  if (Status ok = volumes_.front()->sides.compile(visibilityGlsl); !ok) return ok;
  for (const auto& [program, path] :
       {std::pair(&stencilProgram_, "live_stencils.comp"), std::pair(&carryProgram_, "live_carry.comp")}) {
    Result<Program> made = makeComputeProgram(gl_, path, {});
    if (!made) return made.error();
    *program = std::move(*made);
  }
  return done();
}

Status NestedVolumesGl::checkSize(std::span<const VoxelVolume> volumes) const {
  std::size_t sides = 0, subVoxels = 0;
  int side = 0;
  for (const VoxelVolume& volume : volumes) {
    if (Status ok = volumes_.front()->sides.checkSize(volume); !ok) return ok;
    const glm::ivec3& cells = volume.grid().cells;
    side = std::max({side, cells.x, cells.y, static_cast<int>(volumes.size()) * cells.z});
    sides += volume.sideCount() + volume.sideCount() / 4;
    subVoxels += subVoxelsOf(volume) + subVoxelsOf(volume) / 4;
  }
  const GpuDevice device = deviceOf(gl_, gpu::GroupThreads::parallel);
  if (static_cast<std::uint32_t>(side) > device.volumeSide || device.imageSide < 2 * RELUME_LIVE_SUB_VOXELS_A_ROW ||
      rowsOf(subVoxels, RELUME_LIVE_SUB_VOXELS_A_ROW) >= device.imageSide ||
      (volumes.size() > 1 && LitSides::rowsOfSides(sides) >= device.imageSide))
    return Error{ErrorCode::unsupported, "live light: this OpenGL's textures are too small for " +
                                             std::to_string(side) + " cells along a side, " + std::to_string(sides) +
                                             " sides of voxels and " + std::to_string(subVoxels) +
                                             " voxels with sub-voxels; use fewer cells or fewer volumes"};
  return done();
}

// Where all go. They stay where they are unless one of them no longer fits.
std::vector<SharedPlaces> NestedVolumesGl::placesOf(std::span<const VoxelVolume> volumes,
                                                    const std::vector<Next>& next) const {
  const bool hasSky = volumes.front().grid().roams;
  std::vector<SharedPlaces> places(volumes.size());
  bool stay = size() == volumes.size() && hasSky == hasSky_;
  for (std::size_t l = 0; stay && l < places.size(); ++l) {
    places[l] = volumes_[l]->at;
    stay = volumes_[l]->cells.grid.cells == volumes[l].grid().cells && next[l].caches <= places[l].caches &&
           next[l].voxels <= places[l].voxels && next[l].subVoxels <= places[l].subVoxels;
  }
  if (stay) return places;
  // One alone has what room the textures have beyond it.
  const auto room = [&](std::uint32_t count, std::uint32_t aRow) {
    return aRow * rowsOf(volumes.size() > 1 ? std::size_t{count} + count / 4 : count, aRow);
  };
  SharedPlaces at;
  at.firstCache = hasSky ? RELUME_LIVE_CACHES_A_ROW : 0;
  for (std::size_t l = 0; l < places.size(); ++l) {
    at.caches = room(next[l].caches, RELUME_LIVE_CACHES_A_ROW);
    at.voxels = room(next[l].voxels, RELUME_LIVE_SIDES_A_ROW);
    at.subVoxels = room(next[l].subVoxels, RELUME_LIVE_SUB_VOXELS_A_ROW);
    places[l] = at;
    at.firstCache += at.caches;
    at.firstVoxel += at.voxels;
    at.firstSubVoxels += at.subVoxels;
    at.layer += volumes[l].grid().cells.z;
  }
  return places;
}

// [Size slots] The slot that each cache has now, as live_carry.comp reads it: its own, or that of the cache of the
// volume around it whose cell it lies in.
std::vector<std::uint32_t> NestedVolumesGl::slotsBefore(std::span<const VoxelVolume> volumes,
                                                        const std::vector<Next>& next,
                                                        const std::vector<SharedPlaces>& places) const {
  std::vector<std::uint32_t> from(std::size_t{places.back().firstCache} + next.back().caches, kInactive);
  if (volumes.front().grid().roams && hasSky_) from[0] = 0;
  const CellSet* around = nullptr;
  for (std::size_t l = 0; l < volumes.size(); ++l) {
    const CellSet* const before = l < size() ? &volumes_[l]->cells : nullptr;
    const CellSet& cells = next[l].cells ? *next[l].cells : *before;
    for (std::uint32_t i = 0; i < cells.active.size(); ++i) {
      std::uint32_t& slot = from[places[l].firstCache + i];
      const glm::ivec3 cell = cells.grid.cellAt(cells.active[i]);
      const std::uint32_t own = before != nullptr ? slotBefore(*before, cells, cell) : kInactive;
      if (own != kInactive) {
        slot = volumes_[l]->at.firstCache + own;
      } else if (around != nullptr) {
        const std::uint32_t outer = slotAround(*around, cells, cell);
        if (outer != kInactive) slot = from[places[l - 1].firstCache + outer];
      }
    }
    around = &cells;
  }
  return from;
}

// Caches that stand in other slots keep their light: into the other texture, which takes this one's place.
void NestedVolumesGl::carry(const std::vector<std::uint32_t>& from) {
  const std::uint32_t rows = rowsOf(from.size(), RELUME_LIVE_CACHES_A_ROW);
  carried_.reserve(4 * from.size());
  carried_.write(0, bytesOf(from));
  light_.reserve(1);
  otherLight_.reserve(rows);
  carried_.bind(RELUME_LIVE_SLOT_CARRY);
  light_.bind(RELUME_LIVE_UNIT_LIGHT);
  otherLight_.bindImage(0, GL_WRITE_ONLY);
  runThreads(gl_, carryProgram_, static_cast<std::uint32_t>(from.size()));
  std::swap(light_, otherLight_);
  otherLight_.reserve(rows);  // for the next time
}

// Cells, sub-voxels and caches of a volume, at its places; its sides.
void NestedVolumesGl::write(std::size_t level, const VoxelVolume& volume) {
  FollowedVolume& to = *volumes_[level];
  const CellSet& cells = to.cells;
  std::vector<glm::uvec4> texels = cellTexels(cells);
  for (glm::uvec4& texel : texels) {
    texel.z += to.at.firstSubVoxels;
    if (texel.w != kInactive) texel.w += 64 * to.at.firstCache;
  }
  cells_.writeLayers(cells.grid.cells, to.at.layer, texels.data());
  subVoxelTexels_.write(bytesOf(relume::subVoxelTexels(cells)), to.at.firstSubVoxels / RELUME_LIVE_SUB_VOXELS_A_ROW);
  std::vector<std::uint32_t> voxel(cells.active.size());
  for (std::uint32_t i = 0; i < voxel.size(); ++i) voxel[i] = packVoxel(cells.voxelOf(i));
  cacheVoxels_.write(4 * std::size_t{to.at.firstCache}, bytesOf(voxel));
  writeRayCells(to, volume);
  const auto writeLayer = [&](const VoxelLayer& layer, std::uint32_t first, CellTexture& texture) {
    for (std::size_t c = 0; c < texels.size(); ++c)
      texels[c] = glm::uvec4(wordsOf(layer.bits[c]), first + layer.first[c], 0);
    texture.writeLayers(cells.grid.cells, to.at.layer, texels.data());
  };
  writeLayer(volume.standing(), to.at.firstVoxel, standing_);
  if (to.moves) writeLayer(volume.moving(), to.at.firstVoxel + volume.standing().kept, moving_);
}

void NestedVolumesGl::writeRayCells(const FollowedVolume& to, const VoxelVolume& volume) {
  const SubVoxels &standing = volume.standing().subVoxels, &moving = volume.moving().subVoxels;
  const auto firstMoving = static_cast<std::uint32_t>(to.at.firstSubVoxels + standing.of.size());
  subVoxels_.write(8 * std::size_t{to.at.firstSubVoxels}, bytesOf(standing.of.ofVoxels()));
  subVoxels_.write(8 * std::size_t{firstMoving}, bytesOf(moving.of.ofVoxels()));
  const glm::uvec3 cells(volume.grid().cells), row(cells_.size());
  std::vector<RelumeRayCell> layer(std::size_t{row.x} * row.y);
  for (std::uint32_t z = 0; z < cells.z; ++z) {
    for (std::uint32_t y = 0; y < cells.y; ++y) {
      for (std::uint32_t x = 0; x < cells.x; ++x) {
        const std::uint32_t c = (z * cells.y + y) * cells.x + x;
        layer[y * row.x + x] = {wordsOf(standing.bits[c]), wordsOf(to.moves ? moving.bits[c] : 0),
                                to.at.firstSubVoxels + standing.first[c],
                                firstMoving + (to.moves ? moving.first[c] : 0)};
      }
    }
    rayCells_.write(sizeof(RelumeRayCell) * layer.size() * (static_cast<std::uint32_t>(to.at.layer) + z),
                    bytesOf(layer));
  }
}

void NestedVolumesGl::findStencils(const FollowedVolume& volume) {
  cells_.bind(RELUME_LIVE_UNIT_CELLS);
  subVoxelTexels_.bind(RELUME_LIVE_UNIT_SUB_VOXELS);
  volume.sides.bindSides();
  volume.stencils.bind(RELUME_LIVE_SLOT_STENCILS);
  setGrid(gl_, stencilProgram_.get(), volume.cells.grid, volume.cells.grid.voxel);
  setUniform(gl_, stencilProgram_, "relumeLiveLayer", volume.at.layer);
  runThreads(gl_, stencilProgram_, volume.sides.count());
}

Status NestedVolumesGl::follow(std::span<const VoxelVolume> volumes) {
  const auto isOf = [&](std::size_t l) { return l < size() && volumes_[l]->isOf(volumes[l]); };
  bool isSame = size() == volumes.size();
  for (std::size_t l = 0; isSame && l < volumes.size(); ++l) isSame = isOf(l);
  if (isSame) {
    takeReach(volumes);
    return done();
  }
  if (Status ok = checkSize(volumes); !ok) return ok;

  // 1. Cells, and where all goes
  std::vector<Next> next(volumes.size());
  glm::ivec3 all(1, 1, 0);
  for (std::size_t l = 0; l < volumes.size(); ++l) {
    const VolumeGrid& grid = volumes[l].grid();
    if (!isOf(l)) {
      const FollowedVolume* const before = l < size() ? volumes_[l].get() : nullptr;
      next[l].cells = before != nullptr ? findChangedCells(volumes[l], before->cells).cells : findCells(volumes[l]);
    }
    next[l].caches = static_cast<std::uint32_t>((isOf(l) ? volumes_[l]->cells : *next[l].cells).active.size());
    next[l].voxels = volumes[l].sideCount() / 2;
    next[l].subVoxels = subVoxelsOf(volumes[l]);
    all = {std::max(all.x, grid.cells.x), std::max(all.y, grid.cells.y), all.z + grid.cells.z};
  }
  const std::vector<SharedPlaces> places = placesOf(volumes, next);
  const std::vector<std::uint32_t> from = slotsBefore(volumes, next, places);
  std::vector<std::uint8_t> isDirty(volumes.size(), 0);
  while (volumes_.size() < volumes.size()) volumes_.push_back(std::make_unique<FollowedVolume>(gl_, *volumes_.front()));

  // 2. All memory first: what is refused for want of it leaves light and volume as they were, but for their room.
  dropErrors(gl_);
  carry(from);
  const std::size_t voxels = std::size_t{places.back().firstVoxel} + next.back().voxels,
                    subVoxels = std::size_t{places.back().firstSubVoxels} + next.back().subVoxels;
  bool isElsewhere = cells_.reserve(all);
  standing_.reserve(all);
  moving_.reserve(all);
  isElsewhere = subVoxelTexels_.reserve(rowsOf(subVoxels, RELUME_LIVE_SUB_VOXELS_A_ROW)) || isElsewhere;
  isElsewhere = cacheVoxels_.reserve(4 * from.size()) || isElsewhere;
  isElsewhere = rayCells_.reserve(sizeof(RelumeRayCell) * cells_.count()) || isElsewhere;
  isElsewhere = subVoxels_.reserve(8 * subVoxels) || isElsewhere;
  const std::size_t sides = 2 * std::size_t{places.back().firstVoxel} + volumes.back().sideCount();
  bool isLost = volumes_.front()->sides.reserveRows(sides);
  volumes_.resize(volumes.size());
  hasSky_ = volumes.front().grid().roams;
  follows_ = true;

  // Light is at the new slots: so are the cells from here on, and what is not there yet when memory runs out is not
  // followed.
  for (std::size_t l = 0; l < volumes.size(); ++l) {
    FollowedVolume& volume = *volumes_[l];
    const bool hasChanged = next[l].cells.has_value(), isMoved = !volume.at.beginsAt(places[l]);
    isDirty[l] = hasChanged || isMoved || isElsewhere ? 1 : 0;
    isLost = isLost || isMoved;
    volume.at = places[l];
    volume.reach = volumes[l].reach();
    if (isDirty[l] != 0) volume.standingVersion = volume.movingVersion = 0;
    if (!hasChanged) continue;
    volume.cells = std::move(*next[l].cells);
    volume.standingKept = volumes[l].standing().kept;
    volume.moves = volumes[l].hasMoving();
  }
  for (std::size_t l = 0; l < volumes.size(); ++l)
    volumes_[l]->lostRadiance = volumes_[l]->lostRadiance || isLost || next[l].cells;

  // 3. What has changed, or is elsewhere
  for (std::size_t l = 0; l < volumes.size(); ++l) {
    FollowedVolume& volume = *volumes_[l];
    volume.sides.follow(volumes[l], LitSides::rowsOfSides(2 * std::size_t{volume.at.firstVoxel}));
    if (isDirty[l] != 0) write(l, volumes[l]);
    if (next[l].cells) volume.stencils.reserve(20 * std::size_t{volume.sides.count()});
  }
  waitForShaders(gl_);
  for (std::size_t l = 0; l < volumes.size(); ++l) {
    if (next[l].cells) findStencils(*volumes_[l]);
    volumes_[l]->standingVersion = volumes[l].standingVersion();
    volumes_[l]->movingVersion = volumes[l].movingVersion();
  }
  waitForShaders(gl_);
  if (!takeOutOfMemory(gl_)) return done();
  const std::string refused = "live light: this OpenGL has not enough memory for " + std::to_string(voxels) +
                              " voxels and " + std::to_string(from.size()) + " caches";
  follows_ = false;
  volumes_.resize(1);
  volumes_.front()->sides.leave();
  return Error{ErrorCode::unsupported, refused};
}

void NestedVolumesGl::takeReach(std::span<const VoxelVolume> volumes) {
  for (std::size_t l = 0; l < size() && l < volumes.size(); ++l) {
    if (volumes_[l]->isOf(volumes[l])) volumes_[l]->reach = volumes[l].reach();
  }
}

void NestedVolumesGl::reset() {
  if (!follows_) return;
  const FollowedVolume& last = *volumes_.back();
  carry(std::vector<std::uint32_t>(last.at.firstCache + last.cells.active.size(), kInactive));
  waitForShaders(gl_);
}

void NestedVolumesGl::writeSky(const CacheSum& sky) {
  std::array<float, 4 * kTexelsOfCache> texels{};
  for (std::size_t i = 0; i < 27; ++i) texels[3 * (i % 9) + i / 9] = sky.coefficients[i];
  texels.back() = sky.brightest;
  light_.write(bytesOf(texels));
}

std::uint32_t NestedVolumesGl::activeCells() const {
  std::size_t sum = 0;
  for (std::size_t l = 0; l < size(); ++l) sum += volumes_[l]->cells.active.size();
  return static_cast<std::uint32_t>(sum);
}

std::vector<std::pair<std::string, std::size_t>> NestedVolumesGl::bufferSizes() const {
  auto sizes = volumes_.front()->sides.bufferSizes();
  std::size_t stencils = volumes_.front()->stencils.bytes();
  for (std::size_t l = 1; l < volumes_.size(); ++l) {
    const auto more = volumes_[l]->sides.bufferSizes();
    for (std::size_t i = 0; i < sizes.size(); ++i) sizes[i].second += more[i].second;
    stencils += volumes_[l]->stencils.bytes();
  }
  sizes.emplace_back("cells",
                     cells_.bytes() + standing_.bytes() + moving_.bytes() + cacheVoxels_.bytes() + carried_.bytes());
  sizes.emplace_back("sub-voxels", rayCells_.bytes() + subVoxels_.bytes() + subVoxelTexels_.bytes());
  sizes.emplace_back("cell light", light_.bytes() + otherLight_.bytes());
  sizes.emplace_back("side stencils", stencils);
  return sizes;
}

}  // namespace relume::gl
