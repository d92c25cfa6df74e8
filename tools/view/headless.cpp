// SPDX-License-Identifier: MIT
// See headless.h.
#include "tools/gl_scene/egl_context.h"

#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/images/image_io.h"
#include "tools/render/exposure.h"
#include "tools/view/headless.h"
#include "tools/view/light_set.h"
#include "tools/view/viewer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <system_error>

namespace relume {
namespace {

constexpr double kSecondsAFrame = 1.0 / 15.0;

// Let one light orbit: the one that is named, else the first that is on and has a position.
Status chooseMoving(ViewState& state, const std::string& name) {
  bool isOff = false;
  for (ViewedLight& viewed : state.lights) {
    const bool wanted = name.empty() ? viewed.light.kind != LightKind::directional : viewed.name == name;
    if (!wanted) continue;
    isOff = !viewed.on;
    if (isOff) continue;
    viewed.orbits = true;
    return done();
  }
  if (name.empty()) return done();
  return Error{ErrorCode::usage, "--move: " + (isOff ? "\"" + name + "\" is off; --lights has to name it"
                                                     : "no light \"" + name + "\" in the scene")};
}

std::filesystem::path framePath(const std::string& folder, std::uint32_t frame) {
  char name[32];
  std::snprintf(name, sizeof name, "frame_%04u.png", frame);
  return std::filesystem::path(folder) / name;
}

// No frame may be written over what the level was read from, or over what is no picture.
Status checkFrames(const Scene& scene, const ViewerOptions& options) {
  Context context;
  for (std::uint32_t frame = 0; frame < options.headlessFrames; ++frame) {
    CommandFiles files;
    files.read("the bake", options.bake);
    files.read("a file of the scene", scene.files);
    files.read("the file of --lights-file", options.lightsFile);
    files.read("the file of --sky-map", options.skyMap);
    for (const std::string& image : options.drivenFiles) files.read("an image of --emission", image);
    files.write("-o", framePath(options.output, frame), FileKind::png);
    files.force = options.force;
    if (Status ok = checkOutputs(files, context); !ok) return ok;
  }
  return done();
}

// What frames are drawn into, and read from.
class FrameTarget {
 public:
  // unsupported: OpenGL cannot draw into it.
  static Result<FrameTarget> create(std::uint32_t width, std::uint32_t height) {
    FrameTarget target;
    target.width_ = width;
    target.height_ = height;
    const auto w = static_cast<GLsizei>(width), h = static_cast<GLsizei>(height);
    glBindTexture(GL_TEXTURE_2D, target.color_.name());
    glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, w, h);
    glBindTexture(GL_TEXTURE_2D, target.depth_.name());
    glTexStorage2D(GL_TEXTURE_2D, 1, GL_DEPTH_COMPONENT32F, w, h);
    glBindTexture(GL_TEXTURE_2D, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer_.name());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target.color_.name(), 0);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, target.depth_.name(), 0);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      return Error{ErrorCode::unsupported, "OpenGL cannot draw into a 32-bit float target"};
    return target;
  }

  // One frame, linear. [Size width * height] rows from the top
  Result<std::vector<glm::vec3>> draw(Viewer& viewer, const ViewState& state) const {
    if (Status ok = viewer.draw(state, framebuffer_.name(), width_, height_, false); !ok) return ok.error();
    std::vector<glm::vec3> rows(std::size_t{width_} * height_), pixels(rows.size());
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    glReadBuffer(GL_COLOR_ATTACHMENT0);
    glReadPixels(0, 0, static_cast<GLsizei>(width_), static_cast<GLsizei>(height_), GL_RGB, GL_FLOAT, rows.data());
    for (std::size_t y = 0; y < height_; ++y) {
      const auto from = rows.begin() + static_cast<std::ptrdiff_t>((height_ - 1 - y) * width_);
      std::copy(from, from + width_, pixels.begin() + static_cast<std::ptrdiff_t>(y * width_));
    }
    return pixels;
  }

 private:
  FrameTarget() = default;
  GlTexture color_ = GlTexture::make(), depth_ = GlTexture::make();
  GlFramebuffer framebuffer_ = GlFramebuffer::make();
  std::uint32_t width_ = 0, height_ = 0;
};

