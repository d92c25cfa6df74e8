// SPDX-License-Identifier: MIT
// See live_caches_gl.h.
#include "runtime/live_gl/live_caches_gl.h"

#include "runtime/check_setup.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/gl/saved_state.h"
#include "runtime/gl/timer.h"
#include "runtime/live/nested_caches.h"
#include "runtime/live/open_air.h"
#include "runtime/live_gl/live_resolve_gl.h"
#include "runtime/live_gl/nested_volumes_gl.h"
#include "runtime/shared/stopwatch.h"
#include "runtime/voxels/radiance_along.h"

#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <new>
#include <utility>

namespace relume {
namespace {

using gl::FollowedVolume, gl::GrowingRows, gl::kTexelsOfCache;

constexpr std::uint32_t kBasis = 9;  // of a channel
constexpr int kParallelLanes = 32;

}  // namespace

struct LiveCachesGl::State {
  State(const gl::Functions& functions, const LiveCachesGlOptions& chosen, gpu::GroupThreads groups)
      : gl_(functions),
        options(chosen.live),
        names(chosen.names),
        lanes(groups == gpu::GroupThreads::serial ? 1 : kParallelLanes) {}

  Status compile(const std::string& visibilityGlsl);
  Status makeGather(gl::Program& program, bool isNested) const;
  Status follow(VolumeRange range);
  void reflect(const FollowedVolume& volume, const LiveFrame& frame);
  void writeRays(const LiveFrame& frame);
  void gather(std::size_t level, const LiveFrame& frame);
  std::vector<glm::vec4> readLight() const;
  void readBack();

  template <class T>
  void set(const gl::Program& program, const std::string& name, const T& value) const {
    gl::setUniform(gl_, program, name.c_str(), value);
  }
  void waitForAll() const { gl::waitForShaders(gl_); }

