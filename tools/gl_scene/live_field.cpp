// SPDX-License-Identifier: MIT
// See live_field.h.
#include "tools/gl_scene/live_field.h"

#include <glm/gtc/type_ptr.hpp>

#include <algorithm>

namespace relume {
namespace {

constexpr std::uint32_t kPlanesARow = 2048, kCachesARow = 256, kTexels = 7;  // texels: of a cache
constexpr std::uint32_t kCoefficients = 9;                                   // of a channel

// stencilAt() and LiveLight::irradianceBy(), line by line.
const char* kGlsl = R"(
layout(binding = 12) uniform usampler3D liveCells;
layout(binding = 13) uniform isampler2D livePlanes;
layout(binding = 14) uniform sampler2D liveLight;
uniform vec4 liveGrid;   // [m] its corner; w: the edge of a voxel, 0 = there is no light yet
uniform ivec3 liveSize;  // cells
const uint liveNone = 0xFFFFFFFFu;

bool liveHolds(ivec3 v) { return all(greaterThanEqual(v, ivec3(0))) && all(lessThan(v, 4 * liveSize)); }
uint liveBit(ivec3 v) { return uint((v.x & 3) | (v.y & 3) << 2 | (v.z & 3) << 4); }
bool liveIsSet(uvec2 bits, uint bit) { return ((bit < 32u ? bits.x : bits.y) >> (bit & 31u) & 1u) != 0u; }
uint liveCountBefore(uvec2 bits, uint bit) {
  uvec2 below = bit < 32u ? uvec2((1u << bit) - 1u, 0u) : uvec2(liveNone, (1u << (bit - 32u)) - 1u);
  uvec2 count = uvec2(bitCount(bits & below));
  return count.x + count.y;
}

// Whether a voxel that stands is met on the way, voxel by voxel (runtime/voxels/march.h). [voxels]
bool liveIsHidden(vec3 eye, vec3 way) {
  ivec3 v = ivec3(floor(eye)), along = ivec3(greaterThan(way, vec3(1e-12))) - ivec3(lessThan(way, vec3(-1e-12)));
  vec3 inverse = 1.0 / mix(way, vec3(1.0), equal(along, ivec3(0)));
  ivec3 ahead = max(along, ivec3(0)), cell = ivec3(-1);
  uvec2 bits = uvec2(0u);
  for (int i = 0; i < 64; ++i) {
    if (liveHolds(v)) {
      if ((v >> 2) != cell) {
        cell = v >> 2;
        bits = texelFetch(liveCells, cell, 0).xy;
      }
      if (liveIsSet(bits, liveBit(v))) return true;
    }
    vec3 t = mix((vec3(v + ahead) - eye) * inverse, vec3(1e30), equal(along, ivec3(0)));
    int axis = t.y < t.x ? (t.z < t.y ? 2 : 1) : (t.z < t.x ? 2 : 0);
    if (t[axis] >= 1.0) return false;
    v[axis] += along[axis];
  }
  return false;
}

// Out of the voxel of another surface, to the side of its plane on which the place is; three times at most.
vec3 liveStepOut(vec3 place) {
  for (int tries = 0; tries < 3; ++tries) {
    ivec3 v = ivec3(floor(place));
    if (!liveHolds(v)) return place;
    uvec4 brick = texelFetch(liveCells, v >> 2, 0);
    uint bit = liveBit(v);
    if (!liveIsSet(brick.xy, bit)) return place;
    int number = int(brick.z + liveCountBefore(brick.xy, bit));
    ivec2 at = ivec2(number & 2047, number >> 11);
    if (at.y >= textureSize(livePlanes, 0).y) return place;
    vec4 plane = vec4(texelFetch(livePlanes, at, 0));
    vec3 axis = plane.xyz / 127.0;
    float height = dot(place - (vec3(v) + 0.5), axis) - plane.w / 64.0;
    place += axis * (height < 0.0 ? -0.5 : 0.5);
  }
  return place;
}

// The mean of the caches around a place that it sees, once for a pixel.
vec4 liveSum[7];
float liveMost = 0.0;
bool liveIsRead = false;

void liveAdd(uint cache, float weight) {
  int slot = int(cache >> 6);
  ivec2 at = ivec2(7 * (slot & 255), slot >> 8);
  vec4 last = texelFetch(liveLight, at + ivec2(6, 0), 0);
  liveMost = max(liveMost, last.w);
  for (int k = 0; k < 6; ++k) liveSum[k] += weight * texelFetch(liveLight, at + ivec2(k, 0), 0);
  liveSum[6] += weight * last;
}

void liveRead(vec3 positionWorld, vec3 n) {
  if (liveIsRead) return;
  liveIsRead = true;
  for (int k = 0; k < 7; ++k) liveSum[k] = vec4(0.0);
  if (liveGrid.w == 0.0) return;
  vec3 position = (positionWorld - liveGrid.xyz) / liveGrid.w, size = abs(n);
  float lift = 0.5 * (max(max(size.x, size.y), size.z) + size.x + size.y + size.z) + 0.05;
  vec3 eye = liveStepOut(position + lift * n), at = 0.25 * (position + 0.5 * n) - 0.5;
  ivec3 first = ivec3(floor(at));
  vec3 share = at - vec3(first);
  uint cache[8];
  float before[8], seen[8], beforeSum = 0.0, seenSum = 0.0;
  for (int k = 0; k < 8; ++k) {
    ivec3 corner = ivec3(k & 1, k >> 1 & 1, k >> 2), cell = first + corner;
    cache[k] = liveNone;
    before[k] = seen[k] = 0.0;
    if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, liveSize))) continue;
    cache[k] = texelFetch(liveCells, cell, 0).w;
    if (cache[k] == liveNone) continue;
    uint voxel = cache[k] & 63u;
    vec3 stands = vec3(4 * cell + ivec3(voxel & 3u, voxel >> 2 & 3u, voxel >> 4)) + 0.5, toward = stands - eye;
    vec3 w = mix(1.0 - share, share, vec3(corner));
    float weight = max(w.x * w.y * w.z, 1e-4), height = dot(stands - position, n);
    before[k] = height > 0.0 ? weight : 1e-3 * weight;
    beforeSum += before[k];
    if (height <= 0.0 || (dot(toward, toward) > 1e-6 && liveIsHidden(eye, toward))) continue;
    seen[k] = weight;
    seenSum += weight;
  }
  bool sees = seenSum > 1e-3;
  float sum = sees ? seenSum : beforeSum;
  for (int k = 0; k < 8; ++k) {
    float weight = sees ? seen[k] : before[k];
    if (cache[k] != liveNone && weight > 0.0) liveAdd(cache[k], weight / sum);
  }
}

