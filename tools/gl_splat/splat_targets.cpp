// SPDX-License-Identifier: MIT
// See splat_targets.h.
#include "tools/gl_splat/splat_targets.h"

#include "bake/preview/screen_box.h"
#include "runtime/gl/errors.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <utility>

namespace relume::gl {
namespace {

constexpr std::size_t kRecordsPerDraw = 16384;  // no draw call takes a driver's watchdog's time
constexpr std::array<GLenum, 2> kBoth{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};

static_assert(static_cast<int>(RecordWeight::smooth) == RELUME_SPLAT_SMOOTH &&
              static_cast<int>(RecordWeight::ward) == RELUME_SPLAT_WARD &&
              static_cast<int>(RecordWeight::tabellion) == RELUME_SPLAT_TABELLION);

float finite(float distance) { return std::min(distance, RELUME_SPLAT_FAR); }

}  // namespace

SplatShape splatShapeOf(const CameraRays& camera, const Record& record, const Interpolation& options) {
  const float reach = reachOf(record, options);
  const ScreenBox box = boxOfSphere(camera, record.positionWorld, reach);
  const bool byItsLight = reach > options.minPixels * record.footprint;
  return {{box.minX, box.minY, box.maxX, box.maxY},
          glm::vec4(record.positionWorld, reach),
          glm::vec4(record.normal, gradientShare(record, reach, options)),
          byItsLight ? finite(record.distance) : 0.0f};
}

Error splatUsage(std::string message) { return {ErrorCode::usage, "splats: " + std::move(message)}; }
Error splatUnsupported(std::string message) { return {ErrorCode::unsupported, "splats: " + std::move(message)}; }

std::string splatSizeText(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

SplatTargets::SplatTargets(const Functions& functions, const DrawFunctions& drawing, std::vector<GLenum> pictureFormats)
    : gl(functions), draw(drawing), formats_(std::move(pictureFormats)) {}

SplatTargets::~SplatTargets() {
  for (const GLuint target : {sumTarget_, pictureTarget_}) {
    if (target != 0) draw.DeleteFramebuffers(1, &target);
  }
  if (vertexArray_ != 0) draw.DeleteVertexArrays(1, &vertexArray_);
}

Texture SplatTargets::makeTexture() {
  GLuint name = 0;
  gl.GenTextures(1, &name);
  Texture texture(gl, name);
  bind(RELUME_SPLAT_UNIT_PLACE, texture);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    gl.TexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
  return texture;
}

Buffer SplatTargets::makeBuffer() {
  GLuint name = 0;
  gl.GenBuffers(1, &name);
  gl.BindBuffer(GL_COPY_WRITE_BUFFER, name);  // which makes it
  return {{gl, name}, 0};
}

void SplatTargets::make(const Buffer& shapes, const Buffer& light, GLsizei lightStride) {
  GLint side = 0;
  std::array<GLint, 2> viewport{};
  gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
  gl.GetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
  maxSide_ = std::max(std::min({side, viewport[0], viewport[1]}), 0);
  for (Texture* texture : {&place, &facing, &sum[0], &sum[1]}) *texture = makeTexture();
  for (std::size_t i = 0; i < formats_.size(); ++i) picture.push_back(makeTexture());
  draw.GenFramebuffers(1, &sumTarget_);
  draw.GenFramebuffers(1, &pictureTarget_);

  draw.GenVertexArrays(1, &vertexArray_);
  draw.BindVertexArray(vertexArray_);
  draw.VertexAttribIFormat(RELUME_SPLAT_AT_BOX, 4, GL_UNSIGNED_INT, offsetof(SplatShape, box));
  draw.VertexAttribBinding(RELUME_SPLAT_AT_BOX, kShapeBinding);
  draw.EnableVertexAttribArray(RELUME_SPLAT_AT_BOX);
  const auto attribute = [this](GLuint at, GLint components, std::size_t offset, GLuint binding) {
    draw.VertexAttribFormat(at, components, GL_FLOAT, GL_FALSE, static_cast<GLuint>(offset));
    draw.VertexAttribBinding(at, binding);
    draw.EnableVertexAttribArray(at);
  };
  attribute(RELUME_SPLAT_AT_POSITION, 4, offsetof(SplatShape, position), kShapeBinding);
  attribute(RELUME_SPLAT_AT_NORMAL, 4, offsetof(SplatShape, normal), kShapeBinding);
  attribute(RELUME_SPLAT_AT_NEAR, 1, offsetof(SplatShape, near), kShapeBinding);
  const auto lights = static_cast<std::size_t>(lightStride) / sizeof(glm::vec4);
  for (std::size_t i = 0; i < lights; ++i)
    attribute(RELUME_SPLAT_AT_LIGHT + static_cast<GLuint>(i), 4, i * sizeof(glm::vec4), kLightBinding);
  draw.BindVertexBuffer(kShapeBinding, shapes.get(), 0, sizeof(SplatShape));
  draw.BindVertexBuffer(kLightBinding, light.get(), 0, lightStride);
  draw.VertexBindingDivisor(kShapeBinding, 1);
  draw.VertexBindingDivisor(kLightBinding, 1);
}

Status SplatTargets::takeError(const std::string& what) {
  if (!takeOutOfMemory(gl)) return done();
  return Error{ErrorCode::memory, "splats: this OpenGL has not enough memory for " + what};
}

void SplatTargets::bind(GLuint unit, const Texture& texture) {
  gl.ActiveTexture(GL_TEXTURE0 + unit);
  gl.BindTexture(GL_TEXTURE_2D, texture.get());
}

// Of the picture's size, in a texture that may have had another.
void SplatTargets::storage(const Texture& texture, GLenum format, const void* data) {
  const bool isInteger = format == GL_RGBA32UI;
  bind(RELUME_SPLAT_UNIT_PLACE, texture);
  draw.TexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(format), static_cast<GLsizei>(width),
                  static_cast<GLsizei>(height), 0, isInteger ? GL_RGBA_INTEGER : GL_RGBA,
                  isInteger ? GL_UNSIGNED_INT : GL_FLOAT, data);
}

// Whether it can be drawn into.
bool SplatTargets::attach(GLuint framebuffer, std::span<const Texture> textures) {
  draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  for (std::size_t i = 0; i < textures.size(); ++i)
    draw.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, kBoth[i], GL_TEXTURE_2D, textures[i].get(), 0);
  draw.DrawBuffers(static_cast<GLsizei>(textures.size()), kBoth.data());
  return draw.CheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

Status SplatTargets::setSize(const CameraRays& camera) {
  const auto columns = static_cast<std::uint32_t>(camera.width), rows = static_cast<std::uint32_t>(camera.height);
  const auto most = static_cast<std::uint32_t>(maxSide_);
  if (columns == 0 || rows == 0 || columns > most || rows > most)
    return splatUnsupported("a picture of " + splatSizeText(columns, rows) + " pixels; this OpenGL draws into 1 to " +
                            std::to_string(most) + " along a side");
  if (columns == width && rows == height) return done();
  width = columns;
  height = rows;
  for (const Texture* texture : {&place, &facing, &sum[0], &sum[1]}) storage(*texture, GL_RGBA32F, nullptr);
  for (std::size_t i = 0; i < picture.size(); ++i) storage(picture[i], formats_[i], nullptr);
  Status ok = takeError("a picture of " + splatSizeText(width, height) + " pixels");
  if (ok && !(attach(sumTarget_, sum) && attach(pictureTarget_, picture)))
    ok = splatUnsupported("this OpenGL does not draw into two targets of 32-bit floats");
  if (!ok) forgetSize();
  return ok;
}

void SplatTargets::sendPixels(std::span<const PixelReceiver> receivers) {
  send(place, receivers.size(),
       [&](std::size_t i) { return glm::vec4(receivers[i].positionWorld, receivers[i].footprint); });
  send(facing, receivers.size(),
       [&](std::size_t i) { return glm::vec4(receivers[i].normal, finite(receivers[i].occluder)); });
}

void SplatTargets::sendBytes(const Buffer& buffer, std::span<const std::byte> bytes, std::size_t at, std::size_t room) {
  gl.BindBuffer(GL_COPY_WRITE_BUFFER, buffer.get());
  if (at == 0) gl.BufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(room), nullptr, GL_DYNAMIC_DRAW);
  gl.BufferSubData(GL_COPY_WRITE_BUFFER, static_cast<GLintptr>(at), static_cast<GLsizeiptr>(bytes.size()),
                   bytes.data());
  sentBytes += bytes.size();
}

