// SPDX-License-Identifier: MIT
// See splats_gl.h. A record is an instance of four vertices: attributes that the light does not change in one buffer,
// its light in another, which alone is sent anew when records are relit.
#include "tools/gl_splat/splats_gl.h"

#include "bake/preview/screen_box.h"
#include "relume/bake/scene.h"
#include "runtime/gl/functions.h"
#include "runtime/gl/handle.h"
#include "runtime/gl/program.h"
#include "runtime/gl/saved_state.h"
#include "shaders/shared/layout.h"
#include "tools/gl_splat/saved_drawing.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

constexpr std::uint32_t kMaxRecords = 10000000;
constexpr std::size_t kRecordsPerDraw = 16384;  // no draw call takes a driver's watchdog's time
constexpr std::size_t kLeastRecords = 1024;     // that buffers have room for
constexpr GLuint kShapeBinding = 0, kLightBinding = 1;

static_assert(static_cast<int>(RecordWeight::smooth) == RELUME_SPLAT_SMOOTH &&
              static_cast<int>(RecordWeight::ward) == RELUME_SPLAT_WARD &&
              static_cast<int>(RecordWeight::tabellion) == RELUME_SPLAT_TABELLION);

// What of a record does not depend on the light.
struct Shape {
  glm::uvec4 box;
  glm::vec4 position, normal;
  float near;
};
static_assert(sizeof(Shape) == 52);
using LightWords = std::array<glm::vec4, RELUME_SPLAT_LIGHTS>;

Error usage(std::string message) { return {ErrorCode::usage, "splats: " + std::move(message)}; }
Error unsupported(std::string message) { return {ErrorCode::unsupported, "splats: " + std::move(message)}; }

std::string sizeText(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

float finite(float distance) { return std::min(distance, RELUME_SPLAT_FAR); }

Shape shapeOf(const CameraRays& camera, const Record& record, const Interpolation& options) {
  const float reach = reachOf(record, options);
  const ScreenBox box = boxOfSphere(camera, record.positionWorld, reach);
  const bool byItsLight = reach > options.minPixels * record.footprint;
  return {{box.minX, box.minY, box.maxX, box.maxY},
          glm::vec4(record.positionWorld, reach),
          glm::vec4(record.normal, gradientShare(record, reach, options)),
          byItsLight ? finite(record.distance) : 0.0f};
}

LightWords lightOf(const Record& record) {
  LightWords light;
  for (int c = 0; c < 3; ++c) {
    const RecordLight &reflected = record.reflected, &sky = record.sky;
    glm::vec4* const at = &light[3 * static_cast<std::size_t>(c)];
    at[0] = glm::vec4(reflected.vector[c], reflected.gradient[c].x);
    at[1] = glm::vec4(sky.vector[c], reflected.gradient[c].y);
    at[2] = glm::vec4(sky.gradient[c], reflected.gradient[c].z);
  }
  return light;
}

bool hasSky(const Record& record) {
  return record.sky.vector != glm::mat3(0.0f) || record.sky.gradient != glm::mat3(0.0f);
}

}  // namespace

struct SplatsGl::State {
  State(const gl::Functions& functions, const gl::DrawFunctions& drawing) : gl(functions), draw(drawing) {}
  ~State();
  Status make();
  Status checkBlending();
  Status setSize(const CameraRays& camera);
  void storage(const gl::Texture& texture, GLenum format, const void* pixels);
  void attach(GLuint framebuffer, std::span<const GLuint> textures);
  void sendPixels(std::span<const PixelReceiver> receivers);
  Status send(std::span<const Record> records, std::size_t first);
  template <class T>
  void sendBuffer(const gl::Buffer& buffer, const std::vector<T>& all, std::size_t from);
  void clearSums();
  void addSums(std::size_t first);
  void showSums();
  Status takeError(const std::string& what);

  gl::Functions gl;  // what the handles below point to
  gl::DrawFunctions draw;
  SplatsGlOptions options;
  GLint maxSide = 0;
  gl::Program splat, show;
  gl::Texture place, facing, lit, sum, sumSky, picture, pictureSky;
  gl::Buffer shapeBuffer, lightBuffer;
  GLuint sumTarget = 0, pictureTarget = 0, vertexArray = 0;

