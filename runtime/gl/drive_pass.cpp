// SPDX-License-Identifier: MIT
// See drive_pass.h.
#include "runtime/gl/drive_pass.h"

#include "runtime/gl/program.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <string>

namespace relume::gl {
namespace {

constexpr GLuint kUnit = RELUME_RESOLVE_UNIT_Y;  // is saved
constexpr GLuint kMaxGroups = 65535;

Sampler makeSampler(const Functions& gl, bool clampU, bool clampV) {
  GLuint name = 0;
  gl.GenSamplers(1, &name);
  Sampler sampler(gl, name);
  gl.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  gl.SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.SamplerParameteri(name, GL_TEXTURE_WRAP_S, clampU ? GL_CLAMP_TO_EDGE : GL_REPEAT);
  gl.SamplerParameteri(name, GL_TEXTURE_WRAP_T, clampV ? GL_CLAMP_TO_EDGE : GL_REPEAT);
  return sampler;
}

// What is wrong with the texture that is bound; empty when nothing is.
std::string wrongWith(const Functions& gl, const glm::uvec2& size) {
  const auto sizeOf = [&gl](GLint level) {
    GLint width = 0, height = 0;
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, level, GL_TEXTURE_WIDTH, &width);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, level, GL_TEXTURE_HEIGHT, &height);
    return glm::uvec2(static_cast<GLuint>(width), static_cast<GLuint>(height));
  };
  const auto text = [](const glm::uvec2& s) { return std::to_string(s.x) + " x " + std::to_string(s.y); };
  if (sizeOf(0) != size)
    return "has " + text(sizeOf(0)) + " texels, expected the " + text(size) + " that were declared";
  // The last level: a chain that ends before is read as black.
  GLint last = 0;
  while (std::max(size.x, size.y) >> (last + 1) != 0) ++last;
  if (sizeOf(last) != glm::uvec2(1u, 1u)) return "has no mip levels down to one texel: call glGenerateMipmap()";
  return {};
}

}  // namespace

Result<DrivePass> DrivePass::create(const Functions& gl, const Emitters& emitters, const ImageSizes& sizes,
                                    std::pmr::memory_resource* memory) {
  DrivePass pass(memory);
  if (emitters.count() == 0) return pass;
  Result<Program> program = makeComputeProgram(gl, "drive_emitters.comp", {});
  if (!program) return program.error();
  pass.program_ = std::move(*program);
  const auto location = [&](const char* name) { return gl.GetUniformLocation(pass.program_.get(), name); };
  pass.firstEntry_ = location("relumeFirstEntry");
  pass.endEntry_ = location("relumeEndEntry");
  pass.drivenBy_ = location("relumeDrivenBy");
  pass.factor_ = location("relumeFactor");
  gl.ProgramUniform1i(pass.program_.get(), location("relumeImage"), static_cast<GLint>(kUnit));
  if (std::any_of(sizes.begin(), sizes.end(), [](const glm::uvec2& size) { return size.x > 0; })) {
    for (std::size_t i = 0; i < pass.sampler_.size(); ++i)
      pass.sampler_[i] = makeSampler(gl, (i & 1) != 0, (i & 2) != 0);
    pass.texture_.resize(sizes.size());
  }
  return pass;
}

Status DrivePass::check(const Functions& gl, const LightSetup& setup, const ImageSizes& sizes) const {
  GLint bound = -1;
  std::string wrong;
  for (const MaterialEmission& emission : setup.materialEmissions) {
    if (emission.texture == 0) continue;
    if (bound < 0) gl.GetIntegerv(GL_TEXTURE_BINDING_2D, &bound);
    GLint now = 0;
    if (gl.IsTexture(emission.texture) == GL_TRUE) {
      gl.BindTexture(GL_TEXTURE_2D, emission.texture);
      gl.GetIntegerv(GL_TEXTURE_BINDING_2D, &now);
    }
    if (static_cast<GLuint>(now) != emission.texture) {
      gl.GetError();  // of binding a texture that is of another kind
      wrong = "is no GL_TEXTURE_2D";
    } else {
      wrong = wrongWith(gl, sizes[emission.material]);
    }
    if (wrong.empty()) continue;
    gl.BindTexture(GL_TEXTURE_2D, static_cast<GLuint>(bound));
    return Error{ErrorCode::usage, "light setup: materialEmissions[" +
                                       std::to_string(&emission - setup.materialEmissions.data()) + "].texture " +
                                       std::to_string(emission.texture) + " " + wrong};
  }
  if (bound >= 0) gl.BindTexture(GL_TEXTURE_2D, static_cast<GLuint>(bound));
  return done();
}

