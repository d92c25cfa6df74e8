// SPDX-License-Identifier: MIT
// See view_records.h.
#include "tools/view/view_records.h"

#include "bake/rays/ray_tracer.h"
#include "relume/bake/options.h"
#include "tools/gl_scene/draw_targets.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/render/hit_light.h"
#include "tools/render/view_options.h"

#include <glm/common.hpp>
#include <glm/packing.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

namespace relume {
namespace {

constexpr GLuint kLightUnit = 4, kPlaceUnit = 5;
constexpr GLint kSizeLocation = 40, kScaleLocation = 41, kHeightLocation = 42;
constexpr float kChanged = 1e-3f;  // of the mean radiance: what surfels change by before records are relit
constexpr int kStill = 8;          // frames without a change after which records fit themselves to the light

// Texels whose place is that of the surface, two by two: all that the window shows between the picture's pixels.
const char* kGlsl = R"(
layout(location = 40) uniform ivec2 recordSize;  // [pixel] of the picture by records; 0 = there is none
layout(location = 41) uniform vec2 recordScale;  // its pixels to one of the viewport
layout(location = 42) uniform float recordHeight;  // [pixel] of the viewport
layout(binding = 4) uniform usampler2D recordLight;  // irradiance as floats; normal, and 127 where there is light
layout(binding = 5) uniform sampler2D recordPlace;   // [m] position, width of a pixel
bool recordIrradiance(vec3 p, vec3 n, out vec3 irradiance) {
  irradiance = vec3(0.0);
  if (recordSize.x == 0) return false;
  vec3 plane = normalize(cross(dFdx(p), dFdy(p)));
  vec2 at = vec2(gl_FragCoord.x, recordHeight - gl_FragCoord.y) * recordScale - 0.5;
  ivec2 first = ivec2(floor(at));
  vec2 between = at - vec2(first);
  float sum = 0.0;
  for (int k = 0; k < 4; ++k) {
    ivec2 corner = ivec2(k & 1, k >> 1), texel = clamp(first + corner, ivec2(0), recordSize - 1);
    uvec4 light = texelFetch(recordLight, texel, 0);
    vec4 facing = unpackSnorm4x8(light.w), place = texelFetch(recordPlace, texel, 0);
    vec3 away = place.xyz - p;
    // What faces another way, lies off the surface's plane or far along it is something else.
    bool isSame = facing.w > 0.0 && dot(facing.xyz, n) > 0.6 && abs(dot(away, plane)) < place.w &&
                  dot(away, away) < 64.0 * place.w * place.w;
    vec2 share = mix(1.0 - between, between, vec2(corner));
    float weight = isSame ? share.x * share.y + 1e-4 : 0.0;
    irradiance += weight * uintBitsToFloat(light.xyz);
    sum += weight;
  }
  if (sum > 0.0) irradiance /= sum;
  return sum > 0.0;
}
)";

bool isSame(const Sky& a, const Sky& b) {
  return a.radiance == b.radiance && a.below == b.below && a.map == b.map && a.rotationDeg == b.rotationDeg;
}

bool isSame(const FlyCamera& a, const FlyCamera& b) {
  return a.position == b.position && a.forward() == b.forward() && a.yfovRad == b.yfovRad;
}

bool hasChanged(const std::vector<glm::vec3>& before, const std::vector<glm::vec3>& now) {
  if (before.size() != now.size()) return true;
  double sum = 0.0, difference = 0.0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    const glm::vec3 d = glm::abs(now[i] - before[i]);
    sum += now[i].x + now[i].y + now[i].z;
    difference += d.x + d.y + d.z;
  }
  return difference > static_cast<double>(kChanged) * sum;
}

}  // namespace

Result<std::unique_ptr<ViewRecords>> ViewRecords::create(const LoadedLevel& level,
                                                         const GetProcAddress& getProcAddress) {
  Context context;
  auto tracer =
      RayTracer::create(level.scene, BakeOptions{}.embreeIsa, context, RayStructure::bundles, RayGeometry::fixed);
  if (!tracer) return tracer.error();
  std::unique_ptr<ViewRecords> made(new ViewRecords(level, std::move(*tracer), getProcAddress));
  made->map_ = mapSurfels(level.scene, level.bake, made->context_);
  return made;
}

// Records of another sky are of no use.
void ViewRecords::begin(const Sky& sky) {
  sky_ = sky;
  live_.emplace(tracer_, surfelLeaves(*map_), sky, LivePreview::Options{});
  isByGl_ = false;
  camera_.reset();
  radiance_.clear();
}

// Who splats. Another begins with the picture, of the records that there are.
Status ViewRecords::choose(BackendKind backend) {
  const bool byGl = backend == BackendKind::gl && !isGlOut_;
  if (byGl == isByGl_) return done();
  isByGl_ = false;
  camera_.reset();
  live_->drawBy(nullptr);
  if (!byGl) return done();
  if (!splats_) {
    auto made = SplatsGl::create({getProcAddress_, true});
    isGlOut_ = !made;
    if (!made) return made.error();
    splats_ = std::move(*made);
  }
  live_->drawBy(splats_.get());
  isByGl_ = true;
  return done();
}

