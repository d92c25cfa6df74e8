// SPDX-License-Identifier: MIT
// See renderer.h.
#include "renderer.h"

#include "shaders.h"

#include <epoxy/gl.h>

#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <array>
#include <cstddef>
#include <string>

namespace {

constexpr int kSunSide = 2048, kLampSide = 512;

// std140, as kFrame has it.
struct FrameBlock {
  glm::mat4 clipFromWorld, worldFromClip, sunMapFromWorld;
  glm::vec4 sunDirection, sunIrradiance, lampPosition, lampIntensity, show;
};

// Appends the log to `error` where a shader does not compile.
GLuint link(std::initializer_list<std::pair<GLenum, std::string>> stages, std::string& error) {
  const GLuint program = glCreateProgram();
  std::array<char, 4096> log{};
  for (const auto& [kind, body] : stages) {
    const GLuint shader = glCreateShader(kind);
    const std::string text = "#version 450\n" + body;
    const char* const source = text.c_str();
    glShaderSource(shader, 1, &source, nullptr);
    glCompileShader(shader);
    glGetShaderInfoLog(shader, log.size(), nullptr, log.data());
    GLint ok = GL_FALSE;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (ok == GL_FALSE) error += log.data();
    glAttachShader(program, shader);
  }
  glLinkProgram(program);
  GLint ok = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &ok);
  if (ok == GL_FALSE) error += "a program does not link";
  return program;
}

GLuint makeTexture(GLenum target, GLenum format, int width, int height, GLint filter, int levels = 1) {
  GLuint texture = 0;
  glCreateTextures(target, 1, &texture);
  glTextureStorage2D(texture, levels, format, width, height);
  glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, filter);
  if (filter == GL_NEAREST) glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, filter);
  return texture;
}

