// SPDX-License-Identifier: MIT
// The public door of the runtime: checks what comes in and hands it to a backend. See relighter.h.
#include "runtime/relighter.h"

#include "formats/color.h"
#include "formats/sh.h"
#include "runtime/check_bake.h"
#include "runtime/check_setup.h"
#include "runtime/cpu/cpu_backend.h"
#if defined(RELUME_HAS_GL)
#include "runtime/gl/gl_backend.h"
#endif

namespace relume {

#if !defined(RELUME_HAS_GL)
namespace gl {
// Stands where the OpenGL backend would, in a build without it; never made.
class GlBackend {};
}  // namespace gl
#endif

// One of the two backends is there. The bake's arrays are shared, not copied.
struct Relighter::State {
  Bake bake;
  int lumaBands = 1, chromaBands = 1;
  std::unique_ptr<cpu::CpuBackend> cpu;
  std::unique_ptr<gl::GlBackend> gl;

  cpu::CacheLight cacheLight() const {
#if defined(RELUME_HAS_GL)
    if (gl) return {lumaBands, chromaBands, gl->coefficients(), bake.links.kind == LinkKind::irradiance};
#endif
    return cpu->cacheLight();
  }
};

namespace {

// The parts a frame needs; names and the rest of the provenance stay with the host.
Bake shareArrays(const Bake& bake) {
  Bake shared;
  shared.surfels = bake.surfels;
  shared.hierarchy = bake.hierarchy;
  shared.caches = bake.caches;
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
    return usage("chromaBands is " + std::to_string(options.chromaBands) + ", expected 1 to lumaBands = " +
                 std::to_string(luma) + " or 0 for the bake's choice");
  }
  chroma = options.chromaBands > 0 ? options.chromaBands : recommended(bake.provenance.chromaBands, luma);
  return done();
}

}  // namespace

Result<Relighter> Relighter::create(const Bake& bake, const RelightOptions& options) {
  if (Status ok = checkBake(bake); !ok) return ok.error();
  auto state = std::make_unique<State>();
  if (Status ok = chooseBands(bake, options, state->lumaBands, state->chromaBands); !ok) return ok.error();
  state->bake = shareArrays(bake);
  if (options.backend == Backend::cpu) {
    const cpu::LightCachesKernel kernel = cpu::lightCachesKernel(options.simd);
    if (!kernel) return usage("this processor or this build lacks the instruction set asked for in RelightOptions::simd");
    state->cpu = std::make_unique<cpu::CpuBackend>(state->bake, state->lumaBands, state->chromaBands, kernel,
                                                   options.parallelFor);
    return Relighter(std::move(state));
  }
#if defined(RELUME_HAS_GL)
  Result<std::unique_ptr<gl::GlBackend>> made =
      gl::GlBackend::create(state->bake, state->lumaBands, state->chromaBands, options.visibilityGlsl);
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

bool Relighter::relight(const LightSetup& setup) {
  if (!check(setup)) return false;
  if (state_->cpu) state_->cpu->relight(setup);
#if defined(RELUME_HAS_GL)
  if (state_->gl) state_->gl->relight(setup);
#endif
  return true;
}

Status Relighter::check(const LightSetup& setup) const {
  return checkSetup(setup, state_->bake.surfels.positionWorld.size(), state_->bake.hierarchy.skyDirection.size());
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
  for (const glm::vec4& node : state_->cpu->nodes()) radiosity.push_back(yCoCgToRgb(glm::vec3(node)));
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
  const Bake& bake = state_->bake;
  const auto bytes = [](const auto& array) { return array.size() * sizeof(array[0]); };
  const Surfels& s = bake.surfels;
  return {{"surfels", bytes(s.positionWorld) + bytes(s.normal) + bytes(s.albedo) + bytes(s.emission) + bytes(s.receiver)},
          {"hierarchy", bytes(bake.hierarchy.child) + bytes(bake.hierarchy.firstWeight) + bytes(bake.hierarchy.leafNode)},
          {"radiosity", state_->cpu->nodes().size_bytes()},
          {"links", bytes(bake.links.rowBegin) + bytes(bake.links.cone) + bytes(bake.links.shNode) +
                        bytes(bake.links.shCoefficients) + bytes(bake.links.head) + bytes(bake.links.shape)},
          {"caches", bytes(bake.caches.normal) + state_->cpu->cacheLight().coefficients.size_bytes()},
          {"bounce", state_->cpu->bounceBytes()},
          {"index", bytes(bake.caches.lightmap.cache) + bytes(bake.caches.grid.cache)}};
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