  std::optional<CameraRays> camera;
  std::uint32_t width = 0, height = 0;
  bool isBent = false, isSky = false;  // of the pixels: whether any is; of the records that are drawn next
  bool isReady = false;                // look() and everything since have succeeded
  bool isDrawn = false;                // draw() as well
  Interpolation interpolation;
  std::vector<Shape> shapes;
  std::vector<LightWords> lights;
  std::size_t room = 0;  // records that the buffers hold
  std::size_t sentBytes = 0;
  std::vector<glm::vec4> pixels;
};

SplatsGl::State::~State() {
  for (const GLuint target : {sumTarget, pictureTarget}) {
    if (target != 0) draw.DeleteFramebuffers(1, &target);
  }
  if (vertexArray != 0) draw.DeleteVertexArrays(1, &vertexArray);
}

Status SplatsGl::State::make() {
  GLint side = 0;
  std::array<GLint, 2> viewport{};
  gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
  gl.GetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
  maxSide = std::min({side, viewport[0], viewport[1]});

  auto made = gl::makeDrawProgram(gl, "splat_records.vert", "splat_records.frag", {});
  if (!made) return made.error();
  splat = std::move(*made);
  const std::array<std::pair<std::string, std::string>, 1> packed{{{"RELUME_SPLAT_PACKED", ""}}};
  made =
      gl::makeDrawProgram(gl, "splat_picture.vert", "splat_picture.frag", options.packed ? Defines(packed) : Defines());
  if (!made) return made.error();
  show = std::move(*made);

  for (gl::Texture* texture : {&place, &facing, &lit, &sum, &sumSky, &picture, &pictureSky}) {
    GLuint name = 0;
    gl.GenTextures(1, &name);
    *texture = gl::Texture(gl, name);
    gl.ActiveTexture(GL_TEXTURE0 + RELUME_SPLAT_UNIT_PLACE);
    gl.BindTexture(GL_TEXTURE_2D, name);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      gl.TexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
  }
  for (gl::Buffer* buffer : {&shapeBuffer, &lightBuffer}) {
    GLuint name = 0;
    gl.GenBuffers(1, &name);
    *buffer = {{gl, name}, 0};
    gl.BindBuffer(GL_COPY_WRITE_BUFFER, name);  // which makes it
  }
  draw.GenFramebuffers(1, &sumTarget);
  draw.GenFramebuffers(1, &pictureTarget);

  draw.GenVertexArrays(1, &vertexArray);
  draw.BindVertexArray(vertexArray);
  const auto attribute = [this](GLuint at, GLint components, std::size_t offset, GLuint binding) {
    draw.VertexAttribFormat(at, components, GL_FLOAT, GL_FALSE, static_cast<GLuint>(offset));
    draw.VertexAttribBinding(at, binding);
    draw.EnableVertexAttribArray(at);
  };
  draw.VertexAttribIFormat(RELUME_SPLAT_AT_BOX, 4, GL_UNSIGNED_INT, offsetof(Shape, box));
  draw.VertexAttribBinding(RELUME_SPLAT_AT_BOX, kShapeBinding);
  draw.EnableVertexAttribArray(RELUME_SPLAT_AT_BOX);
  attribute(RELUME_SPLAT_AT_POSITION, 4, offsetof(Shape, position), kShapeBinding);
  attribute(RELUME_SPLAT_AT_NORMAL, 4, offsetof(Shape, normal), kShapeBinding);
  attribute(RELUME_SPLAT_AT_NEAR, 1, offsetof(Shape, near), kShapeBinding);
  for (std::size_t i = 0; i < RELUME_SPLAT_LIGHTS; ++i)
    attribute(RELUME_SPLAT_AT_LIGHT + static_cast<GLuint>(i), 4, i * sizeof(glm::vec4), kLightBinding);
  draw.BindVertexBuffer(kShapeBinding, shapeBuffer.get(), 0, sizeof(Shape));
  draw.BindVertexBuffer(kLightBinding, lightBuffer.get(), 0, sizeof(LightWords));
  draw.VertexBindingDivisor(kShapeBinding, 1);
  draw.VertexBindingDivisor(kLightBinding, 1);
  return done();
}

Status SplatsGl::State::takeError(const std::string& what) {
  GLenum error = gl.GetError();
  bool isOut = false;
  for (int i = 0; error != GL_NO_ERROR && i < 16; ++i, error = gl.GetError()) isOut |= error == GL_OUT_OF_MEMORY;
  if (!isOut) return done();
  isReady = false;
  return Error{ErrorCode::memory, "splats: this OpenGL has not enough memory for " + what};
}

