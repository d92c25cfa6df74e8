// SPDX-License-Identifier: MIT
// See viewer.h.
#include "tools/view/viewer.h"

#include "formats/color.h"
#include "tools/base/clock.h"
#include "tools/gl_scene/draw_targets.h"
#include "tools/gl_scene/gl_program.h"
#include "tools/gl_scene/level_shader.h"

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

constexpr const char* kRecordsPass = "records";

double nowMs() { return 1e3 * clockSeconds(); }

}  // namespace

Result<Viewer> Viewer::create(const LoadedLevel& loaded, std::uint32_t shadowSize, const ViewState& state,
                              const GetProcAddress& getProcAddress, const Viewer* previous) {
  const Bake& bake = loaded.bake;
  // The thread of live light has work to do while all else is made ready.
  std::optional<LiveShading> live;
  if (!loaded.isBaked) {
    auto made = LiveShading::create(loaded, state.live, getProcAddress, state.camera.position);
    if (!made) return made.error();
    live.emplace(std::move(*made));
  }
  auto level = GlLevel::create(loaded.scene, loaded.isBaked ? &bake.caches.lightmap : nullptr, loaded.movable());
  if (!level) return level.error();
  auto shadows = ShadowMaps::create(shadowSize);
  if (!shadows) return shadows.error();
  auto depth = makeDepthProgram();
  if (!depth) return depth.error();
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.glossy = true;
  options.visibilityGlsl = ShadowMaps::glsl();
  options.getProcAddress = getProcAddress;
  for (const ViewedEmitter& emitter : state.emitters) {
    if (!emitter.image.empty() && findMaterial(bake.emitters, emitter.name))
      options.drivenImages.push_back({emitter.name, emitter.width, emitter.height});
  }
  Viewer viewer(loaded, std::move(*level), std::move(*shadows));
  viewer.options_ = std::move(options);
  viewer.depthProgram_ = std::move(*depth);
  viewer.shownKind_ = shadingKind(state, false, false);
  if (live) {
    if (auto program = viewer.shading_.program(viewer.shownKind_, nullptr); !program) return program.error();
    viewer.live_.emplace(std::move(*live));
  } else {
    auto parts = LevelParts::create(loaded, state);
    if (!parts) return parts.error();
    viewer.parts_ = std::move(*parts);
    const std::vector<MovingNode> nodes = movingNodes(loaded.scene, loaded.movable());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      if (!loaded.scene.instances[nodes[k].firstInstance].baked()) viewer.dynamic_.push_back(k);
    }
    if (loaded.movable() == Movable::all) viewer.edits_.emplace(loaded);
    const bool inherits = previous && !previous->live();
    if (Status ok = viewer.build(state.relightBy, inherits ? &previous->relighter() : nullptr); !ok) return ok.error();
    auto overlays = Overlays::create(bake);
    if (!overlays) return overlays.error();
    viewer.overlays_.emplace(std::move(*overlays));
  }
  if (state.sky.map) {
    auto backdrop = Backdrop::create(*state.sky.map);
    if (!backdrop) return backdrop.error();
    viewer.backdrop_.emplace(std::move(*backdrop));
  }
  return viewer;
}

Status Viewer::makeRecords() {
  if (records_) return done();
  if (live_) return Error{ErrorCode::unsupported, "records read a bake, and there is none"};
  auto made = ViewRecords::create(*loaded_, options_.getProcAddress);
  if (!made) return made.error();
  records_ = std::move(*made);
  return done();
}

// What the level's materials are drawn to emit.
void Viewer::setEmissions(const ViewState& state) {
  for (std::uint32_t m = 0; m < loaded_->materials.size(); ++m) {
    const ShownEmission shown = shownEmission(*loaded_, state, m);
    level_.setEmission(m, shown.radiance, shown.texture);
  }
}