GLuint makeShadowMap(GLenum target, int side) {
  const GLuint map = makeTexture(target, GL_DEPTH_COMPONENT32F, side, side, GL_LINEAR);
  glTextureParameteri(map, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  return map;
}

GLuint makeImage(int width, int height, const unsigned char* rgba) {
  int levels = 1;
  while (std::max(width, height) >> levels > 0) ++levels;
  const GLuint image = makeTexture(GL_TEXTURE_2D, GL_SRGB8_ALPHA8, width, height, GL_LINEAR_MIPMAP_LINEAR, levels);
  glTextureSubImage2D(image, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
  glGenerateTextureMipmap(image);
  return image;
}

}  // namespace

relume::Result<Renderer> Renderer::create(const Level& level, const Draw& cube, const relume::Bake& bake, int width,
                                          int height, relume::GetProcAddress getProcAddress) {
  relume::RelightOptions options;
  options.backend = relume::BackendKind::gl;
  options.getProcAddress = std::move(getProcAddress);
  auto relighter = relume::Relighter::create(bake, options);
  if (!relighter) return relighter.error();

  Renderer made;
  made.level_ = &level;
  made.cube_ = cube;
  made.relighter_.emplace(std::move(*relighter));
  made.width_ = width;
  made.height_ = height;
  const relume::GlResolve& gl = *made.relighter_->gl();
  const std::string frame = kFrame;
  std::string error;
  made.solid_ = link({{GL_VERTEX_SHADER, kSolidVertex}, {GL_FRAGMENT_SHADER, kSolidFragment}}, error);
  made.lighting_ =
      link({{GL_VERTEX_SHADER, kFullScreenVertex}, {GL_FRAGMENT_SHADER, frame + gl.glsl() + kLightingFragment}}, error);
  made.surfels_ = link({{GL_COMPUTE_SHADER, frame + gl.surfelGlsl() + kSurfelCompute}}, error);
  if (!error.empty()) return relume::Error{relume::ErrorCode::failed, "a shader: " + error};
  made.makeMeshes();
  made.makeTargets();
  if (glGetError() != GL_NO_ERROR) return relume::Error{relume::ErrorCode::memory, "OpenGL has no room for the level"};
  return made;
}

void Renderer::makeMeshes() {
  const auto fill = [](GLuint buffer, const auto& values) {
    glNamedBufferStorage(buffer, static_cast<GLsizeiptr>(values.size() * sizeof values[0]), values.data(), 0);
  };
  GLuint buffer[3];
  glCreateBuffers(3, buffer);
  fill(buffer[0], level_->vertices);
  fill(buffer[1], level_->indices);
  glNamedBufferStorage(frameBlock_ = buffer[2], sizeof(FrameBlock), nullptr, GL_DYNAMIC_STORAGE_BIT);
  glCreateVertexArrays(1, &vertexArray_);
  glVertexArrayVertexBuffer(vertexArray_, 0, buffer[0], 0, sizeof(Vertex));
  glVertexArrayElementBuffer(vertexArray_, buffer[1]);
  const auto attribute = [&](GLuint at, GLint size, GLenum type, std::size_t offset) {
    glEnableVertexArrayAttrib(vertexArray_, at);
    glVertexArrayAttribFormat(vertexArray_, at, size, type, type != GL_FLOAT, static_cast<GLuint>(offset));
    glVertexArrayAttribBinding(vertexArray_, at, 0);
  };
  attribute(0, 3, GL_FLOAT, offsetof(Vertex, position));
  attribute(1, 3, GL_FLOAT, offsetof(Vertex, normal));
  attribute(2, 2, GL_FLOAT, offsetof(Vertex, uv));
  attribute(3, 2, GL_UNSIGNED_SHORT, offsetof(Vertex, lightmapUv));
  const std::array<unsigned char, 4> white{255, 255, 255, 255};
  white_ = makeImage(1, 1, white.data());
  for (const Image& image : level_->images)
    images_.push_back(image.rgba.empty() ? white_ : makeImage(image.width, image.height, image.rgba.data()));
}

void Renderer::makeTargets() {
  constexpr GLenum kFormats[] = {GL_SRGB8_ALPHA8, GL_RGBA16F,        GL_RGBA16F,
                                 GL_RG16,         GL_R11F_G11F_B10F, GL_DEPTH_COMPONENT32F};
  GLenum attached[6] = {};
  glCreateFramebuffers(1, &gBuffer_);
  for (unsigned i = 0; i < 6; ++i) {
    target_[i] = makeTexture(GL_TEXTURE_2D, kFormats[i], width_, height_, GL_NEAREST);
    attached[i] = i < 5 ? GL_COLOR_ATTACHMENT0 + i : GL_DEPTH_ATTACHMENT;
    glNamedFramebufferTexture(gBuffer_, attached[i], target_[i], 0);
  }
  glNamedFramebufferDrawBuffers(gBuffer_, 5, attached);
  glCreateFramebuffers(1, &result_);
  resultColor_ = makeTexture(GL_TEXTURE_2D, GL_SRGB8_ALPHA8, width_, height_, GL_NEAREST);
  glNamedFramebufferTexture(result_, GL_COLOR_ATTACHMENT0, resultColor_, 0);
  sunMap_ = makeShadowMap(GL_TEXTURE_2D, kSunSide);
  lampMap_ = makeShadowMap(GL_TEXTURE_CUBE_MAP, kLampSide);
  glCreateFramebuffers(1, &shadowBuffer_);
  glNamedFramebufferDrawBuffer(shadowBuffer_, GL_NONE);
}

// The level, then the character.
void Renderer::drawSolids(const glm::mat4& clipFromWorld, const Frame& frame) const {
  const auto draw = [&](const Material& m, const Draw& d) {
    const glm::vec4 emission(m.emission, m.alphaCutoff);
    glUniform4fv(2, 1, glm::value_ptr(m.color));
    glUniform4fv(3, 1, glm::value_ptr(emission));
    glBindTextureUnit(0, m.image >= 0 ? images_[static_cast<std::size_t>(m.image)] : white_);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(d.indexCount), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(d.firstIndex * sizeof(std::uint32_t)));
  };
  const glm::mat4 identity(1.0f);
  glUseProgram(solid_);
  glBindVertexArray(vertexArray_);
  glUniformMatrix4fv(0, 1, GL_FALSE, glm::value_ptr(identity));
  glUniformMatrix4fv(1, 1, GL_FALSE, glm::value_ptr(clipFromWorld));
  for (const Draw& d : level_->draws) draw(level_->materials[d.material], d);
  const Material cloth{{0.13f, 0.25f, 0.55f, 1.0f}, {}, 0.0f, -1};
  for (const glm::mat4& box : frame.boxes) {
    glUniformMatrix4fv(0, 1, GL_FALSE, glm::value_ptr(box));
    draw(cloth, cube_);
  }
}

