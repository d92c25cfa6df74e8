// SPDX-License-Identifier: MIT
// See render_tiles.h.
#include "tools/render/render_tiles.h"

#include "bake/scene/camera_rays.h"

#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>

namespace relume {

std::vector<Tile> tilesOf(const RenderRequest& request, std::uint32_t samples) {
  const std::uint32_t side = std::max(kRenderTile / samples, 1u);
  std::vector<Tile> tiles;
  for (std::uint32_t y = 0; y < request.height; y += side) {
    for (std::uint32_t x = 0; x < request.width; x += side)
      tiles.push_back({x, y, std::min(side, request.width - x), std::min(side, request.height - y)});
  }
  return tiles;
}

LevelView tileView(const RenderRequest& request, const GlLevel& level, const Tile& tile) {
  const CameraRays rays(request.camera, request.width, request.height);
  const glm::mat4 view = glm::lookAt(glm::vec3(0.0f), rays.forward, glm::normalize(rays.up));
  float far = 0.0f, nearest = 0.0f;
  for (int i = 0; i < 8; ++i) {
    const glm::vec3 corner((i & 1) ? level.boundsMax().x : level.boundsMin().x,
                           (i & 2) ? level.boundsMax().y : level.boundsMin().y,
                           (i & 4) ? level.boundsMax().z : level.boundsMin().z);
    const float along = glm::dot(corner - rays.origin, rays.forward);
    far = std::max(far, along);
    nearest = i == 0 ? along : std::min(nearest, along);
  }
  far = 1.01f * far + 0.1f;
  // Levels of a few centimetres are not cut off, whatever the camera says.
  const float across = glm::distance(level.boundsMin(), level.boundsMax());
  const float near =
      std::max({std::min({request.camera.znear, 0.05f, 0.02f * across}), 1e-4f * far, 0.99f * nearest - 0.1f});
  const float halfWidth = glm::length(rays.right), halfHeight = glm::length(rays.up);
  const glm::mat4 project = rays.orthographic ? glm::ortho(-halfWidth, halfWidth, -halfHeight, halfHeight, 0.0f, far)
                                              : glm::frustum(-halfWidth * near, halfWidth * near, -halfHeight * near,
                                                             halfHeight * near, near, far);

  // Stretch the tile's part of clip space over the whole of it.
  const glm::vec2 size(request.width, request.height);
  const glm::vec2 scale = size / glm::vec2(tile.width, tile.height);
  const glm::vec2 centre = glm::vec2(tile.x, tile.y) + 0.5f * glm::vec2(tile.width, tile.height);
  const glm::vec2 ndc(2.0f * centre.x / size.x - 1.0f, 1.0f - 2.0f * centre.y / size.y);
  const glm::mat4 stretch =
      glm::scale(glm::mat4(1.0f), glm::vec3(scale, 1.0f)) * glm::translate(glm::mat4(1.0f), glm::vec3(-ndc, 0.0f));
  return {rays.origin, stretch * project * view};
}

}  // namespace relume
