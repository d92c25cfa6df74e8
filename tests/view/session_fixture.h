// SPDX-License-Identifier: MIT
// A session of the viewer without a window: frames of the sample level into a texture, as fast as they come.
#pragma once

#include "tools/gl_scene/egl_context.h"

#include "formats/color.h"
#include "relume/bake/bake.h"
#include "relume/bake_file.h"
#include "tools/images/read_picture.h"
#include "tools/view/session.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

namespace relume::test {

namespace fs = std::filesystem;

inline constexpr const char* kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";
inline constexpr std::uint32_t kWidth = 96, kHeight = 54;

inline BakeOptions small(std::uint32_t surfels) {
  BakeOptions options = presetOptions(Preset::draft);
  options.surfels.count = surfels;
  options.caches.lightmapCaches = 200;
  options.links.raysPerCache = 64;
  options.links.linksPerCache = 64;
  options.playSpace.walks = 5000;
  return options;
}

class ViewerSession : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / ("relume_session_" + std::string(info->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    auto egl = EglContext::create();
    if (!egl) GTEST_SKIP() << egl.error().message;
    egl_.emplace(std::move(*egl));
    color_ = texture(GL_RGBA32F);
    depth_ = texture(GL_DEPTH_COMPONENT32F);
    framebuffer_ = GlFramebuffer::make();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color_.name(), 0);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_.name(), 0);
    options_.scene = kLevel;
    options_.camera = "cam_living";
    options_.lights = {"lamp"};
    options_.view = "links";
    options_.shadowSize = 128;
    options_.draft = true;
  }
  void TearDown() override {
    session_.reset();
    framebuffer_ = GlFramebuffer();
    color_ = GlTexture();
    depth_ = GlTexture();
    egl_.reset();
    fs::remove_all(folder_);
  }

  static GlTexture texture(GLenum format) {
    GlTexture made = GlTexture::make();
    glBindTexture(GL_TEXTURE_2D, made.name());
    glTexStorage2D(GL_TEXTURE_2D, 1, format, kWidth, kHeight);
    return made;
  }
  std::string at(const char* name) const { return (folder_ / name).string(); }
  Scene scene() const {
    Context context;
    auto loaded = importGltf(kLevel, context);
    EXPECT_TRUE(loaded);
    return std::move(*loaded);
  }
  void writeBakeFile(const BakeOptions& options) const {
    Context context;
    const auto baked = bake(scene(), options, context);
    ASSERT_TRUE(baked) << baked.error().message;
    ASSERT_TRUE(writeBake(*baked, at("level.relume")));
  }
  void start(const std::string& bakeFile) {
    auto state = initialState(scene(), options_);
    ASSERT_TRUE(state) << state.error().message;
    state->coarse = false;  // whatever else the machine does
    session_.emplace(std::move(*state), options_, EglContext::getProcAddress);
    LevelFiles files{kLevel, bakeFile, {}};
    if (bakeFile.empty() && options_.draft) files.bakeBy = presetOptions(Preset::draft);
    session_->begin(std::move(files));
  }
  // Frames until is(), for minutes; the frame is drawn, and its mean brightness noted.
  template <class Condition>
  bool frames(const Condition& is) {
    for (int i = 0; i < 30000; ++i) {
      frame();
      if (is()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  double frame() {
    now_ += 0.05;
    session_->beginFrame(now_, {kWidth, kHeight});
    session_->draw(framebuffer_.name(), kWidth, kHeight);
    pixels_.resize(std::size_t{4} * kWidth * kHeight);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    glReadPixels(0, 0, kWidth, kHeight, GL_RGBA, GL_FLOAT, pixels_.data());
    double sum = 0.0;
    for (std::size_t i = 0; i < pixels_.size(); i += 4) sum += static_cast<double>(pixels_[i + 1]);
    brightness_ = sum / (kWidth * kHeight);
    return brightness_;
  }
  bool says(const std::string& text) const {
    for (const auto& message : session_->messages.shown()) {
      if (message.text.find(text) != std::string::npos) return true;
    }
    return false;
  }

  fs::path folder_;
  std::optional<EglContext> egl_;
  GlTexture color_, depth_;
  GlFramebuffer framebuffer_;
  ViewerOptions options_;
  std::optional<Session> session_;
  double now_ = 0.0, brightness_ = 0.0;
  std::vector<float> pixels_;  // of the last frame
};

// The level without a bake.
class LiveSession : public ViewerSession {
 protected:
  // Of the view's light without direct light, green.
  double meanLight() {
    ViewState state = session_->state;
    state.direct = false;
    double sum = 0.0;
    const std::vector<glm::vec3> shown = *session_->viewer->irradiance(state, kWidth, kHeight);
    for (const glm::vec3& e : shown) sum += static_cast<double>(e.g);
    return sum / (kWidth * kHeight);
  }
  void SetUp() override {
    ViewerSession::SetUp();
    options_.draft = false;
    options_.live = {16, 32, 2};
  }
  // Shown, each frame with light of its own.
  void show(int settle) {
    start("");
    session_->state.liveStep = 1.0 / 15.0;
    ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
    for (int i = 0; i < settle; ++i) frame();
  }
  std::size_t objectNamed(const std::string& name) const {
    const auto& objects = session_->state.objects;
    return static_cast<std::size_t>(
        std::find_if(objects.begin(), objects.end(), [&](const ViewedObject& o) { return o.name == name; }) -
        objects.begin());
  }
};

}  // namespace relume::test
