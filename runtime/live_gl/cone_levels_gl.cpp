// SPDX-License-Identifier: MIT
// See cone_levels_gl.h.
#include "runtime/live_gl/cone_levels_gl.h"

#include "runtime/gl/errors.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/live/nested_caches.h"
#include "runtime/shared/stopwatch.h"

#include <algorithm>
#include <array>
#include <bit>

namespace relume::gl {
namespace {

static_assert(RELUME_LIVE_MAX_VOLUMES == kMaxCascades && RELUME_LIVE_BLEND_CELLS == kBlendCells);

Error tooLarge(const std::string& what) { return {ErrorCode::unsupported, "cones: " + what + "; use fewer cells"}; }

constexpr std::uint32_t kVoxelsAtOnce = RELUME_LIVE_SIDES_A_ROW / 2;  // whose texels fill whole rows
constexpr std::uint32_t kRadianceTexels = 2;                          // of a voxel

std::uint32_t rowsFilled(std::size_t items, std::uint32_t aRow) {
  return static_cast<std::uint32_t>((items + aRow - 1) / aRow);
}
// Of so many texels.
std::uint32_t rowsOfTexels(std::size_t texels) { return rowsFilled(texels, RELUME_LIVE_SIDES_A_ROW); }

std::uint32_t countOf(const glm::uvec3& size) { return size.x * size.y * size.z; }

// As shaders/lib/cone_unit.glsl has it.
float unitOf(std::uint32_t brightest) { return std::bit_cast<float>((std::max(brightest >> 23, 53u) - 12u) << 23); }

// One of several has room for a quarter more.
std::uint32_t roomFor(std::uint32_t voxels) { return kVoxelsAtOnce * rowsFilled(voxels + voxels / 4, kVoxelsAtOnce); }

}  // namespace

ConeLevels::ConeLevels(const Functions& gl, RadianceMips::Directions directions, gpu::GroupThreads groups)
    : gl_(gl),
      directions_(directions),
      halves_(groups == gpu::GroupThreads::parallel),
      cells_(gl),
      brightest_(gl),
      radiance_(gl, kFloats, RELUME_LIVE_SIDES_A_ROW),
      sides_(gl, kFloats, RELUME_LIVE_SIDES_A_ROW),
      rsm_(gl),
      timer_(gl) {}

std::vector<std::pair<std::string, std::string>> ConeLevels::defines() const {
  return {{"RELUME_CONE_DIRECTIONS", std::to_string(perVoxel())}, {"RELUME_CONE_HALVES", halves_ ? "1" : "0"}};
}

Status ConeLevels::compile() {
  const auto list = defines();
  const std::pair<Program*, const char*> programs[] = {{&injectProgram_, "cone_inject.comp"},
                                                       {&brightestProgram_, "cone_brightest.comp"},
                                                       {&firstProgram_, "cone_first.comp"},
                                                       {&levelProgram_, "cone_level.comp"}};
  for (const auto& [program, path] : programs) {
    Result<Program> made = makeComputeProgram(gl_, path, list);
    if (!made) return made.error();
    *program = std::move(*made);
  }
  return rsm_.compile(list);
}

Status ConeLevels::checkSize(std::span<const VoxelVolume> volumes, bool hasMaps) const {
  const GpuDevice device = deviceOf(gl_, gpu::GroupThreads::parallel);
  std::size_t all = 0;
  glm::uvec3 first(0);
  bool isTooMuch = device.imageSide < RELUME_LIVE_SIDES_A_ROW;
  for (const VoxelVolume& volume : volumes) {
    const std::uint32_t voxels = volume.standing().occupied + volume.moving().occupied;
    isTooMuch = isTooMuch || 4 * sizeof(ConeSource) * voxels > device.storageBytes ||
                (hasMaps && RsmPasses::bytesNeeded(voxels, volume.sideCount()) > device.storageBytes);
    all += volumes.size() > 1 ? roomFor(voxels) : voxels;
    // All further levels along z are no longer than the first.
    const glm::uvec3 size(2 * volume.grid().cells);
    first = {std::max(first.x, perVoxel() * size.x), std::max(first.y, size.y),
             first.z + size.z + RELUME_CONE_MAX_LEVELS};
  }
  if (isTooMuch || rowsOfTexels(2 * std::size_t{kConeSideTexels} * all) >= device.imageSide)
    return tooLarge(std::to_string(all) + " voxels are more than this OpenGL's buffers hold");
  const std::uint32_t side = std::max({first.x, first.y, first.z});
  if (side > device.volumeSide)
    return tooLarge("this OpenGL's textures have " + std::to_string(device.volumeSide) + " texels along a side, " +
                    std::to_string(side) + " are needed");
  return done();
}

// Of the volumes' grids.
void ConeLevels::makeLevels() {
  firstSize_ = furtherSize_ = glm::uvec3(0);
  const auto add = [this](glm::uvec3& whole, const glm::uvec3& size) {
    const std::uint32_t offset = whole.z;
    whole = {std::max(whole.x, perVoxel() * size.x), std::max(whole.y, size.y), whole.z + size.z};
    return offset;
  };
  for (const auto& volume : volumes_) {
    volume->offsets.clear();
    for (const glm::uvec3& size : volume->found.sizes())
      volume->offsets.push_back(add(volume->offsets.empty() ? firstSize_ : furtherSize_, size));
  }
  const auto make = [this](const glm::uvec3& size) {
    Texture texture = makeTexture(gl_, GL_TEXTURE_3D);
    gl_.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    for (const auto wrap : std::to_array<GLenum>({GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}))
      gl_.TexParameteri(GL_TEXTURE_3D, wrap, GL_CLAMP_TO_EDGE);
    const auto width = static_cast<GLsizei>(size.x), height = static_cast<GLsizei>(size.y),
               depth = static_cast<GLsizei>(size.z);
    gl_.TexStorage3D(GL_TEXTURE_3D, 1, levelFormat(), width, height, depth);
    const std::vector<glm::vec4> zero(std::size_t{size.x} * size.y);
    for (GLint slice = 0; slice < depth; ++slice)
      gl_.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, slice, width, height, 1, GL_RGBA, GL_FLOAT, zero.data());
    return texture;
  };
  first_ = make(firstSize_);
  further_ = make(furtherSize_);
}

