// SPDX-License-Identifier: MIT
// See splats_gl.h. A record is an instance of four vertices: attributes that the light does not change in one buffer,
// its light in another, which alone is sent anew when records are relit.
#include "tools/gl_splat/splats_gl.h"

#include "relume/bake/scene.h"
#include "runtime/gl/program.h"
#include "runtime/gl/saved_state.h"
#include "shaders/shared/layout.h"
#include "tools/gl_splat/saved_drawing.h"
#include "tools/gl_splat/splat_targets.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

using gl::splatUnsupported, gl::splatUsage, gl::splatSizeText;

constexpr std::uint32_t kMaxRecords = 10000000;
constexpr std::size_t kLeastRecords = 1024;  // that buffers have room for

using LightWords = std::array<glm::vec4, RELUME_SPLAT_LIGHTS>;

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
  State(const gl::Functions& functions, const gl::DrawFunctions& drawing, const SplatsGlOptions& chosen)
      : targets(functions, drawing,
                chosen.packed ? std::vector<GLenum>{GL_RGBA32UI} : std::vector<GLenum>{GL_RGBA32F, GL_RGBA32F}),
        options(chosen) {}
  Status make();
  Status checkBlending();
  void sendPixels(std::span<const PixelReceiver> receivers);
  Status send(std::span<const Record> records, std::size_t first);
  void addSums(std::size_t first);
  void showSums();

  gl::SplatTargets targets;
  SplatsGlOptions options;
  gl::Program splat, show;
  gl::Texture lit;
  gl::Buffer shapeBuffer, lightBuffer;

  std::optional<CameraRays> camera;
  bool isBent = false, isSky = false;  // of the pixels: whether any is; of the records that are drawn next
  bool isReady = false;                // look() has succeeded
  bool isDrawn = false;                // draw() and everything since have succeeded as well
  Interpolation interpolation;
  std::vector<gl::SplatShape> shapes;
  std::vector<LightWords> lights;
  std::size_t room = 0;  // records that the buffers hold
};

Status SplatsGl::State::make() {
  auto made = gl::makeDrawProgram(targets.gl, "splat_records.vert", "splat_records.frag", {});
  if (!made) return made.error();
  splat = std::move(*made);
  const std::array<std::pair<std::string, std::string>, 1> packed{{{"RELUME_SPLAT_PACKED", ""}}};
  made = gl::makeDrawProgram(targets.gl, "splat_picture.vert", "splat_picture.frag",
                             options.packed ? Defines(packed) : Defines());
  if (!made) return made.error();
  show = std::move(*made);
  lit = targets.makeTexture();
  shapeBuffer = targets.makeBuffer();
  lightBuffer = targets.makeBuffer();
  targets.make(shapeBuffer, lightBuffer, sizeof(LightWords));
  return done();
}

void SplatsGl::State::sendPixels(std::span<const PixelReceiver> receivers) {
  targets.sendPixels(receivers);
  isBent =
      std::any_of(receivers.begin(), receivers.end(), [](const PixelReceiver& r) { return r.bent != glm::vec3(0.0f); });
  if (isBent)
    targets.send(lit, receivers.size(), [&](std::size_t i) { return glm::vec4(receivers[i].litNormal(), 0.0f); });
}