// A box along the sun's rays that holds the level, and the width of a texel [m].
glm::mat4 Renderer::clipOfSun(const glm::vec3& direction, float& texel) const {
  const glm::vec3 middle = 0.5f * (level_->low + level_->high);
  const float radius = 0.5f * glm::distance(level_->low, level_->high) + 0.1f;
  texel = 2.0f * radius / kSunSide;
  const glm::vec3 up = std::abs(direction.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
  return glm::ortho(-radius, radius, -radius, radius, 0.0f, 2.0f * radius) *
         glm::lookAt(middle - radius * direction, middle, up);
}

glm::mat4 Renderer::drawShadows(const Frame& frame) {
  const glm::vec3 lamp = frame.lamp.positionWorld, extent = level_->high - level_->low;
  const float far = glm::length(extent) + glm::distance(lamp, level_->low + 0.5f * extent);
  const float aspect = static_cast<float>(width_) / static_cast<float>(height_);
  float texel = 0.0f;
  const glm::mat4 sun = clipOfSun(frame.sun.direction, texel);
  FrameBlock block{};
  block.clipFromWorld = glm::perspective(frame.fovYRad, aspect, 0.05f, far) * glm::inverse(frame.worldFromCamera);
  block.worldFromClip = glm::inverse(block.clipFromWorld);
  block.sunMapFromWorld = glm::scale(glm::translate(glm::mat4(1.0f), glm::vec3(0.5f)), glm::vec3(0.5f)) * sun;
  block.sunDirection = glm::vec4(frame.sun.direction, texel);
  block.sunIrradiance = glm::vec4(frame.sun.intensity, 0.0f);
  block.lampPosition = glm::vec4(lamp, far);
  block.lampIntensity = glm::vec4(frame.lamp.intensity, 0.0f);
  block.show = {frame.show != 2, frame.show != 1, 0.0f, frame.show != 0};
  glNamedBufferSubData(frameBlock_, 0, sizeof block, &block);

  glBindFramebuffer(GL_FRAMEBUFFER, shadowBuffer_);
  glNamedFramebufferTexture(shadowBuffer_, GL_DEPTH_ATTACHMENT, sunMap_, 0);
  glViewport(0, 0, kSunSide, kSunSide);
  glClear(GL_DEPTH_BUFFER_BIT);
  drawSolids(sun, frame);
  constexpr glm::vec3 kForward[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  const glm::mat4 quarter = glm::perspective(glm::radians(90.0f), 1.0f, 0.02f, far);
  glViewport(0, 0, kLampSide, kLampSide);
  for (int side = 0; side < 6; ++side) {
    const glm::vec3 up = side == 2 ? glm::vec3(0, 0, 1) : side == 3 ? glm::vec3(0, 0, -1) : glm::vec3(0, -1, 0);
    glNamedFramebufferTextureLayer(shadowBuffer_, GL_DEPTH_ATTACHMENT, lampMap_, 0, side);
    glClear(GL_DEPTH_BUFFER_BIT);
    drawSolids(quarter * glm::lookAt(lamp, lamp + kForward[side], up), frame);
  }
  return block.clipFromWorld;
}

relume::Status Renderer::draw(const Frame& frame) {
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_FRAMEBUFFER_SRGB);
  glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, frameBlock_);

  // 1. Shadow maps: of the level and of all that moves in it
  const glm::mat4 clipFromWorld = drawShadows(frame);
  glBindTextureUnit(4, sunMap_);
  glBindTextureUnit(5, lampMap_);

  // 2. Light the surfels by the function and the maps that light the pixels, then let Relume take the light from there
  const relume::GlResolve& gl = *relighter_->gl();
  gl.bindSurfels();
  glUseProgram(surfels_);
  glDispatchCompute((gl.surfelSlots() + 63) / 64, 1, 1);
  relume::LightSetup setup;
  setup.surfelIrradianceOnGpu = true;
  if (relume::Status lit = relighter_->relight(setup); !lit) return lit;

  // 3. G-buffer
  glBindFramebuffer(GL_FRAMEBUFFER, gBuffer_);
  glViewport(0, 0, width_, height_);
  glClear(GL_DEPTH_BUFFER_BIT);  // where nothing is drawn, the lighting pass reads no other target
  drawSolids(clipFromWorld, frame);

  // 4. Lighting and tone mapping
  glBindFramebuffer(GL_FRAMEBUFFER, result_);
  glDisable(GL_DEPTH_TEST);
  glUseProgram(lighting_);
  for (GLuint i = 0; i < 6; ++i) glBindTextureUnit(i < 4 ? i : i + 2, target_[i]);
  gl.bind();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  return relume::done();
}

void Renderer::present(int windowWidth, int windowHeight) const {
  glDisable(GL_FRAMEBUFFER_SRGB);  // the picture is encoded already
  glBlitNamedFramebuffer(result_, 0, 0, 0, width_, height_, 0, 0, windowWidth, windowHeight, GL_COLOR_BUFFER_BIT,
                         GL_LINEAR);
}

std::vector<unsigned char> Renderer::picture() const {
  std::vector<unsigned char> rgb(static_cast<std::size_t>(3 * width_ * height_));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glGetTextureImage(resultColor_, 0, GL_RGB, GL_UNSIGNED_BYTE, static_cast<GLsizei>(rgb.size()), rgb.data());
  return rgb;
}