void SplatTargets::setViewport() {
  const std::array<GLfloat, 4> viewport{0.0f, 0.0f, static_cast<GLfloat>(width), static_cast<GLfloat>(height)};
  draw.ViewportIndexedfv(0, viewport.data());
}

void SplatTargets::clearSums() {
  constexpr std::array<GLfloat, 4> kNothing{};
  draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, sumTarget_);
  draw.DrawBuffers(2, kBoth.data());
  for (GLint i = 0; i < 2; ++i) draw.ClearBufferfv(GL_COLOR, i, kNothing.data());
}

void SplatTargets::beginSums(GLuint program, const Interpolation& interpolation, bool second) {
  const std::array<GLenum, 2> targets{kBoth[0], second ? kBoth[1] : GLenum{GL_NONE}};
  draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, sumTarget_);
  draw.DrawBuffers(2, targets.data());
  setViewport();
  for (GLuint i = 0; i < 2; ++i) {
    draw.Enablei(GL_BLEND, i);
    draw.BlendEquationSeparatei(i, GL_FUNC_ADD, GL_FUNC_ADD);
    draw.BlendFuncSeparatei(i, GL_ONE, GL_ONE, GL_ONE, GL_ONE);
  }
  gl.UseProgram(program);
  draw.ProgramUniform2f(program, RELUME_SPLAT_AT_SIZE, static_cast<GLfloat>(width), static_cast<GLfloat>(height));
  gl.ProgramUniform1f(program, RELUME_SPLAT_AT_ACCURACY, interpolation.accuracy);
  gl.ProgramUniform1i(program, RELUME_SPLAT_AT_WEIGHT, static_cast<GLint>(interpolation.weight));
  gl.ProgramUniform1i(program, RELUME_SPLAT_AT_GUARDED, interpolation.reach == RecordReach::guarded ? 1 : 0);
  bind(RELUME_SPLAT_UNIT_PLACE, place);
  bind(RELUME_SPLAT_UNIT_FACING, facing);
  draw.BindVertexArray(vertexArray_);
}