  gl::Functions gl_;  // before all that deletes by it
  LiveOptions options;
  LiveGlNames names;
  std::string resolveGlsl;
  int lanes;
  gl::Program reflectProgram, gatherProgram;
  gl::Program nestedGatherProgram;  // once there are several volumes
  gl::NestedVolumesGl volumes{gl_};
  GrowingRows rays{gl_, gl::kFloats, options.raysPerCell};
  gl::FrameTimer<2> timer{gl_};
  double followMs = 0.0, cellsMs = 0.0;        // since the last frame; of that
  CacheSum sky;                                // as NestedCaches's
  std::vector<float> coefficients, brightest;  // read back, by slots
  bool isReadBack = false;                     // whether they are this frame's
};

Status LiveCachesGl::State::makeGather(gl::Program& program, bool isNested) const {
  const std::array<std::pair<std::string, std::string>, 2> defines{
      {{"RELUME_LANES", std::to_string(lanes)}, {"RELUME_LIVE_NESTED", "1"}}};
  Result<gl::Program> made =
      gl::makeComputeProgram(gl_, "live_gather.comp", std::span(defines).first(isNested ? 2 : 1));
  if (!made) return made.error();
  program = std::move(*made);
  return done();
}

Status LiveCachesGl::State::compile(const std::string& visibilityGlsl) {
  if (Status ok = volumes.compile(visibilityGlsl); !ok) return ok;
  Result<gl::Program> made = gl::makeComputeProgram(gl_, "live_reflect.comp", {});
  if (!made) return made.error();
  reflectProgram = std::move(*made);
  return makeGather(gatherProgram, false);
}

Status LiveCachesGl::State::follow(VolumeRange range) {
  if (range.size() > 1 && !nestedGatherProgram.get()) {
    if (Status ok = makeGather(nestedGatherProgram, true); !ok) return ok;
  }
  isReadBack = false;
  Stopwatch watch;
  Status ok = volumes.follow(range);
  followMs += watch.lap();
  return ok;
}

// Radiance of the sides, with last frame's caches.
void LiveCachesGl::State::reflect(const FollowedVolume& volume, const LiveFrame& frame) {
  volumes.cells().bind(RELUME_LIVE_UNIT_CELLS);
  volumes.light().bind(RELUME_LIVE_UNIT_LIGHT);
  volume.sides.bindRadianceImage();
  volume.sides.bindSides();
  volume.stencils.bind(RELUME_LIVE_SLOT_STENCILS);
  volume.sides.bindVoxels();
  volume.sides.bindDirect();
  set(reflectProgram, "relumeLiveLayer", volume.at.layer);
  set(reflectProgram, "relumeFirstRow", static_cast<std::int32_t>(volume.sides.firstRow()));
  set(reflectProgram, "relumeBounceScale", frame.bounceScale);
  set(reflectProgram, "relumeEmissionScale", frame.emissionScale);
  gl::runThreads(gl_, reflectProgram, volume.sides.count());
}

void LiveCachesGl::State::writeRays(const LiveFrame& frame) {
  const LiveRays found = liveRays(options.raysPerCell, frame);
  std::vector<glm::vec4> texels;
  texels.reserve(2 * found.direction.size());
  for (const glm::vec3& d : found.direction) texels.emplace_back(d, 0.0f);
  for (const glm::vec3& along : found.sky) texels.emplace_back(along, 0.0f);
  rays.reserve(2);
  rays.write(gl::bytesOf(texels));
}

void LiveCachesGl::State::gather(std::size_t level, const LiveFrame& frame) {
  const FollowedVolume& volume = volumes[level];
  volumes.standing().bind(RELUME_LIVE_UNIT_CELLS);
  volumes.moving().bind(RELUME_LIVE_UNIT_MOVING);
  rays.bind(RELUME_LIVE_UNIT_RAYS);
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_LIVE_UNIT_RADIANCE);
  gl_.BindTexture(GL_TEXTURE_2D, volume.sides.radianceTexture());
  volumes.light().bindImage(0, GL_READ_WRITE);
  volumes.cacheVoxels().bind(RELUME_LIVE_SLOT_CACHES);
  volumes.rayCells().bind(RELUME_LIVE_SLOT_RAY_CELLS);
  volumes.subVoxels().bind(RELUME_LIVE_SLOT_SUB_VOXELS);
  const gl::Program& program = level > 0 ? nestedGatherProgram : gatherProgram;
  set(program, "relumeLiveRayCount", options.raysPerCell);
  set(program, "relumeLiveFirstCache", volume.at.firstCache);
  set(program, "relumeLiveKeep", frame.keep);
  std::uint32_t emits = 0;
  for (std::size_t v = 0; v <= level; ++v) emits |= volumes[v].sides.emits() ? 1u : 0u;
  set(program, "relumeLiveEmits", emits);
  set(program, "relumeLiveRow", glm::uvec2(volumes.cells().size()));
  if (level == 0) {
    gl::setGrid(gl_, program.get(), volume.cells.grid, volume.cells.grid.voxel);
    set(program, "relumeLiveMoves", volume.moves ? 1u : 0u);
    set(program, "relumeLiveEnd", volume.ends());
  }
  for (std::size_t v = 0; level > 0 && v <= level; ++v) {
    const FollowedVolume& each = volumes[v];
    const VolumeGrid& grid = each.cells.grid;
    const std::string element = "[" + std::to_string(v) + "]";
    set(program, "relumeLiveSizes" + element, glm::uvec3(grid.cells));
    set(program, "relumeLiveLayers" + element, static_cast<std::uint32_t>(each.at.layer));
    set(program, "relumeLiveMoving" + element, each.moves ? 1u : 0u);
    set(program, "relumeLiveEnds" + element, each.ends());
    if (v > 0) set(program, "relumeLiveToOuter" + element, placeInOuter(grid, volumes[v - 1].cells.grid, glm::vec3(0)));
  }
  set(program, "relumeLiveVolume", static_cast<std::uint32_t>(level));
  const auto caches = static_cast<std::uint32_t>(volume.cells.active.size());
  gl::runThreads(gl_, program, caches * static_cast<std::uint32_t>(lanes));
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

Status LiveCachesGl::lightDirectly(VolumeRange volumes, const LightSetup& setup) {
  LightSetup punctual;
  punctual.lights = setup.lights;
  if (Status ok = checkSetup(punctual, 0, 0); !ok) return ok;
  State& s = *state_;
  try {
    const gl::SavedState saved(s.gl_);
    if (Status ok = s.follow(volumes); !ok) return ok;
    for (std::size_t l = 0; l < volumes.size(); ++l) s.volumes[l].sides.lightDirectly(setup.lights);
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
  return done();
}

Status LiveCachesGl::copyDirect(VolumeRange volumes) {
  State& s = *state_;
  try {
    const gl::SavedState saved(s.gl_);
    if (Status ok = s.follow(volumes); !ok) return ok;
    for (std::size_t l = 0; l < volumes.size(); ++l) s.volumes[l].sides.copyDirect(volumes[l]);
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
  return done();
}

Status LiveCachesGl::update(VolumeRange volumes, const LiveFrame& frame) {
  if (Status ok = checkLiveFrame(frame); !ok) return ok;
  State& s = *state_;
  try {
    const gl::SavedState saved(s.gl_);
    if (Status ok = s.follow(volumes); !ok) return ok;
    const CacheSum sky = s.volumes.hasSky() ? skySum(frame) : CacheSum{};
    s.writeRays(frame);
    s.cellsMs = std::exchange(s.followMs, 0.0);
    s.timer.mark(0);
    for (std::size_t l = 0; l < volumes.size(); ++l) {
      // Sides that are new have no radiance to freeze.
      const bool isNew = std::exchange(s.volumes[l].lostRadiance, false);
      if (!frame.freezeVoxels || isNew) s.reflect(s.volumes[l], frame);
    }
    s.waitForAll();
    s.timer.mark(1);
    for (std::size_t l = 0; l < volumes.size(); ++l) s.gather(l, frame);
    s.waitForAll();
    if (s.volumes.hasSky()) s.volumes.writeSky(sky);
    s.timer.mark(2);
    s.timer.endFrame();
    s.sky = sky;
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
  return done();
}

void LiveCachesGl::takeReach(VolumeRange volumes) { state_->volumes.takeReach(volumes); }

void LiveCachesGl::reset() {
  const gl::SavedState saved(state_->gl_);
  state_->volumes.reset();
  state_->sky = {};
  state_->isReadBack = false;
}

std::uint32_t LiveCachesGl::directProgram() const { return state_->volumes.outermostSides().directProgram(); }

BackendKind LiveCachesGl::fasterBackend(const GetProcAddress& getProcAddress) {
  const Result<gl::Functions> functions = gl::loadFunctions(getProcAddress);
  if (!functions) return BackendKind::cpu;
  const auto* const renderer = reinterpret_cast<const char*>(functions->GetString(GL_RENDERER));
  return gl::groupThreadsOf(renderer) == gpu::GroupThreads::serial ? BackendKind::cpu : BackendKind::gl;
}

const std::string& LiveCachesGl::glsl() const { return state_->resolveGlsl; }

Status LiveCachesGl::checkTextureUnits(std::uint32_t program) const {
  return relume::checkTextureUnits(state_->gl_, program, state_->names);
}

bool LiveCachesGl::hasUniforms(std::uint32_t program) const {
  return hasResolvedVolumes(state_->gl_, program, state_->names.prefix);
}

void LiveCachesGl::setUniforms(std::uint32_t program) const {
  const State& s = *state_;
  std::array<ResolvedVolume, kMaxCascades> resolved;
  for (std::size_t l = 0; l < s.volumes.size(); ++l) {
    const FollowedVolume& volume = s.volumes[l];
    resolved[l] = {volume.cells.grid, volume.at.layer, volume.reach};
  }
  setResolvedVolumes(s.gl_, program, s.names.prefix, std::span(resolved).first(s.volumes.size()));
}

void LiveCachesGl::bind() const {
  const State& s = *state_;
  if (s.volumes.size() == 0) return;
  const auto active = static_cast<GLenum>(gl::integerOf(s.gl_, GL_ACTIVE_TEXTURE));
  s.volumes.cells().bind(s.names.textureUnits[0]);
  s.volumes.subVoxelTexels().bind(s.names.textureUnits[1]);
  s.volumes.light().bind(s.names.textureUnits[2]);
  // By a host's sampler that filters, textures of integers are not complete: they read as zeros.
  for (const std::uint32_t unit : s.names.textureUnits) s.gl_.BindSampler(unit, 0);
  s.gl_.ActiveTexture(active);
}

// All texels of all rows.
std::vector<glm::vec4> LiveCachesGl::State::readLight() const {
  const gl::SavedState saved(gl_);
  const GrowingRows& light = volumes.light();
  std::vector<glm::vec4> texels(std::size_t{light.rows()} * kTexelsOfCache * RELUME_LIVE_CACHES_A_ROW);
  if (texels.empty()) return texels;
  light.bind(RELUME_LIVE_UNIT_LIGHT);
  gl_.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, texels.data());
  return texels;
}

void LiveCachesGl::State::readBack() {
  if (isReadBack) return;
  const std::vector<glm::vec4> texels = readLight();
  const std::size_t slots = texels.size() / kTexelsOfCache;
  coefficients.resize(3 * kBasis * slots);
  brightest.resize(slots);
  for (std::size_t i = 0; i < slots; ++i) {
    const float* const from = &texels[kTexelsOfCache * i].x;
    for (std::size_t k = 0; k < kBasis; ++k) {
      for (std::size_t c = 0; c < 3; ++c) coefficients[3 * kBasis * i + kBasis * c + k] = from[3 * k + c];
    }
    brightest[i] = std::max(from[3 * kBasis], 0.0f);
  }
  isReadBack = true;
}

glm::vec3 LiveCachesGl::irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  State& s = *state_;
  const std::size_t count = s.volumes.size();
  if (count == 0) return glm::vec3(0.0f);
  s.readBack();
  std::array<VolumeCaches, kMaxCascades> caches;
  for (std::size_t l = 0; l < count; ++l) {
    const FollowedVolume& volume = s.volumes[l];
    caches[l] = {&volume.cells, volume.reach, std::span(s.coefficients).subspan(3 * kBasis * volume.at.firstCache),
                 std::span(s.brightest).subspan(volume.at.firstCache)};
  }
  const std::span<const VolumeCaches> all(caches.data(), count);
  return receivedIrradiance(all, s.sky, positionWorld, normal);
}

std::uint32_t LiveCachesGl::activeCells() const { return state_->volumes.activeCells(); }

std::vector<float> LiveCachesGl::coefficients(std::size_t level) const {
  const FollowedVolume& volume = state_->volumes[level];
  state_->readBack();
  const auto begin = state_->coefficients.begin() + std::ptrdiff_t{3 * kBasis} * volume.at.firstCache;
  return {begin, begin + static_cast<std::ptrdiff_t>(3 * kBasis * volume.cells.active.size())};
}

std::vector<float> LiveCachesGl::brightest(std::size_t level) const {
  const FollowedVolume& volume = state_->volumes[level];
  state_->readBack();
  const auto begin = state_->brightest.begin() + volume.at.firstCache;
  return {begin, begin + static_cast<std::ptrdiff_t>(volume.cells.active.size())};
}

std::vector<glm::vec3> LiveCachesGl::radiance(std::size_t level) const {
  const gl::SavedState saved(state_->gl_);
  return state_->volumes[level].sides.radiance();
}

const gl::LitSides& LiveCachesGl::sides(std::size_t level) const {
  return level == 0 ? state_->volumes.outermostSides() : state_->volumes[level].sides;
}

std::vector<PassTime> LiveCachesGl::passTimes() const {
  State& s = *state_;
  const auto& ms = s.timer.passMs();
  double direct = 0.0;
  for (std::size_t l = 0; l < s.volumes.size(); ++l) direct += s.volumes[l].sides.directMs();
  return {{"cells", s.cellsMs}, {"direct", direct}, {"bounce", ms[0]}, {"gather", ms[1]}};
}

std::vector<std::pair<std::string, std::size_t>> LiveCachesGl::bufferSizes() const {
  auto sizes = state_->volumes.bufferSizes();
  for (auto& [name, bytes] : sizes) {
    if (name == "cell light") bytes += state_->rays.bytes();
  }
  return sizes;
}

}  // namespace relume
