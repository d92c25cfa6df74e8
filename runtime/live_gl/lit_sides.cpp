// SPDX-License-Identifier: MIT
// See lit_sides.h.
#include "runtime/live_gl/lit_sides.h"

#include "runtime/check_setup.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/passes/pack_lights.h"

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <array>

namespace relume::gl {
namespace {

// What shaders read of one layer's sides and voxels (shaders/shared/layout.h).
struct PackedLayer {
  std::vector<glm::vec4> sides;                    // three a side
  std::vector<glm::uvec2> voxels;                  // a voxel
  std::vector<std::array<glm::uvec2, 4>> samples;  // a side

  PackedLayer(const VoxelLayer& layer, const VolumeGrid& grid) {
    sides.reserve(3 * std::size_t{layer.sideCount()});
    samples.reserve(layer.sideCount());
    voxels.reserve(layer.kept);
    auto emits = layer.emission.begin();
    forVoxels<CellSides>(layer, grid, 0, layer.kept,
                         [&](std::uint32_t v, const glm::ivec3& voxel, const std::array<VoxelSide, 2>& both) {
                           const std::uint32_t emitters = layer.emitters.empty() ? 0u : layer.emitters[v];
                           voxels.emplace_back(packAxis(glm::ivec3(layer.axis[v])) | emitters << 24, packVoxel(voxel));
                           for (std::uint32_t s = 0; s < 2; ++s) {
                             const VoxelSide& side = both[s];
                             const bool isEmitter = emits != layer.emission.end() && emits->side == 2 * v + s;
                             const glm::vec3 emission = isEmitter ? (emits++)->emission : glm::vec3(0.0f);
                             sides.emplace_back(glm::vec3(voxel) + 0.5f + side.place, side.albedo.x);
                             sides.emplace_back(side.normal, side.albedo.y);
                             sides.emplace_back(emission, side.albedo.z);
                           }
                         });
    forVoxels<CellSurfaces>(layer, grid, 0, layer.kept,
                            [&](std::uint32_t, const glm::ivec3&, const std::array<SideSurface, 2>& both) {
                              for (const SideSurface& side : both) {
                                std::array<glm::uvec2, 4>& to = samples.emplace_back();
                                for (std::size_t k = 0; k < 4; ++k) to[k] = packSample(side.samples[k]);
                              }
                            });
  }

