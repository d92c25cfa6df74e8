// SPDX-License-Identifier: MIT
// See passes.h.
#include "runtime/gl/passes.h"

#include "formats/compact_links.h"
#include "formats/decimal.h"
#include "runtime/light_window.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace relume::gl {
namespace {

// Work groups of a dispatch.
constexpr GLuint kMaxGroups = 65535;

void bindStorage(const Functions& gl, GLuint slot, const Buffer& buffer) {
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, slot, buffer.get());
}

GLuint groupsFor(std::size_t threads, std::size_t group) { return static_cast<GLuint>((threads + group - 1) / group); }

void packLights(std::span<const Light> lights, std::pmr::vector<RelumeLight>& packed) {
  packed.resize(lights.size());
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const Light& from = lights[i];
    RelumeLight& to = packed[i];
    const bool directional = from.kind == LightKind::directional, spot = from.kind == LightKind::spot;
    const float cosOuter = std::cos(from.outerConeRad);
    const float coneScale = spot ? 1.0f / std::max(std::cos(from.innerConeRad) - cosOuter, 0.001f) : 0.0f;
    to.position = glm::vec4(from.positionWorld, directional ? -1.0f : inverseRangeSquared(from.range));
    // A point light's direction may hold anything, also what is not finite.
    to.direction = directional || spot ? glm::vec4(from.direction, coneScale) : glm::vec4(0.0f);
    to.intensity = glm::vec4(from.intensity, spot ? -cosOuter * coneScale : 1.0f);
  }
}

// Give a buffer new contents, growing it when needed.
void refill(const Functions& gl, Buffer& buffer, const void* data, std::size_t bytes) {
  if (bytes == 0) return;
  if (static_cast<std::size_t>(buffer.bytes) < bytes) {
    buffer = makeBuffer(gl, data, bytes, GL_STREAM_DRAW);
    return;
  }
  gl.BindBuffer(GL_COPY_WRITE_BUFFER, buffer.get());
  gl.BufferData(GL_COPY_WRITE_BUFFER, buffer.bytes, nullptr, GL_STREAM_DRAW);
  gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, static_cast<GLsizeiptr>(bytes), data);
}

}  // namespace

CacheGroup chooseCacheGroup(GroupThreads threads, const CacheBands& bands) {
  if (threads == GroupThreads::serial) return {1, 64};
  // Shared memory holds all sums of a group: 32 KiB is what every OpenGL has.
  const int bytesPerCache = 32 * static_cast<int>(2 * cacheBytes(bands));
  return {32, std::clamp(32768 / bytesPerCache, 1, 4)};
}

std::vector<std::pair<std::string, std::string>> cacheDefines(const CacheBands& bands, LinkKind kind,
                                                              const CacheGroup& group, int nodeSteps, bool map) {
  auto defines = bandDefines(map ? bands.ofMap() : CacheBands{bands.lumaBands, bands.chromaBands});
  defines.emplace_back("RELUME_MAP", map ? "1" : "0");
  defines.emplace_back("RELUME_LANES", std::to_string(group.lanes));
  defines.emplace_back("RELUME_CACHES", std::to_string(group.caches));
  // GLSL 4.30 wants a literal for the group's size.
  defines.emplace_back("RELUME_THREADS", std::to_string(group.lanes * group.caches));
  // Links packed again are a kind of the shader's own.
  defines.emplace_back("RELUME_LINK_KIND", nodeSteps < 0 ? std::to_string(static_cast<std::uint32_t>(kind)) : "6");
  defines.emplace_back("RELUME_NODE_STEPS", std::to_string(std::max(nodeSteps, 0)));
  return defines;
}

Result<BouncePass::Kernel> BouncePass::makeKernel(const Functions& gl,
                                                  std::vector<std::pair<std::string, std::string>> defines, bool grid) {
  defines.emplace_back("RELUME_BOUNCE_GRID", grid ? "1" : "0");
  Result<Program> program = makeComputeProgram(gl, "bounce_surfels.comp", defines);
  if (!program) return program.error();
  const auto location = [&](const char* name) { return gl.GetUniformLocation(program->get(), name); };
  Kernel kernel;
  kernel.first = location("relumeFirstSurfel");
  kernel.end = location("relumeEndSurfel");
  kernel.program = std::move(*program);
  return kernel;
}