void DrivePass::reserve(const Functions& gl, const LightSetup& setup, DrivenEmission& driven) {
  for (const MaterialEmission& emission : setup.materialEmissions) {
    if (emission.image.empty() || texture_[emission.material].get() != 0) continue;
    const ImagePyramid& image = *driven.image(emission.material);
    GLuint name = 0;
    gl.GenTextures(1, &name);
    texture_[emission.material] = Texture(gl, name);
    gl.ActiveTexture(GL_TEXTURE0 + kUnit);
    gl.BindTexture(GL_TEXTURE_2D, name);
    gl.TexStorage2D(GL_TEXTURE_2D, static_cast<GLsizei>(image.levels()), GL_RGBA32F,
                    static_cast<GLsizei>(image.size(0).x), static_cast<GLsizei>(image.size(0).y));
    for (std::uint32_t level = 0; level < image.levels(); ++level)
      textureBytes_ += std::size_t{16} * image.size(level).x * image.size(level).y;
  }
}

void DrivePass::uploadImage(const Functions& gl, const ImagePyramid& image, const Texture& texture) const {
  gl.BindTexture(GL_TEXTURE_2D, texture.get());
  for (std::uint32_t level = 0; level < image.levels(); ++level) {
    const glm::uvec2 size = image.size(level);
    gl.TexSubImage2D(GL_TEXTURE_2D, static_cast<GLint>(level), 0, 0, static_cast<GLsizei>(size.x),
                     static_cast<GLsizei>(size.y), GL_RGB, GL_FLOAT, image.texels(level).data());
  }
}

void DrivePass::dispatch(const Functions& gl, GLuint first, GLuint end, GLuint by, const glm::vec3& factor) const {
  const GLuint program = program_.get();
  gl.ProgramUniform1ui(program, drivenBy_, by);
  gl.ProgramUniform3f(program, factor_, factor.x, factor.y, factor.z);
  gl.ProgramUniform1ui(program, endEntry_, end);
  // The number of groups of one dispatch is limited.
  for (; first < end; first += std::min(end - first, kMaxGroups * RELUME_SURFEL_GROUP)) {
    gl.ProgramUniform1ui(program, firstEntry_, first);
    gl.DispatchCompute(std::min((end - first + RELUME_SURFEL_GROUP - 1) / RELUME_SURFEL_GROUP, kMaxGroups), 1, 1);
  }
}

void DrivePass::run(const Functions& gl, const GpuBake& gpu, DrivenEmission& driven, const glm::vec3& undriven) {
  const Emitters& emitters = driven.emitters();
  gl.UseProgram(program_.get());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, RELUME_SLOT_EMITTERS, gpu.emitters.get());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, RELUME_SLOT_EMISSION, gpu.emission.get());
  gl.ActiveTexture(GL_TEXTURE0 + kUnit);
  for (std::uint32_t m = 0; m < emitters.materials.size(); ++m) {
    const DrivableMaterial& material = emitters.materials[m];
    const GLuint first = material.firstEntry;
    GLuint end = first + material.entryCount;
    const MaterialEmission* emission = driven.of(m);
    if (emission == nullptr) {
      // The undriven ones behind it as well.
      for (; m + 1 < emitters.materials.size() && driven.of(m + 1) == nullptr; ++m)
        end += emitters.materials[m + 1].entryCount;
      dispatch(gl, first, end, kRelumeBaked, undriven);
    } else if (emission->image.empty() && emission->texture == 0) {
      dispatch(gl, first, end, kRelumeColor, emission->radiance);
    } else {
      if (emission->texture == 0) {
        uploadImage(gl, *driven.image(m), texture_[m]);
      } else {
        gl.BindTexture(GL_TEXTURE_2D, emission->texture);
      }
      gl.BindSampler(kUnit, sampler_[(material.clampU ? 1u : 0u) + (material.clampV ? 2u : 0u)].get());
      dispatch(gl, first, end, kRelumeImage, emission->radiance);
    }
  }
  gl.BindSampler(kUnit, 0);
}

}  // namespace relume::gl
