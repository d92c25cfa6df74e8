// SPDX-License-Identifier: MIT
// See preview_splats_gl.h.
#include "tools/render/preview_splats_gl.h"

#include "tools/gl_scene/egl_context.h"
#include "tools/gl_splat/mirror_splats_gl.h"
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
  Status drawMirrors(const CameraRays& camera, std::span<const PixelReceiver> receivers,
                     std::span<const MirrorSurface> surfaces, std::span<const Record> records,
                     const RadianceRecords& radiance, const Interpolation& options, std::span<MirrorSplat> picture) {
    context_.makeCurrent();
    if (!mirrors_ || order_ != radiance.order()) {
      auto made = MirrorSplatsGl::create(EglContext::getProcAddress, radiance.order());
      if (!made) return made.error();
      mirrors_ = std::move(*made);
      order_ = radiance.order();
    }
    return mirrors_->draw(camera, receivers, surfaces, records, radiance, options, picture);
  }

 private:
  EglContext context_;
  std::unique_ptr<SplatsGl> splats_;         // go before their context does
  std::unique_ptr<MirrorSplatsGl> mirrors_;  // of an order
  int order_ = 0;
};

}  // namespace

Result<GlPreviewSplats> splatPreviewByGl() {
  auto context = EglContext::create();
  if (!context) return context.error();
  auto splats = SplatsGl::create({EglContext::getProcAddress});
  if (!splats) return splats.error();
  GlPreviewSplats made;
  made.renderer = context->renderer();
  const auto own = std::make_shared<OwnSplats>(std::move(*context), std::move(*splats));
  made.drawer = own;
  made.mirrors = [own](const CameraRays& camera, std::span<const PixelReceiver> receivers,
                       std::span<const MirrorSurface> surfaces, std::span<const Record> records,
                       const RadianceRecords& radiance, const Interpolation& interpolation,
                       std::span<MirrorSplat> picture) {
    return own->drawMirrors(camera, receivers, surfaces, records, radiance, interpolation, picture);
  };
  return made;
}

}  // namespace relume
