// SPDX-License-Identifier: MIT
// See cones_gl.h.
#include "runtime/live_gl/cones_gl.h"

#include "runtime/gl/plan_objects.h"
#include "runtime/gl/program.h"
#include "runtime/gl/saved_state.h"
#include "runtime/gl/timer.h"
#include "runtime/live/live_frame.h"
#include "runtime/live_gl/cone_levels_gl.h"
#include "runtime/live_gl/cone_textures.h"
#include "runtime/live_gl/live_objects.h"
#include "shaders/shared/layout.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <numbers>
#include <optional>

namespace relume {
namespace {

static_assert(kPattern == RELUME_CONE_PATTERN);

using gl::conesError;

Error noRoom() { return conesError(ErrorCode::memory, "memory ran out; fewer cells or a smaller picture take less"); }

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

struct ConesGl::State {
  // A pixel image that passes read and write.
  struct PixelImage {
    gl::Texture texture;
    GLenum format = GL_RGBA32F;

    void bind(const gl::Functions& gl, GLuint unit) const {
      gl.ActiveTexture(GL_TEXTURE0 + unit);
      gl.BindTexture(GL_TEXTURE_2D, texture.get());
    }
    void bindImage(const gl::Functions& gl, GLuint unit) const {
      gl.BindImageTexture(unit, texture.get(), 0, GL_FALSE, 0, GL_WRITE_ONLY, format);
    }
  };

  // All of a picture's size. Of two, the first is of this frame and the second of the one before; of `light` the last
  // two are between passes.
  struct PixelImages {
    glm::ivec2 size{0};
    std::array<PixelImage, 2> places, planes, frames;
    std::array<PixelImage, 3> light;
    PixelImage normals, mirrored, glossy, edges;
  };

  State(const gl::Functions& functions, const ConesGlOptions& wanted, gpu::GroupThreads groups)
      : gl_(functions),
        options(wanted.pixels),
        hemisphere(wanted.hemisphere),
        levels(gl_, wanted.directions, groups),
        isSerial(groups == gpu::GroupThreads::serial) {}

  Status compile();
  Status resize(std::uint32_t width, std::uint32_t height);
  Status checkTexture(GLuint name, const char* what, const glm::ivec2& size, bool isSigned) const {
    return gl::checkConeTexture(gl_, name, what, size, isSigned);
  }
  void upload(const PixelReceivers& pixels, std::span<const glm::vec4> mirrored);
  void run(const gl::Program& program) const {
    gl::runThreads(gl_, program, static_cast<std::uint32_t>(images.size.x * images.size.y));
    gl::waitForShaders(gl_);
  }
  void bindSurfaces(const gl::Program& program) const;
  void writeSky(const LiveSky& sky);
  void bindSky(const gl::Program& program, const LiveSky& sky) const;
  void bindTexture(GLuint unit, GLuint texture) const {
    gl_.ActiveTexture(GL_TEXTURE0 + unit);
    gl_.BindTexture(GL_TEXTURE_2D, texture);
  }
  void lightPixels(const LiveSky& sky, GLuint normals, bool rowsUp);
  void frame(const LiveSky& sky, GLuint normals, GLuint mirrored, const glm::mat4& clipFromWorld, bool rowsUp);
  template <class T>
  std::vector<T> read(const PixelImage& picture, GLenum layout, GLenum type) const;

