// SPDX-License-Identifier: MIT
// See cone_passes_gl.h.
#include "runtime/live_gl/cone_passes_gl.h"

#include "runtime/gl/errors.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/live/live_frame.h"
#include "runtime/live_gl/cone_textures.h"
#include "shaders/shared/layout.h"

#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace relume::gl {
namespace {

static_assert(kPattern == RELUME_CONE_PATTERN);

// The hemisphere's cones, then the sky's map.
std::vector<glm::vec4> packDirections(const LiveSky& sky) {
  std::vector<glm::vec4> packed;
  packed.reserve(kHemisphereCones + sky.map.size());
  for (const LocalCone& cone : hemisphereCones())
    packed.emplace_back(cone.direction, kNarrowHemisphereCone * cone.spread);
  for (const glm::vec3& texel : sky.map) packed.emplace_back(texel, 0.0f);
  return packed;
}

}  // namespace

ConePasses::ConePasses(const Functions& gl, const ConeLevels& levels, const PixelConeOptions& options, bool hemisphere,
                       gpu::GroupThreads groups)
    : gl_(gl),
      levels_(levels),
      options_(options),
      hemisphere_(hemisphere),
      isSerial_(groups == gpu::GroupThreads::serial),
      directions_(gl),
      hostTextures_(gl),
      timer_(gl) {}

std::vector<std::pair<std::string, std::string>> ConePasses::defines() const {
  auto defines = levels_.defines();
  defines.emplace_back("RELUME_CONE_SHARES", isSerial_ ? "0" : "1");
  return defines;
}

Status ConePasses::compile() {
  const std::pair<Program*, const char*> programs[] = {{&surfacesProgram_, "cone_surfaces.comp"},
                                                       {&edgesProgram_, "cone_edges.comp"},
                                                       {&gatherProgram_, "cone_gather.comp"},
                                                       {&blurProgram_, "cone_blur.comp"},
                                                       {&keepProgram_, "cone_keep.comp"}};
  for (const auto& [program, path] : programs) {
    Result<Program> made = makeComputeProgram(gl_, path, defines());
    if (!made) return made.error();
    *program = std::move(*made);
  }
  return compile(tracing_, false);
}

Status ConePasses::compileNested() { return nestedTracing_.lobe.get() != 0 ? done() : compile(nestedTracing_, true); }

Status ConePasses::compile(Tracing& programs, bool isNested) const {
  auto all = defines();
  if (isNested) all.emplace_back("RELUME_LIVE_NESTED", "1");
  Result<Program> hemisphere = makeComputeProgram(gl_, "cone_hemisphere.comp", all);
  if (!hemisphere) return hemisphere.error();
  Result<Program> lobe = makeComputeProgram(gl_, "cone_lobe.comp", all);
  if (!lobe) return lobe.error();
  programs = {std::move(*hemisphere), std::move(*lobe)};
  return done();
}

// Images for so many pixels; those of before stay where there is no room.
Status ConePasses::resize(std::uint32_t width, std::uint32_t height) {
  const glm::ivec2 size(static_cast<int>(width), static_cast<int>(height));
  if (size == images_.size) return done();
  const std::uint32_t most = deviceOf(gl_, gpu::GroupThreads::parallel).imageSide;
  if (std::max(width, height) > most)
    return conesError(ErrorCode::unsupported, std::to_string(width) + " x " + std::to_string(height) +
                                                  " pixels, this OpenGL's textures have " + std::to_string(most) +
                                                  " along a side");
  dropErrors(gl_);
  PixelImages next;
  next.size = size;
  const auto make = [&](PixelImage& picture, GLenum format) {
    picture.texture = makeTexture(gl_, GL_TEXTURE_2D);
    picture.format = format;
    gl_.TexStorage2D(GL_TEXTURE_2D, 1, format, size.x, size.y);
  };
  for (PixelImage& each : next.places) make(each, GL_RGBA32F);
  for (PixelImage& each : next.planes) make(each, GL_RGBA32F);
  for (PixelImage& each : next.light) make(each, GL_RGBA32F);
  for (PixelImage& each : next.frames) make(each, GL_R32F);
  for (PixelImage* each : {&next.normals, &next.mirrored, &next.glossy}) make(*each, GL_RGBA32F);
  make(next.edges, GL_R8UI);
  if (takeOutOfMemory(gl_))
    return conesError(ErrorCode::unsupported, "this OpenGL has not enough memory for " + std::to_string(width) + " x " +
                                                  std::to_string(height) + " pixels");
  images_ = std::move(next);
  hasBefore_ = hasGlossy_ = false;
  return done();
}

