// SPDX-License-Identifier: MIT
// See live_field.h.
#include "tools/gl_scene/live_field.h"

#include "runtime/live/cell_texels.h"
#include "shaders/shared/layout.h"

#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <span>
#include <string>

namespace relume {
namespace {

constexpr std::uint32_t kSubVoxelsARow = RELUME_LIVE_SUB_VOXELS_A_ROW, kCachesARow = RELUME_LIVE_CACHES_A_ROW;
static_assert(RELUME_LIVE_MAX_VOLUMES == kMaxCascades && RELUME_LIVE_BLEND_CELLS == kBlendCells);
constexpr std::uint32_t kTexels = 7;        // of a cache
constexpr std::uint32_t kCoefficients = 9;  // of a channel

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

namespace {

void addCache(std::span<const float> coefficients, float brightest, LiveTexels& texels) {
  float* const to = glm::value_ptr(texels.light.emplace_back()[0]);
  for (std::uint32_t k = 0; k < kCoefficients; ++k) {
    for (std::uint32_t c = 0; c < 3; ++c) to[3 * k + c] = coefficients[kCoefficients * c + k];
  }
  to[3 * kCoefficients] = brightest;
}

void addLight(const LiveCaches& light, LiveTexels& texels) {
  constexpr std::size_t kOfCache = 3 * kCoefficients;
  for (std::size_t i = 0; i < light.activeCells(); ++i)
    addCache(light.coefficients().subspan(kOfCache * i, kOfCache), light.brightest()[i], texels);
}

// Where the volume's layers are in the texture, which is as wide as the widest of all.
void addCells(const CellSet& cells, const ResolvedVolume& volume, LiveTexels& texels) {
  const std::uint32_t caches = static_cast<std::uint32_t>(texels.light.size()),
                      first = static_cast<std::uint32_t>(texels.subVoxels.size());
  const std::vector<glm::uvec4> own = cellTexels(cells);
  for (std::uint32_t c = 0; c < own.size(); ++c) {
    const glm::ivec3 at = cells.grid.cellAt(c) + glm::ivec3(0, 0, volume.layer);
    glm::uvec4 texel = own[c];
    texel.z += first;
    if (texel.w != kInactive) texel.w += 64 * caches;
    texels.cell[static_cast<std::size_t>((at.z * texels.size.y + at.y) * texels.size.x + at.x)] = texel;
  }
  const std::vector<glm::uvec4> subVoxels = subVoxelTexels(cells);
  texels.subVoxels.insert(texels.subVoxels.end(), subVoxels.begin(), subVoxels.end());
}

}  // namespace

LiveTexels texelsOf(const NestedCaches& light) {
  LiveTexels texels;
  texels.size.z = 0;
  for (std::size_t level = 0; level < light.size(); ++level) {
    const VolumeGrid& grid = light[level].cells().grid;
    texels.volumes.push_back({grid, texels.size.z, light.reach(level)});
    texels.size = {std::max(texels.size.x, grid.cells.x), std::max(texels.size.y, grid.cells.y),
                   texels.size.z + grid.cells.z};
  }
  texels.cell.assign(static_cast<std::size_t>(texels.size.x * texels.size.y * texels.size.z),
                     glm::uvec4(0, 0, 0, kInactive));
  if (light[0].cells().grid.roams) addCache(light.sky().coefficients, light.sky().brightest, texels);
  for (std::size_t level = 0; level < light.size(); ++level) {
    addCells(light[level].cells(), texels.volumes[level], texels);
    addLight(light[level], texels);
  }
  return texels;
}

Result<LiveField> LiveField::create(const LiveGlNames& names) {
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  if (most < 4096)
    return Error{ErrorCode::failed,
                 "OpenGL's textures have " + std::to_string(most) + " texels at most, 4096 expected"};
  LiveField field(names);
  field.cells_ = texture(GL_TEXTURE_3D);
  field.subVoxels_ = texture(GL_TEXTURE_2D);
  field.light_ = texture(GL_TEXTURE_2D);
  return field;
}

Status LiveField::upload(const LiveTexels& texels) {
  while (glGetError() != GL_NO_ERROR) {
  }
  volumes_.clear();
  const glm::ivec3& size = texels.size;
  const std::uint32_t subVoxelRows = rowsOf(texels.subVoxels.size(), kSubVoxelsARow),
                      lightRows = rowsOf(texels.light.size(), kCachesARow);
  std::vector<glm::uvec4> subVoxels(texels.subVoxels);
  subVoxels.resize(std::size_t{subVoxelRows} * kSubVoxelsARow);
  std::vector<std::array<glm::vec4, kTexels>> light(texels.light);
  light.resize(std::size_t{lightRows} * kCachesARow);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glBindTexture(GL_TEXTURE_3D, cells_.name());
  glTexImage3D(GL_TEXTURE_3D, 0, GL_RGBA32UI, size.x, size.y, size.z, 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT,
               texels.cell.data());
  glBindTexture(GL_TEXTURE_3D, 0);
  glBindTexture(GL_TEXTURE_2D, subVoxels_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32UI, kSubVoxelsARow, static_cast<GLsizei>(subVoxelRows), 0, GL_RGBA_INTEGER,
               GL_UNSIGNED_INT, subVoxels.data());
  glBindTexture(GL_TEXTURE_2D, light_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, kTexels * kCachesARow, static_cast<GLsizei>(lightRows), 0, GL_RGBA,
               GL_FLOAT, light.data());
  glBindTexture(GL_TEXTURE_2D, 0);
  if (const GLenum error = glGetError(); error != GL_NO_ERROR)
    return Error{ErrorCode::failed, "OpenGL error " + std::to_string(error) + " while uploading live light of " +
                                        std::to_string(texels.light.size()) + " caches"};
  volumes_ = texels.volumes;
  return done();
}

void LiveField::setUniforms(GLuint program) const {
  const auto location = [&](const char* name) { return glGetUniformLocation(program, (names_.prefix + name).c_str()); };
  glProgramUniform1i(program, location("Volumes"), static_cast<GLint>(volumes_.size()));
  for (std::size_t i = 0; i < volumes_.size(); ++i) {
    const ResolvedVolume& volume = volumes_[i];
    const auto element = [&](const char* name) { return location((name + ("[" + std::to_string(i) + "]")).c_str()); };
    const glm::vec3& origin = volume.grid.originWorld;
    const glm::uvec3 size(volume.grid.cells);
    glProgramUniform3f(program, element("Origins"), origin.x, origin.y, origin.z);
    glProgramUniform1f(program, element("Voxels"), volume.grid.voxel);
    glProgramUniform3ui(program, element("Sizes"), size.x, size.y, size.z);
    glProgramUniform1i(program, element("Layers"), volume.layer);
    const VolumeReach& reach = volume.reach;
    glProgramUniform3f(program, element("Lows"), reach.low.x, reach.low.y, reach.low.z);
    glProgramUniform3f(program, element("Highs"), reach.high.x, reach.high.y, reach.high.z);
  }
}

void LiveField::bind() const {
  glActiveTexture(GL_TEXTURE0 + names_.textureUnits[0]);
  glBindTexture(GL_TEXTURE_3D, cells_.name());
  glActiveTexture(GL_TEXTURE0 + names_.textureUnits[1]);
  glBindTexture(GL_TEXTURE_2D, subVoxels_.name());
  glActiveTexture(GL_TEXTURE0 + names_.textureUnits[2]);
  glBindTexture(GL_TEXTURE_2D, light_.name());
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace relume
