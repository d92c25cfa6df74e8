// SPDX-License-Identifier: MIT
// See cpu_light.h.
#include <epoxy/gl.h>

#include "formats/pack.h"
#include "runtime/shared/half_scale.h"
#include "runtime/shared/pack_color.h"
#include "tools/view/cpu_light.h"

#include <algorithm>
#include <array>
#include <thread>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kWord = 4;  // coefficients of a layer, and of a word of the grid's buffer

std::size_t wordsOf(int bands) { return (static_cast<std::size_t>(bands * bands) + kWord - 1) / kWord; }

// What brings each cache within halves, as the passes of OpenGL do (shaders/light_caches.comp): of the light map's by
// the coefficients that the map has, of the grid's by all.
std::vector<float> halfScales(const Caches& caches, std::span<const float> coefficients, const CacheBands& held) {
  const CacheBands map = held.ofMap();
  std::vector<float> scales;
  for (std::size_t cache = 0; held.stride() * cache < coefficients.size(); ++cache) {
    const auto c = coefficients.subspan(held.stride() * cache, held.stride());
    const CacheBands& kept = cache < caches.firstMapCache() ? held : map;
    const float luma = largestOf(c.subspan(0, kept.lumaCount())),
                co = largestOf(c.subspan(held.lumaCount(), kept.chromaCount()), luma);
    scales.push_back(halfScale(largestOf(c.subspan(held.lumaCount() + held.chromaCount(), kept.chromaCount()), co)));
  }
  return scales;
}

// The texels of one channel, a layer after the other. `first`: of the channel's coefficients within a cache.
std::vector<std::uint16_t> mapTexels(const Lightmap& map, std::span<const float> coefficients,
                                     std::span<const float> scales, std::size_t stride, std::size_t first, int bands) {
  const std::size_t texels = map.cache.size(), count = static_cast<std::size_t>(bands * bands);
  std::vector<std::uint16_t> halves(kWord * texels * wordsOf(bands), 0);
  for (std::size_t t = 0; t < texels; ++t) {
    if (map.cache[t] == kNoCache) continue;
    const float* from = coefficients.data() + stride * map.cache[t] + first;
    const float scale = scales[map.cache[t]];
    for (std::size_t i = 0; i < count; ++i)
      halves[kWord * (texels * (i / kWord) + t) + i % kWord] = packHalf(scale * from[i]);
  }
  return halves;
}

}  // namespace

CpuLight::CpuLight(const Scene& scene, const Bake& bake, Movable movable, RayShadows shadows,
                   std::unique_ptr<WorkerThreads> threads, Relighter relighter)
    : scene_(&scene),
      bake_(&bake),
      nodes_(movingNodes(scene, movable)),
      moved_(nodes_.size(), glm::mat4(1.0f)),
      shadows_(std::move(shadows)),
      threads_(std::move(threads)),
      relighter_(std::move(relighter)) {}

Result<CpuLight> CpuLight::create(const Scene& scene, const Bake& bake, const Relighter& like,
                                  const Relighter* previous, RelightOptions options, Movable movable) {
  auto shadows = RayShadows::create(scene);
  if (!shadows) return shadows.error();
  auto threads = std::make_unique<WorkerThreads>(std::max(1u, std::thread::hardware_concurrency()));
  options.backend = BackendKind::cpu;
  options.lumaBands = like.lumaBands();
  options.chromaBands = like.chromaBands();
  options.parallelFor = threads->parallelFor();
  auto relighter = Relighter::create(bake, options);
  if (!relighter) return relighter.error();
  if (previous) {
    const Status inherited = relighter->inherit(*previous, bake);
    if (!inherited && inherited.error().code != ErrorCode::unsupported) return inherited.error();
  }
  return CpuLight(scene, bake, movable, std::move(*shadows), std::move(threads), std::move(*relighter));
}

// What moves, for rays.
Status CpuLight::place(std::span<const glm::mat4> moved) {
  if (Status ok = shadows_.place(placedInstances(*scene_, nodes_, moved)); !ok) return ok;
  moved_.assign(moved.begin(), moved.end());
  return done();
}

Status CpuLight::relight(LightSetup setup, std::span<const glm::mat4> moved) {
  if (!std::ranges::equal(moved, moved_)) {
    if (Status ok = place(moved); !ok) return ok;
  }
  setup.visibility = shadows_.visibility(setup.lights);
  return relighter_.relight(setup);
}

void CpuLight::upload(const GlResolveInputs& inputs) const {
  const std::vector<float> coefficients = relighter_.cacheCoefficients();
  const auto stride = static_cast<std::size_t>(relighter_.coefficientsPerCache());
  const CacheBands held{relighter_.lumaBands(), relighter_.chromaBands(), bake_->links.kind == LinkKind::irradiance,
                        true};
  const std::array<int, 3> bands{relighter_.lumaBands(), relighter_.chromaBands(), relighter_.chromaBands()};
  const std::vector<float> scales = halfScales(bake_->caches, coefficients, held);

  // The light map: four coefficients a layer
  const Lightmap& map = bake_->caches.lightmap;
  const std::array<std::uint32_t, 3> textures{inputs.lightmapY, inputs.lightmapCo, inputs.lightmapCg};
  std::size_t first = 0;
  for (std::size_t k = 0; k < textures.size() && map.width > 0; ++k) {
    const int onMap = held.onMap(bands[k]);
    const auto halves = mapTexels(map, coefficients, scales, stride, first, onMap);
    glBindTexture(GL_TEXTURE_2D_ARRAY, textures[k]);
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, static_cast<GLsizei>(map.width), static_cast<GLsizei>(map.height),
                    static_cast<GLsizei>(wordsOf(onMap)), GL_RGBA, GL_HALF_FLOAT, halves.data());
    first += static_cast<std::size_t>(bands[k] * bands[k]);
  }
  glBindTexture(GL_TEXTURE_2D_ARRAY, 0);

  // The grid's caches: words of four, each channel filled up
  std::vector<std::uint16_t> words;
  const std::uint32_t gridCaches = bake_->caches.firstMapCache();
  for (std::size_t cache = 0; cache < gridCaches; ++cache) {
    const float* from = coefficients.data() + stride * cache;
    for (const int l : bands) {
      const std::size_t begin = words.size();
      for (int i = 0; i < l * l; ++i) words.push_back(packHalf(scales[cache] * *from++));
      words.resize(begin + kWord * wordsOf(l), 0);
    }
  }
  glBindBuffer(GL_COPY_WRITE_BUFFER, inputs.caches);
  glBufferSubData(GL_COPY_WRITE_BUFFER, 0, static_cast<GLsizeiptr>(words.size() * sizeof(std::uint16_t)), words.data());
  glBindBuffer(GL_COPY_WRITE_BUFFER, 0);
}

void CpuLight::uploadNodes(const GlResolveInputs& inputs) const {
  std::vector<std::uint32_t> packed;
  for (const glm::vec3& radiosity : relighter_.nodeRadiosity()) packed.push_back(packColor(radiosity, 0.0f));
  glBindBuffer(GL_COPY_WRITE_BUFFER, inputs.nodes);
  glBufferSubData(GL_COPY_WRITE_BUFFER, 0, static_cast<GLsizeiptr>(packed.size() * sizeof(std::uint32_t)),
                  packed.data());
  glBindBuffer(GL_COPY_WRITE_BUFFER, 0);
}

}  // namespace relume