  static glm::uvec2 packSample(const SideSample& sample) {
    const glm::uvec3 place = glm::uvec3(sample.place()) & 255u, normal = glm::uvec3(sample.normal()) & 255u;
    return {place.x | place.y << 8 | place.z << 16 | normal.x << 24, normal.y | normal.z << 8 | sample.count() << 16};
  }
};

}  // namespace

LitSides::LitSides(const Functions& gl)
    : gl_(gl),
      directProgram_(std::make_shared<Program>()),
      sides_(gl),
      samples_(gl),
      voxels_(gl),
      direct_(gl),
      lights_(gl),
      radiance_(std::make_shared<GrowingRows>(gl, kFloats, RELUME_LIVE_SIDES_A_ROW)),
      timer_(gl) {}

LitSides::LitSides(const Functions& gl, const LitSides& first) : LitSides(gl) {
  directProgram_ = first.directProgram_;
  radiance_ = first.radiance_;
}

Status LitSides::compile(const std::string& visibilityGlsl) {
  Result<Program> made = makeComputeProgram(gl_, "live_direct.comp", {}, visibilityGlsl);
  if (!made) return made.error();
  *directProgram_ = std::move(*made);
  return done();
}

Status LitSides::checkSize(const VoxelVolume& volume) const {
  const GpuDevice device = deviceOf(gl_, gpu::GroupThreads::parallel);
  const std::size_t bytes = 3 * sizeof(glm::vec4) * volume.sideCount();
  if (bytes > device.storageBytes || rowsOfSides(volume.sideCount()) >= device.imageSide)
    return Error{ErrorCode::unsupported, "light on voxels: " + std::to_string(volume.sideCount() / 2) +
                                             " of them are more than this OpenGL's buffers hold; use fewer cells"};
  return done();
}

void LitSides::follow(const VoxelVolume& volume, std::uint32_t firstRow) {
  firstRow_ = firstRow;
  const bool stood = follows_ && volume.standingVersion() == standingVersion_;
  if (stood && volume.movingVersion() == movingVersion_) return;
  // Until all is there: memory that runs out in between leaves buffers that have part of it, or nothing.
  follows_ = false;
  grid_ = volume.grid();
  const std::size_t standing = volume.standingSides(), all = volume.sideCount();
  bool grown = false;
  const std::pair<GrowingBuffer*, std::size_t> buffers[] = {
      {&sides_, 48}, {&samples_, 32}, {&voxels_, 4}, {&direct_, 16}};
  for (const auto& [buffer, bytes] : buffers) grown = buffer->reserve(bytes * all) || grown;
  radiance_->reserve(firstRow + rowsOfSides(all));
  const auto write = [&](const VoxelLayer& layer, std::size_t first) {
    const PackedLayer packed(layer, grid_);
    sides_.write(48 * first, bytesOf(packed.sides));
    samples_.write(32 * first, bytesOf(packed.samples));
    voxels_.write(4 * first, bytesOf(packed.voxels));
  };
  if (grown || !stood) {
    write(volume.standing(), 0);
    direct_.clear();
  } else {
    const std::vector<glm::vec4> dark(all - standing, glm::vec4(0.0f));
    direct_.write(16 * standing, bytesOf(dark));
  }
  write(volume.moving(), standing);
  count_ = volume.sideCount();
  emits_ = !volume.standing().emission.empty() || !volume.moving().emission.empty();
  standingVersion_ = volume.standingVersion();
  movingVersion_ = volume.movingVersion();
  follows_ = true;
}

void LitSides::lightDirectly(std::span<const Light> lights) {
  normaliseLights(lights, normalised_);
  gpu::packLights(normalised_, packed_);
  lights_.reserve(packed_.size() * sizeof(RelumeLight));
  lights_.write(0, bytesOf(packed_));
  samples_.bind(RELUME_LIVE_SLOT_SAMPLES);
  voxels_.bind(RELUME_LIVE_SLOT_VOXELS);
  lights_.bind(RELUME_LIVE_SLOT_LIGHTS);
  direct_.bind(RELUME_LIVE_SLOT_DIRECT);
  setGrid(gl_, directProgram_->get(), grid_, grid_.voxel);
  setUniform(gl_, *directProgram_, "relumeLightCount", static_cast<std::uint32_t>(packed_.size()));
  timer_.mark(0);
  runThreads(gl_, *directProgram_, count_);
  timer_.mark(1);
  timer_.endFrame();
  waitForShaders(gl_);
}

void LitSides::copyDirect(const VoxelVolume& volume) {
  std::vector<glm::vec4> light;
  light.reserve(volume.sideCount());
  for (std::uint32_t s = 0; s < volume.sideCount(); ++s) light.emplace_back(volume.directOf(s), 0.0f);
  direct_.write(0, bytesOf(light));
}

bool LitSides::isOf(const VoxelVolume& volume) const {
  return follows_ && standingVersion_ == volume.standingVersion() && movingVersion_ == volume.movingVersion() &&
         count_ == volume.sideCount();
}

std::vector<glm::vec3> LitSides::radiance() const {
  std::vector<glm::vec4> texels(std::size_t{radiance_->rows()} * RELUME_LIVE_SIDES_A_ROW);
  if (!texels.empty()) {
    radiance_->bind(RELUME_LIVE_UNIT_LIGHT);
    gl_.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, texels.data());
  }
  const auto begin = texels.begin() + static_cast<std::ptrdiff_t>(std::size_t{firstRow_} * RELUME_LIVE_SIDES_A_ROW);
  return {begin, begin + static_cast<std::ptrdiff_t>(count_)};
}

std::vector<std::pair<std::string, std::size_t>> LitSides::bufferSizes() const {
  return {{"voxel sides", sides_.bytes() + samples_.bytes() + voxels_.bytes()},
          {"voxel light", direct_.bytes() + (firstRow_ == 0 ? radiance_->bytes() : 0) + lights_.bytes()}};
}

void setGrid(const Functions& gl, GLuint program, const VolumeGrid& grid, float voxel) {
  const glm::vec3& o = grid.originWorld;
  const glm::uvec3 size(grid.cells);
  gl.ProgramUniform3f(program, gl.GetUniformLocation(program, "relumeLiveOrigin"), o.x, o.y, o.z);
  gl.ProgramUniform1f(program, gl.GetUniformLocation(program, "relumeLiveVoxel"), voxel);
  gl.ProgramUniform3ui(program, gl.GetUniformLocation(program, "relumeLiveSize"), size.x, size.y, size.z);
}

}  // namespace relume::gl
