// SPDX-License-Identifier: MIT
// See cone_levels_gl.h.
#include "runtime/live_gl/cone_levels_gl.h"

#include "runtime/cones/rsm_voxels.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/stopwatch.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>

namespace relume::gl {
namespace {

Error tooLarge(const std::string& what) { return {ErrorCode::unsupported, "cones: " + what + "; use fewer cells"}; }

constexpr std::uint32_t kNoSource = 0xFFFFFFFFu;
constexpr std::uint32_t kSideTexels = 4;  // of a voxel
constexpr std::uint32_t kCells = 1024;    // of a chunk
constexpr std::size_t kSumBytes = 24;     // of a side: three channels of two words

// Of so many texels.
std::uint32_t rowsOfTexels(std::size_t texels) {
  return static_cast<std::uint32_t>((texels + RELUME_LIVE_SIDES_A_ROW - 1) / RELUME_LIVE_SIDES_A_ROW);
}

std::uint32_t countOf(const glm::uvec3& size) { return size.x * size.y * size.z; }

// As shaders/lib/cone_unit.glsl has it.
float unitOf(std::uint32_t brightest) { return std::bit_cast<float>((std::max(brightest >> 23, 53u) - 12u) << 23); }

}  // namespace

ConeLevels::ConeLevels(const Functions& gl, RadianceMips::Directions directions, gpu::GroupThreads groups)
    : gl_(gl),
      directions_(directions),
      halves_(groups == gpu::GroupThreads::parallel),
      cells_(gl),
      sources_(gl),
      listBuffer_(gl),
      rsmVoxels_(gl),
      rsmSums_(gl),
      brightest_(gl),
      radiance_(gl, kFloats, RELUME_LIVE_SIDES_A_ROW),
      sides_(gl, kFloats, RELUME_LIVE_SIDES_A_ROW),
      timer_(gl) {}

std::vector<std::pair<std::string, std::string>> ConeLevels::defines() const {
  return {{"RELUME_CONE_DIRECTIONS", std::to_string(perVoxel())}, {"RELUME_CONE_HALVES", halves_ ? "1" : "0"}};
}

Status ConeLevels::compile() {
  const auto list = defines();
  const std::pair<Program*, const char*> programs[] = {
      {&injectProgram_, "cone_inject.comp"},      {&rsmProgram_, "cone_rsm.comp"},
      {&rsmLightProgram_, "cone_rsm_light.comp"}, {&brightestProgram_, "cone_brightest.comp"},
      {&firstProgram_, "cone_first.comp"},        {&levelProgram_, "cone_level.comp"}};
  for (const auto& [program, path] : programs) {
    Result<Program> made = makeComputeProgram(gl_, path, list);
    if (!made) return made.error();
    *program = std::move(*made);
  }
  return done();
}

Status ConeLevels::checkSize(const VoxelVolume& volume, bool hasMaps) const {
  const GpuDevice device = deviceOf(gl_, gpu::GroupThreads::parallel);
  const std::size_t voxels = volume.standing().occupied + volume.moving().occupied;
  if (rowsOfTexels(2 * kSideTexels * voxels) >= device.imageSide || device.imageSide < RELUME_LIVE_SIDES_A_ROW ||
      4 * sizeof(Source) * voxels > device.storageBytes ||
      (hasMaps && std::max(sizeof(RelumeRsmVoxel) * voxels, kSumBytes * volume.sideCount()) > device.storageBytes))
    return tooLarge(std::to_string(voxels) + " voxels are more than this OpenGL's buffers hold");
  const glm::uvec3 first(2 * volume.grid().cells);
  // All further levels along z are no longer than the first.
  const std::uint32_t side = std::max({perVoxel() * first.x, first.y, first.z + RELUME_CONE_MAX_LEVELS});
  if (side > device.volumeSide)
    return tooLarge("this OpenGL's textures have " + std::to_string(device.volumeSide) + " texels along a side, " +
                    std::to_string(side) + " are needed");
  return done();
}

// Of the grid.
void ConeLevels::makeLevels() {
  sizes_.clear();
  offsets_.clear();
  occupied_.clear();
  firstOccupied_.clear();
  std::uint32_t end = 0;
  for (glm::uvec3 size(grid_.voxels()); std::max({size.x, size.y, size.z}) > 1;) {
    size = (size + 1u) / 2u;
    const bool isFirst = sizes_.empty();
    sizes_.push_back(size);
    offsets_.push_back(isFirst ? 0 : end);
    if (!isFirst) end += size.z;
  }
  const auto make = [this](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    Texture texture = makeTexture(gl_, GL_TEXTURE_3D);
    gl_.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    for (const auto wrap : std::to_array<GLenum>({GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}))
      gl_.TexParameteri(GL_TEXTURE_3D, wrap, GL_CLAMP_TO_EDGE);
    const auto width = static_cast<GLsizei>(x), height = static_cast<GLsizei>(y), depth = static_cast<GLsizei>(z);
    gl_.TexStorage3D(GL_TEXTURE_3D, 1, levelFormat(), width, height, depth);
    const std::vector<glm::vec4> zero(std::size_t{x} * y);
    for (GLint slice = 0; slice < depth; ++slice)
      gl_.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, slice, width, height, 1, GL_RGBA, GL_FLOAT, zero.data());
    return texture;
  };
  first_ = make(perVoxel() * sizes_[0].x, sizes_[0].y, sizes_[0].z);
  further_ = make(perVoxel() * sizes_[1].x, sizes_[1].y, end);
}

