// SPDX-License-Identifier: MIT
// See cones_gl.h.
#include "runtime/live_gl/cones_gl.h"

#include "runtime/gl/plan_objects.h"
#include "runtime/gl/saved_state.h"
#include "runtime/live/live_frame.h"
#include "runtime/live_gl/cone_levels_gl.h"
#include "runtime/live_gl/cone_passes_gl.h"
#include "runtime/live_gl/cone_textures.h"
#include "shaders/shared/layout.h"

#include <glm/vec2.hpp>

#include <new>

namespace relume {
namespace {

using gl::conesError;

Error noRoom() { return conesError(ErrorCode::memory, "memory ran out; fewer cells or a smaller picture take less"); }

}  // namespace

struct ConesGl::State {
  State(const gl::Functions& functions, const ConesGlOptions& options, gpu::GroupThreads groups)
      : gl_(functions),
        levels(gl_, options.directions, groups),
        passes(gl_, levels, options.pixels, options.hemisphere, groups) {}

  gl::Functions gl_;  // before all that deletes by it
  gl::ConeLevels levels;
  gl::ConePasses passes;
  gl::ConeMaps maps{gl_};
};

Result<ConesGl> ConesGl::create(const ConesGlOptions& options) {
  if (Status ok = checkPixelConeOptions(options.pixels); !ok) return ok.error();
  const Result<gl::Functions> functions = gl::loadFunctions(options.getProcAddress);
  if (!functions) return functions.error();
  const gl::SavedState saved(*functions, RELUME_CONE_UNITS);
  const gpu::GroupThreads groups = gl::groupThreadsOf(*functions, options.groups);
  auto state = std::make_unique<State>(*functions, options, groups);
  if (Status ok = state->levels.compile(); !ok) return ok.error();
  if (Status ok = state->passes.compile(); !ok) return ok.error();
  return ConesGl(std::move(state));
}

ConesGl::ConesGl(std::unique_ptr<State> state) : state_(std::move(state)) {}
ConesGl::ConesGl(ConesGl&&) noexcept = default;
ConesGl& ConesGl::operator=(ConesGl&&) noexcept = default;
ConesGl::~ConesGl() = default;

Status ConesGl::fill(VolumeRange volumes, std::span<const gl::LitSides* const> lit) {
  try {
    const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
    if (volumes.size() > 1) {
      if (Status ok = state_->passes.compileNested(); !ok) return ok;
    }
    return state_->levels.fill(volumes, lit, nullptr);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
}

Status ConesGl::fill(const VoxelVolume& volume, const gl::LitSides& lit) {
  const gl::LitSides* const only = &lit;
  return fill(volume, {&only, 1});
}

namespace {

Status checkFrame(const gl::ConeLevels& levels, const LiveSky& sky) {
  if (!levels.isFilled()) return conesError(ErrorCode::usage, "there are no voxels yet: fill() goes before trace()");
  return checkLiveSky(sky);
}

}  // namespace

Status ConesGl::fill(const VoxelVolume& volume, std::span<const RsmTextures> maps, float largestFlux,
                     const glm::vec3& emissionScale) {
  State& s = *state_;
  if (Status ok = checkEmissionScale(emissionScale); !ok) return ok;
  try {
    const gl::SavedState saved(s.gl_, RELUME_CONE_UNITS);
    const auto checked = gl::checkConeMaps(s.gl_, maps, largestFlux);
    if (!checked) return checked.error();
    const gl::RsmMaps all{*checked, largestFlux, emissionScale};
    return s.levels.fill({&volume, 1}, {}, &all);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
}

Status ConesGl::fill(const VoxelVolume& volume, std::span<const RsmImage> maps, const glm::vec3& emissionScale) {
  State& s = *state_;
  if (Status ok = checkEmissionScale(emissionScale); !ok) return ok;
  if (Status ok = checkRsm(maps); !ok) return ok;
  try {
    const gl::SavedState saved(s.gl_, RELUME_CONE_UNITS);
    const auto uploaded = s.maps.upload(maps);
    if (!uploaded) return uploaded.error();
    const gl::RsmMaps all{*uploaded, largestFlux(maps), emissionScale};
    return s.levels.fill({&volume, 1}, {}, &all);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
}

Status ConesGl::trace(const PixelReceivers& pixels, const LiveSky& sky, std::span<const glm::vec4> mirrored) {
  State& s = *state_;
  if (Status ok = checkFrame(s.levels, sky); !ok) return ok;
  if (Status ok = checkPixels(pixels); !ok) return ok;
  if (!mirrored.empty() && mirrored.size() != pixels.depth.size())
    return conesError(ErrorCode::usage, "mirrored has " + std::to_string(mirrored.size()) + " pixels, expected " +
                                            std::to_string(pixels.depth.size()));
  try {
    const gl::SavedState saved(s.gl_, RELUME_CONE_UNITS);
    if (Status ok = s.passes.resize(pixels.width, pixels.height); !ok) return ok;
    s.passes.trace(pixels, sky, mirrored);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
  return done();
}

Status ConesGl::trace(const PixelTextures& pixels, const LiveSky& sky) {
  State& s = *state_;
  if (Status ok = checkFrame(s.levels, sky); !ok) return ok;
  if (Status ok = checkPixelFrame(pixels.width, pixels.height, pixels.clipFromWorld); !ok) return ok;
  const glm::ivec2 size(static_cast<int>(pixels.width), static_cast<int>(pixels.height));
  try {
    const gl::SavedState saved(s.gl_, RELUME_CONE_UNITS);
    const auto check = [&](std::uint32_t name, const char* what, bool isSigned) {
      return gl::checkConeTexture(s.gl_, name, what, size, isSigned);
    };
    if (Status ok = check(pixels.places, "places", false); !ok) return ok;
    if (Status ok = check(pixels.planes, "planes", true); !ok) return ok;
    if (Status ok = check(pixels.normals, "normals", true); !ok) return ok;
    if (pixels.mirrored != 0) {
      if (Status ok = check(pixels.mirrored, "mirrored", false); !ok) return ok;
    }
    if (Status ok = s.passes.resize(pixels.width, pixels.height); !ok) return ok;
    s.passes.trace(pixels, sky);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
  return done();
}

void ConesGl::reset() { state_->passes.reset(); }

std::uint32_t ConesGl::lightTexture() const { return state_->passes.lightTexture(); }
std::uint32_t ConesGl::glossyTexture() const { return state_->passes.glossyTexture(); }

std::vector<glm::vec4> ConesGl::light() const {
  const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
  return state_->passes.light();
}
std::vector<glm::vec3> ConesGl::glossy() const {
  const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
  const std::vector<glm::vec4> texels = state_->passes.glossy();
  return {texels.begin(), texels.end()};
}
std::vector<float> ConesGl::frames() const {
  const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
  return state_->passes.frames();
}
std::vector<std::uint8_t> ConesGl::edges() const {
  const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
  return state_->passes.edges();
}

std::vector<glm::vec3> ConesGl::sideRadiance(std::size_t volume) const {
  const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
  return state_->levels.sideRadiance(volume);
}

std::uint32_t ConesGl::levels(std::size_t volume) const { return state_->levels.levels(volume); }
std::vector<glm::vec4> ConesGl::texels(std::uint32_t level, std::size_t volume) const {
  const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
  return state_->levels.texels(level, volume);
}

std::vector<PassTime> ConesGl::passTimes() const {
  std::vector<PassTime> times = state_->levels.passTimes();
  for (const PassTime& each : state_->passes.passTimes()) times.push_back(each);
  return times;
}

std::vector<std::pair<std::string, std::size_t>> ConesGl::bufferSizes() const {
  const State& s = *state_;
  return {{"cone voxels", s.levels.voxelBytes()},
          {"cone levels", s.levels.levelBytes() + s.passes.directionBytes()},
          {"cone pixels", s.passes.pixelBytes()},
          {"cone maps", s.maps.bytes()}};
}

}  // namespace relume
