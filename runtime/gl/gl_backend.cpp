// SPDX-License-Identifier: MIT
// See gl_backend.h.
#include "runtime/gl/gl_backend.h"

#include "formats/pack.h"
#include "runtime/gl/saved_state.h"
#include "runtime/pack_color.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <utility>

namespace relume::gl {
namespace {

void storageBarrier() { glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT); }

// OpenGL 4.3 as 43; 0 without a context.
int contextVersion() {
  const auto* text = reinterpret_cast<const char*>(glGetString(GL_VERSION));
  return text ? epoxy_gl_version() : 0;
}

// All layers of an array of RGBA16F. State must be saved.
void readTexture(GLuint texture, std::uint16_t* halves) {
  glActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_Y);
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
  glGetTexImage(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA, GL_HALF_FLOAT, halves);
}

}  // namespace

Result<std::unique_ptr<GlBackend>> GlBackend::create(const Bake& bake, int lumaBands, int chromaBands,
                                                     std::string_view visibilityGlsl, float deringing,
                                                     const char* renderer) {
  const int version = contextVersion();
  if (version < 43 || !epoxy_is_desktop_gl()) {
    return Error{
        ErrorCode::unsupported,
        "the OpenGL backend needs a current context of OpenGL 4.3 or newer, found " +
            (version == 0 ? std::string("none") : std::to_string(version / 10) + "." + std::to_string(version % 10))};
  }
  if (renderer == nullptr) renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  const bool irradianceOnMap = bake.links.kind == LinkKind::irradiance;
  const SavedState saved;
  std::unique_ptr<GlBackend> backend(new GlBackend(bake, lumaBands, chromaBands));
  Result<GpuBake> gpu = uploadBake(bake, lumaBands, chromaBands, renderer);
  if (!gpu) return gpu.error();
  backend->gpu_ = std::move(*gpu);
  Result<BouncePass> bounce = BouncePass::create(lumaBands, chromaBands, irradianceOnMap);
  if (!bounce) return bounce.error();
  backend->bounce_ = std::move(*bounce);
  Result<SurfelPass> surfels = SurfelPass::create(visibilityGlsl);
  if (!surfels) return surfels.error();
  backend->surfels_ = std::move(*surfels);
  Result<PullPass> pull = PullPass::create(backend->gpu_.pullGroup);
  if (!pull) return pull.error();
  backend->pull_ = std::move(*pull);
  Result<CachePass> caches =
      CachePass::create(lumaBands, chromaBands, bake.links.kind, backend->gpu_.nodeSteps, renderer);
  if (!caches) return caches.error();
  backend->caches_ = std::move(*caches);
  Result<std::string> resolve =
      expandShader("resolve.glsl", resolveDefines(lumaBands, chromaBands, irradianceOnMap, deringing));
  if (!resolve) return resolve.error();
  backend->resolveGlsl_ = std::move(*resolve);
  return backend;
}

void GlBackend::relight(const LightSetup& setup) {
  const SavedState saved;
  timer_.mark(0);
  const bool bounces = lit_ && setup.bounceScale > 0.0f;
  if (bounces && bounce_.run(gpu_)) storageBarrier();
  surfels_.run(gpu_, bake_, setup, bounces);
  storageBarrier();
  timer_.mark(1);
  pull_.run(gpu_, storageBarrier);
  storageBarrier();
  timer_.mark(2);
  caches_.run(gpu_, bake_.links);
  // The host's shaders, and the next frame's surfels, sample the light map; readers copy buffers.
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                  GL_TEXTURE_UPDATE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  timer_.mark(3);
  timer_.endFrame();
  lit_ = true;
  readBack_ = false;
}

void GlBackend::reset() {
  lit_ = false;
  readBack_ = false;
  const SavedState saved;
  clearLight(bake_, luma_, chroma_, gpu_);
}

std::span<const float> GlBackend::coefficients() const {
  if (readBack_) return coefficients_;
  const SavedState saved;
  const std::size_t perCache = static_cast<std::size_t>(luma_ * luma_ + 2 * chroma_ * chroma_);
  coefficients_.assign(perCache * bake_.caches.count(), 0.0f);
  const auto wordsOf = [](int bands) { return static_cast<std::size_t>((bands * bands + 3) / 4); };
  // Leave out the padding of each channel to words of four halves. `word(w)`: word w of a channel.
  const auto unpack = [](int bands, const auto& word, float* to) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(bands * bands); ++i) to[i] = unpackHalf(word(i / 4)[i % 4]);
    return to + bands * bands;
  };
  const std::size_t words = wordsOf(luma_) + 2 * wordsOf(chroma_);
  const auto halves = readBuffer<std::uint16_t>(gpu_.caches, 4 * words * gpu_.firstMapCache);
  for (std::size_t cache = 0; cache < gpu_.firstMapCache; ++cache) {
    const std::uint16_t* at = halves.data() + 4 * words * cache;
    float* to = coefficients_.data() + perCache * cache;
    for (const int bands : {luma_, chroma_, chroma_}) {
      to = unpack(
          bands, [at](std::size_t w) { return at + 4 * w; }, to);
      at += 4 * wordsOf(bands);
    }
  }
  // Of the light map's caches, one of the texels that hold them.
  const Array<std::uint32_t>& map = bake_.caches.lightmap.cache;
  const bool irradianceOnMap = bake_.links.kind == LinkKind::irradiance;
  std::size_t first = 0;
  for (const auto& [texture, bands] :
       {std::pair{gpu_.mapY.get(), luma_}, {gpu_.mapCo.get(), chroma_}, {gpu_.mapCg.get(), chroma_}}) {
    const int held = mapBands(bands, irradianceOnMap);
    std::vector<std::uint16_t> texels(4 * wordsOf(held) * std::max<std::size_t>(map.size(), 1));
    readTexture(texture, texels.data());
    for (std::size_t t = 0; t < map.size(); ++t) {
      if (map[t] == kNoCache) continue;
      unpack(
          held, [&](std::size_t w) { return texels.data() + 4 * (map.size() * w + t); },
          coefficients_.data() + perCache * map[t] + first);
    }
    first += static_cast<std::size_t>(bands * bands);
  }
  readBack_ = true;
  return coefficients_;
}

std::vector<glm::vec3> GlBackend::nodeRadiosity() const {
  const std::vector<std::uint32_t> packed = readBuffer<std::uint32_t>(gpu_.nodes, bake_.hierarchy.nodeCount());
  std::vector<glm::vec3> radiosity;
  radiosity.reserve(packed.size());
  for (const std::uint32_t node : packed) radiosity.push_back(unpackColor(node));
  return radiosity;
}

std::vector<PassTime> GlBackend::passTimes() const {
  const auto& ms = timer_.passMs();
  return {{"surfels", ms[0]}, {"pull", ms[1]}, {"caches", ms[2]}};
}

GlResolveInputs GlBackend::resolveInputs() const {
  return {gpu_.mapY.get(),   gpu_.mapCo.get(),     gpu_.mapCg.get(),  gpu_.mapNormal.get(),
          gpu_.caches.get(), gpu_.gridCache.get(), gpu_.resolve.get()};
}

}  // namespace relume::gl
