// SPDX-License-Identifier: MIT
// Shapes that move, in the modules that have them: what exports.json is to the others, EMSCRIPTEN_KEEPALIVE is here.
#include "context.h"
#include "relume/relume.h"

#include <emscripten.h>

static_assert(sizeof(relume_moving_mesh) == 32, "src/moving.js writes meshes as eight words");

extern "C" {

// Meshes as relume_moving_mesh has them; null with relume_web_error().
EMSCRIPTEN_KEEPALIVE relume_moving_shapes* relume_web_shapes(const relume_moving_mesh* meshes, unsigned count) {
  relume_moving_shapes* shapes = nullptr;
  relume_moving_shapes_create(relume_web_context(), meshes, count, &shapes);
  return shapes;
}

EMSCRIPTEN_KEEPALIVE void relume_web_free_shapes(relume_moving_shapes* shapes) { relume_moving_shapes_destroy(shapes); }

}  // extern "C"
