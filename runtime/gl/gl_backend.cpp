// SPDX-License-Identifier: MIT
// See gl_backend.h.
#include "runtime/gl/gl_backend.h"

#include "formats/pack.h"
#include "runtime/gl/saved_state.h"
#include "runtime/passes/pack_textures.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/resolve_defines.h"
#include "runtime/shared/shader_text.h"
#include "shaders/shared/layout.h"

#include <array>
#include <utility>

namespace relume::gl {
namespace {

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
                                           std::uint32_t movingParts, std::uint32_t movingLag,
                                           std::optional<gpu::GroupThreads> wanted) {
  const gpu::GroupThreads threads = groupThreadsOf(gl, wanted);
  const SavedState saved(gl);
  Result<Owned<gpu::FramePlan>> plan =
      gpu::FramePlan::create(bake, texture, bands, images, deviceOf(gl, threads), memory, movingParts, movingLag);
  if (!plan) return plan.error();
  Owned<GlBackend> backend =
      makeOwned<GlBackend>(memory, gl, bake, bands, images, std::move(texture), std::move(*plan), memory);
  if (Status ok = backend->objects_.make(visibilityGlsl); !ok) return ok.error();
  backend->plan_->forgetContents();
  if (!backend->texture_.empty()) {
    backend->run(backend->plan_->fill(), false);
    backend->gl_.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  }
  Result<std::string> resolve = expandShader("resolve.glsl", resolveDefines(bands, !backend->texture_.empty()));
  if (!resolve) return resolve.error();
  backend->resolveGlsl_ = std::move(*resolve);
  Result<std::string> surfelGlsl = backend->plan_->surfelGlsl();
  if (!surfelGlsl) return surfelGlsl.error();
  backend->surfelGlsl_ = std::move(*surfelGlsl);
  return backend;
}

void GlBackend::bindSurfels() const {
  if (!objects_.hasSurfelLight()) {
    const SavedState saved(gl_);
    objects_.makeSurfelLight();
  }
  // The box of the surfels is in the text: no uniform buffer of the host's is touched.
  objects_.bind(plan_->surfelBindings().first(2));
}

void GlBackend::reserve(const LightSetup& setup) {
  const SavedState saved(gl_);
  for (const MaterialEmission& emission : setup.materialEmissions) {
    if (!emission.image.empty()) objects_.makeDrivenImage(*plan_->drivenImage(emission.material));
  }
  if (setup.surfelIrradianceOnGpu) objects_.makeSurfelLight();
  plan_->reserve(setup);
}

std::vector<std::pair<std::string, std::size_t>> GlBackend::bufferSizes() const {
  const auto bytes = [this](std::initializer_list<std::uint32_t> buffers) {
    std::size_t sum = 0;
    for (const std::uint32_t each : buffers) sum += objects_.bufferBytes(each);
    return sum;
  };
  const std::size_t grid = texture_.empty() ? 0 : objects_.gridTextureBytes();
  std::vector<std::pair<std::string, std::size_t>> sizes{
      {"surfels", bytes({gpu::kSurfelWords, gpu::kEmission, gpu::kEmitters}) + plan_->orderBytes()},
      {"hierarchy", bytes({gpu::kPullNode, gpu::kPullRuns, gpu::kPullRounds, gpu::kLeafNode})},
      {"radiosity", bytes({gpu::kNodes})},
      {"links", bytes({gpu::kRows, gpu::kLinks, gpu::kLinkShape})},
      {"caches", bytes({gpu::kCacheLight})},
      {"bounce", bytes({gpu::kTexelColors, gpu::kGridded})},
      {"index", bytes({gpu::kMapTexels, gpu::kGrid, gpu::kResolve})},
      {"lightmap", objects_.textureBytes(GpuUse::light) + objects_.textureBytes(GpuUse::constant) - grid}};
  if (grid > 0)
    sizes.emplace_back("grid texture", grid + bytes({gpu::kGridFactors, gpu::kGridShares, gpu::kGridVectors}));
  if (plan_->movingParts() > 0) {
    sizes.emplace_back("moving parts", plan_->movingBytes() + bytes({gpu::kSenderPoints, gpu::kMovingParts,
                                                                     gpu::kMovingShapes, gpu::kMovingLight}));
  }
  sizes.emplace_back("emission", plan_->drivenBytes() + objects_.textureBytes(GpuUse::frame));
  return sizes;
}

void GlBackend::run(const GpuFrame& frame, bool mark) {
  objects_.upload(frame.uploads);
  // The passes of step 2 are one to the timer.
  std::size_t marked = static_cast<std::size_t>(GpuPass::surfels);
  for (std::size_t i = 0; i < frame.dispatches.size(); ++i) {
    const auto pass = static_cast<std::size_t>(frame.dispatches[i].pass);
    for (; mark && marked < pass; ++marked) timer_.mark(marked);
    objects_.run(i, frame.dispatches[i]);
  }
  for (; mark && marked < static_cast<std::size_t>(GpuPass::gridTexture); ++marked) timer_.mark(marked);
}

void GlBackend::relight(const LightSetup& setup) {
  const SavedState saved(gl_);
  timer_.mark(0);
  run(plan_->frame(setup), true);
  // The host's shaders, and the next frame's surfels, sample the light map; readers copy buffers.
  gl_.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                    GL_TEXTURE_UPDATE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  timer_.mark(kTimed);
  timer_.endFrame();
  readBack_ = texelsReadBack_ = false;
}

void GlBackend::reset() {
  const SavedState saved(gl_);
  objects_.clearLight(bake_);
  if (!texture_.empty()) {
    // The texture of caches without light.
    run(plan_->fill(), false);
    gl_.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  }
  plan_->reset();
  readBack_ = texelsReadBack_ = false;
}

std::span<const float> GlBackend::coefficients() const {
  if (readBack_) return coefficients_;
  const SavedState saved(gl_);
  const std::array<int, 3> bands = {bands_.lumaBands, bands_.chromaBands, bands_.chromaBands};
  const std::size_t perCache = bands_.stride();
  coefficients_.assign(perCache * bake_.caches.count(), 0.0f);

  // Of the grid's caches, the buffer.
  const std::size_t stride = gpu::cacheBytes(bands_) / sizeof(std::uint16_t);
  const auto halves =
      readBuffer<std::uint16_t>(gl_, objects_.buffer(gpu::kCacheLight), stride * bake_.caches.firstMapCache(), memory_);
  for (std::size_t cache = 0; cache < bake_.caches.firstMapCache(); ++cache) {
    const std::uint16_t* from = halves.data() + stride * cache;
    float* to = coefficients_.data() + perCache * cache;
    for (const int l : bands) {
      unpackChannel(l, from, kWordHalves, to);
      from += kWordHalves * static_cast<std::size_t>(gpu::wordsOf(l));
      to += l * l;
    }
  }

  // Of the light map's caches, one of the texels that hold them.
  const Array<std::uint32_t>& map = bake_.caches.lightmap.cache;
  const std::array<GLuint, 3> textures = {objects_.texture(gpu::kMapY).get(), objects_.texture(gpu::kMapCo).get(),
                                          objects_.texture(gpu::kMapCg).get()};
  std::size_t channel = 0;  // its first coefficient in a cache
  for (std::size_t k = 0; k < bands.size() && !map.empty(); ++k) {
    const int held = bands_.onMap(bands[k]);
    const std::size_t layer = kWordHalves * map.size();
    std::pmr::vector<std::uint16_t> texels(layer * static_cast<std::size_t>(gpu::wordsOf(held)), memory_);
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

GLuint GlBackend::gridImage(std::uint32_t number) const {
  const std::optional<std::uint32_t> first = plan_->gridImages();
  return first ? objects_.texture(*first + number).get() : 0;
}

std::span<const float> GlBackend::gridTexels() const {
  if (texelsReadBack_ || texture_.empty()) return texels_;
  const SavedState saved(gl_);
  const glm::uvec3 r = texture_.resolution;
  const std::size_t slab = std::size_t{r.x} * r.y, texels = slab * static_cast<std::size_t>(textureDepth(r.z));
  std::pmr::vector<std::uint16_t> luma(4 * texels, memory_), chroma(2 * texels, memory_);
  const auto read = [this](GLuint texture, GLenum format, std::uint16_t* to) {
    gl_.ActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_Y);
    gl_.BindTexture(GL_TEXTURE_3D, texture);
    gl_.GetTexImage(GL_TEXTURE_3D, 0, format, GL_HALF_FLOAT, to);
  };
  read(gridImage(0), GL_RGBA, luma.data());
  read(gridImage(1), GL_RG, chroma.data());
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
  const auto active = static_cast<GLenum>(integerOf(gl_, GL_ACTIVE_TEXTURE));
  objects_.bind(plan_->resolveBindings());
  gl_.ActiveTexture(active);
}

std::vector<glm::vec3> GlBackend::nodeRadiosity() const {
  const auto packed =
      readBuffer<std::uint32_t>(gl_, objects_.buffer(gpu::kNodes), bake_.hierarchy.nodeCount(), memory_);
  std::vector<glm::vec3> radiosity;
  radiosity.reserve(packed.size());
  for (const std::uint32_t node : packed) radiosity.push_back(unpackColor(node));
  return radiosity;
}

std::vector<PassTime> GlBackend::passTimes() const {
  const auto& ms = timer_.passMs();
  std::vector<PassTime> times{{"surfels", ms[0]}, {"pull", ms[1]}, {"caches", ms[3]}};
  if (!texture_.empty()) times.push_back({"grid texture", ms[4]});
  if (plan_->movingParts() > 0) times.push_back({"moving parts", ms[2]});
  return times;
}

GlResolveInputs GlBackend::inputs() const {
  const auto buffer = [this](std::uint32_t index) { return objects_.buffer(index).get(); };
  const auto texture = [this](std::uint32_t index) { return objects_.texture(index).get(); };
  return {texture(gpu::kMapY),
          texture(gpu::kMapCo),
          texture(gpu::kMapCg),
          texture(gpu::kMapNormal),
          buffer(gpu::kCacheLight),
          buffer(gpu::kGrid),
          buffer(gpu::kResolve),
          gridImage(0),
          gridImage(1),
          gridImage(2),
          buffer(gpu::kNodes)};
}

}  // namespace relume::gl

namespace relume {

Result<Owned<Backend>> makeGlBackend(const Bake& bake, const BackendRequest& request) {
  const Result<gl::Functions> functions = gl::loadFunctions(request.options.getProcAddress);
  if (!functions) return functions.error();
  const GpuDevice device = gl::deviceOf(*functions, gpu::GroupThreads::parallel);
  GridTexture texture = makeGridTexture(request, device.volumeSide);
  // Where the driver cannot bind its shares receivers read the caches around.
  if (sizeof(std::uint32_t) * (texture.begin.size() + texture.shares.size()) > device.storageBytes)
    texture = GridTexture(request.memory);
  Result<Owned<gl::GlBackend>> made =
      gl::GlBackend::create(*functions, bake, request.bands, request.options.visibilityGlsl, request.images,
                            std::move(texture), request.memory, request.options.movingParts, request.options.movingLag);
  if (!made) return made.error();
  return Owned<Backend>(std::move(*made));
}

}  // namespace relume