// Where the voxels of each are numbered from. They stay where they are unless one of them no longer fits.
void ConeLevels::placeVoxels() {
  const bool stay = std::all_of(volumes_.begin(), volumes_.end(),
                                [](const auto& volume) { return volume->found.count() <= volume->room; });
  if (stay) return;
  std::uint32_t first = 0;
  for (const auto& volume : volumes_) {
    volume->first = first;
    // One alone has what room the textures have beyond it.
    volume->room = volumes_.size() > 1 ? roomFor(volume->found.count()) : volume->found.count();
    volume->isDirty = true;
    first += volume->room;
  }
}

// What has changed.
void ConeLevels::follow(std::span<const VoxelVolume> volumes) {
  bool isSame = follows_ && volumes_.size() == volumes.size();
  for (std::size_t l = 0; isSame && l < volumes.size(); ++l)
    isSame = volumes_[l]->found.grid().cells == volumes[l].grid().cells;
  follows_ = false;
  rsm_.forget();
  if (!isSame) {
    volumes_.resize(std::min(volumes_.size(), volumes.size()));
    while (volumes_.size() < volumes.size()) volumes_.push_back(std::make_unique<Followed>(gl_));
  }
  glm::ivec3 cells(1, 1, 0);
  for (std::size_t l = 0; l < volumes.size(); ++l) {
    Followed& volume = *volumes_[l];
    volume.reach = volumes[l].reach();
    if (!isSame) volume.found.forget();
    if (!volume.found.isOf(volumes[l])) {
      volume.found.follow(volumes[l]);
      volume.isDirty = true;
    }
    const glm::ivec3& own = volume.found.grid().cells;
    volume.layer = static_cast<std::uint32_t>(cells.z);
    cells = {std::max(cells.x, own.x), std::max(cells.y, own.y), cells.z + own.z};
  }
  if (!isSame) makeLevels();
  placeVoxels();
  const std::size_t voxels = std::size_t{volumes_.back()->first} + volumes_.back()->room;
  bool isLost = cells_.reserve(cells);
  isLost = sides_.reserve(rowsOfTexels(kConeSideTexels * voxels)) || isLost;
  radiance_.reserve(rowsOfTexels(kRadianceTexels * voxels));
  for (const auto& volume : volumes_) {
    if (volume->isDirty || isLost) write(*volume);
  }
}

void ConeLevels::write(Followed& volume) {
  const ConeVolume& found = volume.found;
  std::vector<glm::uvec4> texels = found.cellTexels();
  for (glm::uvec4& texel : texels) texel.z += volume.first;
  cells_.writeLayers(found.grid().cells, static_cast<int>(volume.layer), texels.data());
  volume.sources.reserve(sizeof(ConeSource) * found.count());
  volume.sources.write(0, bytesOf(found.sources()));
  volume.list.reserve(sizeof(std::uint32_t) * found.listed().size());
  volume.list.write(0, bytesOf(found.listed()));
  sides_.write(bytesOf(found.sideTexels()), kConeSideTexels * volume.first / RELUME_LIVE_SIDES_A_ROW);
  volume.isDirty = false;
}

