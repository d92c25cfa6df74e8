// SPDX-License-Identifier: MIT
// The public door of the runtime: checks what comes in and hands it to a backend. See relighter.h.
#include "runtime/relighter.h"

#include "formats/decimal.h"
#include "formats/sh.h"
#include "runtime/check_bake.h"
#include "runtime/check_setup.h"
#include "runtime/cpu/cpu_backend.h"
#include "runtime/cpu/simd.h"
#if defined(RELUME_HAS_GL)
#include "runtime/gl/gl_backend.h"
#endif
#include "runtime/shared/pack_color.h"

namespace relume {

#if !defined(RELUME_HAS_GL)
namespace gl {
// Stands where the OpenGL backend would, in a build without it; never made.
class GlBackend {};
}  // namespace gl
#endif

// One of the two backends is there. What it reads of the bake's arrays every frame is shared, not copied; the rest is
// let go.
struct Relighter::State {
  Bake bake;
  std::size_t surfelCount = 0, skyPatchCount = 0;
  bool surfelArrays = true;
  int lumaBands = 1, chromaBands = 1;
  float deringing = 0.0f;
  std::unique_ptr<cpu::CpuBackend> cpu;
  std::unique_ptr<gl::GlBackend> gl;
  std::vector<Light> lights;  // this frame's, with directions of length 1