// Which voxels there are.
void ConeLevels::findVoxels(const VoxelVolume& volume) {
  const VoxelLayer &standing = volume.standing(), &moving = volume.moving();
  const std::span<const std::uint64_t> bits = volume.bits();
  cellTexels_.resize(grid_.cellCount());
  std::uint32_t count = 0;
  for (std::uint32_t c = 0; c < cellTexels_.size(); ++c) {
    cellTexels_[c] = {static_cast<std::uint32_t>(bits[c]), static_cast<std::uint32_t>(bits[c] >> 32), count, 0};
    count += static_cast<std::uint32_t>(std::popcount(bits[c]));
  }
  source_.assign(count, Source{kNoSource, 0.5f});
  sideTexels_.assign(kSideTexels * std::size_t{count}, glm::vec4(0.0f));
  forChunks(volume.parallelFor(), static_cast<std::uint32_t>(cellTexels_.size()), kCells,
            [&](std::uint32_t begin, std::uint32_t end) {
              for (std::uint32_t c = begin; c < end; ++c) {
                std::uint32_t i = cellTexels_[c].z;
                for (std::uint64_t rest = bits[c]; rest != 0; rest &= rest - 1, ++i) {
                  const glm::ivec3 v = kBrickSide * grid_.cellAt(c) + voxelOfBit(std::countr_zero(rest));
                  const bool moves = moving.occupied > 0 && moving.has(grid_, v);
                  const std::uint32_t number = (moves ? moving : standing).numberOf(grid_, v);
                  if (number >= (moves ? moving : standing).kept) continue;
                  const std::uint32_t voxel = moves ? standing.kept + number : number;
                  const VoxelSide &front = volume.side(2 * voxel), &back = volume.side(2 * voxel + 1);
                  const float area = front.area + back.area;
                  source_[i] = {voxel, area > 0.0f ? front.area / area : 0.5f};
                  glm::vec4* const to = &sideTexels_[kSideTexels * std::size_t{i}];
                  to[0] = glm::vec4(grid_.toGrid(front.positionWorld), source_[i].front);
                  to[1] = glm::vec4(front.normal, 0.0f);
                  to[2] = glm::vec4(grid_.toGrid(back.positionWorld), 0.0f);
                  to[3] = glm::vec4(back.normal, 0.0f);
                }
              }
            });
}

// Of each level the voxels that hold one of the level below, with those that did before: what they hold is zero then.
void ConeLevels::listVoxels() {
  constexpr std::uint8_t kNow = 1, kBefore = 2;
  const std::vector<std::uint32_t> before = std::move(occupied_), firstBefore = std::move(firstOccupied_);
  std::vector<std::uint8_t> is(countOf(sizes_[0]), 0);
  for (std::uint32_t c = 0; c < cellTexels_.size(); ++c) {
    const glm::uvec3 low = 2u * glm::uvec3(grid_.cellAt(c));
    for (std::uint64_t rest = cellTexels_[c].x | std::uint64_t{cellTexels_[c].y} << 32; rest != 0; rest &= rest - 1) {
      const glm::uvec3 v = low + glm::uvec3(voxelOfBit(std::countr_zero(rest)) / 2);
      is[(v.z * sizes_[0].y + v.y) * sizes_[0].x + v.x] = kNow;
    }
  }
  occupied_.clear();
  firstOccupied_.assign(1, 0);
  listed_.clear();
  firstListed_.assign(1, 0);
  for (std::size_t l = 0; l < sizes_.size(); ++l) {
    const glm::uvec3 size = sizes_[l], above = (size + 1u) / 2u;
    for (std::uint32_t i = firstBefore.empty() ? 0 : firstBefore[l]; !firstBefore.empty() && i < firstBefore[l + 1];
         ++i)
      is[((before[i] >> 20) * size.y + (before[i] >> 10 & 1023u)) * size.x + (before[i] & 1023u)] |= kBefore;
    std::vector<std::uint8_t> next(countOf(above), 0);
    for (std::uint32_t i = 0; i < is.size(); ++i) {
      if (is[i] == 0) continue;
      const glm::uvec3 v(i % size.x, i / size.x % size.y, i / (size.x * size.y));
      const std::uint32_t word = v.x | v.y << 10 | v.z << 20;
      listed_.push_back(word);
      if ((is[i] & kNow) == 0) continue;
      occupied_.push_back(word);
      next[((v.z / 2) * above.y + v.y / 2) * above.x + v.x / 2] = kNow;
    }
    firstOccupied_.push_back(static_cast<std::uint32_t>(occupied_.size()));
    firstListed_.push_back(static_cast<std::uint32_t>(listed_.size()));
    is = std::move(next);
  }
}