// The dot product of what was read with a lobe about a unit direction, whose bands have these factors.
vec3 liveAlong(vec3 d, vec3 factor) {
  vec4 a = liveSum[0], b = liveSum[1], c = liveSum[2], e = liveSum[3], f = liveSum[4], g = liveSum[5], h = liveSum[6];
  vec3 first = 0.4886025 * (d.y * vec3(a.w, b.xy) + d.z * vec3(b.zw, c.x) + d.x * c.yzw);
  vec3 second = 1.0925484 * (d.x * d.y * e.xyz + d.y * d.z * vec3(e.w, f.xy) + d.x * d.z * g.yzw) +
                0.3153916 * (3.0 * d.z * d.z - 1.0) * vec3(f.zw, g.x) +
                0.5462742 * (d.x * d.x - d.y * d.y) * h.xyz;
  return factor.x * 0.2820948 * a.xyz + factor.y * first + factor.z * second;
}

vec3 liveIrradiance(vec3 positionWorld, vec3 n) {
  const float pi = 3.14159265;
  liveRead(positionWorld, n);
  return clamp(liveAlong(n, pi * vec3(1.0, 0.6666667, 0.25)), vec3(0.0), vec3(pi * liveMost));
}

vec3 liveGlossy(vec3 positionWorld, vec3 n, vec3 r, float exponent) {
  liveRead(positionWorld, n);
  // Of the lobe (n + 1) / 2 pi cos^n over its half of the sphere.
  vec3 factor = vec3(1.0, (exponent + 1.0) / (exponent + 2.0), exponent / (exponent + 3.0));
  return clamp(liveAlong(r, factor), vec3(0.0), vec3(liveMost));
}
)";

GlTexture texture(GLenum target) {
  GlTexture made = GlTexture::make();
  glBindTexture(target, made.name());
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTexParameteri(target, GL_TEXTURE_MAX_LEVEL, 0);
  glBindTexture(target, 0);
  return made;
}

// Rows of a texture that holds so many items, one at least.
std::uint32_t rowsOf(std::size_t items, std::uint32_t aRow) {
  return std::max(static_cast<std::uint32_t>((items + aRow - 1) / aRow), 1u);
}

}  // namespace