  cpu::CacheLight cacheLight() const {
#if defined(RELUME_HAS_GL)
    cpu::CacheLight light = gl ? cpu::CacheLight{lumaBands, chromaBands, gl->coefficients()} : cpu->cacheLight();
#else
    cpu::CacheLight light = cpu->cacheLight();
#endif
    light.irradianceOnMap = bake.links.kind == LinkKind::irradiance;
    light.guessBands = true;
    light.deringing = deringing;
    return light;
  }
};

namespace {

// The parts a frame needs; names and the rest of the provenance stay with the host.
Bake shareArrays(const Bake& bake) {
  Bake shared;
  shared.surfels = bake.surfels;
  shared.hierarchy = bake.hierarchy;
  shared.caches = bake.caches;
  shared.caches.lightmap.parts = {};
  shared.caches.lightmap.cornerUv = shared.caches.lightmap.backCornerUv = {};
  shared.links = bake.links;
  shared.provenance.sceneHash = bake.provenance.sceneHash;
  return shared;
}

Error usage(const std::string& message) { return Error{ErrorCode::usage, message}; }

// Bands to light with: what was asked for, or what the bake recommends, held against each other and the links.
Status chooseBands(const Bake& bake, const RelightOptions& options, int& luma, int& chroma) {
  const bool sh = linkHasBands(bake.links.kind);
  const int most = sh ? static_cast<int>(bake.links.bands) : kMaxBands;
  if (options.lumaBands < 0 || options.lumaBands > most) {
    return usage("lumaBands is " + std::to_string(options.lumaBands) + ", expected 1 to " + std::to_string(most) +
                 (sh ? ", the bands of the bake's SH links," : "") + " or 0 for the bake's choice");
  }
  const auto recommended = [](std::uint32_t bands, int limit) {
    return bands < 1 ? 1 : (bands > static_cast<std::uint32_t>(limit) ? limit : static_cast<int>(bands));
  };
  luma = options.lumaBands > 0 ? options.lumaBands : recommended(bake.provenance.lumaBands, most);
  if (options.chromaBands < 0 || options.chromaBands > luma) {
    return usage("chromaBands is " + std::to_string(options.chromaBands) +
                 ", expected 1 to lumaBands = " + std::to_string(luma) + " or 0 for the bake's choice");
  }
  chroma = options.chromaBands > 0 ? options.chromaBands : recommended(bake.provenance.chromaBands, luma);
  return done();
}

}  // namespace

Result<Relighter> Relighter::create(const Bake& bake, const RelightOptions& options) {
  if (Status ok = checkBake(bake); !ok) return ok.error();
  auto state = std::make_unique<State>();
  if (Status ok = chooseBands(bake, options, state->lumaBands, state->chromaBands); !ok) return ok.error();
  if (!(options.deringing >= 0.0f && options.deringing <= 1.0f)) {
    return usage("deringing is " + decimal(options.deringing) + ", expected 0 to 1");
  }
  state->deringing = options.deringing;
  state->bake = shareArrays(bake);
  state->surfelCount = bake.surfels.count();
  state->skyPatchCount = bake.hierarchy.skyDirection.size();
  state->surfelArrays = options.surfelArrays || options.backend != Backend::cpu;
  if (options.backend == Backend::cpu) {
    const Simd simd = cpu::chooseSimd(options.simd);
    if (simd == Simd::best)
      return usage("this processor or this build lacks the instruction set asked for in RelightOptions::simd");
    state->cpu = std::make_unique<cpu::CpuBackend>(state->bake, state->lumaBands, state->chromaBands, simd,
                                                   options.parallelFor, options.surfelArrays);
    state->bake.surfels = {};
    state->bake.hierarchy = {};
    state->bake.links = {};
    state->bake.links.kind = bake.links.kind;
    return Relighter(std::move(state));
  }
#if defined(RELUME_HAS_GL)
  Result<std::unique_ptr<gl::GlBackend>> made = gl::GlBackend::create(state->bake, state->lumaBands, state->chromaBands,
                                                                      options.visibilityGlsl, options.deringing);
  if (!made) return made.error();
  state->gl = std::move(*made);
  return Relighter(std::move(state));
#else
  return Error{ErrorCode::unsupported, "this build of the runtime has no OpenGL backend (RELUME_BUILD_GL is off)"};
#endif
}

Relighter::Relighter(std::unique_ptr<State> state) : state_(std::move(state)) {}
Relighter::Relighter(Relighter&&) noexcept = default;
Relighter& Relighter::operator=(Relighter&&) noexcept = default;
Relighter::~Relighter() = default;

Status Relighter::relight(const LightSetup& setup) {
  if (Status ok = check(setup); !ok) return ok;
  LightSetup applied = setup;
  normaliseLights(setup.lights, state_->lights);
  applied.lights = state_->lights;
  if (state_->cpu) state_->cpu->relight(applied);
#if defined(RELUME_HAS_GL)
  if (state_->gl) state_->gl->relight(applied);
#endif
  return done();
}

Status Relighter::check(const LightSetup& setup) const {
  if (!state_->surfelArrays && !(setup.surfelIrradiance.empty() && setup.surfelEmission.empty())) {
    return usage("light setup: surfelIrradiance or surfelEmission without RelightOptions::surfelArrays");
  }
  return checkSetup(setup, state_->surfelCount, state_->skyPatchCount);
}

void Relighter::reset() {
  if (state_->cpu) state_->cpu->reset();
#if defined(RELUME_HAS_GL)
  if (state_->gl) state_->gl->reset();
#endif
}

glm::vec3 Relighter::irradianceOnLightmap(const glm::vec2& lightmapUv, const glm::vec3& normal,
                                          const glm::vec3& geometricNormal) const {
  return cpu::irradianceOnLightmap(state_->bake.caches, state_->cacheLight(), lightmapUv, normal, geometricNormal);
}

glm::vec3 Relighter::irradianceOnLightmap(const glm::vec2& lightmapUv, const glm::vec3& normal) const {
  return irradianceOnLightmap(lightmapUv, normal, normal);
}

glm::vec3 Relighter::irradianceInGrid(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  return cpu::irradianceInGrid(state_->bake.caches, state_->cacheLight(), positionWorld, normal);
}

std::vector<float> Relighter::cacheCoefficients() const {
  const std::span<const float> all = state_->cacheLight().coefficients;
  return std::vector<float>(all.begin(), all.end());
}

std::vector<glm::vec3> Relighter::nodeRadiosity() const {
#if defined(RELUME_HAS_GL)
  if (state_->gl) return state_->gl->nodeRadiosity();
#endif
  std::vector<glm::vec3> radiosity;
  radiosity.reserve(state_->cpu->nodes().size());
  for (const std::uint32_t node : state_->cpu->nodes()) radiosity.push_back(unpackColor(node));
  return radiosity;
}

std::uint64_t Relighter::sceneHash() const { return state_->bake.provenance.sceneHash; }

int Relighter::lumaBands() const { return state_->lumaBands; }
int Relighter::chromaBands() const { return state_->chromaBands; }

int Relighter::coefficientsPerCache() const {
  return static_cast<int>(cpu::CacheLight{state_->lumaBands, state_->chromaBands, {}, false}.stride());
}

Backend Relighter::backend() const { return state_->cpu ? Backend::cpu : Backend::gl; }

std::vector<PassTime> Relighter::passTimes() const {
#if defined(RELUME_HAS_GL)
  if (state_->gl) return state_->gl->passTimes();
#endif
  return state_->cpu->passTimes();
}

std::vector<std::pair<std::string, std::size_t>> Relighter::bufferSizes() const {
#if defined(RELUME_HAS_GL)
  if (state_->gl) return state_->gl->bufferSizes();
#endif
  return state_->cpu->bufferSizes();
}

GlResolveInputs Relighter::glResolveInputs() const {
#if defined(RELUME_HAS_GL)
  if (state_->gl) return state_->gl->resolveInputs();
#endif
  return {};
}

std::string Relighter::resolveGlsl() const {
#if defined(RELUME_HAS_GL)
  if (state_->gl) return state_->gl->resolveGlsl();
#endif
  return {};
}

void Relighter::bindResolveInputs() const {
#if defined(RELUME_HAS_GL)
  if (state_->gl) state_->gl->bindResolveInputs();
#endif
}

std::uint32_t Relighter::surfelProgram() const {
#if defined(RELUME_HAS_GL)
  if (state_->gl) return state_->gl->surfelProgram();
#endif
  return 0;
}

}  // namespace relume