void ConePasses::upload(const PixelReceivers& pixels, std::span<const glm::vec4> mirrored) {
  std::vector<glm::vec4> texels(pixels.depth.size());
  const auto write = [&](const PixelImage& to, std::span<const glm::vec4> from) {
    to.bind(gl_, RELUME_CONE_UNIT_NORMALS);
    gl_.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, images_.size.x, images_.size.y, GL_RGBA, GL_FLOAT, from.data());
  };
  const auto each = [&](const PixelImage& to, const auto& texelAt) {
    for (std::size_t i = 0; i < texels.size(); ++i) texels[i] = pixels.depth[i] > 0.0f ? texelAt(i) : glm::vec4(0.0f);
    write(to, texels);
  };
  each(images_.places[0], [&](std::size_t i) { return glm::vec4(pixels.positionWorld[i], pixels.depth[i]); });
  each(images_.planes[0], [&](std::size_t i) { return glm::vec4(pixels.plane[i], 0.0f); });
  each(images_.normals, [&](std::size_t i) { return glm::vec4(pixels.normal[i], 0.0f); });
  if (!mirrored.empty()) write(images_.mirrored, mirrored);
}

void ConePasses::bindSurfaces(const Program& program) const {
  images_.places[0].bind(gl_, RELUME_CONE_UNIT_PLACES);
  images_.planes[0].bind(gl_, RELUME_CONE_UNIT_PLANES);
  gl_.ProgramUniform2i(program.get(), gl_.GetUniformLocation(program.get(), "relumeConePicture"), images_.size.x,
                       images_.size.y);
}

void ConePasses::writeSky(const LiveSky& sky) {
  const std::vector<glm::vec4> packed = packDirections(sky);
  directions_.reserve(sizeof(glm::vec4) * packed.size());
  directions_.write(0, bytesOf(packed));
}

void ConePasses::bindSky(const Program& program, const LiveSky& sky) const {
  directions_.bind(RELUME_CONE_SLOT_DIRECTIONS);
  setUniform(gl_, program, "relumeConeSky", glm::uvec2(kHemisphereCones, sky.map.empty() ? 0 : sky.side));
  setUniform(gl_, program, "relumeConeSkyRadiance", sky.radiance);
}

// The passes of PixelCones::update(), in its order.
void ConePasses::lightPixels(const LiveSky& sky, GLuint normals, bool rowsUp) {
  auto& light = images_.light;
  std::size_t from = 1, to = 2;  // of `light`, between passes

  // 1. A cone a pixel, or all
  const float angle = options_.interleaved ? 2.0f * std::numbers::pi_v<float> * turnOfFrame(frameNumber_) : 0.0f;
  const Program& hemisphere = tracing().hemisphere;
  levels_.bind(hemisphere);
  bindSurfaces(hemisphere);
  bindSky(hemisphere, sky);
  hostTextures_.bind(RELUME_CONE_UNIT_NORMALS, normals);
  light[from].bindImage(gl_, 0);
  gl_.ProgramUniform2f(hemisphere.get(), gl_.GetUniformLocation(hemisphere.get(), "relumeConeTurn"), std::cos(angle),
                       std::sin(angle));
  setUniform(gl_, hemisphere, "relumeConeAll", options_.interleaved ? 0u : kHemisphereCones);
  setUniform(gl_, hemisphere, "relumeConeFalloff", options_.falloff);
  if (options_.interleaved) {
    const glm::uvec2 blocks = (glm::uvec2(images_.size) + (kPattern - 1)) / kPattern;
    run(hemisphere, kHemisphereCones * blocks.x * blocks.y);
  } else {
    run(hemisphere, pixels());
  }
  timer_.mark(2);

  // 2. Where surfaces end
  bindSurfaces(edgesProgram_);
  images_.edges.bindImage(gl_, 0);
  run(edgesProgram_, pixels());
  timer_.mark(3);

  // 3. The pattern's cones together, and a blur: of each of its strips as many threads as a work group has
  const auto stripThreads = [&](const glm::ivec2& along) {
    const auto size = glm::uvec2(images_.size);
    const std::uint32_t length = along.x != 0 ? size.x : size.y;
    return pixels() / length * ((length + RELUME_LIVE_GROUP - 1) / RELUME_LIVE_GROUP * RELUME_LIVE_GROUP);
  };
  const auto pass = [&](const Program& program, std::uint32_t threads) {
    bindSurfaces(program);
    light[from].bind(gl_, RELUME_CONE_UNIT_LIGHT);
    light[to].bindImage(gl_, 0);
    run(program, threads);
    std::swap(from, to);
  };
  images_.edges.bind(gl_, RELUME_CONE_UNIT_EDGES);
  if (options_.gather) pass(gatherProgram_, pixels());
  timer_.mark(4);
  for (const glm::ivec2& along : {glm::ivec2(1, 0), glm::ivec2(0, 1)}) {
    if (!options_.blur) break;
    gl_.ProgramUniform2i(blurProgram_.get(), gl_.GetUniformLocation(blurProgram_.get(), "relumeConeAlong"), along.x,
                         along.y);
    pass(blurProgram_, stripThreads(along));
  }
  timer_.mark(5);

  // 4. What was found before, where the same surface was seen
  light[0].bind(gl_, RELUME_CONE_UNIT_OLD_LIGHT);
  images_.places[1].bind(gl_, RELUME_CONE_UNIT_OLD_PLACES);
  images_.planes[1].bind(gl_, RELUME_CONE_UNIT_OLD_PLANES);
  images_.frames[1].bind(gl_, RELUME_CONE_UNIT_OLD_FRAMES);
  images_.frames[0].bindImage(gl_, 1);
  const bool keeps = options_.keep && hasBefore_ && wasRowsUp_ == rowsUp;
  setUniform(gl_, keepProgram_, "relumeConeHasBefore", keeps ? 1u : 0u);
  setUniform(gl_, keepProgram_, "relumeConeRowsUp", rowsUp ? 1.0f : -1.0f);
  setUniform(gl_, keepProgram_, "relumeConeMost", static_cast<float>(options_.mostFrames));
  gl_.ProgramUniformMatrix4fv(keepProgram_.get(), gl_.GetUniformLocation(keepProgram_.get(), "relumeConeOldClip"), 1,
                              GL_FALSE, glm::value_ptr(oldClip_));
  pass(keepProgram_, pixels());
  std::swap(light[0], light[from]);
}