void ConeLevels::inject(const Followed& volume, const LitSides& lit) {
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_CONE_UNIT_SOURCE);
  gl_.BindTexture(GL_TEXTURE_2D, lit.radianceTexture());
  radiance_.bindImage(0, GL_WRITE_ONLY);
  volume.sources.bind(RELUME_CONE_SLOT_SOURCES);
  setUniform(gl_, injectProgram_, "relumeConeFirst", glm::uvec2(volume.first, kVoxelsAtOnce * lit.firstRow()));
  runThreads(gl_, injectProgram_, volume.found.count());
}

void ConeLevels::bindVoxels(const Program& program, const Followed& volume) const {
  const VolumeGrid& grid = volume.found.grid();
  cells_.bind(RELUME_LIVE_UNIT_CELLS);
  radiance_.bind(RELUME_CONE_UNIT_RADIANCE);
  sides_.bind(RELUME_CONE_UNIT_SIDES);
  setGrid(gl_, program.get(), grid, grid.voxel);
  setUniform(gl_, program, "relumeLiveLayer", static_cast<std::int32_t>(volume.layer));
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

// As shaders/lib/cone_volumes.glsl has them.
void ConeLevels::bindVolumes(const Program& program) const {
  setUniform(gl_, program, "relumeConeVolumes", static_cast<std::uint32_t>(volumes_.size()));
  for (std::size_t l = 0; l < volumes_.size(); ++l) {
    const Followed& volume = *volumes_[l];
    const VolumeGrid& grid = volume.found.grid();
    const auto set = [&](const char* name, const auto& value) {
      setUniform(gl_, program, (name + ("[" + std::to_string(l) + "]")).c_str(), value);
    };
    set("relumeConeCorners", grid.originWorld);
    set("relumeConeEdges", grid.voxel);
    set("relumeConeCells", glm::uvec3(grid.cells));
    set("relumeConeLows", volume.reach.low);
    set("relumeConeHighs", volume.reach.high);
    set("relumeConeKinds", glm::uvec2(volume.layer, levels(l)));
  }
}

void ConeLevels::bind(const Program& program) const {
  bindVoxels(program, *volumes_.front());
  bindLevels();
  if (halves_) brightest_.bind(RELUME_CONE_SLOT_BRIGHTEST);
  setUniform(gl_, program, "relumeConeLevelCount", levels(0));
  if (volumes_.size() > 1) bindVolumes(program);
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    for (std::size_t l = 1; l <= levels(v); ++l) {
      const std::string name = "relumeConeOffset[" + std::to_string(v * RELUME_CONE_MAX_LEVELS + l) + "]";
      setUniform(gl_, program, name.c_str(), volumes_[v]->offsets[l - 1]);
    }
  }
}

// What halves count radiance in: the brightest voxel of all.
void ConeLevels::findUnit() {
  brightest_.reserve(sizeof(std::uint32_t));
  brightest_.clear();
  brightest_.bind(RELUME_CONE_SLOT_BRIGHTEST);
  for (const auto& volume : volumes_) {
    bindVoxels(brightestProgram_, *volume);
    setUniform(gl_, brightestProgram_, "relumeConeFirst", volume->first);
    runThreads(gl_, brightestProgram_, volume->found.count());
  }
  waitForShaders(gl_);
}

// Each level from the one below.
void ConeLevels::runLevels(const Followed& volume) {
  bindVoxels(firstProgram_, volume);
  bindLevels();
  volume.list.bind(RELUME_CONE_SLOT_LIST);
  const auto& sizes = volume.found.sizes();
  const auto& first = volume.found.firstListed();
  for (std::uint32_t l = 1; l <= sizes.size(); ++l) {
    const Program& program = l == 1 ? firstProgram_ : levelProgram_;
    bindLevelImage(l);
    setUniform(gl_, program, "relumeConeFirstListed", first[l - 1]);
    if (l == 1) {
      setUniform(gl_, program, "relumeConePlace", volume.offsets[0]);
    } else {
      setUniform(gl_, program, "relumeConeSize", sizes[l - 1]);
      setUniform(gl_, program, "relumeConeBelow", sizes[l - 2]);
      setUniform(gl_, program, "relumeConePlace", glm::uvec2(volume.offsets[l - 1], volume.offsets[l - 2]));
      setUniform(gl_, program, "relumeConeIsSecond", l == 2 ? 1u : 0u);
    }
    runThreads(gl_, program, first[l] - first[l - 1]);
    waitForShaders(gl_);
  }
}

