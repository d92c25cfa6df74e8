// SPDX-License-Identifier: MIT
// See live_caches_gl.h.
#include "runtime/live_gl/live_caches_gl.h"

#include "runtime/check_setup.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/gl/saved_state.h"
#include "runtime/gl/timer.h"
#include "runtime/live/cell_texels.h"
#include "runtime/live/live_caches.h"
#include "runtime/live_gl/lit_sides.h"
#include "runtime/live_gl/live_objects.h"
#include "runtime/live_gl/live_resolve_gl.h"
#include "runtime/shared/stopwatch.h"

#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <new>

namespace relume {
namespace {

using gl::GrowingBuffer, gl::GrowingRows;

constexpr std::uint32_t kTexels = 7, kBasis = 9;  // of a cache; of a channel
constexpr int kParallelLanes = 32;

std::uint32_t rowsOf(std::size_t items, std::uint32_t aRow) {
  return static_cast<std::uint32_t>((items + aRow - 1) / aRow);
}

}  // namespace

struct LiveCachesGl::State {
  State(const gl::Functions& functions, const LiveCachesGlOptions& chosen, gpu::GroupThreads groups)
      : gl_(functions),
        options(chosen.live),
        names(chosen.names),
        lanes(groups == gpu::GroupThreads::serial ? 1 : kParallelLanes) {}

  Status compile(const std::string& visibilityGlsl);
  Status follow(const VoxelVolume& volume);
  Status checkSize(const VoxelVolume& volume) const;
  void carry(const CellSet& next, const std::vector<std::uint32_t>& from);
  void writeMoving(const VoxelVolume& volume);
  void findStencils();
  void reflect(const LiveFrame& frame);
  void gather(const LiveFrame& frame);
  std::vector<glm::vec4> readLight() const;

  template <class T>
  void set(const gl::Program& program, const char* name, const T& value) const {
    gl::setUniform(gl_, program, name, value);
  }
  void setGrid(GLuint program) const { gl::setGrid(gl_, program, cells.grid, follows ? cells.grid.voxel : 0.0f); }
  void dispatch(const gl::Program& program, std::uint32_t threads) const { gl::runThreads(gl_, program, threads); }
  void waitForAll() const { gl::waitForShaders(gl_); }

  gl::Functions gl_;  // before all that deletes by it
  LiveOptions options;
  LiveGlNames names;
  std::string resolveGlsl;
  int lanes;
  gl::Program stencilProgram, reflectProgram, gatherProgram, carryProgram;
  CellSet cells;
  bool follows = false;  // a volume
  std::uint64_t standingVersion = 0, movingVersion = 0;
  std::uint32_t standingKept = 0;
  bool moves = false;

