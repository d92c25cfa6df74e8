// SPDX-License-Identifier: MIT
// See gl_backend.h.
#include "runtime/gl/gl_backend.h"

#include "formats/pack.h"
#include "runtime/gl/saved_state.h"
#include "runtime/pack_color.h"

namespace relume::gl {
namespace {

void storageBarrier() { glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT); }

// OpenGL 4.3 as 43; 0 without a context.
int contextVersion() {
  const auto* text = reinterpret_cast<const char*>(glGetString(GL_VERSION));
  return text ? epoxy_gl_version() : 0;
}

}  // namespace

Result<std::unique_ptr<GlBackend>> GlBackend::create(const Bake& bake, int lumaBands, int chromaBands,
                                                     std::string_view visibilityGlsl, float deringing) {
  const int version = contextVersion();
  if (version < 43 || !epoxy_is_desktop_gl()) {
    return Error{
        ErrorCode::unsupported,
        "the OpenGL backend needs a current context of OpenGL 4.3 or newer, found " +
            (version == 0 ? std::string("none") : std::to_string(version / 10) + "." + std::to_string(version % 10))};
  }
  const bool irradianceOnMap = bake.links.kind == LinkKind::irradiance;
  const SavedState saved;
  std::unique_ptr<GlBackend> backend(new GlBackend(bake, lumaBands, chromaBands));
  Result<GpuBake> gpu = uploadBake(bake, lumaBands, chromaBands);
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
  Result<CachePass> caches = CachePass::create(lumaBands, chromaBands, bake.links.kind, backend->gpu_.nodeSteps);
  if (!caches) return caches.error();
  backend->caches_ = std::move(*caches);
  Result<CopyPass> copy = CopyPass::create(lumaBands, chromaBands, irradianceOnMap);
  if (!copy) return copy.error();
  backend->copy_ = std::move(*copy);
  Result<std::string> resolve =
      expandShader("resolve.glsl", resolveDefines(lumaBands, chromaBands, irradianceOnMap, deringing));
  if (!resolve) return resolve.error();
  backend->resolveGlsl_ = std::move(*resolve);
  // Before the first frame the light map is black, not undefined.
  backend->copy_.run(backend->gpu_);
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
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
  storageBarrier();
  timer_.mark(3);
  copy_.run(gpu_);
  // The host's shaders, and the next frame's surfels, sample the light map; readers copy buffers.
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                  GL_TEXTURE_UPDATE_BARRIER_BIT);
  timer_.mark(4);
  timer_.endFrame();
  lit_ = true;
  readBack_ = false;
}

void GlBackend::reset() {
  lit_ = false;
  readBack_ = false;
  const SavedState saved;
  glBindBuffer(GL_COPY_WRITE_BUFFER, gpu_.caches.get());
  glClearBufferData(GL_COPY_WRITE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  copy_.run(gpu_);
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
}

std::span<const float> GlBackend::coefficients() const {
  if (readBack_) return coefficients_;
  const std::size_t caches = bake_.caches.count();
  const std::vector<std::uint16_t> halves =
      readBuffer<std::uint16_t>(gpu_.caches, caches * cacheBytes(luma_, chroma_) / sizeof(std::uint16_t));
  // Leave out the padding of each channel to four halves.
  coefficients_.clear();
  std::size_t at = 0;
  for (std::size_t cache = 0; cache < caches; ++cache) {
    for (const int bands : {luma_, chroma_, chroma_}) {
      const auto count = static_cast<std::size_t>(bands * bands);
      for (std::size_t i = 0; i < count; ++i) coefficients_.push_back(unpackHalf(halves[at + i]));
      at += (count + 3) / 4 * 4;
    }
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
  return {{"surfels", ms[0]}, {"pull", ms[1]}, {"caches", ms[2]}, {"copy", ms[3]}};
}

GlResolveInputs GlBackend::resolveInputs() const {
  return {gpu_.mapY.get(),   gpu_.mapCo.get(),     gpu_.mapCg.get(),  gpu_.mapNormal.get(),
          gpu_.caches.get(), gpu_.gridCache.get(), gpu_.resolve.get()};
}

}  // namespace relume::gl