void SplatTargets::drawRecords(std::size_t first, std::size_t end) {
  for (; first < end; first += kRecordsPerDraw) {
    const std::size_t count = std::min(kRecordsPerDraw, end - first);
    draw.DrawArraysInstancedBaseInstance(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(count),
                                         static_cast<GLuint>(first));
  }
}

void SplatTargets::show(GLuint program) {
  draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, pictureTarget_);
  for (GLuint i = 0; i < 2; ++i) draw.Disablei(GL_BLEND, i);
  setViewport();
  gl.UseProgram(program);
  bind(RELUME_SPLAT_UNIT_SUM, sum[0]);
  bind(RELUME_SPLAT_UNIT_SUM_SKY, sum[1]);
  bind(RELUME_SPLAT_UNIT_FACING, facing);
  draw.BindVertexArray(vertexArray_);  // whose attributes it does not read
  draw.DrawArraysInstancedBaseInstance(GL_TRIANGLES, 0, 3, 1, 0);
}

void SplatTargets::clearPicture() {
  draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, pictureTarget_);
  constexpr std::array<GLfloat, 4> kDark{};
  constexpr std::array<GLuint, 4> kDarkBits{};
  for (std::size_t i = 0; i < formats_.size(); ++i) {
    if (formats_[i] == GL_RGBA32UI) {
      draw.ClearBufferuiv(GL_COLOR, static_cast<GLint>(i), kDarkBits.data());
    } else {
      draw.ClearBufferfv(GL_COLOR, static_cast<GLint>(i), kDark.data());
    }
  }
}

std::span<const glm::vec4> SplatTargets::read(const Texture& texture) {
  pixels_.resize(std::size_t{width} * height);
  bind(RELUME_SPLAT_UNIT_SUM, texture);
  gl.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, pixels_.data());
  return pixels_;
}

}  // namespace relume::gl
