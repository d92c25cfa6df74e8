// SPDX-License-Identifier: MIT
// See gl_backend.h.
#include "runtime/gl/gl_backend.h"

#include "formats/decimal.h"
#include "formats/pack.h"
#include "runtime/gl/saved_state.h"
#include "runtime/shared/pack_color.h"
#include "shaders/shared/layout.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace relume::gl {
namespace {

void storageBarrier(const Functions& gl) { gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT); }

// All layers of an array of RGBA16F. State must be saved.
void readTexture(const Functions& gl, GLuint texture, std::uint16_t* halves) {
  gl.ActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_Y);
  gl.BindTexture(GL_TEXTURE_2D_ARRAY, texture);
  gl.GetTexImage(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA, GL_HALF_FLOAT, halves);
}

constexpr std::size_t kWordHalves = 4;

// Coefficients of a channel from words that lie `stride` halves apart, without what pads the last one.
void unpackChannel(int bands, const std::uint16_t* word, std::size_t stride, float* coefficients) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(bands * bands); ++i)
    coefficients[i] = unpackHalf(word[stride * (i / kWordHalves) + i % kWordHalves]);
}

}  // namespace

Result<Owned<GlBackend>> GlBackend::create(const Functions& gl, const Bake& bake, const CacheBands& bands,
                                           std::string_view visibilityGlsl, const ImageSizes& images,
                                           GridTexture texture, std::pmr::memory_resource* memory,
                                           std::optional<GroupThreads> wanted) {
  const GroupThreads threads =
      wanted ? *wanted : groupThreadsOf(reinterpret_cast<const char*>(gl.GetString(GL_RENDERER)));
  const SavedState saved(gl);
  Owned<GlBackend> backend = makeOwned<GlBackend>(memory, gl, bake, bands, images, std::move(texture), memory);
  Result<GpuBake> gpu = uploadBake(backend->gl_, bake, backend->texture_, bands, threads, memory);
  if (!gpu) return gpu.error();
  backend->gpu_ = std::move(*gpu);
  Result<BouncePass> bounce = BouncePass::create(backend->gl_, bands);
  if (!bounce) return bounce.error();
  backend->bounce_ = std::move(*bounce);
  Result<DrivePass> drive = DrivePass::create(backend->gl_, bake.emitters, images, memory);
  if (!drive) return drive.error();
  backend->drive_ = std::move(*drive);
  Result<SurfelPass> surfels = SurfelPass::create(backend->gl_, visibilityGlsl, memory);
  if (!surfels) return surfels.error();
  backend->surfels_ = std::move(*surfels);
  Result<PullPass> pull = PullPass::create(backend->gl_, backend->gpu_.pullGroup);
  if (!pull) return pull.error();
  backend->pull_ = std::move(*pull);
  Result<CachePass> caches = CachePass::create(backend->gl_, bands, bake.links.kind, backend->gpu_.nodeSteps, threads);
  if (!caches) return caches.error();
  backend->caches_ = std::move(*caches);
  if (!backend->texture_.empty()) {
    Result<GridTexturePass> fill = GridTexturePass::create(backend->gl_, bands);
    if (!fill) return fill.error();
    backend->fill_ = std::move(*fill);
    backend->fill_.run(backend->gl_, backend->gpu_, backend->texture_, storageBarrier);
    backend->gl_.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  }
  Result<std::string> resolve = expandShader("resolve.glsl", resolveDefines(bands, !backend->texture_.empty()));
  if (!resolve) return resolve.error();
  backend->resolveGlsl_ = std::move(*resolve);
  const auto text = [](const glm::vec3& v) {
    return "vec3(" + decimalGlsl(v.x) + ", " + decimalGlsl(v.y) + ", " + decimalGlsl(v.z) + ")";
  };
  const std::array<std::pair<std::string, std::string>, 4> defines{
      {{"RELUME_SURFEL_SLOTS", std::to_string(backend->gpu_.surfelEnd) + "u"},
       {"RELUME_SURFEL_ORIGIN", text(backend->gpu_.box.origin)},
       {"RELUME_SURFEL_STEP", text(backend->gpu_.box.step)},
       {"RELUME_SURFEL_RADIUS", decimalGlsl(std::sqrt(bake.surfels.areaEach / std::numbers::pi_v<float>))}}};
  Result<std::string> surfelGlsl = expandShader("surfels.glsl", defines);
  if (!surfelGlsl) return surfelGlsl.error();
  backend->surfelGlsl_ = std::move(*surfelGlsl);
  return backend;
}