// Send the records from number `first` on, which follow those there are.
Status SplatsGl::State::send(std::span<const Record> records, std::size_t first) {
  const std::size_t count = first + records.size();
  if (count > options.maxRecords)
    return splatUnsupported(std::to_string(count) + " records; there may be " + std::to_string(options.maxRecords));
  shapes.resize(first);
  lights.resize(first);
  shapes.reserve(count);
  lights.reserve(count);
  isSky = false;
  for (const Record& record : records) {
    shapes.push_back(gl::splatShapeOf(*camera, record, interpolation));
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
  targets.sendBuffer(shapeBuffer, shapes, from, room);
  targets.sendBuffer(lightBuffer, lights, from, room);
  Status ok = targets.takeError(std::to_string(count) + " records");
  if (!ok) room = 0;
  return ok;
}

// Add the records from number `first` on.
void SplatsGl::State::addSums(std::size_t first) {
  targets.beginSums(splat.get(), interpolation, isSky);
  targets.gl.ProgramUniform1i(splat.get(), RELUME_SPLAT_AT_GRADIENTS, interpolation.gradients ? 1 : 0);
  targets.bind(RELUME_SPLAT_UNIT_LIT, isBent ? lit : targets.facing);
  targets.drawRecords(first, shapes.size());
}

// The sums, divided, into the picture.
void SplatsGl::State::showSums() {
  if (!shapes.empty()) targets.show(show.get());
}

// Two records alike at a pixel of their own weigh twice what one does, which halves do not hold.
Status SplatsGl::State::checkBlending() {
  camera.emplace(Camera{}, 1, 1);  // along -Z
  if (Status ok = targets.setSize(*camera); !ok) return ok;
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
  if (Status ok = send(std::span(alike).first(std::min<std::size_t>(2, options.maxRecords)), 0); !ok) return ok;
  targets.clearSums();
  addSums(0);
  if (options.maxRecords < 2) addSums(0);
  const float found = targets.read(targets.sum[0]).front().w;
  const float expected = 2.0f * weightOf(record, reachOf(record, interpolation), pixel, interpolation);
  camera.reset();
  targets.forgetSize();
  shapes.clear();
  lights.clear();
  if (std::abs(found - expected) <= 1e-4f * expected) return done();
  return splatUnsupported("this OpenGL does not add up 32-bit floats by blending: expected a weight of " +
                          std::to_string(expected) + ", found " + std::to_string(found));
}

Result<std::unique_ptr<SplatsGl>> SplatsGl::create(const SplatsGlOptions& options) {
  if (options.maxRecords < 1 || options.maxRecords > kMaxRecords)
    return splatUsage("maxRecords must be 1..10000000, found " + std::to_string(options.maxRecords));
  const auto functions = gl::loadFunctions(options.getProcAddress);
  if (!functions) return functions.error();
  const auto drawing = gl::loadDrawFunctions(options.getProcAddress, *functions);
  if (!drawing) return drawing.error();
  const gl::SavedState saved(*functions);
  const gl::SavedDrawing savedDrawing(*functions, *drawing);
  auto state = std::make_unique<State>(*functions, *drawing, options);
  if (Status ok = state->make(); !ok) return ok.error();
  if (Status ok = state->checkBlending(); !ok) return ok.error();
  return std::unique_ptr<SplatsGl>(new SplatsGl(std::move(state)));
}

SplatsGl::SplatsGl(std::unique_ptr<State> state) : state_(std::move(state)) {}
SplatsGl::~SplatsGl() = default;

Status SplatsGl::look(const CameraRays& camera, std::span<const PixelReceiver> receivers) {
  State& s = *state_;
  s.targets.sentBytes = 0;
  s.isReady = s.isDrawn = false;
  const auto expected = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  if (receivers.size() != expected)
    return splatUsage("look() got " + std::to_string(receivers.size()) + " receivers, expected one for each of " +
                      std::to_string(expected) + " pixels");
  const gl::SavedState saved(s.targets.gl);
  const gl::SavedDrawing drawing(s.targets.gl, s.targets.draw);
  if (Status ok = s.targets.setSize(camera); !ok) return ok;
  s.camera = camera;
  s.sendPixels(receivers);
  s.targets.clearPicture();
  const std::string what = "a picture of " + splatSizeText(s.targets.width, s.targets.height) + " pixels";
  if (Status ok = s.targets.takeError(what); !ok) return ok;
  s.shapes.clear();
  s.lights.clear();
  s.isReady = true;
  return done();
}

Status SplatsGl::draw(std::span<const Record> records, const Interpolation& options) {
  State& s = *state_;
  s.targets.sentBytes = 0;
  if (!s.isReady) return splatUsage("draw() before look()");
  const gl::SavedState saved(s.targets.gl);
  const gl::SavedDrawing drawing(s.targets.gl, s.targets.draw);
  s.isDrawn = false;
  s.interpolation = options;
  if (Status ok = s.send(records, 0); !ok) return ok;
  s.targets.clearSums();
  s.addSums(0);
  s.showSums();
  s.isDrawn = true;
  return done();
}

Status SplatsGl::add(std::span<const Record> records) {
  State& s = *state_;
  s.targets.sentBytes = 0;
  if (!s.isDrawn) return splatUsage("add() before draw()");
  if (records.empty()) return done();
  const gl::SavedState saved(s.targets.gl);
  const gl::SavedDrawing drawing(s.targets.gl, s.targets.draw);
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
  s.targets.sentBytes = 0;
  if (!s.isDrawn) return splatUsage("relight() before draw()");
  if (records.size() != s.lights.size())
    return splatUsage("relight() got " + std::to_string(records.size()) + " records, expected the " +
                      std::to_string(s.lights.size()) + " that there are");
  if (records.empty()) return done();
  const gl::SavedState saved(s.targets.gl);
  const gl::SavedDrawing drawing(s.targets.gl, s.targets.draw);
  s.isDrawn = false;
  std::transform(records.begin(), records.end(), s.lights.begin(), lightOf);
  s.isSky = std::any_of(records.begin(), records.end(), hasSky);
  s.targets.sendBuffer(s.lightBuffer, s.lights, 0, s.room);
  if (Status ok = s.targets.takeError(std::to_string(records.size()) + " records"); !ok) {
    s.room = 0;
    return ok;
  }
  s.targets.clearSums();
  s.addSums(0);
  s.showSums();
  s.isDrawn = true;
  return done();
}

Status SplatsGl::read(std::span<Splat> picture) {
  State& s = *state_;
  s.targets.sentBytes = 0;
  if (s.options.packed) return splatUsage("read() of a packed picture");
  if (!s.isReady) return splatUsage("read() before look()");
  const std::string size = splatSizeText(s.targets.width, s.targets.height);
  if (picture.size() != std::size_t{s.targets.width} * s.targets.height)
    return splatUsage("read() into " + std::to_string(picture.size()) + " pixels, expected " + size);
  const gl::SavedState saved(s.targets.gl);
  const std::span<const glm::vec4> reflected = s.targets.read(s.targets.picture[0]);
  for (std::size_t i = 0; i < picture.size(); ++i)
    picture[i] = {glm::vec3(reflected[i]), glm::vec3(0.0f), reflected[i].w};
  const std::span<const glm::vec4> sky = s.targets.read(s.targets.picture[1]);
  for (std::size_t i = 0; i < picture.size(); ++i) picture[i].sky = glm::vec3(sky[i]);
  return s.targets.takeError("reading a picture of " + size + " pixels");
}

std::uint32_t SplatsGl::light() const { return state_->targets.picture[0].get(); }
std::uint32_t SplatsGl::place() const { return state_->targets.place.get(); }
std::size_t SplatsGl::sentBytes() const { return state_->targets.sentBytes; }

std::size_t SplatsGl::sizeBytes() const {
  const State& s = *state_;
  const std::size_t pixels = std::size_t{s.targets.width} * s.targets.height;
  return s.room * (sizeof(gl::SplatShape) + sizeof(LightWords)) + s.targets.textureBytes() +
         (s.isBent ? pixels * sizeof(glm::vec4) : 0);
}

}  // namespace relume