Status ConeLevels::fill(std::span<const VoxelVolume> volumes, std::span<const LitSides* const> lit,
                        const RsmMaps* maps) {
  for (std::size_t l = 0; l < volumes.size() && !lit.empty(); ++l) {
    if (lit.size() != volumes.size() || !lit[l]->isOf(volumes[l]))
      return Error{ErrorCode::usage, "cones: the sides' light is of another volume, or of this one before it changed"};
  }
  if (Status ok = checkSize(volumes, maps != nullptr); !ok) return ok;
  Stopwatch watch;
  dropErrors(gl_);
  bool isNew = !follows_ || volumes_.size() != volumes.size();
  for (std::size_t l = 0; !isNew && l < volumes.size(); ++l) isNew = !volumes_[l]->found.isOf(volumes[l]);
  if (isNew) follow(volumes);
  follows_ = false;
  if (maps != nullptr) rsm_.follow(volumes.front(), volumes_.front()->found);
  for (std::size_t l = 0; l < volumes.size() && lit.empty() && maps == nullptr; ++l)
    radiance_.write(bytesOf(volumes_[l]->found.radianceTexels(volumes[l], directions_)),
                    kRadianceTexels * volumes_[l]->first / RELUME_LIVE_SIDES_A_ROW);
  voxelsMs_ = watch.lap();
  timer_.mark(0);
  for (std::size_t l = 0; l < lit.size(); ++l) inject(*volumes_[l], *lit[l]);
  if (maps != nullptr) rsm_.light(volumes_.front()->found, *maps, cells_, radiance_);
  waitForShaders(gl_);
  timer_.mark(1);
  if (halves_) findUnit();
  for (const auto& volume : volumes_) runLevels(*volume);
  timer_.mark(2);
  timer_.endFrame();
  if (takeOutOfMemory(gl_)) {
    std::size_t voxels = 0;
    for (const auto& volume : volumes_) voxels += volume->found.count();
    return tooLarge("this OpenGL has not enough memory for the levels of " + std::to_string(voxels) + " voxels");
  }
  follows_ = true;
  return done();
}

std::vector<glm::vec4> ConeLevels::texels(std::uint32_t level, std::size_t volume) const {
  const Followed& of = *volumes_[volume];
  const glm::uvec3 size = of.found.sizes()[level - 1], whole = level == 1 ? firstSize_ : furtherSize_;
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
                          all[((of.offsets[level - 1] + z) * whole.y + y) * std::size_t{whole.x} + d * size.x + x]);
      }
    }
  }
  return found;
}

std::vector<glm::vec3> ConeLevels::sideRadiance(std::size_t volume) const {
  const Followed& of = *volumes_[volume];
  std::vector<glm::vec4> texels(std::size_t{radiance_.rows()} * RELUME_LIVE_SIDES_A_ROW);
  std::vector<glm::vec3> found(of.found.sideCount(), glm::vec3(0.0f));
  if (texels.empty()) return found;
  radiance_.bind(RELUME_CONE_UNIT_RADIANCE);
  gl_.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, texels.data());
  const std::vector<ConeSource>& source = of.found.sources();
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (source[i].voxel == kNoSource) continue;
    for (std::size_t side = 0; side < 2; ++side)
      found[2 * std::size_t{source[i].voxel} + side] = texels[2 * (of.first + i) + side];
  }
  return found;
}

std::vector<PassTime> ConeLevels::passTimes() {
  const auto& ms = timer_.passMs();
  return {{"voxels", voxelsMs_}, {"inject", ms[0]}, {"levels", ms[1]}};
}

std::size_t ConeLevels::voxelBytes() const {
  std::size_t bytes = cells_.bytes() + sides_.bytes() + radiance_.bytes() + rsm_.bytes() + brightest_.bytes();
  for (const auto& volume : volumes_) bytes += volume->sources.bytes() + volume->list.bytes();
  return bytes;
}

std::size_t ConeLevels::levelBytes() const {
  const std::size_t texels = std::size_t{countOf(firstSize_)} + countOf(furtherSize_);
  return texels * (halves_ ? sizeof(glm::vec4) / 2 : sizeof(glm::vec4));
}

}  // namespace relume::gl
