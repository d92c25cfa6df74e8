// SPDX-License-Identifier: MIT
// See render_gl.h. The image is drawn in tiles of sub-pixels into float targets and boxed down here, so that its size
// is bound by memory and not by the largest framebuffer.
#include "tools/gl_scene/egl_context.h"

#include "bake/rays/far_level.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/level_shader.h"
#include "tools/gl_scene/shadow_maps.h"
#include "tools/render/edited_gl.h"
#include "tools/render/live_gl.h"
#include "tools/render/render_gl.h"
#include "tools/render/render_tiles.h"

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <optional>

namespace relume {
namespace {

constexpr GLuint kConeUnit = 19;  // of what cones find: renderConeLight, renderConeGlossy

// After levelConstant()s: renderLobes, links in lobes about the reflected directions, else irradiance; renderGloss,
// surfaces mirror as their materials say; renderCones, cones have found what is mirrored and how open places are.
// Radiances with albedo, except normal and position. w of the albedo is 1 where something is hit.
const char* kMain = R"(
layout(location = 0) out vec4 outAlbedo;
layout(location = 1) out vec4 outDirect;
layout(location = 2) out vec4 outLinks;
layout(location = 3) out vec4 outEmission;
layout(location = 9) uniform float renderEmissive;
layout(location = 10) uniform bool renderCentres;
layout(location = 11) uniform float renderExponent;  // of the lobes, where materials do not say it
layout(location = 12) uniform vec4 renderEye;        // position, 1; or of parallel rays the direction, 0
layout(location = 14) uniform bool renderSurfaces;   // what cones start from, and nothing else
layout(location = 16) uniform bool renderCaches;     // beside cones, a bake's caches have rough lobes
layout(binding = 19) uniform sampler2D renderConeLight;
layout(binding = 20) uniform sampler2D renderConeGlossy;
void main() {
  if (!levelOpaque()) discard;
  vec3 n = levelNormal(), p = levelPosition, albedo = levelAlbedo(), specular = vec3(1.0);
  vec3 ray = renderEye.w > 0.0 ? normalize(p - renderEye.xyz) : renderEye.xyz;
  float exponent = renderExponent;
  if (renderGloss) {
    vec2 metalRough = levelMetalRough();
    levelSplitReflectance(albedo, metalRough, n, -ray, albedo, specular);
    exponent = levelExponent(metalRough.y);
  }
  if (renderSurfaces) {
    outAlbedo = vec4(p, 1.0 / gl_FragCoord.w);
    outDirect = vec4(levelPlane(-ray), 0.0);
    outLinks = vec4(n, 0.0);
    outEmission = vec4(reflect(ray, n), exponent);
    return;
  }
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  outAlbedo = vec4(albedo, 1.0);
  if (renderCentres) {
    outDirect = vec4(n, 0.0);
    outLinks = vec4(p, 0.0);
    outEmission = vec4(0.0);
    return;
  }
  const float invPi = 0.31830988618;
  outDirect = vec4(albedo * levelDirect(p, n) * invPi, 0.0);
  if (renderLobes) {
    vec3 r = reflect(ray, n), light = vec3(0.0);
    if (renderCones) {
      float share = renderCaches ? levelCacheShare(exponent) : 0.0;
      light = (1.0 - share) * texelFetch(renderConeGlossy, pixel, 0).rgb;
      if (share > 0.0) light += share * levelGlossy(p, n, r, exponent);
    } else {
      light = levelGlossy(p, n, r, renderGloss ? levelCacheExponent(exponent) : exponent);
    }
    if (renderGloss) light += levelHighlights(p, r, exponent, -ray);
    outLinks = vec4(specular * light, 0.0);
  } else {
    outLinks = vec4(albedo * levelLinks(p, n) * invPi, 0.0);
  }
  outEmission = vec4(renderEmissive * levelEmission(), renderCones ? texelFetch(renderConeLight, pixel, 0).w : 0.0);
}
)";

// Light over links, of a bake or without one; neither where there is none.
struct LinkLight {
  const Relighter* baked = nullptr;
  const LiveCachesGl* live = nullptr;
  const EditFields* edits = nullptr;  // of the bake's level

  explicit operator bool() const { return baked != nullptr || live != nullptr; }
  void bind(GLuint program) const {
    if (baked != nullptr) baked->gl()->bind();
    if (edits != nullptr) edits->bind(program);
    if (live == nullptr) return;
    live->setUniforms(program);
    live->bind();
  }
};

class GlRenderer {
 public:
  // live: as the request asks for it, or null.
  // lobes: the program that draws them; irradiance: the other one.
  GlRenderer(const RenderRequest& request, const GlLevel& level, GLuint irradiance, GLuint lobes,
             const TileTargets& targets, LiveGl* live, RenderedFrame& frame)
      : request_(request),
        level_(level),
        irradiance_(irradiance),
        lobes_(lobes),
        targets_(targets),
        live_(live),
        frame_(frame) {}

