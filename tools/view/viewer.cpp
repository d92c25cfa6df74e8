// SPDX-License-Identifier: MIT
// See viewer.h.
#include "tools/view/viewer.h"

#include "formats/color.h"
#include "relume/glossy.h"
#include "tools/gl_scene/gl_program.h"
#include "tools/gl_scene/level_shader.h"
#include "tools/render/read_sky_map.h"
#include "tools/view/display.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

const char* kMain = R"(
layout(location = 22) uniform int viewMode;
layout(location = 23) uniform vec2 viewShare;  // 1 where it is shown: direct light, light over links
layout(location = 24) uniform vec3 viewEye;
layout(location = 25) uniform float viewReflectance;
layout(location = 26) uniform float viewExponent;
layout(location = 0) out vec4 outColor;
// Mean radiance in the lobe about the reflected direction.
vec3 glossy(vec3 p, vec3 n) { return levelGlossy(p, n, reflect(normalize(p - viewEye), n), viewExponent); }
void main() {
  if (!levelOpaque()) discard;
  vec3 n = levelNormal(), p = levelPosition;
  const float invPi = 0.31830988618;
  vec3 color = vec3(0.0);
  if (viewMode == 0) {
    vec3 irradiance = viewShare.x * levelDirect(p, n) + viewShare.y * levelLinks(p, n);
    color = (1.0 - viewReflectance) * levelAlbedo() * invPi * irradiance + levelEmission();
    if (viewReflectance > 0.0) color += viewShare.y * viewReflectance * glossy(p, n);
  }
  if (viewMode == 1) color = levelAlbedo() * invPi * levelDirect(p, n) + levelEmission();
  if (viewMode == 2) color = invPi * levelLinks(p, n);
  if (viewMode == 3) color = glossy(p, n);
  if (viewMode == 4) color = levelAlbedo();
  if (viewMode == 5) color = 0.5 * n + 0.5;
  outColor = vec4(display(color), 1.0);
}
)";

const char* kLightmapVertex = R"(#version 430
out vec2 uv;
void main() {
  uv = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
}
)";

// Mean radiance of the texels' caches: coefficient 0 of Y, Co, Cg times y_0^0.
const char* kLightmapMain = R"(
in vec2 uv;
layout(binding = 0) uniform sampler2DArray lightY;
layout(binding = 1) uniform sampler2DArray lightCo;
layout(binding = 2) uniform sampler2DArray lightCg;
out vec4 outColor;
void main() {
  vec3 at = vec3(uv.x, 1.0 - uv.y, 0.0);
  vec3 c = 0.2820948 * vec3(texture(lightY, at).x, texture(lightCo, at).x, texture(lightCg, at).x);
  float t = c.x - c.z;
  outColor = vec4(display(vec3(t + c.y, c.x + c.z, t - c.y)), 1.0);
}
)";

double nowMs() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// A relighter of those bands that begins with the light of `previous`, which may be null.
Result<Relighter> makeRelighter(const Bake& bake, RelightOptions options, const Bands& bands,
                                const Relighter* previous) {
  options.lumaBands = bands.luma;
  options.chromaBands = bands.chroma;
  auto relighter = Relighter::create(bake, options);
  if (!relighter || !previous) return relighter;
  const Status inherited = relighter->inherit(*previous, bake);
  // A bake without a grid has nothing to hand over.
  if (!inherited && inherited.error().code != ErrorCode::unsupported) return inherited.error();
  return relighter;
}

std::vector<Light> activeLights(const ViewState& state) {
  std::vector<Light> lights;
  for (const ViewedLight& viewed : state.lights) {
    if (viewed.on) lights.push_back(viewed.light);
  }
  return lights;
}

// As GlLevel::drawDynamic() wants them.
std::vector<glm::mat4> movesOf(const ViewState& state) {
  std::vector<glm::mat4> moved;
  for (const ViewedObject& object : state.objects)
    moved.push_back(glm::translate(glm::mat4(1.0f), object.position - object.home));
  return moved;
}

}  // namespace

Result<Viewer> Viewer::create(const LoadedLevel& loaded, std::uint32_t shadowSize, const ViewState& state,
                              const GetProcAddress& getProcAddress, const Viewer* previous) {
  const Bake& bake = loaded.bake;
  auto level = GlLevel::create(loaded.scene, &bake.caches.lightmap);
  if (!level) return level.error();
  auto shadows = ShadowMaps::create(shadowSize);
  if (!shadows) return shadows.error();
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.glossy = true;
  options.visibilityGlsl = ShadowMaps::glsl();
  options.getProcAddress = getProcAddress;
  for (const ViewedEmitter& emitter : state.emitters) {
    if (!emitter.image.empty()) options.drivenImages.push_back({emitter.name, emitter.width, emitter.height});
  }
  Viewer viewer(loaded, std::move(*level), std::move(*shadows));
  viewer.options_ = std::move(options);
  if (Status ok = viewer.build(state.relightBy, previous ? &previous->relighter() : nullptr); !ok) return ok.error();
  auto lightmapProgram = linkProgram("light map", kLightmapVertex, "#version 430\n" + displayGlsl() + kLightmapMain);
  if (!lightmapProgram) return lightmapProgram.error();
  auto surfels = Discs::create(bake.surfels.positionWorld, bake.surfels.normal);
  if (!surfels) return surfels.error();
  auto caches = Discs::create(bake.caches.positionWorld, bake.caches.normal);
  if (!caches) return caches.error();
  viewer.lightmapProgram_ = std::move(*lightmapProgram);
  viewer.surfels_.emplace(std::move(*surfels));
  viewer.caches_.emplace(std::move(*caches));
  viewer.nothing_ = GlVertexArray::make();
  if (state.sky.map) {
    auto backdrop = Backdrop::create(*state.sky.map);
    if (!backdrop) return backdrop.error();
    viewer.backdrop_.emplace(std::move(*backdrop));
  }
  return viewer;
}

