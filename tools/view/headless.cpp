// SPDX-License-Identifier: MIT
// See headless.h.
#include "tools/gl_scene/egl_context.h"

#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/images/image_io.h"
#include "tools/view/headless.h"
#include "tools/view/viewer.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <system_error>

namespace relume {
namespace {

constexpr double kSecondsAFrame = 1.0 / 15.0;

// Let one light orbit: the one that is named, else the first that is on and has a position.
Status chooseMoving(ViewState& state, const std::string& name) {
  for (ViewedLight& viewed : state.lights) {
    const bool wanted = name.empty() ? viewed.on && viewed.light.kind != LightKind::directional : viewed.name == name;
    if (!wanted) continue;
    viewed.orbits = true;
    return done();
  }
  if (name.empty()) return done();
  return Error{ErrorCode::usage, "--move: no light \"" + name + "\" in the scene"};
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

}  // namespace

Status runHeadless(const LoadedLevel& level, const ViewerOptions& options) {
  auto state = initialState(level.scene, options);
  if (!state) return state.error();
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
  const auto width = static_cast<GLsizei>(options.width), height = static_cast<GLsizei>(options.height);
  const GlTexture color = GlTexture::make(), depth = GlTexture::make();
  glBindTexture(GL_TEXTURE_2D, color.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, width, height);
  glBindTexture(GL_TEXTURE_2D, depth.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_DEPTH_COMPONENT32F, width, height);
  glBindTexture(GL_TEXTURE_2D, 0);
  const GlFramebuffer framebuffer = GlFramebuffer::make();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color.name(), 0);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth.name(), 0);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return Error{ErrorCode::unsupported, "OpenGL cannot draw into a 32-bit float target"};

  std::vector<glm::vec3> rows(std::size_t{options.width} * options.height), pixels(rows.size());
  for (std::uint32_t frame = 0; frame < options.headlessFrames; ++frame) {
    animate(*state, frame * kSecondsAFrame);
    if (Status ok = viewer->draw(*state, framebuffer.name(), options.width, options.height, false); !ok) return ok;
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    glReadBuffer(GL_COLOR_ATTACHMENT0);
    glReadPixels(0, 0, width, height, GL_RGB, GL_FLOAT, rows.data());
    for (std::size_t y = 0; y < options.height; ++y) {
      const auto from = rows.begin() + static_cast<std::ptrdiff_t>((options.height - 1 - y) * options.width);
      std::copy(from, from + width, pixels.begin() + static_cast<std::ptrdiff_t>(y * options.width));
    }
    const std::filesystem::path path = framePath(options.output, frame);
    if (Status ok = writePng(path, options.width, options.height, pixels); !ok) return ok;
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