// Storage of the picture's size, in a texture that has had another.
void SplatsGl::State::storage(const gl::Texture& texture, GLenum format, const void* data) {
  const bool isInteger = format == GL_RGBA32UI;
  gl.ActiveTexture(GL_TEXTURE0 + RELUME_SPLAT_UNIT_PLACE);
  gl.BindTexture(GL_TEXTURE_2D, texture.get());
  draw.TexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(format), static_cast<GLsizei>(width),
                  static_cast<GLsizei>(height), 0, isInteger ? GL_RGBA_INTEGER : GL_RGBA,
                  isInteger ? GL_UNSIGNED_INT : GL_FLOAT, data);
}

void SplatsGl::State::attach(GLuint framebuffer, std::span<const GLuint> textures) {
  draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  constexpr std::array<GLenum, 2> kBoth{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  for (std::size_t i = 0; i < textures.size(); ++i)
    draw.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, kBoth[i], GL_TEXTURE_2D, textures[i], 0);
  draw.DrawBuffers(static_cast<GLsizei>(textures.size()), kBoth.data());
}

// Targets of the camera's size; those there are if it is the same.
Status SplatsGl::State::setSize(const CameraRays& seen) {
  const auto columns = static_cast<std::uint32_t>(seen.width), rows = static_cast<std::uint32_t>(seen.height);
  const auto most = static_cast<std::uint32_t>(std::max(maxSide, 0));
  if (columns == 0 || rows == 0 || columns > most || rows > most)
    return unsupported("a picture of " + sizeText(columns, rows) + " pixels; this OpenGL draws into 1 to " +
                       std::to_string(most) + " along a side");
  if (columns == width && rows == height) return done();
  width = columns;
  height = rows;
  for (const gl::Texture* texture : {&place, &facing, &sum, &sumSky}) storage(*texture, GL_RGBA32F, nullptr);
  const std::array<GLuint, 2> sums{sum.get(), sumSky.get()}, pictures{picture.get(), pictureSky.get()};
  storage(picture, options.packed ? GL_RGBA32UI : GL_RGBA32F, nullptr);
  if (!options.packed) storage(pictureSky, GL_RGBA32F, nullptr);
  if (Status ok = takeError("a picture of " + sizeText(width, height) + " pixels"); !ok) {
    width = height = 0;
    return ok;
  }
  for (const auto& [target, textures] :
       {std::pair{sumTarget, std::span<const GLuint>(sums)},
        std::pair{pictureTarget, std::span<const GLuint>(pictures).first(options.packed ? 1 : 2)}}) {
    attach(target, textures);
    if (draw.CheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) continue;
    width = height = 0;
    return unsupported("this OpenGL does not draw into two targets of 32-bit floats");
  }
  return done();
}

void SplatsGl::State::sendPixels(std::span<const PixelReceiver> receivers) {
  pixels.resize(receivers.size());
  isBent = false;
  const auto send = [&](const gl::Texture& texture, auto&& texelOf) {
    std::transform(receivers.begin(), receivers.end(), pixels.begin(), texelOf);
    storage(texture, GL_RGBA32F, pixels.data());
    sentBytes += pixels.size() * sizeof(glm::vec4);
  };
  send(place, [](const PixelReceiver& r) { return glm::vec4(r.positionWorld, r.footprint); });
  send(facing, [this](const PixelReceiver& r) {
    isBent = isBent || r.bent != glm::vec3(0.0f);
    return glm::vec4(r.normal, finite(r.occluder));
  });
  if (isBent) send(lit, [](const PixelReceiver& r) { return glm::vec4(r.litNormal(), 0.0f); });
}

// Send what there is from number `from` on; anew where that is all, so that what is still being drawn keeps what it
// reads.
template <class T>
void SplatsGl::State::sendBuffer(const gl::Buffer& buffer, const std::vector<T>& all, std::size_t from) {
  gl.BindBuffer(GL_COPY_WRITE_BUFFER, buffer.get());
  if (from == 0)
    gl.BufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(room * sizeof(T)), nullptr, GL_DYNAMIC_DRAW);
  const std::size_t bytes = (all.size() - from) * sizeof(T);
  gl.BufferSubData(GL_COPY_WRITE_BUFFER, static_cast<GLintptr>(from * sizeof(T)), static_cast<GLsizeiptr>(bytes),
                   all.data() + from);
  sentBytes += bytes;
}

