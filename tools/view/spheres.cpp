// SPDX-License-Identifier: MIT
// See spheres.h. A sphere is a square toward the eye, of which a disc is kept.
#include "tools/view/spheres.h"

#include "tools/gl_scene/gl_program.h"
#include "tools/view/display.h"

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

constexpr GLuint kLightSlot = 0;

const char* kSphereVertex = R"(#version 430
layout(location = 0) in vec4 sphere;  // centre, radius
layout(location = 1) in float state;  // CacheState
layout(location = 0) uniform mat4 clipFromWorld;
layout(location = 1) uniform vec3 eye;
out vec2 corner;
flat out vec3 right, up, toEye;
flat out int cacheState;
flat out int cache;
void main() {
  corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  toEye = normalize(eye - sphere.xyz);
  right = normalize(cross(abs(toEye.y) < 0.99 ? vec3(0, 1, 0) : vec3(1, 0, 0), toEye));
  up = cross(toEye, right);
  cacheState = int(state);
  cache = gl_InstanceID;
  // One that the eye is next to would hide all others.
  float radius = distance(eye, sphere.xyz) > 8.0 * sphere.w ? sphere.w : 0.0;
  gl_Position = clipFromWorld * vec4(sphere.xyz + radius * (corner.x * right + corner.y * up), 1.0);
}
)";

// Irradiance / pi by up to three bands of each channel (formats/sh.h): the clamped cosine's factors are pi, 2 pi / 3
// and pi / 4.
const char* kSphereFragment = R"(
in vec2 corner;
flat in vec3 right, up, toEye;
flat in int cacheState;
flat in int cache;
layout(location = 2) uniform ivec3 layoutOfCache;  // coefficients, bands of luma, of chroma
layout(std430, binding = 0) readonly buffer Light { float coefficient[]; };
out vec4 outColor;
float channel(int first, int bands, vec3 n) {
  float e = 0.28209479 * coefficient[first];
  if (bands > 1) {
    vec3 c = vec3(coefficient[first + 1], coefficient[first + 2], coefficient[first + 3]);
    e += 0.66666667 * 0.48860251 * dot(c, n.yzx);
  }
  if (bands > 2) {
    e += 0.25 * (1.09254843 * (coefficient[first + 4] * n.x * n.y + coefficient[first + 5] * n.y * n.z +
                               coefficient[first + 7] * n.x * n.z) +
                 0.31539157 * coefficient[first + 6] * (3.0 * n.z * n.z - 1.0) +
                 0.54627422 * coefficient[first + 8] * (n.x * n.x - n.y * n.y));
  }
  return e;
}
void main() {
  float square = dot(corner, corner);
  if (square > 1.0) discard;
  if (cacheState == 2) {
    outColor = vec4(0.75, 0.1, 0.12, 1.0);
    return;
  }
  if (square > 0.8) {
    outColor = cacheState == 1 ? vec4(1.0, 0.55, 0.05, 1.0) : vec4(0.05, 0.05, 0.05, 1.0);
    return;
  }
  vec3 n = corner.x * right + corner.y * up + sqrt(1.0 - square) * toEye;
  int at = cache * layoutOfCache.x, luma = layoutOfCache.y * layoutOfCache.y, chroma = layoutOfCache.z * layoutOfCache.z;
  float y = channel(at, layoutOfCache.y, n), co = channel(at + luma, layoutOfCache.z, n);
  float cg = channel(at + luma + chroma, layoutOfCache.z, n), t = y - cg;
  outColor = vec4(display(vec3(t + co, y + cg, t - co)), 1.0);
}
)";

// Visits every point of the grid: its position, and the cache there or none.
template <class Visit>
void visitGrid(const CacheGrid& grid, const Visit& visit) {
  const glm::uvec3 points = grid.resolution, cells = grid.cells();
  const auto at = [&](const glm::vec3& p) { return grid.originWorld + p * grid.spacing; };
  for (std::uint32_t i = 0; i < grid.cache.size(); ++i)
    visit(at({i % points.x, i / points.x % points.y, i / (points.x * points.y)}), grid.cache[i]);
  for (std::uint32_t c = 0; c < grid.brick.size(); ++c) {
    if (grid.brick[c] == kNoBrick) continue;
    const glm::vec3 cell(c % cells.x, c / cells.x % cells.y, c / (cells.x * cells.y));
    for (std::uint32_t k = 0; k < kBrickWords; ++k) {
      const glm::vec3 inside = 0.5f * glm::vec3(k % 3, k / 3 % 3, k / 9);
      visit(at(cell + inside), grid.fine[std::size_t{grid.brick[c]} * kBrickWords + k]);
    }
  }
}

}  // namespace

