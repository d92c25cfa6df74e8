// SPDX-License-Identifier: MIT
// Light near what was edited since the bake (edited_light.h) for OpenGL: the CPU finds it, by rays, and the level's
// shader reads it.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"
#include "tools/gl_scene/edit_fields.h"
#include "tools/render/edited_light.h"
#include "tools/render/render_frame.h"

#include <optional>

namespace relume {

struct EditedGl {
  EditedLight light;
  EditFields all;
  std::optional<EditFields> straight;  // where the request has it
};

// A context of OpenGL is current. Errors of RayTracer, lightEdited() and EditFields. [request.edited holds]
Result<EditedGl> lightEditedGl(const Scene& scene, const RenderRequest& request, Context& context);

}  // namespace relume