Result<BouncePass> BouncePass::create(const Functions& gl, const CacheBands& bands) {
  const auto defines = bandDefines(bands);
  Result<Kernel> tilted = makeKernel(gl, defines, false), gridded = makeKernel(gl, defines, true);
  if (!tilted) return tilted.error();
  if (!gridded) return gridded.error();
  BouncePass pass;
  pass.tilted_ = std::move(*tilted);
  pass.gridded_ = std::move(*gridded);
  return pass;
}

bool BouncePass::runKernel(const Functions& gl, const Kernel& kernel, GLuint first, GLuint end) {
  if (first == end) return false;
  const GLuint program = kernel.program.get();
  gl.UseProgram(program);
  gl.ProgramUniform1ui(program, kernel.first, first);
  gl.ProgramUniform1ui(program, kernel.end, end);
  gl.DispatchCompute(groupsFor(end - first, RELUME_SURFEL_GROUP), 1, 1);
  return true;
}

bool BouncePass::run(const Functions& gl, const GpuBake& gpu) const {
  bindStorage(gl, RELUME_SLOT_SURFELS, gpu.surfels);
  bindStorage(gl, RELUME_SLOT_LEAF_NODE, gpu.leafNode);
  bindStorage(gl, RELUME_SLOT_NODES, gpu.nodes);
  bindStorage(gl, RELUME_SLOT_GRIDDED, gpu.gridded);
  bindResolve(gl, gpu);
  const bool tilted = runKernel(gl, tilted_, gpu.flatEnd, gpu.tiltedEnd);
  return runKernel(gl, gridded_, gpu.tiltedEnd, gpu.surfelEnd) || tilted;
}

Result<SurfelPass> SurfelPass::create(const Functions& gl, std::string_view visibilityGlsl,
                                      std::pmr::memory_resource* memory) {
  Result<Program> program = makeComputeProgram(gl, "light_surfels.comp", {}, visibilityGlsl);
  if (!program) return program.error();
  SurfelPass pass(memory);
  pass.program_ = std::move(*program);
  pass.lights_ = makeBuffer(gl, nullptr, 0, GL_STREAM_DRAW);
  pass.host_ = makeBuffer(gl, nullptr, 0, GL_STREAM_DRAW);
  const auto location = [&](const char* name) { return gl.GetUniformLocation(pass.program_.get(), name); };
  pass.litOnGpu_ = location("relumeLitOnGpu");
  pass.emits_ = location("relumeEmits");
  pass.boxOrigin_ = location("relumeBoxOrigin");
  pass.boxStep_ = location("relumeBoxStep");
  pass.flatEnd_ = location("relumeFlatEnd");
  pass.surfelEnd_ = location("relumeSurfelEnd");
  pass.senderEnd_ = location("relumeSenderEnd");
  pass.lightCount_ = location("relumeLightCount");
  pass.mapSize_ = location("relumeMapSize");
  pass.hostOffset_ = location("relumeHostOffset");
  pass.emissionScale_ = location("relumeEmissionScale");
  pass.skyRadiance_ = location("relumeSkyRadiance");
  pass.bounceScale_ = location("relumeBounceScale");
  return pass;
}

GLuint SurfelPass::lightBuffer(const Functions& gl, const GpuBake& gpu) {
  if (surfelLight_.get() == 0) {
    surfelLight_ =
        makeBuffer(gl, nullptr, std::max<std::size_t>(gpu.surfelEnd, 1) * sizeof(glm::vec4), GL_DYNAMIC_COPY);
  }
  return surfelLight_.get();
}