void GlBackend::bindSurfels() const {
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, RELUME_SURFELS_SLOT_WORDS, gpu_.surfels.get());
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, RELUME_SURFELS_SLOT_LIGHT, surfels_.lightBuffer(gl_, gpu_));
}

void GlBackend::reserve(const LightSetup& setup) {
  if (!setup.materialEmissions.empty()) {
    const SavedState saved(gl_);
    drive_.reserve(gl_, setup, driven_);
  }
  surfels_.reserve(gl_, gpu_, bake_, setup);
}

// Write the emission of this frame, where it is not that of the frame before.
void GlBackend::driveEmitters(const LightSetup& setup) {
  const bool drives = !setup.materialEmissions.empty();
  if (!drives && !drove_) return;
  driven_.begin(setup.materialEmissions, {});
  // Light of surfels that is handed over has their baked emission already.
  const glm::vec3 undriven =
      !drives ? glm::vec3(1.0f) : (setup.surfelEmission.empty() ? setup.emissionScale : glm::vec3(0.0f));
  drive_.run(gl_, gpu_, driven_, undriven);
  driven_.end();
  drove_ = drives;
  storageBarrier(gl_);
}

std::vector<std::pair<std::string, std::size_t>> GlBackend::bufferSizes() const {
  auto sizes = gpu_.bufferSizes();
  sizes.emplace_back("emission", driven_.bytes() + drive_.textureBytes());
  return sizes;
}

void GlBackend::relight(const LightSetup& setup) {
  const SavedState saved(gl_);
  timer_.mark(0);
  if (setup.surfelIrradianceOnGpu) storageBarrier(gl_);  // what the host's shader has written
  driveEmitters(setup);
  const bool bounces = lit_ && setup.bounceScale > 0.0f;
  if (bounces && bounce_.run(gl_, gpu_)) storageBarrier(gl_);
  surfels_.run(gl_, gpu_, bake_, setup, bounces);
  storageBarrier(gl_);
  timer_.mark(1);
  pull_.run(gl_, gpu_, storageBarrier);
  storageBarrier(gl_);
  timer_.mark(2);
  caches_.run(gl_, gpu_, bake_.links);
  timer_.mark(3);
  if (!texture_.empty()) {
    storageBarrier(gl_);
    fill_.run(gl_, gpu_, texture_, storageBarrier);
  }
  // The host's shaders, and the next frame's surfels, sample the light map; readers copy buffers.
  gl_.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                    GL_TEXTURE_UPDATE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  timer_.mark(4);
  timer_.endFrame();
  lit_ = true;
  readBack_ = texelsReadBack_ = false;
}

void GlBackend::reset() {
  const SavedState saved(gl_);
  clearLight(gl_, bake_, bands_, gpu_, memory_);
  if (!texture_.empty()) {
    // The texture of caches without light.
    fill_.run(gl_, gpu_, texture_, storageBarrier);
    gl_.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  }
  lit_ = false;
  readBack_ = texelsReadBack_ = false;
}

std::span<const float> GlBackend::coefficients() const {
  if (readBack_) return coefficients_;
  const SavedState saved(gl_);
  const std::array<int, 3> bands = {bands_.lumaBands, bands_.chromaBands, bands_.chromaBands};
  const std::size_t perCache = bands_.stride();
  coefficients_.assign(perCache * bake_.caches.count(), 0.0f);

  // Of the grid's caches, the buffer.
  const std::size_t stride = cacheBytes(bands_) / sizeof(std::uint16_t);
  const auto halves = readBuffer<std::uint16_t>(gl_, gpu_.caches, stride * gpu_.firstMapCache, memory_);
  for (std::size_t cache = 0; cache < gpu_.firstMapCache; ++cache) {
    const std::uint16_t* from = halves.data() + stride * cache;
    float* to = coefficients_.data() + perCache * cache;
    for (const int l : bands) {
      unpackChannel(l, from, kWordHalves, to);
      from += kWordHalves * static_cast<std::size_t>(wordsOf(l));
      to += l * l;
    }
  }

  // Of the light map's caches, one of the texels that hold them.
  const Array<std::uint32_t>& map = bake_.caches.lightmap.cache;
  const std::array<GLuint, 3> textures = {gpu_.mapY.get(), gpu_.mapCo.get(), gpu_.mapCg.get()};
  std::size_t channel = 0;  // its first coefficient in a cache
  for (std::size_t k = 0; k < bands.size() && !map.empty(); ++k) {
    const int held = bands_.onMap(bands[k]);
    const std::size_t layer = kWordHalves * map.size();
    std::pmr::vector<std::uint16_t> texels(layer * static_cast<std::size_t>(wordsOf(held)), memory_);
    readTexture(gl_, textures[k], texels.data());
    for (std::size_t t = 0; t < map.size(); ++t) {
      if (map[t] != kNoCache)
        unpackChannel(held, &texels[kWordHalves * t], layer, &coefficients_[perCache * map[t] + channel]);
    }
    channel += static_cast<std::size_t>(bands[k] * bands[k]);
  }
  readBack_ = true;
  return coefficients_;
}