bool ViewRecords::look(const FlyCamera& fly, std::uint32_t width, std::uint32_t height) {
  const double pixels = static_cast<double>(width) * height,
               scale = std::min(1.0, std::sqrt(static_cast<double>(kMaxPixels) / pixels));
  const auto along = [scale](std::uint32_t n) {
    return std::max(1u, static_cast<std::uint32_t>(std::lround(scale * n)));
  };
  const std::uint32_t columns = along(width), rows = along(height);
  if (camera_ && isSame(*camera_, fly) && live_->width() == columns && live_->height() == rows) return false;
  camera_ = fly;
  Camera camera = lookAt(fly.position, fly.position + fly.forward(), fly.yfovRad);
  camera.aspect = static_cast<float>(width) / static_cast<float>(height);
  live_->look(camera, columns, rows, context_);
  return true;
}

bool ViewRecords::relight(const Relighter& relighter) {
  next_ = surfelRadiances(level_.bake, relighter);
  if (!hasChanged(radiance_, next_)) {
    // Once, when the light has come to rest.
    if (++still_ != kStill) return false;
    live_->settle(context_);
    return true;
  }
  still_ = 0;
  std::swap(radiance_, next_);
  live_->relight(radiance_, context_);
  return true;
}

Status ViewRecords::update(const ViewState& state, const Relighter& relighter, std::uint32_t width,
                           std::uint32_t height, double frameSeconds) {
  using Clock = std::chrono::steady_clock;
  if (!live_ || !isSame(sky_, state.sky)) begin(state.sky);
  const Status chosen = choose(state.relightBy.backend);
  const bool isRelit = relight(relighter), isMoved = look(state.camera, width, height);
  const double seconds = std::clamp(0.5 * frameSeconds, kFrameSeconds, 1.0);
  const auto most = static_cast<std::uint32_t>(kPerFrame * seconds / kFrameSeconds);
  const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  const bool isMore = live_->fill(most, until, context_) > 0;
  const std::optional<Error> failed = live_->takeDrawError();
  if (failed) {
    isGlOut_ = true;
    isByGl_ = false;
  }
  if ((isRelit || isMoved || isMore) && !live_->isDrawn()) upload();
  return failed ? Status(*failed) : chosen;
}

void ViewRecords::upload() {
  const std::uint32_t width = live_->width(), height = live_->height();
  std::vector<glm::uvec4> light(std::size_t{width} * height);
  std::vector<glm::vec4> place(light.size());
  for (std::size_t i = 0; i < light.size(); ++i) {
    const PixelReceiver& r = live_->receivers()[i];
    const Splat& splat = live_->picture()[i];
    const glm::vec3 e = splat.reflected + splat.sky;
    light[i] = {std::bit_cast<std::uint32_t>(e.x), std::bit_cast<std::uint32_t>(e.y), std::bit_cast<std::uint32_t>(e.z),
                splat.weight > 0.0f ? glm::packSnorm4x8(glm::vec4(r.normal, 1.0f)) : 0u};
    place[i] = glm::vec4(r.positionWorld, r.footprint);
  }
  GLint columns = 0, rows = 0;
  if (light_.name() != 0) {
    glBindTexture(GL_TEXTURE_2D, light_.name());
    glGetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_WIDTH, &columns);
    glGetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_HEIGHT, &rows);
  }
  const auto sizeX = static_cast<GLsizei>(width), sizeY = static_cast<GLsizei>(height);
  if (columns != sizeX || rows != sizeY) {
    light_ = makeTexture(GL_RGBA32UI, width, height);
    place_ = makeTexture(GL_RGBA32F, width, height);
  }
  glBindTexture(GL_TEXTURE_2D, light_.name());
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, sizeX, sizeY, GL_RGBA_INTEGER, GL_UNSIGNED_INT, light.data());
  glBindTexture(GL_TEXTURE_2D, place_.name());
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, sizeX, sizeY, GL_RGBA, GL_FLOAT, place.data());
  glBindTexture(GL_TEXTURE_2D, 0);
}

std::string ViewRecords::glsl() { return kGlsl; }

void ViewRecords::bind(const ViewRecords* light) {
  const bool isThere = light != nullptr && light->live_ && light->light() != 0;
  glUniform2i(kSizeLocation, isThere ? static_cast<GLint>(light->live_->width()) : 0,
              isThere ? static_cast<GLint>(light->live_->height()) : 0);
  if (!isThere) return;
  std::array<GLint, 4> viewport{};
  glGetIntegerv(GL_VIEWPORT, viewport.data());
  glUniform2f(kScaleLocation, static_cast<float>(light->live_->width()) / static_cast<float>(std::max(viewport[2], 1)),
              static_cast<float>(light->live_->height()) / static_cast<float>(std::max(viewport[3], 1)));
  glUniform1f(kHeightLocation, static_cast<float>(viewport[3]));
  glActiveTexture(GL_TEXTURE0 + kLightUnit);
  glBindTexture(GL_TEXTURE_2D, light->light());
  glActiveTexture(GL_TEXTURE0 + kPlaceUnit);
  glBindTexture(GL_TEXTURE_2D, light->place());
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace relume
