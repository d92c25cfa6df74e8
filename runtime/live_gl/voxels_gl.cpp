// SPDX-License-Identifier: MIT
// See voxels_gl.h.
#include "runtime/live_gl/voxels_gl.h"

#include "runtime/gl/errors.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/gl/saved_state.h"
#include "runtime/gl/timer.h"
#include "runtime/live_gl/live_objects.h"
#include "runtime/voxels/check_geometry.h"
#include "runtime/voxels/packed_mesh.h"
#include "runtime/voxels/step_place.h"
#include "shaders/shared/layout.h"

#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <new>

namespace relume {
namespace {

Error voxelsGlError(const std::string& what) { return {ErrorCode::usage, "voxels: " + what}; }
Error tooMuch(const std::string& what) { return {ErrorCode::unsupported, "voxels: " + what}; }

Error tooThin() {
  return tooMuch(
      "a triangle that is much larger than the grid is a sliver, which is too many pieces for "
      "OpenGL: cut it, or find its voxels on the CPU");
}

std::string sizeText(const glm::ivec3& size) {
  return std::to_string(size.x) + " x " + std::to_string(size.y) + " x " + std::to_string(size.z);
}

gl::RelumePlace pack(const StepPlace& place) {
  const auto low = [](std::int64_t v) {
    return static_cast<std::int32_t>(static_cast<std::uint64_t>(v) & 0xFFFFFFFFu);
  };
  const auto high = [](std::int64_t v) { return static_cast<std::int32_t>(v >> 32); };
  const auto row = [&](std::size_t k) {
    return glm::ivec4(place.factor[k][0], place.factor[k][1], place.factor[k][2], low(place.offset[k]));
  };
  return {row(0),
          row(1),
          row(2),
          {high(place.offset[0]), high(place.offset[1]), high(place.offset[2])},
          place.exponent,
          place.mirrored ? 1 : 0,
          0,
          0,
          0};
}

// The triangles of all parts that stand, or of all that move, as shaders read them; those that chance leaves out of a
// surface are out. False where they are more than `most`.
bool collect(const VoxelGeometry& geometry, bool moves, std::span<const std::uint32_t> firstVertex, std::size_t most,
             std::vector<glm::uvec4>& triangles) {
  for (std::uint32_t p = 0; p < geometry.parts.size(); ++p) {
    const VoxelPart& part = geometry.parts[p];
    if (part.moves != moves) continue;
    const VoxelMesh& mesh = geometry.meshes[part.mesh];
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      if (isThere(geometry.surfaces[mesh.surface[t]].coverage, t))
        triangles.emplace_back(mesh.triangle[t] + firstVertex[part.mesh], p);
    }
    if (triangles.size() > most) return false;
  }
  return true;
}

}  // namespace

struct VoxelsGl::State {
  explicit State(const gl::Functions& functions) : gl_(functions) {}

  Status make(const VoxelGeometry& geometry, gpu::GroupThreads threads);
  void voxelise(bool isMoving);
  bool isComplete() const;

  // What is of each of the two tables.
  struct Layer {
    explicit Layer(const gl::Functions& gl) : bricks(gl), timer(gl) {}
    gl::BrickTexture bricks;
    gl::Buffer triangles;
    std::uint32_t count = 0;
    gl::FrameTimer<1> timer;
  };

  gl::Functions gl_;  // before all that deletes by it
  VolumeGrid grid;
  std::vector<bool> moves;  // of each part
  std::vector<gl::RelumePlace> places;
  gl::Program clearProgram, voxeliseProgram, largeProgram;
  gl::Buffer positions, placeBuffer, large;
  gl::HostWrites writes{gl_};
  std::uint32_t blocks = 0;  // of RELUME_LIVE_BLOCK voxels on a side
  Layer standing{gl_}, moving{gl_};
};

