// SPDX-License-Identifier: MIT
// See bake_voxels_gl.h.
#include "runtime/live_gl/bake_voxels_gl.h"

#include "runtime/check_setup.h"
#include "runtime/cones/rsm_voxels.h"
#include "runtime/gl/errors.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/gl/saved_state.h"
#include "runtime/live_gl/lit_sides.h"
#include "runtime/shared/resolve_defines.h"

#include <bit>
#include <new>

namespace relume {
namespace {

Error noMemoryForSides() { return {ErrorCode::memory, "voxels lit by a bake: memory ran out; fewer cells take less"}; }

}  // namespace

struct BakeVoxelsGl::State {
  explicit State(const gl::Functions& functions) : gl_(functions) {}
  void writeSenders(const SurfelVoxels& surfels);

  gl::Functions gl_;  // before all that deletes by it
  gl::Program program;
  gl::LitSides sides{gl_};
  gl::GrowingBuffer senders{gl_};
  std::uint64_t standingVersion = 0;  // that the senders are of, 0 = none
  gl::FrameTimer<1> timer{gl_};
};

void BakeVoxelsGl::State::writeSenders(const SurfelVoxels& surfels) {
  std::vector<std::uint32_t> words(surfels.first().begin(), surfels.first().end());
  words.reserve(words.size() + 2 * surfels.senders().size());
  for (const SurfelVoxels::Sender& sender : surfels.senders()) {
    words.push_back(sender.node);
    words.push_back(std::bit_cast<std::uint32_t>(sender.weight));
  }
  senders.reserve(sizeof(std::uint32_t) * words.size());
  senders.write(0, gl::bytesOf(words));
}

Result<BakeVoxelsGl> BakeVoxelsGl::create(const BakeVoxelsGlOptions& options) {
  const Result<gl::Functions> functions = gl::loadFunctions(options.getProcAddress);
  if (!functions) return functions.error();
  const gl::SavedState saved(*functions);
  auto state = std::make_unique<State>(*functions);
  if (Status ok = state->sides.compile(options.visibilityGlsl); !ok) return ok.error();
  const auto defines = resolveDefines({options.lumaBands, options.chromaBands, false, false});
  Result<gl::Program> made = gl::makeComputeProgram(state->gl_, "live_bake.comp", defines);
  if (!made) return made.error();
  state->program = std::move(*made);
  return BakeVoxelsGl(std::move(state));
}

BakeVoxelsGl::BakeVoxelsGl(std::unique_ptr<State> state) : state_(std::move(state)) {}
BakeVoxelsGl::BakeVoxelsGl(BakeVoxelsGl&&) noexcept = default;
BakeVoxelsGl& BakeVoxelsGl::operator=(BakeVoxelsGl&&) noexcept = default;
BakeVoxelsGl::~BakeVoxelsGl() = default;

Status BakeVoxelsGl::light(const VoxelVolume& volume, const SurfelVoxels& surfels, const GlResolveInputs& inputs,
                           std::span<const Light> lights, const glm::vec3& emissionScale) {
  LightSetup punctual;
  punctual.lights = lights;
  if (Status ok = checkSetup(punctual, 0, 0); !ok) return ok;
  if (Status ok = checkEmissionScale(emissionScale); !ok) return ok;
  if (Status ok = surfels.checkVolume(volume); !ok) return ok;
  for (const std::uint32_t name : {inputs.nodes, inputs.caches, inputs.gridIndex, inputs.uniforms}) {
    if (name == 0) return Error{ErrorCode::usage, "voxels lit by a bake: the inputs are not those of a GL relighter"};
  }
  State& s = *state_;
  try {
    const gl::SavedState saved(s.gl_);
    if (Status ok = s.sides.checkSize(volume); !ok) return ok;
    gl::dropErrors(s.gl_);
    s.sides.follow(volume);
    if (s.standingVersion != volume.standingVersion()) {
      s.writeSenders(surfels);
      s.standingVersion = volume.standingVersion();
    }
    if (gl::takeOutOfMemory(s.gl_)) {
      s.sides.leave();
      s.standingVersion = 0;
      return Error{ErrorCode::unsupported, "voxels lit by a bake: this OpenGL has not enough memory for " +
                                               std::to_string(s.sides.count() / 2) + " voxels"};
    }
    s.sides.lightDirectly(lights);

    s.sides.bindSides();
    s.sides.bindVoxels();
    s.sides.bindDirect();
    s.sides.bindRadianceImage();
    s.senders.bind(RELUME_LIVE_SLOT_SENDERS);
    const auto bind = [&s](GLenum target, GLuint slot, GLuint buffer) { s.gl_.BindBufferBase(target, slot, buffer); };
    bind(GL_SHADER_STORAGE_BUFFER, RELUME_LIVE_SLOT_NODES, inputs.nodes);
    bind(GL_SHADER_STORAGE_BUFFER, RELUME_RESOLVE_SLOT_CACHES, inputs.caches);
    bind(GL_SHADER_STORAGE_BUFFER, RELUME_RESOLVE_SLOT_GRID, inputs.gridIndex);
    bind(GL_UNIFORM_BUFFER, RELUME_RESOLVE_SLOT_UNIFORMS, inputs.uniforms);
    gl::setGrid(s.gl_, s.program.get(), volume.grid(), volume.grid().voxel);
    gl::setUniform(s.gl_, s.program, "relumeBakeSides", volume.standingSides());
    gl::setUniform(s.gl_, s.program, "relumeEmissionScale", emissionScale);
    s.timer.mark(0);
    gl::runThreads(s.gl_, s.program, s.sides.count());
    gl::waitForShaders(s.gl_);
    s.timer.mark(1);
    s.timer.endFrame();
  } catch (const std::bad_alloc&) {
    return noMemoryForSides();
  }
  return done();
}

const gl::LitSides& BakeVoxelsGl::sides() const { return state_->sides; }
std::uint32_t BakeVoxelsGl::directProgram() const { return state_->sides.directProgram(); }

std::vector<glm::vec3> BakeVoxelsGl::radiance() const {
  const gl::SavedState saved(state_->gl_);
  return state_->sides.radiance();
}

std::vector<PassTime> BakeVoxelsGl::passTimes() const {
  return {{"direct", state_->sides.directMs()}, {"voxels by the bake", state_->timer.passMs()[0]}};
}

std::vector<std::pair<std::string, std::size_t>> BakeVoxelsGl::bufferSizes() const {
  auto sizes = state_->sides.bufferSizes();
  sizes.emplace_back("surfels in voxels", state_->senders.bytes());
  return sizes;
}

}  // namespace relume
