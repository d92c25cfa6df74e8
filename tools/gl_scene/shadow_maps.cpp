// SPDX-License-Identifier: MIT
// See shadow_maps.h.
//
// Bias: each texel's depth is compared with that of the receiver's own plane at the middle of the texel, so that a
// plane does not shade itself at any angle, and what touches it does. (A receiver moved along its normal instead, by as
// much as slopes ask for, comes out of such shadows: by two texels of 2 cm Sponza reflected 6 % too much of the sun.)
// What is left is a quarter of a texel for surfaces that are not flat.
//
// Depths are compared in GLSL, on the four texels of a gather: compute shaders have no derivatives for a comparing
// sampler to choose a level by, and plain layers for a cube's sides give the same filter everywhere.
#include "tools/gl_scene/shadow_maps.h"

#include "formats/decimal.h"

#include "tools/gl_scene/gl_program.h"
#include "tools/gl_scene/level_shader.h"

#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr float kWidestFlat = 1.2f;    // [rad] half angle of the widest spot that has a flat map
constexpr float kSideTangent = 1.02f;  // of half a cube side's opening
constexpr GLint kPerFarthestLocation = 9;
constexpr float kCoarseTexel = 0.05f;  // [m] of a map that gets a finer one inside
constexpr float kFiner = 8.0f;

const char* kDistanceFragment = R"(
layout(location = 9) uniform float shadowPerFarthest;
void main() {
  if (!levelOpaque()) discard;
  gl_FragDepth = min(length(levelPlace) * shadowPerFarthest, 1.0);
}
)";

std::array<glm::vec3, 8> boxCorners(const glm::vec3& low, const glm::vec3& high) {
  std::array<glm::vec3, 8> corners;
  for (unsigned i = 0; i < 8; ++i)
    corners[i] = {(i & 1u) ? high.x : low.x, (i & 2u) ? high.y : low.y, (i & 4u) ? high.z : low.z};
  return corners;
}

glm::vec3 middleOf(const GlLevel& level) { return 0.5f * level.boundsMin() + 0.5f * level.boundsMax(); }

