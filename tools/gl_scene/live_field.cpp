// SPDX-License-Identifier: MIT
// See live_field.h.
#include "tools/gl_scene/live_field.h"

#include "runtime/live/cell_texels.h"
#include "runtime/live_gl/live_caches_gl.h"
#include "shaders/shared/layout.h"

#include <glm/gtc/type_ptr.hpp>

#include <algorithm>

namespace relume {
namespace {

constexpr std::uint32_t kPlanesARow = RELUME_LIVE_PLANES_A_ROW, kCachesARow = RELUME_LIVE_CACHES_A_ROW;
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

LiveTexels texelsOf(const LiveCaches& light) {
  const CellSet& cells = light.cells();
  LiveTexels texels{cells.grid, cellTexels(cells), cells.plane, {}};
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

Result<std::string> LiveNames::glsl() const {
  const Result<std::string> one = LiveCachesGl::glsl();
  if (!one) return one;
  std::string text = *one;
  const auto replace = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
  };
  replace("kRelumeLive", std::string("k_") + prefix);
  replace("relumeLive", prefix);
  const std::array<const char*, 3> slots{"CELLS", "PLANES", "LIGHT"};
  for (std::size_t k = 0; k < slots.size(); ++k)
    replace(std::string("binding = RELUME_LIVE_UNIT_") + slots[k], "binding = " + std::to_string(units[k]));
  return text;
}

Result<LiveField> LiveField::create(const LiveNames& names) {
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  if (most < 4096)
    return Error{ErrorCode::failed,
                 "OpenGL's textures have " + std::to_string(most) + " texels at most, 4096 expected"};
  LiveField field(names);
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
  const glm::vec3& origin = grid_.originWorld;
  const glm::uvec3 size(grid_.cells);
  const auto location = [&](const char* name) {
    return glGetUniformLocation(program, (std::string(names_.prefix) + name).c_str());
  };
  glProgramUniform3f(program, location("Origin"), origin.x, origin.y, origin.z);
  glProgramUniform1f(program, location("Voxel"), isLit_ ? grid_.voxel : 0.0f);
  glProgramUniform3ui(program, location("Size"), size.x, size.y, size.z);
}

void LiveField::bind() const {
  glActiveTexture(GL_TEXTURE0 + names_.units[0]);
  glBindTexture(GL_TEXTURE_3D, cells_.name());
  glActiveTexture(GL_TEXTURE0 + names_.units[1]);
  glBindTexture(GL_TEXTURE_2D, planes_.name());
  glActiveTexture(GL_TEXTURE0 + names_.units[2]);
  glBindTexture(GL_TEXTURE_2D, light_.name());
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace relume