  // Draw a tile with supersampling and add it to the frame. Errors of ConesGl.
  Status shade(const Tile& tile, const LinkLight& all, const LinkLight& straight) {
    if (live_ != nullptr && live_->cones) {
      if (Status ok = followCones(tile); !ok) return ok;
    }
    if (request_.drawsGlossy() && (all || request_.drawsCones())) {
      drawTile(lobes_, tile, all, request_.samples, false);
      box(2, tile, frame_.glossy);
    }
    drawTile(irradiance_, tile, all, request_.samples, false);
    if (request_.occlusionFalloff) boxOpen(tile);
    box(0, tile, frame_.albedo);
    box(1, tile, frame_.direct);
    box(2, tile, frame_.indirect);
    box(3, tile, frame_.emission);
    addSky(tile);
    if (!straight) return done();
    drawTile(irradiance_, tile, straight, request_.samples, false);
    box(2, tile, frame_.straight);
    return done();
  }

  // Normals, positions and depths at pixel centres.
  void centres(const Tile& tile) {
    drawTile(irradiance_, tile, {}, 1, true);
    const CameraRays rays(request_.camera, request_.width, request_.height);
    std::vector<glm::vec4> hit, normal, position;
    targets_.read(0, tile.width, tile.height, hit);
    targets_.read(1, tile.width, tile.height, normal);
    targets_.read(2, tile.width, tile.height, position);
    for (std::uint32_t y = 0; y < tile.height; ++y) {
      for (std::uint32_t x = 0; x < tile.width; ++x) {
        const std::size_t from = std::size_t{tile.height - 1 - y} * tile.width + x;
        const std::size_t to = std::size_t{tile.y + y} * request_.width + tile.x + x;
        if (hit[from].w == 0.0f) continue;
        frame_.normal[to] = glm::vec3(normal[from]);
        frame_.position[to] = glm::vec3(position[from]);
        frame_.depth[to] = glm::dot(frame_.position[to] - rays.origin, rays.forward);
      }
    }
  }

  // The lit side of the first voxel that each pixel's ray meets.
  void voxels() {
    const CameraRays rays(request_.camera, request_.width, request_.height);
    for (std::uint32_t i = 0; i < request_.width * request_.height; ++i) {
      glm::vec3 origin, direction;
      rays.at(static_cast<float>(i % request_.width) + 0.5f, static_cast<float>(i / request_.width) + 0.5f, origin,
              direction);
      frame_.voxels[i] = live_->voxels.volumes.radianceAlong(origin, direction);
    }
  }

 private:
  // From each sub-pixel of a tile. What they find stays bound for the draws.
  Status followCones(const Tile& tile) {
    glUseProgram(irradiance_);
    glUniform1i(14, 1);
    drawTile(irradiance_, tile, {}, request_.samples, false);
    glUniform1i(14, 0);
    PixelTextures surfaces = targets_.surfaces(request_.drawsGlossy());
    surfaces.clipFromWorld = tileView(request_, level_, tile).clipFromWorld();
    if (Status ok = live_->cones->trace(surfaces, live_->voxels.sky()); !ok) return ok;
    const GLuint found[] = {live_->cones->lightTexture(), live_->cones->glossyTexture()};
    for (GLuint i = 0; i < 2; ++i) {
      glActiveTexture(GL_TEXTURE0 + kConeUnit + i);
      glBindTexture(GL_TEXTURE_2D, found[i]);
    }
    glActiveTexture(GL_TEXTURE0);
    return done();
  }

  void drawTile(GLuint program, const Tile& tile, const LinkLight& links, std::uint32_t samples,
                bool centresOnly) const {
    targets_.begin(tile.width * samples, tile.height * samples);
    glUseProgram(program);
    glUniform1f(9, request_.drawsEmission() ? 1.0f : 0.0f);
    glUniform1i(10, centresOnly ? 1 : 0);
    glUniform1f(11, request_.exponent.value_or(0.0f));
    const CameraRays rays(request_.camera, request_.width, request_.height);
    const glm::vec4 eye = rays.orthographic ? glm::vec4(rays.forward, 0.0f) : glm::vec4(rays.origin, 1.0f);
    glUniform4fv(12, 1, glm::value_ptr(eye));
    glUniform1i(16, links.baked != nullptr ? 1 : 0);
    links.bind(program);
    const LevelView view = tileView(request_, level_, tile);
    level_.draw(view, request_.gloss);
    level_.drawDynamic(view, {}, request_.gloss);
  }

