// SPDX-License-Identifier: MIT
// See edit_fields.h.
#include "tools/gl_scene/edit_fields.h"

#include <glm/gtc/type_ptr.hpp>

#include <span>

namespace relume {
namespace {

LiveGlNames namesBefore() { return {"relumeBefore", {21, 22, 23}}; }
LiveGlNames namesAfter() { return {"relumeAfter", {24, 25, 26}}; }

}  // namespace

Result<EditFields> EditFields::create() {
  auto before = LiveField::create(namesBefore());
  if (!before) return before.error();
  auto after = LiveField::create(namesAfter());
  if (!after) return after.error();
  return EditFields(std::move(*before), std::move(*after));
}

Result<std::string> EditFields::glsl() {
  const Result<std::string> before = liveResolveGlsl(namesBefore()), after = liveResolveGlsl(namesAfter());
  if (!before) return before;
  if (!after) return after;
  return *before + *after + EditBlend::glsl();
}

void EditFields::bind(GLuint program) const {
  before_.setUniforms(program);
  before_.bind();
  after_.setUniforms(program);
  after_.bind();
  const std::span<const glm::vec4> boxes = isLit() ? blend_.boxes() : std::span<const glm::vec4>();
  const auto location = [&](const char* name) { return glGetUniformLocation(program, name); };
  glProgramUniform1i(program, location("relumeEditBoxes"), static_cast<GLint>(boxes.size() / 2));
  glProgramUniform1f(program, location("relumeEditVoxel"), blend_.voxel());
  glProgramUniform1i(program, location("levelHasEdits"), isLit() ? 1 : 0);
  if (!boxes.empty())
    glProgramUniform4fv(program, location("relumeEditBox"), static_cast<GLsizei>(boxes.size()),
                        glm::value_ptr(boxes[0]));
}

}  // namespace relume