Status Viewer::choose(const RelightChoice& choice) { return choice == choice_ ? done() : build(choice, &relighter()); }

// Relighter and program of a choice, in place of those that are there.
Status Viewer::build(const RelightChoice& choice, const Relighter* previous) {
  auto relighter = makeRelighter(*bake_, options_, choice.bands, previous);
  if (!relighter) return relighter.error();
  auto program = makeLevelProgram(&*relighter, displayGlsl() + kMain);
  if (!program) return program.error();
  std::optional<CpuLight> cpu;
  if (choice.backend == BackendKind::cpu) {
    RelightOptions options;
    options.drivenImages = options_.drivenImages;
    auto made = CpuLight::create(loaded_->scene, *bake_, *relighter, previous, options);
    if (!made) return made.error();
    cpu.emplace(std::move(*made));
  }
  gl_.emplace(std::move(*relighter));
  program_ = std::move(*program);
  cpu_.reset();
  if (cpu) cpu_.emplace(std::move(*cpu));
  choice_ = choice;
  return done();
}

// The light over links that the state asks for.
Status Viewer::relight(const ViewState& state, const std::vector<Light>& lights) {
  shadows_.setUniforms(gl_->gl()->surfelProgram());
  shadows_.bind();
  LightSetup setup;
  setup.lights = lights;
  setup.emissionScale = glm::vec3(state.emission);
  std::vector<MaterialEmission> emissions;
  for (const ViewedEmitter& emitter : state.emitters) {
    const auto material = findMaterial(bake_->emitters, emitter.name);
    if (!emitter.isDriven || !material) continue;
    emissions.emplace_back();
    emissions.back().material = *material;
    emissions.back().radiance = emitter.radiance;
    emissions.back().image = emitter.image;
  }
  setup.materialEmissions = emissions;
  setup.skyRadiance = state.sky.radiance;
  if (state.sky.map && patchesRotation_ != state.sky.rotationDeg) {
    skyPatches_ = skyPatchesOf(state.sky, bake_->hierarchy.skyDirection.span());
    patchesRotation_ = state.sky.rotationDeg;
  }
  setup.skyPatches = skyPatches_;
  setup.bounceScale = state.bounceScale;
  // So many bounces and no more: so many frames from nothing.
  if (state.bounces > 0) relighter().reset();
  for (int frame = 0; frame < std::max(state.bounces, 1); ++frame) {
    if (Status ok = cpu_ ? cpu_->relight(setup) : gl_->relight(setup); !ok) return ok;
  }
  if (cpu_) cpu_->upload(gl_->gl()->inputs());
  return done();
}

// What the level's materials are drawn to emit.
void Viewer::setEmissions(const ViewState& state) {
  for (std::uint32_t m = 0; m < loaded_->materials.size(); ++m) {
    const Material &baked = loaded_->materials[m], &driven = loaded_->scene.materials[m];
    const auto emitter = std::find_if(state.emitters.begin(), state.emitters.end(),
                                      [&](const ViewedEmitter& e) { return e.isDriven && e.name == baked.name; });
    if (emitter == state.emitters.end()) {
      level_.setEmission(m, state.emission * baked.emission, baked.emissionTexture);
    } else if (emitter->image.empty()) {
      level_.setEmission(m, emitter->radiance, {});
    } else {
      level_.setEmission(m, emitter->radiance * driven.emission, driven.emissionTexture);
    }
  }
}