  gl::LitSides sides{gl_};
  gl::CellTexture cellTexture{gl_}, movingTexture{gl_};
  GrowingRows planes{gl_, gl::kBytes, RELUME_LIVE_PLANES_A_ROW};
  GrowingRows light{gl_, gl::kFloats, kTexels*RELUME_LIVE_CACHES_A_ROW},
      otherLight{gl_, gl::kFloats, kTexels*RELUME_LIVE_CACHES_A_ROW};
  GrowingRows rays{gl_, gl::kFloats, options.raysPerCell};
  GrowingBuffer stencils{gl_}, cacheVoxels{gl_}, carried{gl_};
  gl::FrameTimer<2> timer{gl_};
  double cellsMs = 0.0;
  std::vector<float> coefficients, brightest;  // read back
  bool isReadBack = false;                     // whether they are this frame's
};

Status LiveCachesGl::State::compile(const std::string& visibilityGlsl) {
  const std::array<std::pair<std::string, std::string>, 1> lanesDefine{{{"RELUME_LANES", std::to_string(lanes)}}};
  const auto make = [&](gl::Program& program, const char* path) -> Status {
    Result<gl::Program> made = gl::makeComputeProgram(gl_, path, lanesDefine);
    if (!made) return made.error();
    program = std::move(*made);
    return done();
  };
  if (Status ok = sides.compile(visibilityGlsl); !ok) return ok;
  if (Status ok = make(stencilProgram, "live_stencils.comp"); !ok) return ok;
  if (Status ok = make(reflectProgram, "live_reflect.comp"); !ok) return ok;
  if (Status ok = make(gatherProgram, "live_gather.comp"); !ok) return ok;
  return make(carryProgram, "live_carry.comp");
}

// Whether the volume fits into OpenGL's buffers and textures.
Status LiveCachesGl::State::checkSize(const VoxelVolume& volume) const {
  if (Status ok = sides.checkSize(volume); !ok) return ok;
  const GpuDevice device = gl::deviceOf(gl_, gpu::GroupThreads::parallel);
  const auto side =
      static_cast<std::uint32_t>(std::max({volume.grid().cells.x, volume.grid().cells.y, volume.grid().cells.z}));
  if (side > device.volumeSide || device.imageSide < 2 * RELUME_LIVE_PLANES_A_ROW)
    return Error{ErrorCode::unsupported, "live light: this OpenGL's textures are too small for " +
                                             std::to_string(side) + " cells along a side"};
  return done();
}

// Caches that stand in other slots keep their light: into the other texture, which takes this one's place.
void LiveCachesGl::State::carry(const CellSet& next, const std::vector<std::uint32_t>& from) {
  std::vector<std::uint32_t> voxel(next.position.size());
  for (std::size_t i = 0; i < voxel.size(); ++i) voxel[i] = gl::packVoxel(glm::ivec3(glm::floor(next.position[i])));
  cacheVoxels.reserve(4 * voxel.size());
  cacheVoxels.write(0, gl::bytesOf(voxel));
  carried.reserve(4 * from.size());
  carried.write(0, gl::bytesOf(from));
  light.reserve(1);
  otherLight.reserve(rowsOf(from.size(), RELUME_LIVE_CACHES_A_ROW));
  carried.bind(RELUME_LIVE_SLOT_CARRY);
  light.bind(RELUME_LIVE_UNIT_LIGHT);
  otherLight.bindImage(0, GL_WRITE_ONLY);
  dispatch(carryProgram, static_cast<std::uint32_t>(from.size()));
  std::swap(light, otherLight);
  isReadBack = false;
  otherLight.reserve(rowsOf(from.size(), RELUME_LIVE_CACHES_A_ROW));  // for the next time
}

// Bits of what moves, and where their sides begin.
void LiveCachesGl::State::writeMoving(const VoxelVolume& volume) {
  const VolumeGrid& grid = volume.grid();
  const VoxelLayer& moving = volume.moving();
  std::vector<glm::uvec4> texels(grid.cellCount());
  for (std::size_t c = 0; c < texels.size() && moving.occupied > 0; ++c) {
    const std::uint64_t bits = moving.bits[c];
    texels[c] = {static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32),
                 moving.first[c] + volume.standing().kept, 0};
  }
  movingTexture.write(grid.cells.x, grid.cells.y, grid.cells.z, texels.data());
}

void LiveCachesGl::State::findStencils() {
  cellTexture.bind(RELUME_LIVE_UNIT_CELLS);
  planes.bind(RELUME_LIVE_UNIT_PLANES);
  sides.bindSides();
  stencils.bind(RELUME_LIVE_SLOT_STENCILS);
  setGrid(stencilProgram.get());
  dispatch(stencilProgram, sides.count());
}

// Take over what has changed of the volume, as LiveCaches::follow().
Status LiveCachesGl::State::follow(const VoxelVolume& volume) {
  const bool stood = follows && volume.standingVersion() == standingVersion;
  if (stood && volume.movingVersion() == movingVersion) return done();
  if (Status ok = checkSize(volume); !ok) return ok;
  const bool isSame = follows && cells.grid.cells == volume.grid().cells &&
                      cells.grid.originWorld == volume.grid().originWorld && cells.grid.voxel == volume.grid().voxel;
  CellSet next = findCells(volume);
  std::vector<std::uint32_t> from(next.active.size(), kInactive);
  for (std::size_t i = 0; i < from.size() && isSame; ++i) from[i] = cells.slot[next.active[i]];
  const std::vector<glm::uvec4> texels = cellTexels(next);
  while (gl_.GetError() != GL_NO_ERROR) {
  }
  // All memory first: what is refused for want of it leaves light and volume as they were, but for their room.
  carry(next, from);
  planes.reserve(rowsOf(next.plane.size(), RELUME_LIVE_PLANES_A_ROW));
  planes.write(gl::bytesOf(next.plane));
  cellTexture.write(next.grid.cells.x, next.grid.cells.y, next.grid.cells.z, texels.data());
  cells = std::move(next);
  standingKept = volume.standing().kept;
  moves = volume.moving().occupied > 0;
  sides.follow(volume);
  stencils.reserve(20 * std::size_t{sides.count()});
  writeMoving(volume);
  standingVersion = volume.standingVersion();
  movingVersion = volume.movingVersion();
  follows = true;
  waitForAll();
  findStencils();
  waitForAll();
  if (gl_.GetError() == GL_OUT_OF_MEMORY) {
    follows = false;
    sides.leave();
    return Error{ErrorCode::unsupported, "live light: this OpenGL has not enough memory for " +
                                             std::to_string(sides.count() / 2) + " voxels and " +
                                             std::to_string(cells.active.size()) + " caches"};
  }
  return done();
}