glm::vec3 anyUp(const glm::vec3& direction) {
  return std::abs(direction.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
}

// The smallest box along a direction that holds the level. Returns the clip matrix, from the level's middle, and the
// wider side [m].
glm::mat4 fitDirectional(const GlLevel& level, const glm::vec3& direction, float& side) {
  const glm::vec3 middle = middleOf(level);
  const glm::mat4 view = glm::lookAt(glm::vec3(0.0f), direction, anyUp(direction));
  glm::vec3 low(std::numeric_limits<float>::max()), high(-low);
  for (const glm::vec3& corner : boxCorners(level.boundsMin() - middle, level.boundsMax() - middle)) {
    const glm::vec3 p(view * glm::vec4(corner, 1.0f));
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::vec3 margin = 0.01f * (high - low) + 0.01f;
  low -= margin;
  high += margin;
  side = std::max(high.x - low.x, high.y - low.y);
  return glm::ortho(low.x, high.x, low.y, high.y, -high.z, -low.z) * view;
}

// A clip matrix of the part of a map: see Map::inner.
glm::mat4 clipInside(const glm::vec3& inner, const glm::mat4& clip) {
  const glm::vec3 middle(2.0f * inner.x - 1.0f, 2.0f * inner.y - 1.0f, 0.0f);
  return glm::translate(glm::scale(glm::mat4(1.0f), glm::vec3(inner.z, inner.z, 1.0f)), -middle) * clip;
}

// Farthest point of the level from a light. [m]
float farthest(const GlLevel& level, const glm::vec3& position) {
  float distance = 0.0f;
  for (const glm::vec3& corner : boxCorners(level.boundsMin(), level.boundsMax()))
    distance = std::max(distance, glm::length(corner - position));
  return 1.01f * distance + 0.01f;
}

// A side of a cube about the origin, opened a little wider than a right angle so that the filter finds its neighbours
// past the edge.
glm::mat4 cubeSide(std::uint32_t side, float near, float far) {
  constexpr std::array<glm::vec3, 6> kForward{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  constexpr std::array<glm::vec3, 6> kUp{{{0, -1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, {0, -1, 0}, {0, -1, 0}}};
  const float half = near * kSideTangent;
  return glm::frustum(-half, half, -half, half, near, far) * glm::lookAt(glm::vec3(0.0f), kForward[side], kUp[side]);
}

bool needsCube(const Light& light) {
  return light.kind == LightKind::point || (light.kind == LightKind::spot && light.outerConeRad > kWidestFlat);
}

GlTexture depthLayers(GLsizei side, GLsizei layers) {
  GlTexture texture = GlTexture::make();
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture.name());
  glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_DEPTH_COMPONENT32F, side, side, layers);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
  return texture;
}

}  // namespace

Result<ShadowMaps> ShadowMaps::create(std::uint32_t size) {
  ShadowMaps maps;
  auto program = linkProgram("shadow map", "#version 430\n" + levelVertexGlsl() + "void main() { levelVertex(); }\n",
                             "#version 430\n" + levelMaterialGlsl() + kDistanceFragment);
  if (!program) return program.error();
  maps.distanceProgram_ = std::move(*program);
  auto depth = makeDepthProgram();
  if (!depth) return depth.error();
  maps.depthProgram_ = std::move(*depth);
  maps.framebuffer_ = GlFramebuffer::make();
  maps.size_ = size;
  return maps;
}

Status ShadowMaps::allocate(std::uint32_t flat, std::uint32_t cubes) {
  // At least one layer each, so that the samplers are complete.
  if (flat_.name() != 0 && flat == flatLayers_ && cubes == cubes_) return done();
  while (glGetError() != GL_NO_ERROR) {
  }
  flat_ = depthLayers(static_cast<GLsizei>(flat > 0 ? size_ : 1), static_cast<GLsizei>(std::max(flat, 1u)));
  sides_ = depthLayers(static_cast<GLsizei>(cubes > 0 ? size_ / 2 : 1), static_cast<GLsizei>(6 * std::max(cubes, 1u)));
  flatLayers_ = flat;
  cubes_ = cubes;
  if (glGetError() != GL_NO_ERROR) {
    flat_ = GlTexture();  // none that a later call would take for what it needs
    return Error{ErrorCode::failed, "no memory for " + std::to_string(flat) + " shadow maps of " +
                                        std::to_string(size_) + " texels a side and " + std::to_string(cubes) +
                                        " cubes of half that"};
  }
  return done();
}

// The middle keeps to eighths of the map, which are whole texels, so that edges of shadows lie still while the eye
// moves.
glm::vec3 ShadowMaps::innerMap(const Map& map, const glm::vec3& eyeWorld, float finer) const {
  const glm::vec2 at(map.fromOrigin * glm::vec4(eyeWorld - glm::vec3(map.light), 1.0f));
  const float step = static_cast<float>(std::max(size_ / 8, 1u)) / (finer * static_cast<float>(size_));
  const float half = 0.5f / finer;
  return {glm::clamp(glm::round(at / step) * step, half, 1.0f - half), finer};
}

bool ShadowMaps::isAbout(const glm::vec3& eyeWorld) const {
  return std::all_of(maps_.begin(), maps_.end(), [&](const Map& map) {
    return std::all_of(map.inner.begin(), map.inner.end(), [&](const glm::vec3& inner) {
      return inner.z == 0.0f || inner == innerMap(map, eyeWorld, inner.z);
    });
  });
}

Status ShadowMaps::update(const GlLevel& level, std::span<const Light> lights, const std::vector<glm::mat4>* moved,
                          const glm::vec3* eyeWorld) {
  if (lights.size() > kMaxLights) {
    return Error{ErrorCode::usage, std::to_string(lights.size()) + " lights are on, and at most " +
                                       std::to_string(kMaxLights) +
                                       " can be where shadow maps are drawn; choose them with --lights"};
  }
  // Place the maps of directional lights, which says how many there are
  const glm::mat4 mapFromClip = glm::scale(glm::translate(glm::mat4(1.0f), glm::vec3(0.5f)), glm::vec3(0.5f));
  const auto cubes = static_cast<std::uint32_t>(std::count_if(lights.begin(), lights.end(), needsCube));
  auto flat = static_cast<std::uint32_t>(lights.size()) - cubes;
  maps_.assign(lights.size(), {});
  std::vector<glm::mat4> clipOfLight(lights.size());
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (lights[i].kind != LightKind::directional) continue;
    Map& map = maps_[i];
    float side = 0.0f;
    clipOfLight[i] = fitDirectional(level, lights[i].direction, side);
    map.light = glm::vec4(middleOf(level), 0.0f);
    map.fromOrigin = mapFromClip * clipOfLight[i];
    map.layer.z = side / static_cast<float>(size_);
    float finer = 1.0f;
    for (glm::vec3& inner : map.inner) {
      if (eyeWorld == nullptr || map.layer.z / finer <= kCoarseTexel) break;
      finer *= kFiner;
      inner = innerMap(map, *eyeWorld, finer);
      ++flat;
    }
  }
  if (Status ok = allocate(flat, cubes); !ok) {
    maps_.clear();
    return ok;
  }

  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glDisable(GL_CULL_FACE);
  std::uint32_t flatLayer = 0, cube = 0;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const Light& light = lights[i];
    Map& map = maps_[i];
    if (light.kind == LightKind::directional) {
      map.layer = {0.0f, static_cast<float>(flatLayer), map.layer.z, 0.0f};
      renderLayer(level, moved, clipOfLight[i], map.light, flat_.name(), flatLayer++, size_);
      for (const glm::vec3& inner : map.inner) {
        if (inner.z > 0.0f)
          renderLayer(level, moved, clipInside(inner, clipOfLight[i]), map.light, flat_.name(), flatLayer++, size_);
      }
      continue;
    }
    const float far = farthest(level, light.positionWorld);
    const float near = std::max(std::min(0.01f, 5e-3f * far), 1e-4f * far);  // 1 cm, but less in tiny levels
    map.light = glm::vec4(light.positionWorld, 1.0f / far);
    if (needsCube(light)) {
      map.layer = {1.0f, static_cast<float>(cube), 4.0f * kSideTangent / static_cast<float>(size_), 0.0f};
      for (std::uint32_t side = 0; side < 6; ++side)
        renderLayer(level, moved, cubeSide(side, near, far), map.light, sides_.name(), 6 * cube + side, size_ / 2);
      ++cube;
    } else {
      const float half = std::min(light.outerConeRad + 0.02f, kWidestFlat + 0.02f);
      const glm::mat4 clip = glm::perspective(2.0f * half, 1.0f, near, far) *
                             glm::lookAt(glm::vec3(0.0f), light.direction, anyUp(light.direction));
      map.fromOrigin = mapFromClip * clip;
      map.layer = {0.0f, static_cast<float>(flatLayer), 2.0f * std::tan(half) / static_cast<float>(size_), 0.0f};
      renderLayer(level, moved, clip, map.light, flat_.name(), flatLayer++, size_);
    }
  }
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  return done();
}

