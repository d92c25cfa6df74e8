// SPDX-License-Identifier: MIT
// Light over links by radiance records, frame by frame (bake/preview/live_preview.h): their rays find the relit bake's
// surfels, so that they show what the bake would come to with caches everywhere. The level's shader reads them where
// they are, and the bake's own caches elsewhere.
#pragma once

#include "bake/preview/live_preview.h"
#include "bake/rays/ray_tracer.h"
#include "bake/scene/sky.h"
#include "bake/surfels/surfels_on_demand.h"
#include "relume/bake/context.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"
#include "tools/gl_splat/splats_gl.h"
#include "tools/view/loaded_level.h"
#include "tools/view/view_state.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace relume {

class ViewRecords {
 public:
  static constexpr std::uint32_t kPerFrame = 100;         // records, at most (RCS 5)
  static constexpr double kFrameSeconds = 0.05;           // for them
  static constexpr std::uint32_t kMaxPixels = 512 * 512;  // of the picture by records; larger windows read between them

  // Makes rays and the map from hits to surfels, which takes seconds in large levels. Errors of RayTracer. `level` must
  // outlive it. getProcAddress: of the context that is current.
  static Result<std::unique_ptr<ViewRecords>> create(const LoadedLevel& level, const GetProcAddress& getProcAddress);

  // One frame in the light that the relighter has by now: records for what is new in view, those there are relit where
  // the light has changed. width, height [pixel] of what will be drawn; frameSeconds that the last frame took without
  // records. OpenGL splats them where it relights (RelightChoice), else the processor does. Errors of SplatsGl, once:
  // the processor splats from then on.
  [[nodiscard]] Status update(const ViewState& state, const Relighter& relighter, std::uint32_t width,
                              std::uint32_t height, double frameSeconds);

  // GLSL: bool recordIrradiance(vec3 p, vec3 n, out vec3 irradiance), false where no record reaches.
  static std::string glsl();
  // For the program in use and the viewport; null = there are none.
  static void bind(const ViewRecords* light);

  std::size_t records() const { return live_ ? live_->records().records().size() : 0; }
  std::size_t sizeBytes() const {
    return (live_ ? live_->records().sizeBytes() : 0) + (isSplattedByGl() ? splats_->sizeBytes() : 0);
  }
  bool isComplete() const { return live_ && live_->isComplete(); }
  bool isSplattedByGl() const { return live_ && live_->isDrawn(); }

 private:
  ViewRecords(const LoadedLevel& level, RayTracer tracer, GetProcAddress getProcAddress)
      : level_(level), tracer_(std::move(tracer)), getProcAddress_(std::move(getProcAddress)) {}
  void begin(const Sky& sky);
  Status choose(BackendKind backend);
  GLuint light() const { return isSplattedByGl() ? splats_->light() : light_.name(); }
  GLuint place() const { return isSplattedByGl() ? splats_->place() : place_.name(); }
  bool look(const FlyCamera& camera, std::uint32_t width, std::uint32_t height);
  bool relight(const Relighter& relighter);
  void upload();

  const LoadedLevel& level_;
  RayTracer tracer_;
  std::unique_ptr<const SurfelsOnDemand> map_;
  Context context_;
  Sky sky_;
  GetProcAddress getProcAddress_;
  std::unique_ptr<SplatsGl> splats_;  // null until OpenGL is asked for
  bool isByGl_ = false;               // from the next look on
  bool isGlOut_ = false;              // OpenGL has failed to splat
  std::optional<LivePreview> live_;
  std::optional<FlyCamera> camera_;         // that the picture is of
  std::vector<glm::vec3> radiance_, next_;  // [W/m²/sr] of the surfels, that records have
  int still_ = 0;                           // frames since the light has changed
  GlTexture light_, place_;
};

}  // namespace relume
