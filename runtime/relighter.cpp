// SPDX-License-Identifier: MIT
// The entry point of the runtime: checks what comes in and hands it to a backend. See relighter.h.
#include "relume/relighter.h"

#include "runtime/backend.h"
#include "runtime/check_options.h"
#include "runtime/check_setup.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/driven_emission.h"
#include "runtime/shared/glossy.h"
#include "runtime/shared/memory.h"
#include "runtime/shared/plain_results.h"
#include "runtime/shared/resolve.h"
#include "runtime/shared/stencil.h"
#include "runtime/shared/texture_resolve.h"
#include "runtime/shared/usage_error.h"

#include <glm/common.hpp>

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

namespace relume {

struct Relighter::State {
  explicit State(std::pmr::memory_resource* host)
      : memory(host), imageSizes(&memory), lights(&memory), inherited{&memory} {}

  AlignedMemory memory;                // of all that follows
  std::optional<PackedCaches> caches;  // what look-ups read
  std::uint64_t sceneHash = 0;
  std::size_t surfelCount = 0, skyPatchCount = 0;
  bool surfelArrays = true;
  Emitters emitters;      // shares the bake's arrays
  ImageSizes imageSizes;  // of the images that were declared
  CacheBands bands;
  BackendKind kind = BackendKind::cpu;
  std::uint32_t movingParts = 0;  // at most
  ParallelFor parallelFor;
  Owned<Backend> backend;
  std::pmr::vector<Light> lights;  // this frame's, with directions of length 1
  // After inherit(), until the next frame; else empty.
  struct Inherited {
    explicit Inherited(std::pmr::memory_resource* memory) : radiance(memory) {}
    std::pmr::vector<glm::vec3> radiance;  // [W/m²/sr] [Size n_S] that surfels reflect of the light that is handed over
    Array<glm::vec3> emission;             // [W/m²/sr] [Size n_S] the bake's

    void forget() {
      std::pmr::vector<glm::vec3>(radiance.get_allocator()).swap(radiance);
      emission = {};
    }
  } inherited;

  ResolveSource resolveSource() { return {*caches, bands, backend->gridTexture(), &memory}; }
  glm::vec2 inSight(const glm::vec2& uv) const { return pointInSight(caches->map(), uv); }
  CacheLight cacheLight() const {
    CacheLight light = backend->light();
    light.guessBands = true;
    return light;
  }

  // [Size to = n_C * stride]
  void writeCoefficients(std::span<float> to) const {
    const CacheLight light = backend->light();
    for (std::uint32_t cache = 0; cache < caches->count(); ++cache) {
      CacheLight::Row row;
      std::copy_n(light.of(cache, row), bands.stride(), to.data() + bands.stride() * cache);
    }
  }

  // Irradiance in the grid by one kind of look-up: the texture where it answers, else the caches around.
  struct GridReader {
    const PackedCaches& caches;
    CacheLight light;
    const GridTexture* texture;  // null = none is read
    std::span<const float> texels;
    bool smooth;