void ShadowMaps::renderLayer(const GlLevel& level, const std::vector<glm::mat4>* moved, const glm::mat4& clip,
                             const glm::vec4& light, GLuint texture, std::uint32_t layer, std::uint32_t size) const {
  glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, texture, 0, static_cast<GLint>(layer));
  glViewport(0, 0, static_cast<GLsizei>(size), static_cast<GLsizei>(size));
  glClearDepth(1.0);
  glClear(GL_DEPTH_BUFFER_BIT);
  // Where depth is that of the triangle, hidden fragments need no shading.
  const bool isDirectional = light.w == 0.0f;
  glUseProgram(isDirectional ? depthProgram_.name() : distanceProgram_.name());
  if (!isDirectional) glUniform1f(kPerFarthestLocation, light.w);
  const LevelView view{glm::vec3(light), clip};
  level.draw(view);
  if (moved) level.drawDynamic(view, *moved);
}

void ShadowMaps::setUniforms(GLuint program) const {
  const auto location = [&](const std::string& name) { return glGetUniformLocation(program, name.c_str()); };
  for (std::size_t i = 0; i < maps_.size(); ++i) {
    const std::string at = "[" + std::to_string(i) + "]";
    glProgramUniformMatrix4fv(program, location("relumeShadowFromOrigin" + at), 1, GL_FALSE,
                              glm::value_ptr(maps_[i].fromOrigin));
    glProgramUniform4fv(program, location("relumeShadowLight" + at), 1, glm::value_ptr(maps_[i].light));
    glProgramUniform4fv(program, location("relumeShadowLayer" + at), 1, glm::value_ptr(maps_[i].layer));
    glProgramUniform3fv(program, location("relumeShadowInner[" + std::to_string(i * kMaxInner) + "]"), kMaxInner,
                        glm::value_ptr(maps_[i].inner[0]));
  }
  glProgramUniform1i(program, location("relumeShadowFlat"), kFlatUnit);
  glProgramUniform1i(program, location("relumeShadowSides"), kSideUnit);
}