void ConeLevels::writeVoxels() {
  cells_.write(grid_.cells.x, grid_.cells.y, grid_.cells.z, cellTexels_.data());
  sources_.reserve(sizeof(Source) * source_.size());
  sources_.write(0, bytesOf(source_));
  listBuffer_.reserve(sizeof(std::uint32_t) * listed_.size());
  listBuffer_.write(0, bytesOf(listed_));
  sides_.reserve(rowsOfTexels(sideTexels_.size()));
  sides_.write(bytesOf(sideTexels_));
  radiance_.reserve(rowsOfTexels(2 * source_.size()));
}

// As shaders/cone_inject.comp.
void ConeLevels::writeRadiance(const VoxelVolume& volume) {
  std::vector<glm::vec4> texels;
  texels.reserve(2 * source_.size());
  for (const Source& source : source_) {
    VoxelRadiance r;
    if (source.voxel != kNoSource) r = volume.radiance()[source.voxel];
    if (directions_ == RadianceMips::Directions::one) r.front = r.back = glm::mix(r.back, r.front, source.front);
    const int longest = std::max({std::abs(r.axis[0]), std::abs(r.axis[1]), std::abs(r.axis[2])});
    const float depth = source.voxel == kNoSource ? kSolidDepth : depthOfWall(longest);
    const float axis =
        source.voxel == kNoSource ? 0.0f : static_cast<float>(packAxis({r.axis[0], r.axis[1], r.axis[2]}));
    texels.emplace_back(r.front, axis);
    texels.emplace_back(r.back, depth);
  }
  radiance_.write(bytesOf(texels));
}

void ConeLevels::inject(const LitSides& lit) {
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_CONE_UNIT_SOURCE);
  gl_.BindTexture(GL_TEXTURE_2D, lit.radianceTexture());
  radiance_.bindImage(0, GL_WRITE_ONLY);
  sources_.bind(RELUME_CONE_SLOT_SOURCES);
  runThreads(gl_, injectProgram_, static_cast<std::uint32_t>(source_.size()));
}

// As RsmVoxels finds them.
void ConeLevels::writeRsmVoxels(const VoxelVolume& volume) {
  const RsmTargets targets = findRsmTargets(volume);
  std::vector<RelumeRsmVoxel> voxels(source_.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const std::uint32_t from = source_[i].voxel;
    RelumeRsmVoxel& to = voxels[i];
    to = {0, kRelumeNone, kRelumeNone, source_[i].front, glm::vec4(0.0f), glm::vec4(0.0f)};
    if (from == kNoSource) continue;
    const auto& axis = volume.radiance()[from].axis;
    to.axis = packAxis({axis[0], axis[1], axis[2]});
    to.front = targets.side[2 * std::size_t{from}];
    to.back = targets.side[2 * std::size_t{from} + 1];
    to.frontLight = glm::vec4(volume.side(2 * from).emission, targets.perFlux[2 * std::size_t{from}]);
    to.backLight = glm::vec4(volume.side(2 * from + 1).emission, targets.perFlux[2 * std::size_t{from} + 1]);
  }
  rsmVoxels_.reserve(sizeof(RelumeRsmVoxel) * voxels.size());
  rsmVoxels_.write(0, bytesOf(voxels));
  rsmSums_.reserve(kSumBytes * volume.sideCount());
}