// Radiance of the sides, with last frame's caches.
void LiveCachesGl::State::reflect(const LiveFrame& frame) {
  cellTexture.bind(RELUME_LIVE_UNIT_CELLS);
  light.bind(RELUME_LIVE_UNIT_LIGHT);
  sides.bindRadianceImage();
  sides.bindSides();
  stencils.bind(RELUME_LIVE_SLOT_STENCILS);
  sides.bindVoxels();
  sides.bindDirect();
  set(reflectProgram, "relumeBounceScale", frame.bounceScale);
  set(reflectProgram, "relumeEmissionScale", frame.emissionScale);
  dispatch(reflectProgram, sides.count());
}

void LiveCachesGl::State::gather(const LiveFrame& frame) {
  const LiveRays found = liveRays(options.raysPerCell, frame);
  std::vector<glm::vec4> texels;
  texels.reserve(2 * found.direction.size());
  for (const glm::vec3& d : found.direction) texels.emplace_back(d, 0.0f);
  for (const glm::vec3& sky : found.sky) texels.emplace_back(sky, 0.0f);
  rays.reserve(2);
  rays.write(gl::bytesOf(texels));
  cellTexture.bind(RELUME_LIVE_UNIT_CELLS);
  movingTexture.bind(RELUME_LIVE_UNIT_MOVING);
  rays.bind(RELUME_LIVE_UNIT_RAYS);
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_LIVE_UNIT_RADIANCE);
  gl_.BindTexture(GL_TEXTURE_2D, sides.radianceTexture());
  light.bindImage(0, GL_READ_WRITE);
  cacheVoxels.bind(RELUME_LIVE_SLOT_CACHES);
  const auto caches = static_cast<std::uint32_t>(cells.active.size());
  setGrid(gatherProgram.get());
  set(gatherProgram, "relumeLiveRayCount", options.raysPerCell);
  set(gatherProgram, "relumeLiveMoves", moves ? 1u : 0u);
  set(gatherProgram, "relumeLiveKept", glm::uvec2(standingKept, sides.count() / 2));
  set(gatherProgram, "relumeLiveKeep", frame.keep);
  dispatch(gatherProgram, caches * static_cast<std::uint32_t>(lanes));
}

Result<LiveCachesGl> LiveCachesGl::create(const LiveCachesGlOptions& options) {
  if (Status ok = checkLiveOptions(options.live); !ok) return ok.error();
  const Result<gl::Functions> functions = gl::loadFunctions(options.getProcAddress);
  if (!functions) return functions.error();
  if (Status ok = checkLiveGlNames(*functions, options.names); !ok) return ok.error();
  Result<std::string> resolveGlsl = liveResolveGlsl(options.names);
  if (!resolveGlsl) return resolveGlsl.error();
  const gpu::GroupThreads groups = gl::groupThreadsOf(*functions, options.groups);
  const gl::SavedState saved(*functions);
  auto state = std::make_unique<State>(*functions, options, groups);
  state->resolveGlsl = std::move(*resolveGlsl);
  if (Status ok = state->compile(options.visibilityGlsl); !ok) return ok.error();
  return LiveCachesGl(std::move(state));
}

LiveCachesGl::LiveCachesGl(std::unique_ptr<State> state) : state_(std::move(state)) {}
LiveCachesGl::LiveCachesGl(LiveCachesGl&&) noexcept = default;
LiveCachesGl& LiveCachesGl::operator=(LiveCachesGl&&) noexcept = default;
LiveCachesGl::~LiveCachesGl() = default;