Status VoxelsGl::State::make(const VoxelGeometry& geometry, gpu::GroupThreads threads) {
  const GpuDevice device = gl::deviceOf(gl_, threads);
  const glm::ivec3 texels = gl::brickTexels(grid.cells);
  if (std::max({texels.x, texels.y, texels.z}) > static_cast<int>(device.volumeSide))
    return tooMuch("this OpenGL's textures are too small for " + sizeText(texels) + " texels");
  std::vector<std::uint32_t> firstVertex;
  std::vector<glm::vec3> vertices;
  const std::size_t mostVertices = device.storageBytes / sizeof(glm::vec3),
                    mostTriangles = device.storageBytes / sizeof(glm::uvec4);
  for (const VoxelMesh& mesh : geometry.meshes) {
    firstVertex.push_back(static_cast<std::uint32_t>(vertices.size()));
    if (mesh.position.size() > mostVertices - vertices.size())
      return tooMuch("the meshes have more than the " + std::to_string(mostVertices) +
                     " vertices that this OpenGL's buffers hold");
    vertices.insert(vertices.end(), mesh.position.begin(), mesh.position.end());
  }
  if (sizeof(gl::RelumePlace) * geometry.parts.size() > device.storageBytes)
    return tooMuch(std::to_string(geometry.parts.size()) + " parts are more than this OpenGL's buffers hold");
  for (const VoxelPart& part : geometry.parts) {
    moves.push_back(part.moves);
    places.push_back(pack(StepPlace::of(grid, part.toWorld)));
  }
  gl::dropErrors(gl_);
  // No buffer is empty: what is bound has to have a word.
  const auto bufferOf = [this](const auto& data, GLenum usage) {
    return gl::makeBuffer(gl_, gl::bytesOf(data), std::max<std::size_t>(gl::bytesOf(data).size(), 16), usage);
  };
  positions = bufferOf(vertices, GL_STATIC_DRAW);
  placeBuffer = bufferOf(places, GL_DYNAMIC_DRAW);
  for (Layer* const layer : {&standing, &moving}) {
    std::vector<glm::uvec4> triangles;
    if (!collect(geometry, layer == &moving, firstVertex, mostTriangles, triangles))
      return tooMuch("the parts have more than the " + std::to_string(mostTriangles) +
                     " triangles that this OpenGL's buffers hold");
    layer->triangles = bufferOf(triangles, GL_STATIC_DRAW);
    layer->count = static_cast<std::uint32_t>(triangles.size());
    layer->bricks.make(grid.cells);
  }
  const std::vector<std::uint32_t> none(5 + std::max(standing.count, moving.count), 0);
  large = bufferOf(none, GL_DYNAMIC_COPY);
  const glm::ivec3 along = (grid.voxels() + RELUME_LIVE_BLOCK - 1) / RELUME_LIVE_BLOCK;
  blocks = static_cast<std::uint32_t>(along.x * along.y * along.z);
  // Software runs the threads of a group by so many as a vector has lanes, one vector after the other.
  const std::array<std::pair<std::string, std::string>, 1> lanes{
      {{"RELUME_LANES", threads == gpu::GroupThreads::serial ? "8" : "64"}}};
  const std::pair<gl::Program*, const char*> programs[] = {{&clearProgram, "live_clear.comp"},
                                                           {&voxeliseProgram, "live_voxelise.comp"},
                                                           {&largeProgram, "live_voxelise_large.comp"}};
  for (const auto& [program, path] : programs) {
    Result<gl::Program> made = gl::makeComputeProgram(gl_, path, lanes);
    if (!made) return made.error();
    *program = std::move(*made);
    const glm::uvec3 cells(grid.cells);
    gl_.ProgramUniform3ui(program->get(), gl_.GetUniformLocation(program->get(), "relumeBrickCells"), cells.x, cells.y,
                          cells.z);
  }
  if (gl::takeOutOfMemory(gl_))
    return tooMuch("this OpenGL has not enough memory for " + std::to_string(standing.count + moving.count) +
                   " triangles");
  return done();
}

// All of a layer, where `places` has it. Those of the parts that are not there are without extent, so that nothing of
// them is left.
void VoxelsGl::State::voxelise(bool isMoving) {
  Layer& layer = isMoving ? moving : standing;
  const std::array<std::uint32_t, 5> noLarge{blocks, 0, 1, 0, 0};
  writes.write(placeBuffer, 0, gl::bytesOf(places));
  writes.write(large, 0, gl::bytesOf(noLarge));
  layer.bricks.bindImage(RELUME_LIVE_IMAGE_BRICKS);
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, RELUME_LIVE_SLOT_POSITIONS, positions.get());
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, RELUME_LIVE_SLOT_TRIANGLES, layer.triangles.get());
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, RELUME_LIVE_SLOT_PLACES, placeBuffer.get());
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, RELUME_LIVE_SLOT_LARGE, large.get());
  gl_.BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, large.get());
  layer.timer.mark(0);
  gl::runThreads(gl_, clearProgram, layer.bricks.words());
  gl_.MemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  gl::runThreads(gl_, voxeliseProgram, layer.count);
  gl_.MemoryBarrier(GL_COMMAND_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
  gl_.UseProgram(largeProgram.get());
  gl_.DispatchComputeIndirect(0);
  // The next call writes the buffer of large triangles anew.
  gl_.MemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT |
                    GL_BUFFER_UPDATE_BARRIER_BIT);
  layer.timer.mark(1);
  layer.timer.endFrame();
}