    glm::vec3 operator()(const glm::vec3& positionWorld, const glm::vec3& normal) const {
      if (texture) {
        if (const auto e = readGridTexture(*texture, texels, positionWorld, normal, smooth)) return *e;
      }
      return relume::irradianceInGrid(caches, light, positionWorld, normal);
    }
  };
  GridReader gridReader(GridLookup lookup) const {
    const GridTexture* texture = lookup == GridLookup::stencil ? nullptr : backend->gridTexture();
    return {*caches, cacheLight(), texture, texture ? backend->gridTexels() : std::span<const float>(),
            lookup == GridLookup::smooth};
  }
};

Result<Relighter> Relighter::create(const Bake& bake, const RelightOptions& options) try {
  std::pmr::memory_resource* host = memoryOr(options.memory);
  std::unique_ptr<State, Destroy> state(makeOwned<State>(host, host).release());
  Result<CheckedOptions> checked = checkOptions(bake, options, &state->memory);
  if (!checked) return checked.error();
  const Bake& shared = checked->bake;
  state->bands = checked->bands;
  state->caches.emplace(shared.caches, &state->memory);
  state->sceneHash = bake.provenance.sceneHash;
  state->surfelCount = bake.surfels.count();
  state->skyPatchCount = bake.hierarchy.skyDirection.size();
  state->kind = options.backend;
  state->movingParts = options.movingParts;
  state->parallelFor = options.parallelFor;
  state->surfelArrays = options.surfelArrays || options.backend != BackendKind::cpu;
  state->emitters = bake.emitters;
  state->imageSizes = std::move(checked->images);
  const BackendRequest request{state->bands, options, &state->memory, state->imageSizes, *state->caches};
  Result<Owned<Backend>> backend =
      options.backend == BackendKind::cpu ? makeCpuBackend(shared, request) : makeGlBackend(shared, request);
  if (!backend) return backend.error();
  state->backend = std::move(*backend);
  return Relighter(std::move(state));
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

void Relighter::Destroy::operator()(State* state) const noexcept {
  std::pmr::memory_resource* host = state->memory.host();
  state->~State();
  host->deallocate(state, sizeof(State), alignof(State));
}

namespace {

// Receivers of a task.
constexpr std::uint32_t kReceiverGrain = 256;
// Receivers of a call, at most: chunks of them are numbered in 32 bits.
constexpr std::size_t kMaxReceivers = std::size_t{1} << 31;

Status wrongSize(const char* what, std::size_t size, std::size_t expected) {
  return usageError(std::string(what) + " has " + std::to_string(size) + " elements, expected " +
                    std::to_string(expected));
}

// Every input has as many elements as the output, which one call may have.
Status checkReceivers(std::size_t count, std::initializer_list<std::pair<const char*, std::size_t>> inputs) {
  for (const auto& [name, size] : inputs) {
    if (size != count) return wrongSize(name, size, count);
  }
  if (count > kMaxReceivers) return usageError(std::to_string(count) + " receivers in one call, expected at most 2^31");
  return done();
}

// body(i) for each of `count` receivers.
template <class Body>
void forReceivers(const ParallelFor& parallelFor, std::size_t count, const Body& body) {
  forChunks(parallelFor, static_cast<std::uint32_t>(count), kReceiverGrain,
            [&](std::uint32_t begin, std::uint32_t end) {
              for (std::uint32_t i = begin; i < end; ++i) body(i);
            });
}

// Baked emission off the radiance of surfels whose material the frame drives: the backend adds what it does.
void takeOffDriven(const Emitters& emitters, const LightSetup& setup, std::span<const glm::vec3> baked,
                   std::span<glm::vec3> radiance) {
  for (const MaterialEmission& driven : setup.materialEmissions) {
    const DrivableMaterial& material = emitters.materials[driven.material];
    for (std::uint32_t i = 0; i < material.entryCount; ++i) {
      const std::uint32_t s = emitters.surfel[material.firstEntry + i];
      radiance[s] = glm::max(radiance[s] - setup.emissionScale * baked[s], 0.0f);
    }
  }
}

}  // namespace

Relighter::Relighter(std::unique_ptr<State, Destroy> state) : state_(std::move(state)) {}
Relighter::Relighter(Relighter&&) noexcept = default;
Relighter& Relighter::operator=(Relighter&&) noexcept = default;
Relighter::~Relighter() = default;

Status Relighter::relight(const LightSetup& setup) {
  if (Status ok = check(setup); !ok) return ok;
  // The host's functions by reference: copies of them would allocate in every frame.
  LightSetup applied = withoutFunctions(setup);
  if (setup.visibility) applied.visibility = std::cref(setup.visibility);
  if (setup.visibilityBatch) applied.visibilityBatch = std::cref(setup.visibilityBatch);
  const bool handsOver = setup.bounceScale > 0.0f && !state_->inherited.radiance.empty();
  if (handsOver) {
    applied.surfelEmission = state_->inherited.radiance;
    applied.bounceScale = 0.0f;  // what was handed over has the last bounce in it
    if (Status ok = state_->backend->checkTextures(applied); !ok) return ok;
  }
  // Take all memory before any light changes.
  try {
    normaliseLights(setup.lights, state_->lights);
    applied.lights = state_->lights;
    state_->backend->reserve(applied);
  } catch (const std::bad_alloc& e) {
    return outOfMemory(e);
  }
  // Light that is handed over leaves the surfels with their emission, once.
  State::Inherited inherited = std::move(state_->inherited);
  state_->inherited.forget();
  if (handsOver) {
    for (std::size_t s = 0; s < state_->surfelCount; ++s) {
      const glm::vec3 own =
          setup.surfelEmission.empty() ? setup.emissionScale * inherited.emission[s] : setup.surfelEmission[s];
      inherited.radiance[s] = own + setup.bounceScale * inherited.radiance[s];
    }
    takeOffDriven(state_->emitters, setup, inherited.emission.span(), inherited.radiance);
  }
  state_->backend->relight(applied);
  return done();
}

Status Relighter::check(const LightSetup& setup) const {
  if (setup.surfelIrradianceOnGpu && state_->kind != BackendKind::gl)
    return usageError("light setup: surfelIrradianceOnGpu needs the OpenGL backend");
  if (!state_->surfelArrays && !(setup.surfelIrradiance.empty() && setup.surfelEmission.empty())) {
    return usageError("light setup: surfelIrradiance or surfelEmission without RelightOptions::surfelArrays");
  }
  if (Status ok = checkSetup(setup, state_->surfelCount, state_->skyPatchCount); !ok) return ok;
  if (Status ok = checkEmissions(setup, state_->emitters, state_->imageSizes, state_->kind); !ok) return ok;
  if (Status ok = checkMovingParts(setup, state_->movingParts); !ok) return ok;
  return state_->backend->checkTextures(setup);
}

void Relighter::reset() {
  state_->backend->reset();
  state_->inherited.forget();
}

Status Relighter::inherit(const Relighter& previous, const Bake& bake) try {
  if (bake.surfels.count() != state_->surfelCount || bake.provenance.sceneHash != state_->sceneHash)
    return usageError("inherit: the bake is not the one that this relighter was made from");
  if (!state_->surfelArrays) return usageError("inherit: needs RelightOptions::surfelArrays");
  if (previous.state_->caches->grid().cache.empty())
    return Error{ErrorCode::unsupported, "inherit: the previous bake has no grid to read light from"};
  const CacheLight light = previous.state_->cacheLight();
  const Surfels& surfels = bake.surfels;
  std::pmr::vector<glm::vec3> radiance(state_->surfelCount, &state_->memory);
  forReceivers(state_->parallelFor, radiance.size(), [&](std::size_t s) {
    const glm::vec3 e =
        relume::irradianceInGrid(*previous.state_->caches, light, surfels.positionWorld[s], surfels.normal[s]);
    radiance[s] = surfels.albedo[s] * e / std::numbers::pi_v<float>;
  });
  state_->inherited.radiance.swap(radiance);
  state_->inherited.emission = surfels.emission;
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

glm::vec3 Relighter::irradianceOnLightmap(const glm::vec2& lightmapUv, const glm::vec3& normal,
                                          const glm::vec3& geometricNormal) const {
  return relume::irradianceOnLightmap(*state_->caches, state_->cacheLight(), state_->inSight(lightmapUv), normal,
                                      geometricNormal);
}

glm::vec3 Relighter::irradianceOnLightmap(const glm::vec2& lightmapUv, const glm::vec3& normal) const {
  return irradianceOnLightmap(lightmapUv, normal, normal);
}

glm::vec3 Relighter::irradianceInGrid(const glm::vec3& positionWorld, const glm::vec3& normal,
                                      GridLookup lookup) const {
  return state_->gridReader(lookup)(positionWorld, normal);
}

Status Relighter::irradianceOnLightmap(std::span<const glm::vec2> lightmapUv, std::span<const glm::vec3> normal,
                                       std::span<const glm::vec3> geometricNormal,
                                       std::span<glm::vec3> irradiance) const try {
  if (Status ok = checkReceivers(
          irradiance.size(),
          {{"lightmapUv", lightmapUv.size()}, {"normal", normal.size()}, {"geometricNormal", geometricNormal.size()}});
      !ok)
    return ok;
  const CacheLight light = state_->cacheLight();
  forReceivers(state_->parallelFor, irradiance.size(), [&](std::size_t i) {
    irradiance[i] = relume::irradianceOnLightmap(*state_->caches, light, state_->inSight(lightmapUv[i]), normal[i],
                                                 geometricNormal[i]);
  });
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Status Relighter::irradianceInGrid(std::span<const glm::vec3> positionWorld, std::span<const glm::vec3> normal,
                                   std::span<glm::vec3> irradiance, GridLookup lookup) const try {
  if (Status ok =
          checkReceivers(irradiance.size(), {{"positionWorld", positionWorld.size()}, {"normal", normal.size()}});
      !ok)
    return ok;
  const State::GridReader read = state_->gridReader(lookup);
  forReceivers(state_->parallelFor, irradiance.size(),
               [&](std::size_t i) { irradiance[i] = read(positionWorld[i], normal[i]); });
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

glm::vec3 Relighter::glossyOnLightmap(const glm::vec2& lightmapUv, const glm::vec3& reflected, float exponent) const {
  return relume::glossyOnLightmap(*state_->caches, state_->cacheLight(), state_->inSight(lightmapUv), reflected,
                                  exponent);
}

glm::vec3 Relighter::glossyInGrid(const glm::vec3& positionWorld, const glm::vec3& normal, const glm::vec3& reflected,
                                  float exponent) const {
  return relume::glossyInGrid(*state_->caches, state_->cacheLight(), positionWorld, normal, reflected, exponent);
}

Status Relighter::glossyOnLightmap(std::span<const glm::vec2> lightmapUv, std::span<const glm::vec3> reflected,
                                   std::span<const float> exponent, std::span<glm::vec3> radiance) const try {
  if (Status ok = checkReceivers(
          radiance.size(),
          {{"lightmapUv", lightmapUv.size()}, {"reflected", reflected.size()}, {"exponent", exponent.size()}});
      !ok)
    return ok;
  const CacheLight light = state_->cacheLight();
  forReceivers(state_->parallelFor, radiance.size(), [&](std::size_t i) {
    radiance[i] =
        relume::glossyOnLightmap(*state_->caches, light, state_->inSight(lightmapUv[i]), reflected[i], exponent[i]);
  });
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Status Relighter::glossyInGrid(std::span<const glm::vec3> positionWorld, std::span<const glm::vec3> normal,
                               std::span<const glm::vec3> reflected, std::span<const float> exponent,
                               std::span<glm::vec3> radiance) const try {
  if (Status ok = checkReceivers(radiance.size(), {{"positionWorld", positionWorld.size()},
                                                   {"normal", normal.size()},
                                                   {"reflected", reflected.size()},
                                                   {"exponent", exponent.size()}});
      !ok)
    return ok;
  const CacheLight light = state_->cacheLight();
  forReceivers(state_->parallelFor, radiance.size(), [&](std::size_t i) {
    radiance[i] = relume::glossyInGrid(*state_->caches, light, positionWorld[i], normal[i], reflected[i], exponent[i]);
  });
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

glm::uvec2 Relighter::lightmapSize() const { return {state_->caches->map().width, state_->caches->map().height}; }

Status Relighter::irradianceMap(std::span<std::uint16_t> rgba16f) const try {
  const std::size_t expected = std::size_t{4} * lightmapSize().x * lightmapSize().y;
  if (rgba16f.size() != expected) return wrongSize("rgba16f", rgba16f.size(), expected);
  relume::irradianceMap(*state_->caches, state_->cacheLight(), rgba16f, state_->parallelFor);
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Status Relighter::irradianceMapL1(std::span<std::uint16_t> rgba16f) const try {
  const std::size_t expected = std::size_t{16} * lightmapSize().x * lightmapSize().y;
  if (rgba16f.size() != expected) return wrongSize("rgba16f", rgba16f.size(), expected);
  relume::irradianceMapL1(*state_->caches, state_->cacheLight(), rgba16f, state_->parallelFor);
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Status Relighter::ambientVolume(const AmbientVolume& volume, std::span<glm::vec3> cubes) const try {
  // The points' number from the span's, so that no product of resolutions can overflow.
  const glm::uvec3 n = volume.resolution;
  std::size_t points = cubes.size() / 6;
  bool fits = cubes.size() % 6 == 0;
  if (n.x == 0 || n.y == 0 || n.z == 0) {
    fits = fits && points == 0;
  } else {
    for (const std::uint32_t along : {n.x, n.y, n.z}) {
      fits = fits && points % along == 0;
      points /= along;
    }
    fits = fits && points == 1;
  }
  if (!fits) {
    return usageError("cubes has " + std::to_string(cubes.size()) + " elements, expected 6 for each of " +
                      std::to_string(n.x) + " x " + std::to_string(n.y) + " x " + std::to_string(n.z) + " points");
  }
  if (!cubes.empty()) {
    relume::ambientVolume(*state_->caches, state_->cacheLight(), volume, cubes, state_->parallelFor);
  }
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Result<TextureResolve> Relighter::textureResolve() const try {
  return describeTextures(state_->resolveSource());
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Result<std::string> Relighter::textureResolveGlsl() const try {
  return relume::textureResolveGlsl(state_->bands, state_->backend->gridTexture() != nullptr);
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Status Relighter::writeResolveTexture(std::size_t texture, std::span<std::byte> texels) const try {
  const ResolveSource source = state_->resolveSource();
  const Result<TextureResolve> resolve = describeTextures(source);
  if (!resolve) return resolve.error();
  if (texture >= resolve->textures.size())
    return usageError("texture is " + std::to_string(texture) + ", there are " +
                      std::to_string(resolve->textures.size()));
  const ResolveTexture& wanted = resolve->textures[texture];
  if (texels.size() != wanted.bytes) return wrongSize("texels", texels.size(), wanted.bytes);
  const std::span<const float> gridTexels =
      source.gridTexture && wanted.isLight ? state_->backend->gridTexels() : std::span<const float>();
  writeTexels(source, texture, state_->cacheLight(), gridTexels, state_->parallelFor, texels);
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

std::vector<float> Relighter::cacheCoefficients() const {
  std::vector<float> all(state_->bands.stride() * state_->caches->count());
  state_->writeCoefficients(all);
  return all;
}

Status Relighter::cacheCoefficients(std::span<float> coefficients) const try {
  const std::size_t expected = state_->bands.stride() * state_->caches->count();
  if (coefficients.size() != expected) return wrongSize("coefficients", coefficients.size(), expected);
  state_->writeCoefficients(coefficients);
  return done();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

std::vector<glm::vec3> Relighter::nodeRadiosity() const { return state_->backend->nodeRadiosity(); }

std::uint64_t Relighter::sceneHash() const { return state_->sceneHash; }
int Relighter::lumaBands() const { return state_->bands.lumaBands; }
int Relighter::chromaBands() const { return state_->bands.chromaBands; }

int Relighter::coefficientsPerCache() const { return static_cast<int>(state_->bands.stride()); }

BackendKind Relighter::backend() const { return state_->kind; }
std::vector<PassTime> Relighter::passTimes() const { return state_->backend->passTimes(); }

std::vector<std::pair<std::string, std::size_t>> Relighter::bufferSizes() const {
  return state_->backend->bufferSizes();
}

GridTextureInfo Relighter::gridTexture() const {
  const GridTexture* texture = state_->backend->gridTexture();
  if (!texture) return {};
  return {texture->resolution, texture->originWorld, texture->spacing, texture->open.size(), texture->openCells()};
}

const GlResolve* Relighter::gl() const { return state_->backend->gl(); }

}  // namespace relume