Status LiveCachesGl::lightDirectly(const VoxelVolume& volume, const LightSetup& setup) {
  LightSetup punctual;
  punctual.lights = setup.lights;
  if (Status ok = checkSetup(punctual, 0, 0); !ok) return ok;
  State& s = *state_;
  try {
    const gl::SavedState saved(s.gl_);
    if (Status ok = s.follow(volume); !ok) return ok;
    s.sides.lightDirectly(setup.lights);
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
  return done();
}

Status LiveCachesGl::copyDirect(const VoxelVolume& volume) {
  State& s = *state_;
  try {
    const gl::SavedState saved(s.gl_);
    if (Status ok = s.follow(volume); !ok) return ok;
    s.sides.copyDirect(volume);
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
  return done();
}

Status LiveCachesGl::update(const VoxelVolume& volume, const LiveFrame& frame) {
  if (Status ok = checkLiveFrame(frame); !ok) return ok;
  State& s = *state_;
  try {
    const gl::SavedState saved(s.gl_);
    Stopwatch watch;
    if (Status ok = s.follow(volume); !ok) return ok;
    s.cellsMs = watch.lap();
    s.timer.mark(0);
    if (!frame.freezeVoxels) s.reflect(frame);
    s.waitForAll();
    s.timer.mark(1);
    s.gather(frame);
    s.waitForAll();
    s.timer.mark(2);
    s.timer.endFrame();
    s.isReadBack = false;
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
  return done();
}

void LiveCachesGl::reset() {
  const gl::SavedState saved(state_->gl_);
  const std::vector<std::uint32_t> from(state_->cells.active.size(), kInactive);
  state_->carry(state_->cells, from);
  state_->waitForAll();
}

std::uint32_t LiveCachesGl::directProgram() const { return state_->sides.directProgram(); }

BackendKind LiveCachesGl::fasterBackend(const GetProcAddress& getProcAddress) {
  const Result<gl::Functions> functions = gl::loadFunctions(getProcAddress);
  if (!functions) return BackendKind::cpu;
  const auto* const renderer = reinterpret_cast<const char*>(functions->GetString(GL_RENDERER));
  return gl::groupThreadsOf(renderer) == gpu::GroupThreads::serial ? BackendKind::cpu : BackendKind::gl;
}

const std::string& LiveCachesGl::glsl() const { return state_->resolveGlsl; }

void LiveCachesGl::setUniforms(std::uint32_t program) const {
  const State& s = *state_;
  const std::array<ResolvedVolume, 1> volume{{{s.cells.grid}}};
  setResolvedVolumes(s.gl_, program, s.names.prefix, std::span(volume).first(s.follows ? 1 : 0));
}

void LiveCachesGl::bind() const {
  const State& s = *state_;
  if (!s.follows) return;
  s.cellTexture.bind(s.names.textureUnits[0]);
  s.planes.bind(s.names.textureUnits[1]);
  s.light.bind(s.names.textureUnits[2]);
  s.gl_.ActiveTexture(GL_TEXTURE0);
}

glm::vec3 LiveCachesGl::irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  State& s = *state_;
  if (!s.follows) return glm::vec3(0.0f);
  if (!s.isReadBack) {
    s.coefficients = coefficients();
    s.brightest = brightest();
    s.isReadBack = true;
  }
  return readStencil(checkedStencil(s.cells, positionWorld, normal), s.coefficients, s.brightest, normal);
}

std::uint32_t LiveCachesGl::activeCells() const { return static_cast<std::uint32_t>(state_->cells.active.size()); }

// All texels of all rows.
std::vector<glm::vec4> LiveCachesGl::State::readLight() const {
  const gl::SavedState saved(gl_);
  std::vector<glm::vec4> texels(std::size_t{light.rows()} * kTexels * RELUME_LIVE_CACHES_A_ROW);
  if (texels.empty()) return texels;
  light.bind(RELUME_LIVE_UNIT_LIGHT);
  gl_.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, texels.data());
  return texels;
}

std::vector<float> LiveCachesGl::coefficients() const {
  const std::vector<glm::vec4> texels = state_->readLight();
  std::vector<float> found(std::size_t{3 * kBasis} * activeCells());
  for (std::size_t i = 0; i < activeCells(); ++i) {
    const float* const from = &texels[kTexels * i].x;
    for (std::size_t k = 0; k < kBasis; ++k) {
      for (std::size_t c = 0; c < 3; ++c) found[3 * kBasis * i + kBasis * c + k] = from[3 * k + c];
    }
  }
  return found;
}

std::vector<float> LiveCachesGl::brightest() const {
  const std::vector<glm::vec4> texels = state_->readLight();
  std::vector<float> found(activeCells());
  for (std::size_t i = 0; i < found.size(); ++i) found[i] = std::max(texels[kTexels * i + kTexels - 1].w, 0.0f);
  return found;
}

std::vector<glm::vec3> LiveCachesGl::radiance() const {
  const gl::SavedState saved(state_->gl_);
  return state_->sides.radiance();
}

const gl::LitSides& LiveCachesGl::sides() const { return state_->sides; }

std::vector<PassTime> LiveCachesGl::passTimes() const {
  const auto& ms = state_->timer.passMs();
  return {{"cells", state_->cellsMs}, {"direct", state_->sides.directMs()}, {"bounce", ms[0]}, {"gather", ms[1]}};
}

std::vector<std::pair<std::string, std::size_t>> LiveCachesGl::bufferSizes() const {
  const State& s = *state_;
  auto sizes = s.sides.bufferSizes();
  sizes.emplace_back("cells", s.cellTexture.bytes() + s.movingTexture.bytes() + s.planes.bytes() +
                                  s.cacheVoxels.bytes() + s.carried.bytes());
  sizes.emplace_back("cell light", s.light.bytes() + s.otherLight.bytes() + s.rays.bytes());
  sizes.emplace_back("side stencils", s.stencils.bytes());
  return sizes;
}

}  // namespace relume