Status Viewer::draw(const ViewState& state, GLuint framebuffer, std::uint32_t width, std::uint32_t height,
                    bool encode) {
  // Shadow maps
  const double begin = nowMs();
  const std::vector<Light> lights = activeLights(state);
  const std::vector<glm::mat4> moved = movesOf(state);
  if (Status ok = shadows_.update(level_, lights, &moved); !ok) return ok;
  glFinish();
  const double shadowed = nowMs();

  // Light over links
  Status lit = done();
  if (state.relight) lit = relight(state, lights);
  setEmissions(state);

  // The level and what is laid over it
  const double relit = nowMs();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  const glm::vec3 sky = 1.0f - glm::exp(-std::exp2(state.exposure) * state.sky.radiance);
  const auto shown = [&](float c) { return encode ? linearToSrgb(c) : c; };
  glClearColor(shown(sky.r), shown(sky.g), shown(sky.b), 1.0f);
  glClearDepth(1.0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  const glm::mat4 clip = clipFromWorld(state.camera, static_cast<float>(width) / static_cast<float>(height));
  if (backdrop_) {
    glDisable(GL_DEPTH_TEST);
    backdrop_->draw(clip, state.sky.rotationDeg, state.exposure, encode);
    glEnable(GL_DEPTH_TEST);
  }
  drawLevel(state, lights, moved, clip, encode);
  drawOverlays(state, clip, width, height, encode);
  glFinish();
  times_ = {{"shadow maps", shadowed - begin}};
  for (const PassTime& pass : relighter().passTimes()) times_.emplace_back(pass.pass, pass.ms);
  times_.emplace_back("draw", nowMs() - relit);
  return lit;
}

glm::mat4 Viewer::clipFromWorld(const FlyCamera& camera, float aspect) const {
  const float size = glm::length(level_.boundsMax() - level_.boundsMin());
  const float far = size + glm::length(camera.position - 0.5f * (level_.boundsMin() + level_.boundsMax()));
  return camera.clipFromWorld(aspect, std::max(0.02f, 5e-4f * far), far);
}

void Viewer::drawLevel(const ViewState& state, const std::vector<Light>& lights, const std::vector<glm::mat4>& moved,
                       const glm::mat4& clip, bool encode) const {
  shadows_.setUniforms(program_.name());
  setLevelLights(program_.name(), lights);
  glUseProgram(program_.name());
  setDisplay(state.mode == ViewMode::albedo || state.mode == ViewMode::normal ? 0.5f : state.exposure, encode);
  glUniform1i(22, static_cast<int>(state.mode));
  glUniform2f(23, state.direct ? 1.0f : 0.0f, state.indirect ? 1.0f : 0.0f);
  glUniform3fv(24, 1, glm::value_ptr(state.camera.position));
  glUniform1f(25, state.reflectance);
  glUniform1f(26, glossyExponent(state.roughness));
  gl_->gl()->bind();
  shadows_.bind();
  level_.draw(clip);
  level_.drawDynamic(clip, moved);
}

void Viewer::drawOverlays(const ViewState& state, const glm::mat4& clip, std::uint32_t width, std::uint32_t height,
                          bool encode) const {
  if (state.surfels) {
    const float radius = std::sqrt(bake_->surfels.areaEach / std::numbers::pi_v<float>);
    surfels_->draw(surfelColors(), 0.9f * radius, clip, state.camera.position, state.exposure, encode);
  }
  if (state.caches) {
    const float size = glm::length(level_.boundsMax() - level_.boundsMin());
    caches_->draw(cacheColors(), 1.5e-3f * size, clip, state.camera.position, state.exposure, encode);
  }
  if (state.lightmap && bake_->caches.lightmap.width > 0) drawLightmap(state, width, height, encode);
}

// The light map in the lower right corner.
void Viewer::drawLightmap(const ViewState& state, std::uint32_t width, std::uint32_t height, bool encode) const {
  const auto side = static_cast<GLsizei>(std::min(width, height) * 2 / 3);
  glViewport(static_cast<GLint>(width) - side, 0, side, side);
  glDisable(GL_DEPTH_TEST);
  glUseProgram(lightmapProgram_.name());
  setDisplay(state.exposure, encode);
  const GlResolveInputs inputs = gl_->gl()->inputs();
  const GLuint textures[] = {inputs.lightmapY, inputs.lightmapCo, inputs.lightmapCg};
  for (GLuint i = 0; i < 3; ++i) {
    glActiveTexture(GL_TEXTURE0 + i);
    glBindTexture(GL_TEXTURE_2D_ARRAY, textures[i]);
  }
  glActiveTexture(GL_TEXTURE0);
  glBindVertexArray(nothing_.name());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glBindVertexArray(0);
  glEnable(GL_DEPTH_TEST);
}

// Radiance of each surfel: radiosity over pi.
std::vector<glm::vec3> Viewer::surfelColors() const {
  const std::vector<glm::vec3> radiosity = relighter().nodeRadiosity();
  std::vector<glm::vec3> colors(bake_->surfels.count());
  for (std::size_t s = 0; s < colors.size(); ++s)
    colors[s] = radiosity[bake_->hierarchy.leafNode[s]] * std::numbers::inv_pi_v<float>;
  return colors;
}

// Mean radiance around each cache.
std::vector<glm::vec3> Viewer::cacheColors() const {
  const std::vector<float> c = relighter().cacheCoefficients();
  const auto stride = static_cast<std::size_t>(relighter().coefficientsPerCache());
  const auto luma = static_cast<std::size_t>(gl_->lumaBands() * gl_->lumaBands());
  const auto chroma = static_cast<std::size_t>(gl_->chromaBands() * gl_->chromaBands());
  std::vector<glm::vec3> colors(bake_->caches.count());
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const float* at = c.data() + i * stride;
    colors[i] = yCoCgToRgb(0.2820948f * glm::vec3(at[0], at[luma], at[luma + chroma]));
  }
  return colors;
}

}  // namespace relume