  gl::Functions gl_;  // before all that deletes by it
  PixelConeOptions options;
  bool hemisphere;
  gl::ConeLevels levels;
  bool isSerial;  // threads of a work group run one after the other
  gl::Program surfacesProgram, hemisphereProgram, lobeProgram, edgesProgram, gatherProgram, blurProgram, keepProgram;
  gl::GrowingBuffer directions{gl_};
  PixelImages images;
  gl::ConeMaps maps{gl_};
  bool hasBefore = false;  // a frame of this size, to keep light of
  bool hasGlossy = false;
  bool wasRowsUp = false;
  glm::mat4 oldClip{1.0f};
  std::uint32_t frameNumber = 0;
  gl::FrameTimer<7> timer{gl_};
};

Status ConesGl::State::compile() {
  if (Status ok = levels.compile(); !ok) return ok;
  auto defines = levels.defines();
  defines.emplace_back("RELUME_CONE_SHARES", isSerial ? "0" : "1");
  const std::pair<gl::Program*, const char*> programs[] = {
      {&surfacesProgram, "cone_surfaces.comp"}, {&hemisphereProgram, "cone_hemisphere.comp"},
      {&lobeProgram, "cone_lobe.comp"},         {&edgesProgram, "cone_edges.comp"},
      {&gatherProgram, "cone_gather.comp"},     {&blurProgram, "cone_blur.comp"},
      {&keepProgram, "cone_keep.comp"}};
  for (const auto& [program, path] : programs) {
    Result<gl::Program> made = gl::makeComputeProgram(gl_, path, defines);
    if (!made) return made.error();
    *program = std::move(*made);
  }
  return done();
}

// Images for so many pixels; those of before stay where there is no room.
Status ConesGl::State::resize(std::uint32_t width, std::uint32_t height) {
  const glm::ivec2 size(static_cast<int>(width), static_cast<int>(height));
  if (size == images.size) return done();
  const std::uint32_t most = gl::deviceOf(gl_, gpu::GroupThreads::parallel).imageSide;
  if (std::max(width, height) > most)
    return conesError(ErrorCode::unsupported, std::to_string(width) + " x " + std::to_string(height) +
                                                  " pixels, this OpenGL's textures have " + std::to_string(most) +
                                                  " along a side");
  while (gl_.GetError() != GL_NO_ERROR) {
  }
  PixelImages next;
  next.size = size;
  const auto make = [&](PixelImage& picture, GLenum format) {
    picture.texture = gl::makeTexture(gl_, GL_TEXTURE_2D);
    picture.format = format;
    gl_.TexStorage2D(GL_TEXTURE_2D, 1, format, size.x, size.y);
  };
  for (PixelImage& each : next.places) make(each, GL_RGBA32F);
  for (PixelImage& each : next.planes) make(each, GL_RGBA32F);
  for (PixelImage& each : next.light) make(each, GL_RGBA32F);
  for (PixelImage& each : next.frames) make(each, GL_R32F);
  for (PixelImage* each : {&next.normals, &next.mirrored, &next.glossy}) make(*each, GL_RGBA32F);
  make(next.edges, GL_R8UI);
  if (gl_.GetError() == GL_OUT_OF_MEMORY)
    return conesError(ErrorCode::unsupported, "this OpenGL has not enough memory for " + std::to_string(width) + " x " +
                                                  std::to_string(height) + " pixels");
  images = std::move(next);
  hasBefore = hasGlossy = false;
  return done();
}

void ConesGl::State::upload(const PixelReceivers& pixels, std::span<const glm::vec4> mirrored) {
  std::vector<glm::vec4> texels(pixels.depth.size());
  const auto write = [&](const PixelImage& to, std::span<const glm::vec4> from) {
    to.bind(gl_, RELUME_CONE_UNIT_NORMALS);
    gl_.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, images.size.x, images.size.y, GL_RGBA, GL_FLOAT, from.data());
  };
  const auto each = [&](const PixelImage& to, const auto& texelAt) {
    for (std::size_t i = 0; i < texels.size(); ++i) texels[i] = pixels.depth[i] > 0.0f ? texelAt(i) : glm::vec4(0.0f);
    write(to, texels);
  };
  each(images.places[0], [&](std::size_t i) { return glm::vec4(pixels.positionWorld[i], pixels.depth[i]); });
  each(images.planes[0], [&](std::size_t i) { return glm::vec4(pixels.plane[i], 0.0f); });
  each(images.normals, [&](std::size_t i) { return glm::vec4(pixels.normal[i], 0.0f); });
  if (!mirrored.empty()) write(images.mirrored, mirrored);
}

void ConesGl::State::bindSurfaces(const gl::Program& program) const {
  images.places[0].bind(gl_, RELUME_CONE_UNIT_PLACES);
  images.planes[0].bind(gl_, RELUME_CONE_UNIT_PLANES);
  gl_.ProgramUniform2i(program.get(), gl_.GetUniformLocation(program.get(), "relumeConePicture"), images.size.x,
                       images.size.y);
}

void ConesGl::State::writeSky(const LiveSky& sky) {
  const std::vector<glm::vec4> packed = packDirections(sky);
  directions.reserve(sizeof(glm::vec4) * packed.size());
  directions.write(0, gl::bytesOf(packed));
}

void ConesGl::State::bindSky(const gl::Program& program, const LiveSky& sky) const {
  directions.bind(RELUME_CONE_SLOT_DIRECTIONS);
  gl::setUniform(gl_, program, "relumeConeSky", glm::uvec2(kHemisphereCones, sky.map.empty() ? 0 : sky.side));
  gl::setUniform(gl_, program, "relumeConeSkyRadiance", sky.radiance);
}

// The passes of PixelCones::update(), in its order.
void ConesGl::State::lightPixels(const LiveSky& sky, GLuint normals, bool rowsUp) {
  auto& light = images.light;
  std::size_t from = 1, to = 2;  // of `light`, between passes

  // 1. A cone a pixel, or all
  const float angle = options.interleaved ? 2.0f * std::numbers::pi_v<float> * turnOfFrame(frameNumber) : 0.0f;
  levels.bind(hemisphereProgram);
  bindSurfaces(hemisphereProgram);
  bindSky(hemisphereProgram, sky);
  bindTexture(RELUME_CONE_UNIT_NORMALS, normals);
  light[from].bindImage(gl_, 0);
  gl_.ProgramUniform2f(hemisphereProgram.get(), gl_.GetUniformLocation(hemisphereProgram.get(), "relumeConeTurn"),
                       std::cos(angle), std::sin(angle));
  gl::setUniform(gl_, hemisphereProgram, "relumeConeAll", options.interleaved ? 0u : kHemisphereCones);
  gl::setUniform(gl_, hemisphereProgram, "relumeConeFalloff", options.falloff);
  if (options.interleaved) {
    const glm::uvec2 blocks = (glm::uvec2(images.size) + (kPattern - 1)) / kPattern;
    gl::runThreads(gl_, hemisphereProgram, kHemisphereCones * blocks.x * blocks.y);
    gl::waitForShaders(gl_);
  } else {
    run(hemisphereProgram);
  }
  timer.mark(2);

  // 2. Where surfaces end
  bindSurfaces(edgesProgram);
  images.edges.bindImage(gl_, 0);
  run(edgesProgram);
  timer.mark(3);

  // 3. The pattern's cones together, and a blur
  const auto pixels = static_cast<std::uint32_t>(images.size.x * images.size.y);
  // Of each strip as many as a work group has.
  const auto stripThreads = [&](const glm::ivec2& along) {
    const auto size = glm::uvec2(images.size);
    const std::uint32_t length = along.x != 0 ? size.x : size.y;
    return pixels / length * ((length + RELUME_LIVE_GROUP - 1) / RELUME_LIVE_GROUP * RELUME_LIVE_GROUP);
  };
  const auto pass = [&](const gl::Program& program, std::uint32_t threads) {
    bindSurfaces(program);
    light[from].bind(gl_, RELUME_CONE_UNIT_LIGHT);
    light[to].bindImage(gl_, 0);
    gl::runThreads(gl_, program, threads);
    gl::waitForShaders(gl_);
    std::swap(from, to);
  };
  images.edges.bind(gl_, RELUME_CONE_UNIT_EDGES);
  if (options.gather) pass(gatherProgram, pixels);
  timer.mark(4);
  for (const glm::ivec2& along : {glm::ivec2(1, 0), glm::ivec2(0, 1)}) {
    if (!options.blur) break;
    gl_.ProgramUniform2i(blurProgram.get(), gl_.GetUniformLocation(blurProgram.get(), "relumeConeAlong"), along.x,
                         along.y);
    pass(blurProgram, stripThreads(along));
  }
  timer.mark(5);

  // 4. What was found before, where the same surface was seen
  light[0].bind(gl_, RELUME_CONE_UNIT_OLD_LIGHT);
  images.places[1].bind(gl_, RELUME_CONE_UNIT_OLD_PLACES);
  images.planes[1].bind(gl_, RELUME_CONE_UNIT_OLD_PLANES);
  images.frames[1].bind(gl_, RELUME_CONE_UNIT_OLD_FRAMES);
  images.frames[0].bindImage(gl_, 1);
  const bool keeps = options.keep && hasBefore && wasRowsUp == rowsUp;
  gl::setUniform(gl_, keepProgram, "relumeConeHasBefore", keeps ? 1u : 0u);
  gl::setUniform(gl_, keepProgram, "relumeConeRowsUp", rowsUp ? 1.0f : -1.0f);
  gl::setUniform(gl_, keepProgram, "relumeConeMost", static_cast<float>(options.mostFrames));
  gl_.ProgramUniformMatrix4fv(keepProgram.get(), gl_.GetUniformLocation(keepProgram.get(), "relumeConeOldClip"), 1,
                              GL_FALSE, glm::value_ptr(oldClip));
  pass(keepProgram, pixels);
  std::swap(light[0], light[from]);
}

void ConesGl::State::frame(const LiveSky& sky, GLuint normals, GLuint mirrored, const glm::mat4& clipFromWorld,
                           bool rowsUp) {
  writeSky(sky);
  timer.mark(1);
  if (hemisphere) {
    lightPixels(sky, normals, rowsUp);
  } else {
    for (std::size_t pass = 2; pass < 6; ++pass) timer.mark(pass);
  }
  timer.mark(6);

  // What pixels mirror
  hasGlossy = mirrored != 0;
  if (hasGlossy) {
    levels.bind(lobeProgram);
    bindSurfaces(lobeProgram);
    bindSky(lobeProgram, sky);
    bindTexture(RELUME_CONE_UNIT_NORMALS, mirrored);
    images.glossy.bindImage(gl_, 0);
    run(lobeProgram);
  }
  timer.mark(7);
  timer.endFrame();

  // What the next frame looks back at
  std::swap(images.places[0], images.places[1]);
  std::swap(images.planes[0], images.planes[1]);
  std::swap(images.frames[0], images.frames[1]);
  oldClip = clipFromWorld;
  wasRowsUp = rowsUp;
  hasBefore = true;
  ++frameNumber;
}

Result<ConesGl> ConesGl::create(const ConesGlOptions& options) {
  if (Status ok = checkPixelConeOptions(options.pixels); !ok) return ok.error();
  const Result<gl::Functions> functions = gl::loadFunctions(options.getProcAddress);
  if (!functions) return functions.error();
  const gl::SavedState saved(*functions, RELUME_CONE_UNITS);
  const gpu::GroupThreads groups = gl::groupThreadsOf(*functions, options.groups);
  auto state = std::make_unique<State>(*functions, options, groups);
  if (Status ok = state->compile(); !ok) return ok.error();
  return ConesGl(std::move(state));
}

ConesGl::ConesGl(std::unique_ptr<State> state) : state_(std::move(state)) {}
ConesGl::ConesGl(ConesGl&&) noexcept = default;
ConesGl& ConesGl::operator=(ConesGl&&) noexcept = default;
ConesGl::~ConesGl() = default;

Status ConesGl::fill(const VoxelVolume& volume) {
  try {
    const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
    return state_->levels.fill(volume, nullptr, nullptr);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
}

Status ConesGl::fill(const VoxelVolume& volume, const gl::LitSides& lit) {
  try {
    const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
    return state_->levels.fill(volume, &lit, nullptr);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
}

namespace {

Status checkFrame(const gl::ConeLevels& levels, const LiveSky& sky) {
  if (!levels.isFilled()) return conesError(ErrorCode::usage, "there are no voxels yet: fill() goes before trace()");
  return checkLiveSky(sky);
}

}  // namespace

Status ConesGl::fill(const VoxelVolume& volume, std::span<const RsmTextures> maps, float largestFlux,
                     const glm::vec3& emissionScale) {
  State& s = *state_;
  if (Status ok = checkEmissionScale(emissionScale); !ok) return ok;
  try {
    const gl::SavedState saved(s.gl_, RELUME_CONE_UNITS);
    const auto checked = gl::checkConeMaps(s.gl_, maps, largestFlux);
    if (!checked) return checked.error();
    const gl::RsmMaps all{*checked, largestFlux, emissionScale};
    return s.levels.fill(volume, nullptr, &all);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
}

Status ConesGl::fill(const VoxelVolume& volume, std::span<const RsmImage> maps, const glm::vec3& emissionScale) {
  State& s = *state_;
  if (Status ok = checkEmissionScale(emissionScale); !ok) return ok;
  if (Status ok = checkRsm(maps); !ok) return ok;
  try {
    const gl::SavedState saved(s.gl_, RELUME_CONE_UNITS);
    const auto uploaded = s.maps.upload(maps);
    if (!uploaded) return uploaded.error();
    const gl::RsmMaps all{*uploaded, largestFlux(maps), emissionScale};
    return s.levels.fill(volume, nullptr, &all);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
}

Status ConesGl::trace(const PixelReceivers& pixels, const LiveSky& sky, std::span<const glm::vec4> mirrored) {
  State& s = *state_;
  if (Status ok = checkFrame(s.levels, sky); !ok) return ok;
  if (Status ok = checkPixels(pixels); !ok) return ok;
  if (!mirrored.empty() && mirrored.size() != pixels.depth.size())
    return conesError(ErrorCode::usage, "mirrored has " + std::to_string(mirrored.size()) + " pixels, expected " +
                                            std::to_string(pixels.depth.size()));
  try {
    const gl::SavedState saved(s.gl_, RELUME_CONE_UNITS);
    if (Status ok = s.resize(pixels.width, pixels.height); !ok) return ok;
    s.timer.mark(0);
    s.upload(pixels, mirrored);
    s.frame(sky, s.images.normals.texture.get(), mirrored.empty() ? 0 : s.images.mirrored.texture.get(),
            pixels.clipFromWorld, false);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
  return done();
}

Status ConesGl::trace(const PixelTextures& pixels, const LiveSky& sky) {
  State& s = *state_;
  if (Status ok = checkFrame(s.levels, sky); !ok) return ok;
  if (Status ok = checkPixelFrame(pixels.width, pixels.height, pixels.clipFromWorld); !ok) return ok;
  const glm::ivec2 size(static_cast<int>(pixels.width), static_cast<int>(pixels.height));
  try {
    const gl::SavedState saved(s.gl_, RELUME_CONE_UNITS);
    if (Status ok = s.checkTexture(pixels.places, "places", size, false); !ok) return ok;
    if (Status ok = s.checkTexture(pixels.planes, "planes", size, true); !ok) return ok;
    if (Status ok = s.checkTexture(pixels.normals, "normals", size, true); !ok) return ok;
    if (pixels.mirrored != 0) {
      if (Status ok = s.checkTexture(pixels.mirrored, "mirrored", size, false); !ok) return ok;
    }
    if (Status ok = s.resize(pixels.width, pixels.height); !ok) return ok;
    s.timer.mark(0);
    s.bindSurfaces(s.surfacesProgram);
    s.bindTexture(RELUME_CONE_UNIT_PLACES, pixels.places);
    s.bindTexture(RELUME_CONE_UNIT_PLANES, pixels.planes);
    s.images.places[0].bindImage(s.gl_, 0);
    s.images.planes[0].bindImage(s.gl_, 1);
    s.run(s.surfacesProgram);
    s.frame(sky, pixels.normals, pixels.mirrored, pixels.clipFromWorld, true);
  } catch (const std::bad_alloc&) {
    return noRoom();
  }
  return done();
}

void ConesGl::reset() { state_->hasBefore = false; }

std::uint32_t ConesGl::lightTexture() const { return state_->images.light[0].texture.get(); }
std::uint32_t ConesGl::glossyTexture() const { return state_->hasGlossy ? state_->images.glossy.texture.get() : 0; }

template <class T>
std::vector<T> ConesGl::State::read(const PixelImage& picture, GLenum layout, GLenum type) const {
  std::vector<T> texels(static_cast<std::size_t>(images.size.x) * static_cast<std::size_t>(images.size.y));
  if (texels.empty()) return texels;
  const gl::SavedState saved(gl_, RELUME_CONE_UNITS);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  picture.bind(gl_, RELUME_CONE_UNIT_NORMALS);
  gl_.GetTexImage(GL_TEXTURE_2D, 0, layout, type, texels.data());
  return texels;
}

std::vector<glm::vec4> ConesGl::light() const {
  return state_->read<glm::vec4>(state_->images.light[0], GL_RGBA, GL_FLOAT);
}
std::vector<glm::vec3> ConesGl::glossy() const {
  if (!state_->hasGlossy) return {};
  const std::vector<glm::vec4> texels = state_->read<glm::vec4>(state_->images.glossy, GL_RGBA, GL_FLOAT);
  return {texels.begin(), texels.end()};
}
std::vector<float> ConesGl::frames() const { return state_->read<float>(state_->images.frames[1], GL_RED, GL_FLOAT); }
std::vector<std::uint8_t> ConesGl::edges() const {
  return state_->read<std::uint8_t>(state_->images.edges, GL_RED_INTEGER, GL_UNSIGNED_BYTE);
}

std::vector<glm::vec3> ConesGl::sideRadiance() const {
  const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
  return state_->levels.sideRadiance();
}

std::uint32_t ConesGl::levels() const { return state_->levels.levels(); }
std::vector<glm::vec4> ConesGl::texels(std::uint32_t level) const {
  const gl::SavedState saved(state_->gl_, RELUME_CONE_UNITS);
  return state_->levels.texels(level);
}

std::vector<PassTime> ConesGl::passTimes() const {
  std::vector<PassTime> times = state_->levels.passTimes();
  const auto& ms = state_->timer.passMs();
  constexpr std::array kNames = {"surfaces", "cones", "edges", "gather", "blur", "keep", "lobes"};
  for (std::size_t i = 0; i < kNames.size(); ++i) times.push_back({kNames[i], ms[i]});
  return times;
}

std::vector<std::pair<std::string, std::size_t>> ConesGl::bufferSizes() const {
  const State& s = *state_;
  const auto pixels = static_cast<std::size_t>(s.images.size.x) * static_cast<std::size_t>(s.images.size.y);
  constexpr std::size_t kPixelBytes = 10 * 16 + 2 * 4 + 1;  // of PixelImages
  return {{"cone voxels", s.levels.voxelBytes()},
          {"cone levels", s.levels.levelBytes() + s.directions.bytes()},
          {"cone pixels", kPixelBytes * pixels},
          {"cone maps", s.maps.bytes()}};
}

}  // namespace relume