Status Viewer::draw(const ViewState& state, GLuint framebuffer, std::uint32_t width, std::uint32_t height,
                    bool encode) {
  // Shadow maps
  const double begin = nowMs();
  const std::vector<Light> lights = activeLights(state);
  const std::vector<glm::mat4> moved = movesOf(state);
  const glm::vec3& eye = state.camera.position;
  if (!shadowed_ || !areSame(shadowed_->first, lights) || shadowed_->second != moved || !shadows_.isAbout(eye)) {
    shadowed_.reset();
    if (Status ok = shadows_.update(level_, lights, &moved, &eye); !ok) return ok;
    shadowed_.emplace(lights, moved);
  }
  glFinish();
  const double shadowed = nowMs();

  // Light over links
  const bool wantsCones = shadingKind(state, false, true).cones;
  Status lit = done();
  if (live_) {
    constexpr double kSlowMs = 100.0;  // of shadow maps
    lit = live_->update(state, lights, shadows_, shadowed - begin > kSlowMs, wantsCones);
  } else if (state.relight) {
    lit = relight(state, lights, moved);
  }
  if (edits_) {
    const Status blended = edits_->update(state, lights);
    if (lit) lit = blended;
  }
  setEmissions(state);

  const double linked = nowMs();
  const bool isByRecords = showsRecords(state);
  if (isByRecords) {
    double frameMs = 0.0;
    for (const auto& [pass, ms] : times_) frameMs += pass == kRecordsPass ? 0.0 : ms;
    const Status splatted = records_->update(state, relighter(), width, height, 1e-3 * frameMs);
    if (lit) lit = splatted;
  }

  const LevelView view = viewOf(state.camera, static_cast<float>(width) / static_cast<float>(height));
  const double splat = nowMs();
  if (wantsCones && !live_) {
    const Status found = lightVoxels(state, lights, moved);
    if (lit) lit = found;
  }
  bool hasCones = wantsCones && (live_ ? !live_->volumes().empty() : voxels_ && voxels_->isLit());
  if (hasCones) {
    const Status followed = followCones(state, moved, view, width, height);
    hasCones = static_cast<bool>(followed);
    if (lit) lit = followed;
    glFinish();
  }

  // The level and what is laid over it
  const double relit = nowMs();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  const glm::vec3 sky = std::exp2(state.exposure) * state.sky.radiance;
  const auto shown = [&](float c) { return encode ? linearToSrgb(1.0f - std::exp(-c)) : c; };
  glClearColor(shown(sky.r), shown(sky.g), shown(sky.b), 1.0f);
  glClearDepth(1.0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  if (backdrop_) {
    glDisable(GL_DEPTH_TEST);
    backdrop_->draw(view.clip, state.sky.rotationDeg, state.exposure, encode);
    glEnable(GL_DEPTH_TEST);
  }
  if (Status ok = drawLevel(state, lights, moved, view, encode, hasCones); !ok) return ok;
  // Until a point is picked, the links are those of the middle of the view.
  std::optional<glm::vec3> picked = state.picked;
  if (state.shows(Overlay::links) && !picked) picked = surfaceAt(state, 0.5f * glm::vec2(width, height), width, height);
  if (overlays_)
    overlays_->draw(state, relighter(), gl_->gl()->inputs(), picked, {view.clipFromWorld(), width, height, encode});
  glFinish();
  times_ = {{"shadow maps", shadowed - begin}};
  if (live_) {
    times_.emplace_back("take light", linked - shadowed);
  } else if (state.relight) {
    for (const PassTime& pass : relighter().passTimes()) times_.emplace_back(pass.pass, pass.ms);
  }
  if (isByRecords) times_.emplace_back(kRecordsPass, splat - linked);
  if (hasCones) times_.emplace_back("cones", relit - splat);
  times_.emplace_back("draw", nowMs() - relit);
  return lit;
}

Result<std::vector<glm::vec3>> Viewer::irradiance(const ViewState& state, std::uint32_t width, std::uint32_t height) {
  const GlTexture color = makeTexture(GL_RGBA32F, width, height);
  const GlTexture depth = makeTexture(GL_DEPTH_COMPONENT32F, width, height);
  const GlFramebuffer framebuffer = GlFramebuffer::make();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color.name(), 0);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth.name(), 0);
  glViewport(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  ViewState plain = state;
  plain.mode = ViewMode::irradiance;
  const Status drawn =
      drawLevel(plain, activeLights(state), movesOf(state), viewOf(state.camera, aspect), false, false);
  std::vector<glm::vec4> rows(std::size_t{width} * height);
  glReadPixels(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height), GL_RGBA, GL_FLOAT, rows.data());
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  if (!drawn) return drawn.error();
  std::vector<glm::vec3> pixels;
  for (std::size_t y = height; y-- > 0;) {
    for (std::size_t x = 0; x < width; ++x) pixels.emplace_back(rows[y * width + x]);
  }
  return pixels;
}

LevelView Viewer::viewOf(const FlyCamera& camera, float aspect) const {
  const float far = levelSize() + glm::length(camera.position - 0.5f * (level_.boundsMin() + level_.boundsMax()));
  // 2 cm: less in levels of a few centimetres, more in those of hundreds of metres, for depths of 24 bits.
  return camera.view(aspect, std::max(std::min(0.02f, 8e-3f * far), 1e-4f * far), far);
}