// Send the records from number `first` on, which follow those there are.
Status SplatsGl::State::send(std::span<const Record> records, std::size_t first) {
  const std::size_t count = first + records.size();
  if (count > options.maxRecords)
    return unsupported(std::to_string(count) + " records; there may be " + std::to_string(options.maxRecords));
  shapes.resize(first);
  lights.resize(first);
  shapes.reserve(count);
  lights.reserve(count);
  isSky = false;
  for (const Record& record : records) {
    shapes.push_back(shapeOf(*camera, record, interpolation));
    lights.push_back(lightOf(record));
    isSky = isSky || hasSky(record);
  }
  if (records.empty()) return done();
  // All of them, where there is no room for more.
  std::size_t from = first;
  if (count > room) {
    room = std::min<std::size_t>(std::max({count, 2 * room, kLeastRecords}), options.maxRecords);
    from = 0;
  }
  sendBuffer(shapeBuffer, shapes, from);
  sendBuffer(lightBuffer, lights, from);
  Status ok = takeError(std::to_string(count) + " records");
  if (!ok) room = 0;
  return ok;
}

void SplatsGl::State::clearSums() {
  constexpr std::array<GLfloat, 4> kNothing{};
  constexpr std::array<GLenum, 2> kBoth{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, sumTarget);
  draw.DrawBuffers(2, kBoth.data());
  for (GLint i = 0; i < 2; ++i) draw.ClearBufferfv(GL_COLOR, i, kNothing.data());
}

// Add the records from number `first` on.
void SplatsGl::State::addSums(std::size_t first) {
  const std::array<GLenum, 2> targets{GL_COLOR_ATTACHMENT0, isSky ? GLenum{GL_COLOR_ATTACHMENT1} : GLenum{GL_NONE}};
  draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, sumTarget);
  draw.DrawBuffers(2, targets.data());
  const std::array<GLfloat, 4> viewport{0.0f, 0.0f, static_cast<GLfloat>(width), static_cast<GLfloat>(height)};
  draw.ViewportIndexedfv(0, viewport.data());
  for (GLuint i = 0; i < 2; ++i) {
    draw.Enablei(GL_BLEND, i);
    draw.BlendEquationSeparatei(i, GL_FUNC_ADD, GL_FUNC_ADD);
    draw.BlendFuncSeparatei(i, GL_ONE, GL_ONE, GL_ONE, GL_ONE);
  }
  const GLuint program = splat.get();
  gl.UseProgram(program);
  draw.ProgramUniform2f(program, RELUME_SPLAT_AT_SIZE, viewport[2], viewport[3]);
  gl.ProgramUniform1f(program, RELUME_SPLAT_AT_ACCURACY, interpolation.accuracy);
  gl.ProgramUniform1i(program, RELUME_SPLAT_AT_WEIGHT, static_cast<GLint>(interpolation.weight));
  gl.ProgramUniform1i(program, RELUME_SPLAT_AT_GUARDED, interpolation.reach == RecordReach::guarded ? 1 : 0);
  gl.ProgramUniform1i(program, RELUME_SPLAT_AT_GRADIENTS, interpolation.gradients ? 1 : 0);
  for (const auto& [unit, texture] :
       {std::pair{RELUME_SPLAT_UNIT_PLACE, place.get()}, std::pair{RELUME_SPLAT_UNIT_FACING, facing.get()},
        std::pair{RELUME_SPLAT_UNIT_LIT, isBent ? lit.get() : facing.get()}}) {
    gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    gl.BindTexture(GL_TEXTURE_2D, texture);
  }
  draw.BindVertexArray(vertexArray);
  for (; first < shapes.size(); first += kRecordsPerDraw) {
    const std::size_t count = std::min(kRecordsPerDraw, shapes.size() - first);
    draw.DrawArraysInstancedBaseInstance(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(count),
                                         static_cast<GLuint>(first));
  }
}