void SurfelPass::reserve(const Functions& gl, GpuBake& gpu, const Bake& bake, const LightSetup& setup) {
  packed_.reserve(setup.lights.size());
  const bool irradiance = !setup.surfelIrradiance.empty(), emission = !setup.surfelEmission.empty();
  if (irradiance || emission) orderSurfels(gl, bake, gpu);
  hostColors_.reserve((irradiance ? gpu.surfelOrder.size() : 0) + (emission ? gpu.surfelOrder.size() : 0) +
                      (setup.skyPatches.empty() ? 0 : gpu.skyOrder.size()));
}

void SurfelPass::run(const Functions& gl, GpuBake& gpu, const Bake& bake, const LightSetup& setup, bool bounce) {
  packLights(setup.lights, packed_);
  refill(gl, lights_, packed_.data(), packed_.size() * sizeof(RelumeLight));
  if (!setup.surfelIrradiance.empty() || !setup.surfelEmission.empty()) orderSurfels(gl, bake, gpu);
  // What the host hands over, one after the other: a colour a surfel and a colour a patch, in their order here.
  std::pmr::vector<glm::vec4>& host = hostColors_;
  host.clear();
  const auto append = [&host](std::span<const glm::vec3> colors, std::span<const std::uint32_t> order) {
    if (colors.empty()) return GLuint{kRelumeNone};
    const auto offset = static_cast<GLuint>(host.size());
    for (const std::uint32_t i : order) host.emplace_back(i == kRelumeNone ? glm::vec3(0.0f) : colors[i], 0.0f);
    return offset;
  };
  const GLuint irradiance = append(setup.surfelIrradiance, gpu.surfelOrder),
               emission = append(setup.surfelEmission, gpu.surfelOrder), sky = append(setup.skyPatches, gpu.skyOrder);
  refill(gl, host_, host.data(), host.size() * sizeof(glm::vec4));

  const GLuint program = program_.get();
  gl.UseProgram(program);
  gl.ProgramUniform1i(program, litOnGpu_, setup.surfelIrradianceOnGpu ? 1 : 0);
  const bool drives = !setup.materialEmissions.empty();
  gl.ProgramUniform1i(program, emits_, gpu.emits && (drives || setup.surfelEmission.empty()) ? 1 : 0);
  gl.ProgramUniform3fv(program, boxOrigin_, 1, &gpu.box.origin.x);
  gl.ProgramUniform3fv(program, boxStep_, 1, &gpu.box.step.x);
  gl.ProgramUniform1ui(program, flatEnd_, gpu.flatEnd);
  gl.ProgramUniform2ui(program, mapSize_, std::max(gpu.mapWidth, 1u), std::max(gpu.mapHeight, 1u));
  gl.ProgramUniform1ui(program, surfelEnd_, gpu.surfelEnd);
  gl.ProgramUniform1ui(program, senderEnd_, gpu.senderEnd);
  gl.ProgramUniform1ui(program, lightCount_, static_cast<GLuint>(packed_.size()));
  gl.ProgramUniform3ui(program, hostOffset_, irradiance, emission, sky);
  const glm::vec3 scale = drives ? glm::vec3(1.0f) : setup.emissionScale;
  gl.ProgramUniform3f(program, emissionScale_, scale.x, scale.y, scale.z);
  gl.ProgramUniform3f(program, skyRadiance_, setup.skyRadiance.x, setup.skyRadiance.y, setup.skyRadiance.z);
  gl.ProgramUniform1f(program, bounceScale_, bounce ? setup.bounceScale : 0.0f);
  bindStorage(gl, RELUME_SLOT_SURFELS, gpu.surfels);
  bindStorage(gl, RELUME_SLOT_LEAF_NODE, gpu.leafNode);
  bindStorage(gl, RELUME_SLOT_LIGHTS, lights_);
  bindStorage(gl, RELUME_SLOT_HOST, host_);
  if (setup.surfelIrradianceOnGpu) {
    lightBuffer(gl, gpu);
    bindStorage(gl, RELUME_SLOT_SURFEL_LIGHT, surfelLight_);
  }
  bindStorage(gl, RELUME_SLOT_NODES, gpu.nodes);
  bindStorage(gl, RELUME_SLOT_TEXELS, gpu.texels);
  bindStorage(gl, RELUME_SLOT_EMISSION, gpu.emission);
  gl.DispatchCompute(groupsFor(gpu.senderEnd, RELUME_SURFEL_GROUP), 1, 1);
}