// Depths alone, so that each pixel is shaded once.
void Viewer::drawDepths(const std::vector<glm::mat4>& moved, const LevelView& view) const {
  glUseProgram(depthProgram_.name());
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  level_.draw(view);
  level_.drawDynamic(view, moved);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

Status Viewer::drawLevel(const ViewState& state, const std::vector<Light>& lights, const std::vector<glm::mat4>& moved,
                         const LevelView& view, bool encode, bool hasCones) {
  ShadingKind kind = shadingKind(state, showsRecords(state), hasCones);
  kind.edited = edits_ && edits_->isLit();
  const Result<GLuint> program = shading_.program(kind, live_ ? nullptr : &*gl_);
  if (!program) return program.error();
  if (state.mode != ViewMode::irradiance) shownKind_ = kind;
  drawDepths(moved, view);
  glDepthFunc(GL_EQUAL);
  glDepthMask(GL_FALSE);
  shadows_.setUniforms(*program);
  setLevelLights(*program, lights);
  glUseProgram(*program);
  Shading::set(state, kind.mode, {bake_->caches.lightmap.width, bake_->caches.lightmap.height}, encode);
  if (live_) {
    live_->bind(*program);
  } else {
    gl_->gl()->bind();
  }
  if (kind.edited) edits_->bind(*program);
  shadows_.bind();
  if (kind.cones) cones_->bind();
  if (kind.records) ViewRecords::bind(records_.get());
  level_.draw(view, state.gloss);
  // Records are of the level without what moves. Where static objects can be moved, none has been.
  if (kind.records && !edits_) ViewRecords::bind(nullptr);
  level_.drawDynamic(view, moved, state.gloss);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  return done();
}

std::optional<glm::vec3> Viewer::surfaceAt(const ViewState& state, const glm::vec2& pixel, std::uint32_t width,
                                           std::uint32_t height) const {
  const auto x = static_cast<GLint>(pixel.x), y = static_cast<GLint>(height) - 1 - static_cast<GLint>(pixel.y);
  if (x < 0 || y < 0 || x >= static_cast<GLint>(width) || y >= static_cast<GLint>(height)) return std::nullopt;
  float depth = 1.0f;
  glReadPixels(x, y, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
  if (!(depth < 1.0f)) return std::nullopt;
  const LevelView view = viewOf(state.camera, static_cast<float>(width) / static_cast<float>(height));
  const glm::dvec4 clip(2.0 * (x + 0.5) / width - 1.0, 2.0 * (y + 0.5) / height - 1.0,
                        2.0 * static_cast<double>(depth) - 1.0, 1.0);
  const glm::dvec4 at = glm::inverse(glm::dmat4(view.clip)) * clip;
  return glm::vec3(glm::dvec3(view.originWorld) + glm::dvec3(at) / at.w);
}

std::optional<float> Viewer::distanceAhead(const ViewState& state) const {
  const GlTexture color = makeTexture(GL_RGBA8, 1, 1), depth = makeTexture(GL_DEPTH_COMPONENT32F, 1, 1);
  const GlFramebuffer framebuffer = GlFramebuffer::make();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color.name(), 0);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth.name(), 0);
  glViewport(0, 0, 1, 1);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT);
  drawDepths(movesOf(state), viewOf(state.camera, 1.0f));
  const std::optional<glm::vec3> surface = surfaceAt(state, glm::vec2(0.0f), 1, 1);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  return surface ? std::optional(glm::distance(*surface, state.camera.position)) : std::nullopt;
}

std::vector<std::pair<std::string, std::size_t>> Viewer::memory() const {
  if (live_) {
    auto held = live_->bufferSizes();
    if (cones_) {
      for (auto& [name, bytes] : cones_->bufferSizes()) held.emplace_back("OpenGL: " + name, bytes);
    }
    return held;
  }
  auto held = relighter().bufferSizes();
  if (voxels_) {
    for (auto& [name, bytes] : voxels_->bufferSizes()) held.emplace_back("voxels: " + name, bytes);
  }
  if (cones_) {
    for (auto& [name, bytes] : cones_->bufferSizes()) held.emplace_back("OpenGL: " + name, bytes);
  }
  if (cpu_) {
    std::size_t drawn = 0;
    for (const auto& [name, bytes] : gl_->bufferSizes()) drawn += bytes;
    held.emplace_back("OpenGL's", drawn);
  }
  if (edits_) {
    for (auto& buffer : edits_->bufferSizes()) held.push_back(buffer);
  }
  if (records_) held.emplace_back("records", records_->sizeBytes());
  return held;
}

}  // namespace relume