void ShadowMaps::bind() const {
  glActiveTexture(GL_TEXTURE0 + kFlatUnit);
  glBindTexture(GL_TEXTURE_2D_ARRAY, flat_.name());
  glActiveTexture(GL_TEXTURE0 + kSideUnit);
  glBindTexture(GL_TEXTURE_2D_ARRAY, sides_.name());
  glActiveTexture(GL_TEXTURE0);
}

std::string ShadowMaps::glsl() {
  return "const uint relumeShadowCount = " + std::to_string(kMaxLights) +
         "u, relumeShadowInnerCount = " + std::to_string(kMaxInner) +
         "u;\nconst float relumeSideTangent = " + decimalGlsl(kSideTangent) + ";\n" + R"(
uniform mat4 relumeShadowFromOrigin[relumeShadowCount];
uniform vec4 relumeShadowLight[relumeShadowCount];
uniform vec4 relumeShadowLayer[relumeShadowCount];
uniform vec3 relumeShadowInner[relumeShadowCount * relumeShadowInnerCount];
uniform sampler2DArray relumeShadowFlat;
uniform sampler2DArray relumeShadowSides;
// Bilinear mean of four comparisons, the depths in the order of textureGather: (0,1), (1,1), (1,0), (0,0).
float relumeCompare(vec4 depths, vec2 texel, vec4 references) {
  vec4 lit = vec4(greaterThanEqual(depths, references));
  vec2 w = fract(texel - 0.5);
  return mix(mix(lit.w, lit.z, w.x), mix(lit.x, lit.y, w.x), w.y);
}
const vec2 relumeGathered[4] = vec2[4](vec2(0.0, 1.0), vec2(1.0, 1.0), vec2(1.0, 0.0), vec2(0.0, 0.0));
// How far a plane may seem to rise or fall from texel to texel, in texels: steeper ones receive next to no light.
const float relumeSteepest = 100.0;
// How far the plane of v and n is from the light, in the directions of the texels around a place of its map [m], and no
// farther than v itself: past an edge of the plane there is something nearer.
// v: from the light, n: normal, both with the map's axes; map coordinates are 0.5 + opening v.xy / v.z. texel: its size at v [m].
vec4 relumePlaneDistances(vec3 v, vec3 n, float opening, vec2 at, vec2 size, float texel) {
  vec2 first = floor(at * size - 0.5) + 0.5;
  float own = length(v), height = dot(n, v);
  vec4 distances;
  for (int i = 0; i < 4; ++i) {
    vec3 d = vec3(((first + relumeGathered[i]) / size - 0.5) / opening, 1.0);
    float along = dot(n, d);
    float found = along * height > 0.0 ? height / along * length(d) : own;
    distances[i] = clamp(found, own - relumeSteepest * texel, own);
  }
  return distances;
}
// v with the axes right, up and forward of a side of the cube; sides are in the order of +x, -x, +y, -y, +z, -z.
vec3 relumeOnSide(vec3 v, uint side) {
  if (side == 0u) return vec3(-v.z, -v.y, v.x);
  if (side == 1u) return vec3(v.z, -v.y, -v.x);
  if (side == 2u) return vec3(v.x, v.z, v.y);
  if (side == 3u) return vec3(v.x, -v.z, -v.y);
  if (side == 4u) return vec3(v.x, -v.y, v.z);
  return vec3(-v.x, -v.y, -v.z);
}
uint relumeSideOf(vec3 v) {
  vec3 a = abs(v);
  if (a.x >= a.y && a.x >= a.z) return v.x > 0.0 ? 0u : 1u;
  if (a.y >= a.z) return v.y > 0.0 ? 2u : 3u;
  return v.z > 0.0 ? 4u : 5u;
}
// The finest map of a directional light that has a place, and the texels about it: its middle in the whole map's
// coordinates, how many times as fine, its layer after the whole map's.
vec4 relumeFinestMap(uint light, vec2 at) {
  float edge = 2.0 / float(textureSize(relumeShadowFlat, 0).x);
  for (uint k = relumeShadowInnerCount; k > 0u; --k) {
    vec3 inner = relumeShadowInner[light * relumeShadowInnerCount + k - 1u];
    vec2 off = abs((at - inner.xy) * inner.z);
    if (inner.z > 0.0 && max(off.x, off.y) < 0.5 - edge) return vec4(inner, float(k));
  }
  return vec4(0.5, 0.5, 1.0, 0.0);
}
float relumeVisibility(uint light, vec3 positionWorld, vec3 normal) {
  vec4 source = relumeShadowLight[light], layer = relumeShadowLayer[light];
  if (layer.x < 0.0) return 1.0;
  bool directional = source.w == 0.0;
  mat4 m = relumeShadowFromOrigin[light];
  vec3 place = positionWorld - source.xyz;
  vec4 finest = vec4(0.5, 0.5, 1.0, 0.0);
  if (directional) finest = relumeFinestMap(light, (m * vec4(place, 1.0)).xy);
  float texel = directional ? layer.z / finest.z : layer.z * length(place);
  float margin = 0.25 * texel;
  vec3 v = place + margin * normal;
  if (layer.x > 0.5) {
    uint side = relumeSideOf(v);
    vec2 size = vec2(textureSize(relumeShadowSides, 0).xy);
    vec3 toward = relumeOnSide(v, side);
    float opening = 0.5 / relumeSideTangent;
    vec2 at = 0.5 + opening * toward.xy / toward.z;
    vec4 distances = relumePlaneDistances(toward, relumeOnSide(normal, side), opening, at, size, texel);
    return relumeCompare(textureGather(relumeShadowSides, vec3(at, 6.0 * layer.y + float(side))), at * size,
                         (distances - margin) * source.w);
  }
  vec4 q = m * vec4(v, 1.0);
  if (!directional && q.w <= 0.0) return 0.0;
  vec2 at = q.xy / q.w, size = vec2(textureSize(relumeShadowFlat, 0).xy);
  if (any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(1.0)))) return 1.0;
  at = (at - finest.xy) * finest.z + 0.5;
  vec4 depths = textureGather(relumeShadowFlat, vec3(at, layer.y + finest.w));
  // The map's axes in the world: rows of its matrix; a map with a position has the middle of its picture in them.
  vec3 forward = vec3(m[0][3], m[1][3], m[2][3]), depth = vec3(m[0][2], m[1][2], m[2][2]);
  vec3 right = vec3(m[0][0], m[1][0], m[2][0]) - 0.5 * forward, up = vec3(m[0][1], m[1][1], m[2][1]) - 0.5 * forward;
  if (!directional) {
    float opening = length(right);
    mat3 toMap = transpose(mat3(right / opening, up / opening, forward));
    vec4 distances = relumePlaneDistances(toMap * v, toMap * normal, opening, at, size, texel);
    return relumeCompare(depths, at * size, (distances - margin) * source.w);
  }
  right *= finest.z;
  up *= finest.z;
  // Depth a map coordinate along the plane, and its bounds.
  float perMetre = length(depth), facing = dot(depth, normal) / perMetre;
  vec2 slope = -vec2(dot(right, normal) / dot(right, right), dot(up, normal) / dot(up, up)) * perMetre /
               (abs(facing) > 1e-4 ? facing : 1e-4);
  vec2 first = floor(at * size - 0.5) + 0.5;
  vec4 references;
  for (int i = 0; i < 4; ++i)
    references[i] = q.z - margin * perMetre +
                    clamp(dot((first + relumeGathered[i]) / size - at, slope), -relumeSteepest * texel * perMetre, 0.0);
  return relumeCompare(depths, at * size, references);
}
)";
}

}  // namespace relume