Result<PullPass> PullPass::create(const Functions& gl, const PullGroup& group) {
  PullPass pass;
  for (const bool top : {false, true}) {
    const std::array<std::pair<std::string, std::string>, 2> defines{
        {{"RELUME_PULL_THREADS", std::to_string(group.threads)}, {"RELUME_PULL_TOP", top ? "1" : "0"}}};
    Result<Program> program = makeComputeProgram(gl, "pull.comp", defines);
    if (!program) return program.error();
    (top ? pass.top_ : pass.groups_) = std::move(*program);
  }
  pass.firstGroup_ = gl.GetUniformLocation(pass.groups_.get(), "relumeFirst");
  pass.firstRound_ = gl.GetUniformLocation(pass.top_.get(), "relumeFirst");
  pass.endRound_ = gl.GetUniformLocation(pass.top_.get(), "relumeEndRound");
  return pass;
}

void PullPass::run(const Functions& gl, const GpuBake& gpu, void (*barrier)(const Functions& gl)) const {
  gl.UseProgram(groups_.get());
  bindStorage(gl, RELUME_SLOT_PULL, gpu.pullNode);
  bindStorage(gl, RELUME_SLOT_RUNS, gpu.pullRuns);
  bindStorage(gl, RELUME_SLOT_ROUNDS, gpu.pullRounds);
  bindStorage(gl, RELUME_SLOT_NODES, gpu.nodes);
  // The number of groups of one dispatch is limited.
  for (GLuint first = 0; first < gpu.pullGroupCount; first += kMaxGroups) {
    gl.ProgramUniform1ui(groups_.get(), firstGroup_, first);
    gl.DispatchCompute(std::min(gpu.pullGroupCount - first, kMaxGroups), 1, 1);
  }
  if (gpu.pullRoundCount == 0) return;
  barrier(gl);
  // The top's rounds come after the groups' beginnings, which are one more than groups.
  const GLuint firstRound = gpu.pullGroupCount + 1;
  gl.UseProgram(top_.get());
  gl.ProgramUniform1ui(top_.get(), firstRound_, firstRound);
  gl.ProgramUniform1ui(top_.get(), endRound_, firstRound + gpu.pullRoundCount);
  gl.DispatchCompute(1, 1, 1);
}

Result<CachePass::Kernel> CachePass::makeKernel(const Functions& gl, const CacheBands& bands, LinkKind kind,
                                                int nodeSteps, GroupThreads threads, bool map) {
  Kernel kernel;
  kernel.group = chooseCacheGroup(threads, map ? bands.ofMap() : bands);
  Result<Program> program =
      makeComputeProgram(gl, "light_caches.comp", cacheDefines(bands, kind, kernel.group, nodeSteps, map));
  if (!program) return program.error();
  kernel.program = std::move(*program);
  const auto location = [&](const char* name) { return gl.GetUniformLocation(kernel.program.get(), name); };
  kernel.firstCache = location("relumeFirstCache");
  kernel.endCache = location("relumeEndCache");
  kernel.firstLink = location("relumeFirstLink");
  kernel.wordOffset = location("relumeWordOffset");
  kernel.halfOffset = location("relumeHalfOffset");
  kernel.shapeStride = location("relumeShapeStride");
  kernel.gridLinks = location("relumeGridLinks");
  kernel.firstMapCache = location("relumeFirstMapCache");
  kernel.mapWidth = location("relumeMapWidth");
  return kernel;
}

Result<CachePass> CachePass::create(const Functions& gl, const CacheBands& bands, LinkKind kind, int nodeSteps,
                                    GroupThreads threads) {
  Result<Kernel> grid = makeKernel(gl, bands, kind, nodeSteps, threads, false),
                 map = makeKernel(gl, bands, kind, nodeSteps, threads, true);
  if (!grid) return grid.error();
  if (!map) return map.error();
  CachePass pass;
  pass.grid_ = std::move(*grid);
  pass.map_ = std::move(*map);
  return pass;
}