std::vector<CacheSphere> cacheSpheres(const Bake& bake) {
  const Caches& caches = bake.caches;
  std::vector<CacheSphere> spheres;
  // On surfaces a third of the mean distance of caches, in the air a tenth of that of the finest points.
  const std::uint32_t gridCaches = caches.firstMapCache(), onMap = caches.count() - gridCaches;
  const float area = bake.surfels.areaEach * static_cast<float>(bake.surfels.count());
  const float mapRadius = 0.12f * std::sqrt(area / static_cast<float>(std::max(onMap, 1u)));
  const float gridRadius = gridCaches > 0 ? 0.11f * caches.grid.finestSpacing() : mapRadius;
  for (std::uint32_t i = 0; i < caches.count(); ++i)
    spheres.push_back({caches.positionWorld[i], i < gridCaches ? gridRadius : std::min(mapRadius, 2.0f * gridRadius),
                       CacheState::valid});
  visitGrid(caches.grid, [&](const glm::vec3& point, std::uint32_t cache) {
    if (cache == kHangingPoint) return;
    if (cache == kNoCache) {
      spheres.push_back({point, 0.4f * gridRadius, CacheState::off});
    } else if (glm::distance(point, caches.positionWorld[cache]) > 0.01f * caches.grid.finestSpacing()) {
      spheres[cache].state = CacheState::moved;
    }
  });
  return spheres;
}

Result<Spheres> Spheres::create(const Bake& bake) {
  auto program = linkProgram("caches", kSphereVertex, "#version 430\n" + displayGlsl() + kSphereFragment);
  if (!program) return program.error();
  std::vector<float> numbers;
  const std::vector<CacheSphere> all = cacheSpheres(bake);
  for (const CacheSphere& s : all) {
    for (const float v : {s.centreWorld.x, s.centreWorld.y, s.centreWorld.z, s.radius, static_cast<float>(s.state)})
      numbers.push_back(v);
  }
  Spheres spheres;
  spheres.program_ = std::move(*program);
  spheres.count_ = static_cast<GLsizei>(all.size());
  spheres.layout_ = GlVertexArray::make();
  spheres.spheres_ = GlBuffer::make();
  spheres.light_ = GlBuffer::make();
  glBindVertexArray(spheres.layout_.name());
  glBindBuffer(GL_ARRAY_BUFFER, spheres.spheres_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(numbers.size() * sizeof(float)), numbers.data(),
               GL_STATIC_DRAW);
  constexpr GLsizei kStride = 5 * sizeof(float);
  for (const GLuint slot : {0u, 1u}) {
    glEnableVertexAttribArray(slot);
    glVertexAttribPointer(slot, slot == 0 ? 4 : 1, GL_FLOAT, GL_FALSE, kStride,
                          reinterpret_cast<const void*>(slot * 4 * sizeof(float)));
    glVertexAttribDivisor(slot, 1);
  }
  glBindVertexArray(0);
  return spheres;
}

void Spheres::draw(const Relighter& relighter, const glm::mat4& clipFromWorld, const glm::vec3& eye, float exposure,
                   bool encode) const {
  const std::vector<float> coefficients = relighter.cacheCoefficients();
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, light_.name());
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(coefficients.size() * sizeof(float)),
               coefficients.data(), GL_STREAM_DRAW);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kLightSlot, light_.name());
  glUseProgram(program_.name());
  glUniformMatrix4fv(0, 1, GL_FALSE, glm::value_ptr(clipFromWorld));
  glUniform3fv(1, 1, glm::value_ptr(eye));
  glUniform3i(2, relighter.coefficientsPerCache(), relighter.lumaBands(), relighter.chromaBands());
  setDisplay(exposure, encode);
  glBindVertexArray(layout_.name());
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, count_);
  glBindVertexArray(0);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kLightSlot, 0);
}

}  // namespace relume
