// SPDX-License-Identifier: MIT
// See hemispheres_gl.h.
#include "tools/gl_scene/egl_context.h"

#include "tools/gl_scene/hemisphere_raster.h"
#include "tools/render/hemispheres_gl.h"
#include "tools/render/render_frame.h"

#include <glm/trigonometric.hpp>

#include <memory>
#include <utility>
#include <vector>

namespace relume {
namespace {

struct OwnContext {
  EglContext context;
  HemisphereRaster raster;  // goes before its context does
  ~OwnContext() { context.makeCurrent(); }
};

}  // namespace

Result<GlHemispheres> drawHemispheresByGl(const Scene& scene, std::span<const SceneLight> lights,
                                          const PreviewOptions& options, std::uint32_t shadowSize) {
  auto context = EglContext::create();
  if (!context) return context.error();
  const std::vector<Light> drawn = toRuntimeLights({lights.begin(), lights.end()});
  auto raster =
      HemisphereRaster::create(scene, drawn, {options.planeSide, glm::radians(options.planeFovDeg), shadowSize});
  if (!raster) return raster.error();
  GlHemispheres made;
  made.renderer = context->renderer();
  const std::shared_ptr<OwnContext> own(new OwnContext{std::move(*context), std::move(*raster)});
  made.draw = [own](std::span<const glm::mat4> worldFromFrame, std::span<glm::vec3> radiance,
                    std::span<float> distance) {
    own->context.makeCurrent();
    own->raster.draw(worldFromFrame, radiance, distance);
  };
  return made;
}

}  // namespace relume