void CachePass::run(const Functions& gl, const GpuBake& gpu, const Links& links) const {
  bindStorage(gl, RELUME_SLOT_ROWS, gpu.rows);
  bindStorage(gl, RELUME_SLOT_NODES, gpu.nodes);
  gl.ActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_NORMAL);
  gl.BindTexture(GL_TEXTURE_2D, gpu.mapNormal.get());
  gl.BindSampler(RELUME_RESOLVE_UNIT_NORMAL, 0);
  const auto bindImage = [&gl](GLuint unit, const Texture& texture) {
    gl.BindImageTexture(unit, texture.get(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA16F);
  };
  bindImage(RELUME_IMAGE_Y, gpu.mapY);
  bindImage(RELUME_IMAGE_CO, gpu.mapCo);
  bindImage(RELUME_IMAGE_CG, gpu.mapCg);
  for (const LinkBatch& batch : gpu.batches)
    runBatch(gl, batch.firstCache < gpu.firstMapCache ? grid_ : map_, gpu, links, batch);
}

void CachePass::runBatch(const Functions& gl, const Kernel& kernel, const GpuBake& gpu, const Links& links,
                         const LinkBatch& batch) const {
  const GLuint program = kernel.program.get();
  gl.UseProgram(program);
  if (batch.firstCache < gpu.firstMapCache) {
    bindStorage(gl, RELUME_RESOLVE_SLOT_CACHES, gpu.caches);
  } else {
    bindStorage(gl, RELUME_SLOT_MAP_TEXELS, gpu.mapTexels);
    bindStorage(gl, RELUME_SLOT_TEXELS, gpu.texels);
    gl.ProgramUniform1ui(program, kernel.firstMapCache, gpu.firstMapCache);
    gl.ProgramUniform1ui(program, kernel.mapWidth, gpu.mapWidth);
  }
  gl.BindBufferRange(GL_SHADER_STORAGE_BUFFER, RELUME_SLOT_LINKS, gpu.links.get(), batch.linkStart, batch.linkBytes);
  gl.BindBufferRange(GL_SHADER_STORAGE_BUFFER, RELUME_SLOT_LINK_SHAPE, gpu.linkShape.get(), batch.shapeStart,
                     batch.shapeBytes);
  gl.ProgramUniform1ui(program, kernel.shapeStride, links.bands * links.bands);
  gl.ProgramUniform1ui(program, kernel.gridLinks, static_cast<GLuint>(links.shape.size()));
  gl.ProgramUniform1ui(program, kernel.firstLink, batch.firstLink);
  gl.ProgramUniform1ui(program, kernel.wordOffset, batch.wordOffset);
  gl.ProgramUniform1ui(program, kernel.halfOffset, batch.halfOffset);
  gl.ProgramUniform1ui(program, kernel.endCache, batch.endCache);
  // The number of groups of one dispatch is limited.
  const auto perGroup = static_cast<GLuint>(kernel.group.caches);
  for (GLuint first = batch.firstCache; first < batch.endCache; first += kMaxGroups * perGroup) {
    gl.ProgramUniform1ui(program, kernel.firstCache, first);
    gl.DispatchCompute(std::min(groupsFor(batch.endCache - first, perGroup), kMaxGroups), 1, 1);
  }
}

Result<GridTexturePass::Kernel> GridTexturePass::makeKernel(const Functions& gl, const CacheBands& bands, bool texels) {
  auto defines = bandDefines(bands);
  defines.emplace_back("RELUME_FILL_TEXELS", texels ? "1" : "0");
  Result<Program> program = makeComputeProgram(gl, "fill_grid_texture.comp", defines);
  if (!program) return program.error();
  const auto location = [&](const char* name) { return gl.GetUniformLocation(program->get(), name); };
  Kernel kernel;
  kernel.first = location("relumeFirst");
  kernel.end = location("relumeEnd");
  kernel.resolution = location("relumeResolution");
  kernel.program = std::move(*program);
  return kernel;
}