// The sums, divided, into the picture.
void SplatsGl::State::showSums() {
  if (shapes.empty()) return;
  draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, pictureTarget);
  for (GLuint i = 0; i < 2; ++i) draw.Disablei(GL_BLEND, i);
  const std::array<GLfloat, 4> viewport{0.0f, 0.0f, static_cast<GLfloat>(width), static_cast<GLfloat>(height)};
  draw.ViewportIndexedfv(0, viewport.data());
  gl.UseProgram(show.get());
  for (const auto& [unit, texture] :
       {std::pair{RELUME_SPLAT_UNIT_SUM, sum.get()}, std::pair{RELUME_SPLAT_UNIT_SUM_SKY, sumSky.get()},
        std::pair{RELUME_SPLAT_UNIT_FACING, facing.get()}}) {
    gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    gl.BindTexture(GL_TEXTURE_2D, texture);
  }
  draw.BindVertexArray(vertexArray);  // whose attributes it does not read
  draw.DrawArraysInstancedBaseInstance(GL_TRIANGLES, 0, 3, 1, 0);
}

// Two records alike at a pixel of their own weigh twice what one does, which halves do not hold.
Status SplatsGl::State::checkBlending() {
  camera.emplace(Camera{}, 1, 1);  // along -Z
  if (Status ok = setSize(*camera); !ok) return ok;
  PixelReceiver pixel;
  pixel.positionWorld = glm::vec3(0.0f, 0.0f, -1.0f);
  pixel.normal = pixel.geometricNormal = glm::vec3(0.0f, 0.0f, 1.0f);
  pixel.footprint = 1.0f;
  Record record;
  record.positionWorld = pixel.positionWorld;
  record.normal = pixel.normal;
  record.distance = 1.0f;
  record.footprint = 1.0f;
  interpolation = {};
  interpolation.accuracy = 1e-6f;
  interpolation.weight = RecordWeight::ward;
  sendPixels({&pixel, 1});
  const std::array<Record, 2> alike{record, record};
  if (Status ok = send(alike, 0); !ok) return ok;
  clearSums();
  addSums(0);
  glm::vec4 found(0.0f);
  gl.ActiveTexture(GL_TEXTURE0 + RELUME_SPLAT_UNIT_SUM);
  gl.BindTexture(GL_TEXTURE_2D, sum.get());
  gl.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, &found);
  const float expected = 2.0f * weightOf(record, reachOf(record, interpolation), pixel, interpolation);
  camera.reset();
  width = height = 0;
  shapes.clear();
  lights.clear();
  if (std::abs(found.w - expected) <= 1e-4f * expected) return done();
  return unsupported("this OpenGL does not add up 32-bit floats by blending: expected a weight of " +
                     std::to_string(expected) + ", found " + std::to_string(found.w));
}

Result<std::unique_ptr<SplatsGl>> SplatsGl::create(const SplatsGlOptions& options) {
  if (options.maxRecords < 1 || options.maxRecords > kMaxRecords)
    return usage("maxRecords must be 1..10000000, found " + std::to_string(options.maxRecords));
  const auto functions = gl::loadFunctions(options.getProcAddress);
  if (!functions) return functions.error();
  const auto drawing = gl::loadDrawFunctions(options.getProcAddress, *functions);
  if (!drawing) return drawing.error();
  const gl::SavedState saved(*functions);
  const gl::SavedDrawing savedDrawing(*functions, *drawing);
  auto state = std::make_unique<State>(*functions, *drawing);
  state->options = options;
  if (Status ok = state->make(); !ok) return ok.error();
  if (Status ok = state->checkBlending(); !ok) return ok.error();
  return std::unique_ptr<SplatsGl>(new SplatsGl(std::move(state)));
}

SplatsGl::SplatsGl(std::unique_ptr<State> state) : state_(std::move(state)) {}
SplatsGl::~SplatsGl() = default;

Status SplatsGl::look(const CameraRays& camera, std::span<const PixelReceiver> receivers) {
  State& s = *state_;
  s.sentBytes = 0;
  s.isReady = s.isDrawn = false;
  const auto expected = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  if (receivers.size() != expected)
    return usage("look() got " + std::to_string(receivers.size()) + " receivers, expected one for each of " +
                 std::to_string(expected) + " pixels");
  const gl::SavedState saved(s.gl);
  const gl::SavedDrawing drawing(s.gl, s.draw);
  if (Status ok = s.setSize(camera); !ok) return ok;
  s.camera = camera;
  s.sendPixels(receivers);
  if (Status ok = s.takeError("a picture of " + sizeText(s.width, s.height) + " pixels"); !ok) return ok;
  s.draw.BindFramebuffer(GL_DRAW_FRAMEBUFFER, s.pictureTarget);
  constexpr std::array<GLfloat, 4> kDark{};
  constexpr std::array<GLuint, 4> kDarkBits{};
  if (s.options.packed) {
    s.draw.ClearBufferuiv(GL_COLOR, 0, kDarkBits.data());
  } else {
    for (GLint i = 0; i < 2; ++i) s.draw.ClearBufferfv(GL_COLOR, i, kDark.data());
  }
  s.shapes.clear();
  s.lights.clear();
  s.isReady = true;
  return done();
}