// The passes of RsmVoxels::light().
void ConeLevels::inject(const RsmMaps& maps) {
  const float unit = rsmUnit(maps.largestFlux);
  rsmSums_.clear();
  rsmVoxels_.bind(RELUME_CONE_SLOT_RSM_VOXELS);
  rsmSums_.bind(RELUME_CONE_SLOT_RSM_SUMS);
  cells_.bind(RELUME_LIVE_UNIT_CELLS);
  setUniform(gl_, rsmProgram_, "relumeLiveOrigin", grid_.originWorld);
  setUniform(gl_, rsmProgram_, "relumeLiveSize", glm::uvec3(grid_.cells));
  setUniform(gl_, rsmProgram_, "relumeRsmPerMetre", 1.0f / grid_.voxel);
  setUniform(gl_, rsmProgram_, "relumeRsmPerWatt", 1.0f / unit);
  setUniform(gl_, rsmProgram_, "relumeRsmLargest", maps.largestFlux);
  for (const RsmMaps::Map& map : maps.map) {
    for (const auto& [texture, at] : {std::pair{map.places, RELUME_CONE_UNIT_RSM_PLACES},
                                      {map.normals, RELUME_CONE_UNIT_RSM_NORMALS},
                                      {map.flux, RELUME_CONE_UNIT_RSM_FLUX}}) {
      gl_.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(at));
      gl_.BindTexture(GL_TEXTURE_2D, texture);
    }
    setUniform(gl_, rsmProgram_, "relumeRsmSide", map.width);
    runThreads(gl_, rsmProgram_, map.width * map.height);
  }
  waitForShaders(gl_);
  radiance_.bindImage(0, GL_WRITE_ONLY);
  setUniform(gl_, rsmLightProgram_, "relumeRsmUnit", unit);
  setUniform(gl_, rsmLightProgram_, "relumeRsmEmissionScale", maps.emissionScale);
  runThreads(gl_, rsmLightProgram_, static_cast<std::uint32_t>(source_.size()));
}

void ConeLevels::bindVoxels(const Program& program) const {
  cells_.bind(RELUME_LIVE_UNIT_CELLS);
  radiance_.bind(RELUME_CONE_UNIT_RADIANCE);
  sides_.bind(RELUME_CONE_UNIT_SIDES);
  setUniform(gl_, program, "relumeLiveOrigin", grid_.originWorld);
  setUniform(gl_, program, "relumeLiveVoxel", grid_.voxel);
  setUniform(gl_, program, "relumeLiveSize", glm::uvec3(grid_.cells));
}

void ConeLevels::bindLevels() const {
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_CONE_UNIT_FIRST);
  gl_.BindTexture(GL_TEXTURE_3D, first_.get());
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_CONE_UNIT_LEVELS);
  gl_.BindTexture(GL_TEXTURE_3D, further_.get());
}

void ConeLevels::bindLevelImage(std::uint32_t level) const {
  gl_.BindImageTexture(0, level == 1 ? first_.get() : further_.get(), 0, GL_TRUE, 0, GL_WRITE_ONLY, levelFormat());
}

void ConeLevels::bind(const Program& program) const {
  bindVoxels(program);
  bindLevels();
  if (halves_) brightest_.bind(RELUME_CONE_SLOT_BRIGHTEST);
  setUniform(gl_, program, "relumeConeLevelCount", levels());
  for (std::size_t l = 1; l <= sizes_.size(); ++l)
    setUniform(gl_, program, ("relumeConeOffset[" + std::to_string(l) + "]").c_str(), offsets_[l - 1]);
}

// What halves count radiance in: the brightest voxel.
void ConeLevels::findUnit() {
  brightest_.reserve(sizeof(std::uint32_t));
  brightest_.clear();
  brightest_.bind(RELUME_CONE_SLOT_BRIGHTEST);
  bindVoxels(brightestProgram_);
  runThreads(gl_, brightestProgram_, static_cast<std::uint32_t>(source_.size()));
  waitForShaders(gl_);
}

// Each level from the one below.
void ConeLevels::runLevels() {
  if (halves_) findUnit();
  bindVoxels(firstProgram_);
  bindLevels();
  listBuffer_.bind(RELUME_CONE_SLOT_LIST);
  for (std::uint32_t l = 1; l <= levels(); ++l) {
    const Program& program = l == 1 ? firstProgram_ : levelProgram_;
    bindLevelImage(l);
    setUniform(gl_, program, "relumeConeFirstListed", firstListed_[l - 1]);
    if (l > 1) {
      setUniform(gl_, program, "relumeConeSize", sizes_[l - 1]);
      setUniform(gl_, program, "relumeConeBelow", sizes_[l - 2]);
      setUniform(gl_, program, "relumeConePlace", glm::uvec2(offsets_[l - 1], offsets_[l - 2]));
      setUniform(gl_, program, "relumeConeIsSecond", l == 2 ? 1u : 0u);
    }
    runThreads(gl_, program, firstListed_[l] - firstListed_[l - 1]);
    waitForShaders(gl_);
  }
}