// Whether the last layer has all its voxels.
bool VoxelsGl::State::isComplete() const {
  std::uint32_t unfinished = 0;
  gl_.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  gl_.BindBuffer(GL_COPY_READ_BUFFER, large.get());
  gl_.GetBufferSubData(GL_COPY_READ_BUFFER, 16, 4, &unfinished);
  return unfinished == 0;
}

Result<VoxelsGl> VoxelsGl::create(const VoxelGeometry& geometry, const VolumeGrid& grid,
                                  const VoxelsGlOptions& options) {
  if (Status ok = checkGeometry(geometry); !ok) return ok.error();
  const Result<gl::Functions> functions = gl::loadFunctions(options.getProcAddress);
  if (!functions) return functions.error();
  try {
    const gpu::GroupThreads threads = gl::groupThreadsOf(*functions, options.groups);
    auto state = std::make_unique<State>(*functions);
    const gl::SavedState saved(state->gl_);
    state->grid = grid;
    if (Status ok = state->make(geometry, threads); !ok) return ok.error();
    for (const bool isMoving : {false, true}) {
      state->voxelise(isMoving);
      if (!state->isComplete()) return tooThin();
    }
    return VoxelsGl(std::move(state));
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::memory, "voxels: memory ran out"};
  }
}

VoxelsGl::VoxelsGl(std::unique_ptr<State> state) : state_(std::move(state)) {}
VoxelsGl::VoxelsGl(VoxelsGl&&) noexcept = default;
VoxelsGl& VoxelsGl::operator=(VoxelsGl&&) noexcept = default;
VoxelsGl::~VoxelsGl() = default;

Status VoxelsGl::move(std::span<const glm::mat4x3> toWorld) {
  State& s = *state_;
  const auto count = static_cast<std::size_t>(std::count(s.moves.begin(), s.moves.end(), true));
  if (count != toWorld.size())
    return voxelsGlError("move() got " + std::to_string(toWorld.size()) + " transforms, expected one for each of " +
                         std::to_string(count) + " parts that move");
  std::size_t next = 0;
  for (std::size_t p = 0; p < s.moves.size(); ++p) {
    if (!s.moves[p]) continue;
    if (Status ok = checkTransform(toWorld[next++], p); !ok) return ok;
  }
  next = 0;
  for (std::size_t p = 0; p < s.moves.size(); ++p) {
    if (s.moves[p]) s.places[p] = pack(StepPlace::of(s.grid, toWorld[next++]));
  }
  const gl::SavedState saved(s.gl_);
  s.voxelise(true);
  return done();
}

Status VoxelsGl::edit(std::span<const PartEdit> edits) {
  State& s = *state_;
  for (const PartEdit& e : edits) {
    if (e.part >= s.moves.size())
      return voxelsGlError("edit() of part " + std::to_string(e.part) + " of " + std::to_string(s.moves.size()));
    if (s.moves[e.part])
      return voxelsGlError("edit() of part " + std::to_string(e.part) + ", which moves: move() places it");
    if (Status ok = checkTransform(e.toWorld, e.part); !ok) return ok;
  }
  for (const PartEdit& e : edits) s.places[e.part] = pack(e.present ? StepPlace::of(s.grid, e.toWorld) : StepPlace{});
  const gl::SavedState saved(s.gl_);
  s.voxelise(false);
  return s.isComplete() ? done() : Status(tooThin());
}

std::uint32_t VoxelsGl::standing() const { return state_->standing.bricks.name(); }
std::uint32_t VoxelsGl::moving() const { return state_->moving.bricks.name(); }

bool VoxelsGl::isComplete() const {
  const gl::SavedState saved(state_->gl_);
  return state_->isComplete();
}

std::vector<std::uint64_t> VoxelsGl::standingBits() const {
  const gl::SavedState saved(state_->gl_);
  return state_->standing.bricks.read();
}
std::vector<std::uint64_t> VoxelsGl::movingBits() const {
  const gl::SavedState saved(state_->gl_);
  return state_->moving.bricks.read();
}

Result<std::string> VoxelsGl::rasterGlsl() { return expandShader("live_raster.glsl", {}); }

