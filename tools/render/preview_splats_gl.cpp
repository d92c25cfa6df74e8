// SPDX-License-Identifier: MIT
// See preview_splats_gl.h.
#include "tools/render/preview_splats_gl.h"

#include "tools/gl_scene/egl_context.h"
#include "tools/gl_splat/splats_gl.h"

#include <utility>

namespace relume {
namespace {

// Splats in a context of their own, which others may not be current in.
class OwnSplats final : public SplatDrawer {
 public:
  OwnSplats(EglContext context, std::unique_ptr<SplatsGl> splats)
      : context_(std::move(context)), splats_(std::move(splats)) {}
  OwnSplats(const OwnSplats&) = delete;
  OwnSplats& operator=(const OwnSplats&) = delete;
  ~OwnSplats() override { context_.makeCurrent(); }

  Status look(const CameraRays& camera, std::span<const PixelReceiver> receivers) override {
    context_.makeCurrent();
    return splats_->look(camera, receivers);
  }
  Status draw(std::span<const Record> records, const Interpolation& options) override {
    context_.makeCurrent();
    return splats_->draw(records, options);
  }
  Status add(std::span<const Record> records) override {
    context_.makeCurrent();
    return splats_->add(records);
  }
  Status relight(std::span<const Record> records) override {
    context_.makeCurrent();
    return splats_->relight(records);
  }
  Status read(std::span<Splat> picture) override {
    context_.makeCurrent();
    return splats_->read(picture);
  }

 private:
  EglContext context_;
  std::unique_ptr<SplatsGl> splats_;  // goes before its context does
};

}  // namespace

Result<GlPreviewSplats> splatPreviewByGl() {
  auto context = EglContext::create();
  if (!context) return context.error();
  auto splats = SplatsGl::create({EglContext::getProcAddress});
  if (!splats) return splats.error();
  GlPreviewSplats made;
  made.renderer = context->renderer();
  made.drawer = std::make_unique<OwnSplats>(std::move(*context), std::move(*splats));
  return made;
}

}  // namespace relume