Status ConeLevels::fill(const VoxelVolume& volume, const LitSides* lit, const RsmMaps* maps) {
  if (lit != nullptr && !lit->isOf(volume))
    return Error{ErrorCode::usage, "cones: the sides' light is of another volume, or of this one before it changed"};
  if (Status ok = checkSize(volume, maps != nullptr); !ok) return ok;
  Stopwatch watch;
  while (gl_.GetError() != GL_NO_ERROR) {
  }
  if (!follows_ || volume.standingVersion() != standingVersion_ || volume.movingVersion() != movingVersion_) {
    const bool isSame = follows_ && grid_.cells == volume.grid().cells;
    follows_ = rsmFollows_ = false;
    grid_ = volume.grid();
    if (!isSame) makeLevels();
    findVoxels(volume);
    listVoxels();
    writeVoxels();
    standingVersion_ = volume.standingVersion();
    movingVersion_ = volume.movingVersion();
    sideCount_ = volume.sideCount();
  }
  follows_ = false;
  if (maps != nullptr && !rsmFollows_) {
    writeRsmVoxels(volume);
    rsmFollows_ = true;
  }
  if (lit == nullptr && maps == nullptr) writeRadiance(volume);
  voxelsMs_ = watch.lap();
  timer_.mark(0);
  if (lit != nullptr) inject(*lit);
  if (maps != nullptr) inject(*maps);
  waitForShaders(gl_);
  timer_.mark(1);
  runLevels();
  timer_.mark(2);
  timer_.endFrame();
  if (gl_.GetError() == GL_OUT_OF_MEMORY)
    return tooLarge("this OpenGL has not enough memory for the levels of " + std::to_string(source_.size()) +
                    " voxels");
  follows_ = true;
  return done();
}

std::vector<glm::vec4> ConeLevels::texels(std::uint32_t level) const {
  const glm::uvec3 size = sizes_[level - 1];
  const glm::uvec3 whole = level == 1
                               ? glm::uvec3(perVoxel() * size.x, size.y, size.z)
                               : glm::uvec3(perVoxel() * sizes_[1].x, sizes_[1].y, offsets_.back() + sizes_.back().z);
  std::vector<glm::vec4> all(countOf(whole));
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_CONE_UNIT_FIRST);
  gl_.BindTexture(GL_TEXTURE_3D, level == 1 ? first_.get() : further_.get());
  gl_.GetTexImage(GL_TEXTURE_3D, 0, GL_RGBA, GL_FLOAT, all.data());
  const glm::vec4 unit(glm::vec3(halves_ ? unitOf(brightest_.readWord()) : 1.0f), 1.0f);
  std::vector<glm::vec4> found;
  found.reserve(std::size_t{perVoxel()} * countOf(size));
  for (std::uint32_t z = 0; z < size.z; ++z) {
    for (std::uint32_t y = 0; y < size.y; ++y) {
      for (std::uint32_t x = 0; x < size.x; ++x) {
        for (std::uint32_t d = 0; d < perVoxel(); ++d)
          found.push_back(unit *
                          all[((offsets_[level - 1] + z) * whole.y + y) * std::size_t{whole.x} + d * size.x + x]);
      }
    }
  }
  return found;
}

std::vector<glm::vec3> ConeLevels::sideRadiance() const {
  std::vector<glm::vec4> texels(std::size_t{radiance_.rows()} * RELUME_LIVE_SIDES_A_ROW);
  std::vector<glm::vec3> found(sideCount_, glm::vec3(0.0f));
  if (texels.empty()) return found;
  radiance_.bind(RELUME_CONE_UNIT_RADIANCE);
  gl_.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, texels.data());
  for (std::size_t i = 0; i < source_.size(); ++i) {
    if (source_[i].voxel == kNoSource) continue;
    for (std::size_t side = 0; side < 2; ++side) found[2 * std::size_t{source_[i].voxel} + side] = texels[2 * i + side];
  }
  return found;
}

std::vector<PassTime> ConeLevels::passTimes() {
  const auto& ms = timer_.passMs();
  return {{"voxels", voxelsMs_}, {"inject", ms[0]}, {"levels", ms[1]}};
}

std::size_t ConeLevels::levelBytes() const {
  if (sizes_.empty()) return 0;
  const std::size_t texels = std::size_t{perVoxel()} * (countOf(sizes_[0]) + std::size_t{sizes_[1].x} * sizes_[1].y *
                                                                                 (offsets_.back() + sizes_.back().z));
  return texels * (halves_ ? sizeof(glm::vec4) / 2 : sizeof(glm::vec4));
}

}  // namespace relume::gl
