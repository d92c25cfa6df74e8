// SPDX-License-Identifier: MIT
// See edited_gl.h.
#include "tools/gl_scene/egl_context.h"

#include "bake/rays/ray_tracer.h"
#include "relume/bake/options.h"
#include "tools/render/edited_gl.h"

#include <utility>

namespace relume {
namespace {

Result<EditFields> fieldsOf(const EditedLight& light, const std::optional<NestedCaches> LiveView::*part) {
  auto fields = EditFields::create();
  if (!fields) return fields.error();
  fields->place(light.blend);
  if (Status ok = fields->uploadBefore(texelsOf(*(light.before.*part))); !ok) return ok.error();
  if (Status ok = fields->uploadAfter(texelsOf(*(light.after.*part))); !ok) return ok.error();
  return fields;
}

}  // namespace

Result<EditedGl> lightEditedGl(const Scene& scene, const RenderRequest& request, Context& context) {
  const auto tracer =
      RayTracer::create(scene, BakeOptions{}.embreeIsa, context, RayStructure::thorough, RayGeometry::drawn);
  if (!tracer) return tracer.error();
  auto light = lightEdited(*tracer, request, context);
  if (!light) return light.error();
  if (context.cancelled()) return cancelledError();
  auto all = fieldsOf(*light, &LiveView::all);
  if (!all) return all.error();
  EditedGl edits{std::move(*light), std::move(*all), {}};
  if (!request.straight) return edits;
  auto straight = fieldsOf(edits.light, &LiveView::straight);
  if (!straight) return straight.error();
  edits.straight.emplace(std::move(*straight));
  return edits;
}

}  // namespace relume