LiveTexels texelsOf(const LiveLight& light) {
  const CellSet& cells = light.cells();
  LiveTexels texels{cells.grid, {}, cells.plane, {}};
  texels.cell.reserve(cells.standing.size());
  for (std::size_t c = 0; c < cells.standing.size(); ++c) {
    const std::uint64_t bits = cells.standing[c];
    std::uint32_t cache = kInactive;
    if (const std::uint32_t slot = cells.slot[c]; slot != kInactive)
      cache = 64 * slot + brickBit(glm::ivec3(glm::floor(cells.position[slot])));
    texels.cell.emplace_back(static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32), cells.first[c],
                             cache);
  }
  texels.light.resize(light.activeCells());
  for (std::size_t i = 0; i < texels.light.size(); ++i) {
    const float* const from = light.coefficients().data() + 3 * kCoefficients * i;
    float* const to = glm::value_ptr(texels.light[i][0]);
    for (std::uint32_t k = 0; k < kCoefficients; ++k) {
      for (std::uint32_t c = 0; c < 3; ++c) to[3 * k + c] = from[kCoefficients * c + k];
    }
    to[3 * kCoefficients] = light.brightest()[i];
  }
  return texels;
}

Result<LiveField> LiveField::create() {
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  if (most < 4096)
    return Error{ErrorCode::failed,
                 "OpenGL's textures have " + std::to_string(most) + " texels at most, 4096 expected"};
  LiveField field;
  field.cells_ = texture(GL_TEXTURE_3D);
  field.planes_ = texture(GL_TEXTURE_2D);
  field.light_ = texture(GL_TEXTURE_2D);
  return field;
}

Status LiveField::upload(const LiveTexels& texels) {
  while (glGetError() != GL_NO_ERROR) {
  }
  isLit_ = false;
  grid_ = texels.grid;
  const glm::ivec3 size = grid_.cells;
  const std::uint32_t planeRows = rowsOf(texels.plane.size(), kPlanesARow),
                      lightRows = rowsOf(texels.light.size(), kCachesARow);
  std::vector<std::array<std::int8_t, 4>> plane(texels.plane);
  plane.resize(std::size_t{planeRows} * kPlanesARow);
  std::vector<std::array<glm::vec4, kTexels>> light(texels.light);
  light.resize(std::size_t{lightRows} * kCachesARow);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glBindTexture(GL_TEXTURE_3D, cells_.name());
  glTexImage3D(GL_TEXTURE_3D, 0, GL_RGBA32UI, size.x, size.y, size.z, 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT,
               texels.cell.data());
  glBindTexture(GL_TEXTURE_3D, 0);
  glBindTexture(GL_TEXTURE_2D, planes_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8I, kPlanesARow, static_cast<GLsizei>(planeRows), 0, GL_RGBA_INTEGER, GL_BYTE,
               plane.data());
  glBindTexture(GL_TEXTURE_2D, light_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, kTexels * kCachesARow, static_cast<GLsizei>(lightRows), 0, GL_RGBA,
               GL_FLOAT, light.data());
  glBindTexture(GL_TEXTURE_2D, 0);
  if (const GLenum error = glGetError(); error != GL_NO_ERROR)
    return Error{ErrorCode::failed, "OpenGL error " + std::to_string(error) + " while uploading live light of " +
                                        std::to_string(texels.light.size()) + " caches"};
  isLit_ = true;
  return done();
}

void LiveField::setUniforms(GLuint program) const {
  const glm::vec4 grid(grid_.originWorld, isLit_ ? grid_.voxel : 0.0f);
  glProgramUniform4fv(program, glGetUniformLocation(program, "liveGrid"), 1, glm::value_ptr(grid));
  glProgramUniform3i(program, glGetUniformLocation(program, "liveSize"), grid_.cells.x, grid_.cells.y, grid_.cells.z);
}

void LiveField::bind() const {
  glActiveTexture(GL_TEXTURE0 + kUnits[0]);
  glBindTexture(GL_TEXTURE_3D, cells_.name());
  glActiveTexture(GL_TEXTURE0 + kUnits[1]);
  glBindTexture(GL_TEXTURE_2D, planes_.name());
  glActiveTexture(GL_TEXTURE0 + kUnits[2]);
  glBindTexture(GL_TEXTURE_2D, light_.name());
  glActiveTexture(GL_TEXTURE0);
}

std::string LiveField::glsl() { return kGlsl; }

}  // namespace relume