Result<GridTexturePass> GridTexturePass::create(const Functions& gl, const CacheBands& bands) {
  Result<Kernel> vectors = makeKernel(gl, bands, false), texels = makeKernel(gl, bands, true);
  if (!vectors) return vectors.error();
  if (!texels) return texels.error();
  GridTexturePass pass;
  pass.vectors_ = std::move(*vectors);
  pass.texels_ = std::move(*texels);
  return pass;
}

void GridTexturePass::runKernel(const Functions& gl, const Kernel& kernel, GLuint count) {
  const GLuint program = kernel.program.get();
  gl.UseProgram(program);
  gl.ProgramUniform1ui(program, kernel.end, count);
  // The number of groups of one dispatch is limited.
  for (GLuint first = 0; first < count; first += kMaxGroups * RELUME_FILL_GROUP) {
    gl.ProgramUniform1ui(program, kernel.first, first);
    gl.DispatchCompute(std::min(groupsFor(count - first, RELUME_FILL_GROUP), kMaxGroups), 1, 1);
  }
}

void GridTexturePass::run(const Functions& gl, const GpuBake& gpu, const GridTexture& texture,
                          void (*barrier)(const Functions& gl)) const {
  bindStorage(gl, RELUME_RESOLVE_SLOT_CACHES, gpu.caches);
  bindStorage(gl, RELUME_SLOT_FACTORS, gpu.gridFactors);
  bindStorage(gl, RELUME_SLOT_SHARES, gpu.gridShares);
  bindStorage(gl, RELUME_SLOT_VECTORS, gpu.gridVectors);
  gl.BindImageTexture(RELUME_IMAGE_GRID_VECTORS, gpu.gridTexels.get(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA16F);
  gl.BindImageTexture(RELUME_IMAGE_GRID_CHROMA, gpu.gridChroma.get(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RG16F);
  runKernel(gl, vectors_, texture.cacheCount);
  barrier(gl);
  const glm::uvec3 r = texture.resolution;
  gl.ProgramUniform3ui(texels_.program.get(), texels_.resolution, r.x, r.y, r.z);
  runKernel(gl, texels_, 6 * texture.points());
}

void bindGridTextures(const Functions& gl, const GpuBake& gpu) {
  const auto bind = [&gl](GLuint unit, const Texture& texture) {
    gl.ActiveTexture(GL_TEXTURE0 + unit);
    gl.BindTexture(GL_TEXTURE_3D, texture.get());
    gl.BindSampler(unit, 0);
  };
  bind(RELUME_RESOLVE_UNIT_GRID_VECTORS, gpu.gridTexels);
  bind(RELUME_RESOLVE_UNIT_GRID_CHROMA, gpu.gridChroma);
  bind(RELUME_RESOLVE_UNIT_GRID_OPEN, gpu.gridOpen);
}

void bindResolve(const Functions& gl, const GpuBake& gpu) {
  const auto bindTexture = [&gl](GLuint unit, GLenum target, const Texture& texture) {
    gl.ActiveTexture(GL_TEXTURE0 + unit);
    gl.BindTexture(target, texture.get());
    gl.BindSampler(unit, 0);
  };
  bindTexture(RELUME_RESOLVE_UNIT_Y, GL_TEXTURE_2D_ARRAY, gpu.mapY);
  bindTexture(RELUME_RESOLVE_UNIT_CO, GL_TEXTURE_2D_ARRAY, gpu.mapCo);
  bindTexture(RELUME_RESOLVE_UNIT_CG, GL_TEXTURE_2D_ARRAY, gpu.mapCg);
  bindTexture(RELUME_RESOLVE_UNIT_NORMAL, GL_TEXTURE_2D, gpu.mapNormal);
  bindStorage(gl, RELUME_RESOLVE_SLOT_CACHES, gpu.caches);
  bindStorage(gl, RELUME_RESOLVE_SLOT_GRID, gpu.gridCache);
  gl.BindBufferBase(GL_UNIFORM_BUFFER, RELUME_RESOLVE_SLOT_UNIFORMS, gpu.resolve.get());
}

}  // namespace relume::gl