  // Mean of the samples of each pixel of a target.
  void box(int target, const Tile& tile, std::vector<glm::vec3>& layer) {
    const std::uint32_t samples = request_.samples, width = tile.width * samples, height = tile.height * samples;
    targets_.read(target, width, height, pixels_);
    const float weight = 1.0f / static_cast<float>(samples * samples);
    for (std::uint32_t y = 0; y < height; ++y) {
      const std::size_t row = std::size_t{tile.y + (height - 1 - y) / samples} * request_.width + tile.x;
      for (std::uint32_t x = 0; x < width; ++x) {
        layer[row + x / samples] += weight * glm::vec3(pixels_[std::size_t{y} * width + x]);
      }
    }
  }

  // How open the surroundings of each pixel are: wholly where nothing is hit.
  void boxOpen(const Tile& tile) {
    const std::uint32_t samples = request_.samples, width = tile.width * samples, height = tile.height * samples;
    std::vector<glm::vec4> hit;
    targets_.read(0, width, height, hit);
    targets_.read(3, width, height, pixels_);
    const float weight = 1.0f / static_cast<float>(samples * samples);
    for (std::uint32_t y = 0; y < height; ++y) {
      const std::size_t row = std::size_t{tile.y + (height - 1 - y) / samples} * request_.width + tile.x;
      for (std::uint32_t x = 0; x < width; ++x) {
        const std::size_t from = std::size_t{y} * width + x;
        frame_.open[row + x / samples] += weight * (hit[from].w > 0.0f ? 1.0f - pixels_[from].w : 1.0f);
      }
    }
  }

  // The sky's radiance where nothing is hit.
  void addSky(const Tile& tile) {
    if (request_.sky.isDark()) return;
    const std::uint32_t samples = request_.samples, width = tile.width * samples, height = tile.height * samples;
    targets_.read(0, width, height, pixels_);
    const float step = 1.0f / static_cast<float>(samples), weight = step * step;
    const CameraRays rays(request_.camera, request_.width, request_.height);
    for (std::uint32_t y = 0; y < height; ++y) {
      const std::uint32_t fromTop = height - 1 - y;
      const std::size_t row = std::size_t{tile.y + fromTop / samples} * request_.width + tile.x;
      for (std::uint32_t x = 0; x < width; ++x) {
        const float seen = 1.0f - pixels_[std::size_t{y} * width + x].w;
        if (seen == 0.0f) continue;
        glm::vec3 origin, direction;
        rays.at(static_cast<float>(tile.x) + (static_cast<float>(x) + 0.5f) * step,
                static_cast<float>(tile.y) + (static_cast<float>(fromTop) + 0.5f) * step, origin, direction);
        frame_.emission[row + x / samples] += weight * seen * request_.sky.along(direction);
      }
    }
  }

  const RenderRequest& request_;
  const GlLevel& level_;
  GLuint irradiance_, lobes_;
  const TileTargets& targets_;
  LiveGl* live_;
  RenderedFrame& frame_;
  std::vector<glm::vec4> pixels_;
};

}  // namespace