Status SplatsGl::draw(std::span<const Record> records, const Interpolation& options) {
  State& s = *state_;
  s.sentBytes = 0;
  if (!s.isReady) return usage("draw() before look()");
  const gl::SavedState saved(s.gl);
  const gl::SavedDrawing drawing(s.gl, s.draw);
  s.isDrawn = false;
  s.interpolation = options;
  if (Status ok = s.send(records, 0); !ok) return ok;
  s.clearSums();
  s.addSums(0);
  s.showSums();
  s.isDrawn = true;
  return done();
}

Status SplatsGl::add(std::span<const Record> records) {
  State& s = *state_;
  s.sentBytes = 0;
  if (!s.isDrawn) return usage("add() before draw()");
  if (records.empty()) return done();
  const gl::SavedState saved(s.gl);
  const gl::SavedDrawing drawing(s.gl, s.draw);
  const std::size_t first = s.shapes.size();
  s.isDrawn = false;
  if (Status ok = s.send(records, first); !ok) return ok;
  s.addSums(first);
  s.showSums();
  s.isDrawn = true;
  return done();
}

Status SplatsGl::relight(std::span<const Record> records) {
  State& s = *state_;
  s.sentBytes = 0;
  if (!s.isDrawn) return usage("relight() before draw()");
  if (records.size() != s.lights.size())
    return usage("relight() got " + std::to_string(records.size()) + " records, expected the " +
                 std::to_string(s.lights.size()) + " that there are");
  if (records.empty()) return done();
  const gl::SavedState saved(s.gl);
  const gl::SavedDrawing drawing(s.gl, s.draw);
  std::transform(records.begin(), records.end(), s.lights.begin(), lightOf);
  s.isSky = std::any_of(records.begin(), records.end(), hasSky);
  s.sendBuffer(s.lightBuffer, s.lights, 0);
  s.clearSums();
  s.addSums(0);
  s.showSums();
  return done();
}

Status SplatsGl::read(std::span<Splat> picture) {
  State& s = *state_;
  s.sentBytes = 0;
  if (s.options.packed) return usage("read() of a packed picture");
  if (!s.isReady) return usage("read() before look()");
  if (picture.size() != std::size_t{s.width} * s.height)
    return usage("read() into " + std::to_string(picture.size()) + " pixels, expected " + sizeText(s.width, s.height));
  const gl::SavedState saved(s.gl);
  s.pixels.resize(picture.size());
  const auto readInto = [&](const gl::Texture& texture, auto&& take) {
    s.gl.ActiveTexture(GL_TEXTURE0 + RELUME_SPLAT_UNIT_SUM);
    s.gl.BindTexture(GL_TEXTURE_2D, texture.get());
    s.gl.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, s.pixels.data());
    for (std::size_t i = 0; i < picture.size(); ++i) take(picture[i], s.pixels[i]);
  };
  readInto(s.picture, [](Splat& splat, const glm::vec4& texel) {
    splat.reflected = glm::vec3(texel);
    splat.weight = texel.w;
  });
  readInto(s.pictureSky, [](Splat& splat, const glm::vec4& texel) { splat.sky = glm::vec3(texel); });
  return s.takeError("reading a picture of " + sizeText(s.width, s.height) + " pixels");
}

std::uint32_t SplatsGl::light() const { return state_->picture.get(); }
std::uint32_t SplatsGl::place() const { return state_->place.get(); }
std::size_t SplatsGl::sentBytes() const { return state_->sentBytes; }

std::size_t SplatsGl::sizeBytes() const {
  const State& s = *state_;
  const std::size_t textures = std::size_t{5} + (s.isBent ? 1 : 0) + (s.options.packed ? 0 : 1);
  return s.room * (sizeof(Shape) + sizeof(LightWords)) + textures * s.width * s.height * sizeof(glm::vec4);
}

}  // namespace relume