void ConePasses::frame(const LiveSky& sky, GLuint normals, GLuint mirrored, const glm::mat4& clipFromWorld,
                       bool rowsUp) {
  writeSky(sky);
  timer_.mark(1);
  if (hemisphere_) {
    lightPixels(sky, normals, rowsUp);
  } else {
    for (std::size_t pass = 2; pass < 6; ++pass) timer_.mark(pass);
  }
  timer_.mark(6);

  // What pixels mirror
  hasGlossy_ = mirrored != 0;
  if (hasGlossy_) {
    const Program& program = tracing().lobe;
    levels_.bind(program);
    bindSurfaces(program);
    bindSky(program, sky);
    hostTextures_.bind(RELUME_CONE_UNIT_NORMALS, mirrored);
    images_.glossy.bindImage(gl_, 0);
    run(program, pixels());
  }
  timer_.mark(7);
  timer_.endFrame();

  // What the next frame looks back at
  std::swap(images_.places[0], images_.places[1]);
  std::swap(images_.planes[0], images_.planes[1]);
  std::swap(images_.frames[0], images_.frames[1]);
  oldClip_ = clipFromWorld;
  wasRowsUp_ = rowsUp;
  hasBefore_ = true;
  ++frameNumber_;
}

void ConePasses::run(const Program& program, std::uint32_t threads) const {
  runThreads(gl_, program, threads);
  waitForShaders(gl_);
}

void ConePasses::trace(const PixelReceivers& pixels, const LiveSky& sky, std::span<const glm::vec4> mirrored) {
  timer_.mark(0);
  upload(pixels, mirrored);
  frame(sky, images_.normals.texture.get(), mirrored.empty() ? 0 : images_.mirrored.texture.get(), pixels.clipFromWorld,
        false);
}

void ConePasses::trace(const PixelTextures& textures, const LiveSky& sky) {
  timer_.mark(0);
  bindSurfaces(surfacesProgram_);
  hostTextures_.bind(RELUME_CONE_UNIT_PLACES, textures.places);
  hostTextures_.bind(RELUME_CONE_UNIT_PLANES, textures.planes);
  images_.places[0].bindImage(gl_, 0);
  images_.planes[0].bindImage(gl_, 1);
  run(surfacesProgram_, pixels());
  frame(sky, textures.normals, textures.mirrored, textures.clipFromWorld, true);
}

template <class T>
std::vector<T> ConePasses::read(const PixelImage& picture, GLenum layout, GLenum type) const {
  std::vector<T> texels(static_cast<std::size_t>(images_.size.x) * static_cast<std::size_t>(images_.size.y));
  if (texels.empty()) return texels;
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  picture.bind(gl_, RELUME_CONE_UNIT_NORMALS);
  gl_.GetTexImage(GL_TEXTURE_2D, 0, layout, type, texels.data());
  return texels;
}

std::vector<glm::vec4> ConePasses::light() const { return read<glm::vec4>(images_.light[0], GL_RGBA, GL_FLOAT); }
std::vector<float> ConePasses::frames() const { return read<float>(images_.frames[1], GL_RED, GL_FLOAT); }
std::vector<std::uint8_t> ConePasses::edges() const {
  return read<std::uint8_t>(images_.edges, GL_RED_INTEGER, GL_UNSIGNED_BYTE);
}
std::vector<glm::vec4> ConePasses::glossy() const {
  return hasGlossy_ ? read<glm::vec4>(images_.glossy, GL_RGBA, GL_FLOAT) : std::vector<glm::vec4>();
}

std::array<PassTime, 7> ConePasses::passTimes() {
  const auto& ms = timer_.passMs();
  return {{{"surfaces", ms[0]},
           {"cones", ms[1]},
           {"edges", ms[2]},
           {"gather", ms[3]},
           {"blur", ms[4]},
           {"keep", ms[5]},
           {"lobes", ms[6]}}};
}

std::size_t ConePasses::pixelBytes() const {
  constexpr std::size_t kPixelBytes = 10 * 16 + 2 * 4 + 1;  // of PixelImages
  return kPixelBytes * pixels();
}

}  // namespace relume::gl