std::span<const float> GlBackend::gridTexels() const {
  if (texelsReadBack_ || texture_.empty()) return texels_;
  const SavedState saved(gl_);
  const glm::uvec3 r = texture_.resolution;
  const std::size_t slab = std::size_t{r.x} * r.y, texels = slab * static_cast<std::size_t>(textureDepth(r.z));
  std::pmr::vector<std::uint16_t> luma(4 * texels, memory_), chroma(2 * texels, memory_);
  const auto read = [this](const Texture& texture, GLenum format, std::uint16_t* to) {
    gl_.ActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_Y);
    gl_.BindTexture(GL_TEXTURE_3D, texture.get());
    gl_.GetTexImage(GL_TEXTURE_3D, 0, format, GL_HALF_FLOAT, to);
  };
  read(gpu_.gridTexels, GL_RGBA, luma.data());
  read(gpu_.gridChroma, GL_RG, chroma.data());
  texels_.assign(kTexelFloats * 6 * texture_.points(), 0.0f);
  for (std::size_t half = 0; half < 6; ++half) {
    for (std::size_t point = 0; point < texture_.points(); ++point) {
      const std::size_t from = half * (std::size_t{r.z} + 1) * slab + point;
      float* to = &texels_[kTexelFloats * (6 * point + half)];
      for (std::size_t k = 0; k < 4; ++k) to[k] = unpackHalf(luma[4 * from + k]);
      for (std::size_t k = 0; k < 2; ++k) to[4 + k] = unpackHalf(chroma[2 * from + k]);
    }
  }
  texelsReadBack_ = true;
  return texels_;
}

void GlBackend::bind() const {
  bindResolve(gl_, gpu_);
  if (!texture_.empty()) bindGridTextures(gl_, gpu_);
}

std::vector<glm::vec3> GlBackend::nodeRadiosity() const {
  const auto packed = readBuffer<std::uint32_t>(gl_, gpu_.nodes, bake_.hierarchy.nodeCount(), memory_);
  std::vector<glm::vec3> radiosity;
  radiosity.reserve(packed.size());
  for (const std::uint32_t node : packed) radiosity.push_back(unpackColor(node));
  return radiosity;
}

std::vector<PassTime> GlBackend::passTimes() const {
  const auto& ms = timer_.passMs();
  std::vector<PassTime> times{{"surfels", ms[0]}, {"pull", ms[1]}, {"caches", ms[2]}};
  if (!texture_.empty()) times.push_back({"grid texture", ms[3]});
  return times;
}

GlResolveInputs GlBackend::inputs() const {
  return {gpu_.mapY.get(),      gpu_.mapCo.get(),   gpu_.mapCg.get(),      gpu_.mapNormal.get(),  gpu_.caches.get(),
          gpu_.gridCache.get(), gpu_.resolve.get(), gpu_.gridTexels.get(), gpu_.gridChroma.get(), gpu_.gridOpen.get()};
}

}  // namespace relume::gl

namespace relume {

Result<Owned<Backend>> makeGlBackend(const Bake& bake, const BackendRequest& request) {
  const Result<gl::Functions> functions = gl::loadFunctions(request.options.getProcAddress);
  if (!functions) return functions.error();
  GridTexture texture = makeGridTexture(bake, request, gl::max3dSide(*functions));
  // Where the driver cannot bind its shares receivers read the caches around.
  if (sizeof(std::uint32_t) * (texture.begin.size() + texture.shares.size()) > gl::maxStorageBytes(*functions))
    texture = GridTexture(request.memory);
  Result<Owned<gl::GlBackend>> made =
      gl::GlBackend::create(*functions, bake, request.bands, request.options.visibilityGlsl, request.images,
                            std::move(texture), request.memory);
  if (!made) return made.error();
  return Owned<Backend>(std::move(*made));
}

}  // namespace relume