VoxelRasterView VoxelsGl::rasterView(int axis) const {
  const VolumeGrid& grid = state_->grid;
  const int across[3] = {(axis + 1) % 3, (axis + 2) % 3, axis};  // along x, y and z of the clip space
  VoxelRasterView view;
  view.clipFromWorld = glm::mat4(0.0f);
  view.clipFromWorld[3][3] = 1.0f;
  for (int k = 0; k < 3; ++k) {
    const float scale = 2.0f / (static_cast<float>(grid.voxels()[across[k]]) * grid.voxel);
    view.clipFromWorld[across[k]][k] = scale;
    view.clipFromWorld[3][k] = -1.0f - scale * grid.originWorld[across[k]];
  }
  view.width = static_cast<std::uint32_t>(grid.voxels()[across[0]]);
  view.height = static_cast<std::uint32_t>(grid.voxels()[across[1]]);
  return view;
}

void VoxelsGl::setRasterUniforms(std::uint32_t program, int axis) const {
  const gl::Functions& gl = state_->gl_;
  const VolumeGrid& grid = state_->grid;
  const glm::vec3& o = grid.originWorld;
  const glm::uvec3 cells(grid.cells);
  gl.ProgramUniform3f(program, gl.GetUniformLocation(program, "relumeRasterOrigin"), o.x, o.y, o.z);
  gl.ProgramUniform1f(program, gl.GetUniformLocation(program, "relumeRasterVoxel"), grid.voxel);
  gl.ProgramUniform1ui(program, gl.GetUniformLocation(program, "relumeRasterAxis"), static_cast<GLuint>(axis));
  gl.ProgramUniform3ui(program, gl.GetUniformLocation(program, "relumeBrickCells"), cells.x, cells.y, cells.z);
}

Status VoxelsGl::bindRaster(std::uint32_t texture) const {
  const gl::Functions& gl = state_->gl_;
  std::string wrong;
  {
    const gl::SavedState saved(gl);
    gl.ActiveTexture(GL_TEXTURE0 + RELUME_LIVE_UNIT_CELLS);
    GLint now = 0;
    if (gl.IsTexture(texture) == GL_TRUE) {
      gl.BindTexture(GL_TEXTURE_3D, texture);
      gl.GetIntegerv(GL_TEXTURE_BINDING_3D, &now);
    }
    if (texture == 0 || static_cast<GLuint>(now) != texture) {
      gl.GetError();  // of binding a texture that is of another kind
      wrong = "is no GL_TEXTURE_3D";
    } else {
      glm::ivec3 size(0);
      GLint format = 0;
      gl.GetTexLevelParameteriv(GL_TEXTURE_3D, 0, GL_TEXTURE_WIDTH, &size.x);
      gl.GetTexLevelParameteriv(GL_TEXTURE_3D, 0, GL_TEXTURE_HEIGHT, &size.y);
      gl.GetTexLevelParameteriv(GL_TEXTURE_3D, 0, GL_TEXTURE_DEPTH, &size.z);
      gl.GetTexLevelParameteriv(GL_TEXTURE_3D, 0, GL_TEXTURE_INTERNAL_FORMAT, &format);
      const glm::ivec3 expected = gl::brickTexels(state_->grid.cells);
      if (format != static_cast<GLint>(gl::kBrickFormat)) {
        wrong = "is not of GL_R32UI";
      } else if (size != expected) {
        wrong = "has " + sizeText(size) + " texels, expected " + sizeText(expected);
      }
    }
  }
  if (!wrong.empty()) return voxelsGlError("texture " + std::to_string(texture) + " to draw into " + wrong);
  gl.BindImageTexture(RELUME_LIVE_IMAGE_BRICKS, texture, 0, GL_TRUE, 0, GL_READ_WRITE, gl::kBrickFormat);
  return done();
}

std::vector<PassTime> VoxelsGl::passTimes() const {
  return {{"voxelise", state_->standing.timer.passMs()[0]}, {"move", state_->moving.timer.passMs()[0]}};
}

std::vector<std::pair<std::string, std::size_t>> VoxelsGl::bufferSizes() const {
  const State& s = *state_;
  const auto bytes = [](const gl::Buffer& buffer) { return static_cast<std::size_t>(buffer.bytes); };
  return {{"bricks", std::size_t{4} * (s.standing.bricks.words() + s.moving.bricks.words())},
          {"voxel geometry", bytes(s.positions) + bytes(s.placeBuffer) + bytes(s.large) + bytes(s.standing.triangles) +
                                 bytes(s.moving.triangles)}};
}

}  // namespace relume