// Frames of a few pixels until light goes no further from one to the next: what is written begins with all bounces.
Status settle(Viewer& viewer, const ViewState& state) {
  constexpr int kMaxFrames = 64, kStill = 3;
  constexpr double kChange = 1e-3;  // of the picture's light
  auto target = FrameTarget::create(32, 18);
  if (!target) return target.error();
  ViewState few = state;
  few.records = false;
  few.overlays = {};
  double last = -1.0;
  for (int frame = 0, still = 0; frame < kMaxFrames && still < kStill; ++frame) {
    const auto pixels = target->draw(viewer, few);
    if (!pixels) return pixels.error();
    double light = 0.0;
    for (const glm::vec3& pixel : *pixels) light += static_cast<double>(pixel.r + pixel.g + pixel.b);
    still = std::abs(light - last) <= kChange * light ? still + 1 : 0;
    last = light;
  }
  return done();
}

// Of the first frame, without what is laid over it.
Result<float> exposureOf(Viewer& viewer, const ViewState& state, const FrameTarget& target) {
  ViewState plain = state;
  plain.exposure = 0.0f;
  plain.overlays = {};
  const auto pixels = target.draw(viewer, plain);
  if (!pixels) return pixels.error();
  return autoExposure(*pixels);
}

}  // namespace

Status runHeadless(const LoadedLevel& level, const ViewerOptions& options) {
  auto state = initialState(level.scene, options);
  if (!state) return state.error();
  if (const std::size_t off = limitLightsOn(state->lights); off > 0)
    std::fprintf(stderr, "relume-view: warning: %s\n", switchedOffText(off).c_str());
  if (Status ok = chooseMoving(*state, options.moving); !ok) return ok;
  std::error_code failure;
  std::filesystem::create_directories(options.output, failure);
  if (failure) return Error{ErrorCode::io, "cannot make folder \"" + options.output + "\": " + failure.message()};
  if (Status ok = checkFrames(level.scene, options); !ok) return ok;

  auto egl = EglContext::create();
  if (!egl) return egl.error();
  if (options.choosesLiveBackend) state->live.backend = LiveCachesGl::fasterBackend(EglContext::getProcAddress);
  auto viewer = Viewer::create(level, options.shadowSize, *state, EglContext::getProcAddress);
  if (!viewer) return viewer.error();
  if (state->records) {
    if (Status ok = viewer->makeRecords(); !ok) return ok;
  }
  std::printf("bands %s\n", viewer->bands().c_str());
  state->liveStep = kSecondsAFrame;
  const auto target = FrameTarget::create(options.width, options.height);
  if (!target) return target.error();
  animate(*state, 0.0, viewer->levelSize());
  if (Status ok = settle(*viewer, *state); !ok) return ok;
  if (!options.exposure && showsLight(state->mode)) {
    const auto stops = exposureOf(*viewer, *state, *target);
    if (!stops) return stops.error();
    state->exposure = *stops;
    std::printf("exposure: %s stops, from the first frame\n", stopsText(*stops).c_str());
  }

  for (std::uint32_t frame = 0; frame < options.headlessFrames; ++frame) {
    animate(*state, frame * kSecondsAFrame, viewer->levelSize());
    const auto pixels = target->draw(*viewer, *state);
    if (!pixels) return pixels.error();
    const std::filesystem::path path = framePath(options.output, frame);
    if (Status ok = writePng(path, options.width, options.height, *pixels); !ok) return ok;
    std::printf("%s ", printable(path.string()).c_str());
    for (const auto& [pass, ms] : viewer->times()) std::printf("  %s %.2f ms", pass.c_str(), ms);
    if (const LiveShading* live = viewer->live()) {
      for (const PassTime& pass : live->passTimes()) std::printf("  %s %.2f ms", pass.pass, pass.ms);
    }
    std::printf("\n");
  }
  return done();
}

}  // namespace relume