Result<RenderedFrame> renderGl(const Scene& scene, const RenderRequest& request, Context& context) {
  auto egl = EglContext::create();
  if (!egl) return egl.error();
  const bool hasRays = request.edited || (request.live && request.live->lit && request.bake);  // that light something
  if (!hasRays) warnOfFarLevel(scene, context);

  // Level and shadow maps
  const std::span<const std::uint8_t> isEdited =
      request.edited != nullptr ? request.edited->isChanged : std::span<const std::uint8_t>();
  auto level =
      GlLevel::create(scene, request.bake ? &request.bake->caches.lightmap : nullptr, Movable::dynamic, isEdited);
  if (!level) return level.error();
  auto shadows = ShadowMaps::create(request.shadowSize);
  if (!shadows) return shadows.error();
  const std::vector<Light> lights = toRuntimeLights(request.lights);
  // Dynamic instances stand where the level has them, and cast shadows as all else.
  const std::vector<glm::mat4> unmoved;  // where the level has them
  const glm::vec3 eye(request.camera.toWorld[3]);
  if (Status ok = shadows->update(*level, lights, &unmoved, &eye); !ok) return ok.error();

  // Relight
  context.progress("relight", 0.0);
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.lumaBands = request.bands.luma;
  options.chromaBands = request.bands.chroma;
  options.glossy = request.drawsGlossy();
  options.gridTexture = request.gridLookup != GridLookup::stencil;
  options.visibilityGlsl = ShadowMaps::glsl();
  options.getProcAddress = EglContext::getProcAddress;
  auto relit = relightRequest(request, options, {}, [&](const Relighter& relighter) {
    shadows->setUniforms(relighter.gl()->surfelProgram());
    if (const GLuint program = relighter.gl()->movingProgram(); program != 0) shadows->setUniforms(program);
    shadows->bind();
  });
  if (!relit) return relit.error();

  // Light by voxels
  std::optional<LiveGl> live;
  if (request.live && (request.drawsCones() || request.voxels || !request.edited)) {
    auto lit = lightLiveGl(scene, request, *shadows, lights, context);
    if (context.cancelled()) return cancelledError();
    if (!lit) return lit.error();
    live.emplace(std::move(*lit));
  }

  std::optional<EditedGl> edits;
  if (request.edited != nullptr && relit->all) {
    auto lit = lightEditedGl(scene, request, context);
    if (!lit) return lit.error();
    edits.emplace(std::move(*lit));
  }

  // Draw, tile by tile
  const auto makeProgram = [&](bool lobes) -> Result<GlProgram> {
    const std::string fragment = levelConstant("renderLobes", lobes) + levelConstant("renderGloss", request.gloss) +
                                 levelConstant("renderCones", live && live->cones) + kMain;
    auto program = live && live->all ? makeLiveProgram(fragment)
                   : edits           ? makeEditedProgram(*relit->all, fragment, request.gridLookup)
                           : makeLevelProgram(relit->all ? &*relit->all : nullptr, fragment, request.gridLookup);
    if (!program) return program;
    shadows->setUniforms(program->name());
    setLevelLights(program->name(), lights);
    return program;
  };
  const Result<GlProgram> irradiance = makeProgram(false);
  if (!irradiance) return irradiance.error();
  std::optional<Result<GlProgram>> lobes;
  if (request.drawsGlossy()) lobes.emplace(makeProgram(true));
  if (lobes && !*lobes) return lobes->error();
  shadows->bind();
  const std::vector<Tile> tiles = tilesOf(request, request.samples);
  const std::uint32_t most = std::max(request.samples, 1u);
  const TileTargets targets(std::max(most * tiles[0].width, std::min(request.width, kRenderTile)),
                            std::max(most * tiles[0].height, std::min(request.height, kRenderTile)));
  if (!targets.complete()) return Error{ErrorCode::unsupported, "OpenGL cannot draw into 32-bit float targets"};
  RenderedFrame frame;
  frame.renderer = "gl: " + egl->renderer();
  frame.resize(request);
  GlRenderer renderer(request, *level, irradiance->name(), lobes ? (*lobes)->name() : 0, targets,
                      live ? &*live : nullptr, frame);
  const LinkLight all{relit->all ? &*relit->all : nullptr, live && live->all ? &*live->all : nullptr,
                      edits ? &edits->all : nullptr},
      straight{relit->straight ? &*relit->straight : nullptr, live && live->straight ? &*live->straight : nullptr,
               edits && edits->straight ? &*edits->straight : nullptr};
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (Status ok = renderer.shade(tiles[i], all, straight); !ok) return ok.error();
    if (!context.progress("draw", static_cast<double>(i + 1) / static_cast<double>(tiles.size())))
      return cancelledError();
  }
  if (request.centres) {
    for (const Tile& tile : tilesOf(request, 1)) {
      if (context.cancelled()) return cancelledError();
      renderer.centres(tile);
    }
  }
  if (request.voxels) renderer.voxels();
  frame.frames = relit->frames;
  if (relit->all) {
    frame.bands = bandsName({relit->all->lumaBands(), relit->all->chromaBands()});
    frame.passTimes = relit->all->passTimes();
    frame.bufferBytes = relit->all->bufferSizes();
  }
  if (live) {
    if (live->all) {
      frame.frames = live->frames;
      frame.bands = "live light";
    } else if (!relit->all) {
      frame.bands = "voxels without light";
    }
    for (const PassTime& pass : live->passTimes()) frame.passTimes.push_back(pass);
    for (const auto& buffer : live->bufferSizes()) frame.bufferBytes.push_back(buffer);
  }
  if (edits) {
    for (const PassTime& pass : edits->light.passTimes()) frame.passTimes.push_back(pass);
    for (const auto& buffer : edits->light.bufferSizes()) frame.bufferBytes.push_back(buffer);
  }
  return frame;
}

}  // namespace relume
