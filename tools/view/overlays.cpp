// SPDX-License-Identifier: MIT
// See overlays.h.
#include "tools/view/overlays.h"

#include "tools/gl_scene/gl_program.h"
#include "tools/view/display.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

// [stops] Of colours that are no light: what the screen's shoulder takes.
float flatExposure(bool encode) { return encode ? 1.0f : 0.0f; }

const char* kLightmapVertex = R"(#version 430
out vec2 uv;
void main() {
  uv = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
}
)";

// Mean radiance of the texels' caches: coefficient 0 of Y, Co, Cg times y_0^0.
const char* kLightmapMain = R"(
in vec2 uv;
layout(binding = 0) uniform sampler2DArray lightY;
layout(binding = 1) uniform sampler2DArray lightCo;
layout(binding = 2) uniform sampler2DArray lightCg;
out vec4 outColor;
void main() {
  vec3 at = vec3(uv.x, 1.0 - uv.y, 0.0);
  vec3 c = 0.2820948 * vec3(texture(lightY, at).x, texture(lightCo, at).x, texture(lightCg, at).x);
  float t = c.x - c.z;
  outColor = vec4(display(vec3(t + c.y, c.x + c.z, t - c.y)), 1.0);
}
)";

float surfelRadius(const Surfels& surfels) { return std::sqrt(surfels.areaEach / std::numbers::pi_v<float>); }

}  // namespace

Result<Overlays> Overlays::create(const Bake& bake) {
  auto lightmapProgram = linkProgram("light map", kLightmapVertex, "#version 430\n" + displayGlsl() + kLightmapMain);
  if (!lightmapProgram) return lightmapProgram.error();
  auto surfels = Discs::create(bake.surfels.positionWorld, bake.surfels.normal);
  if (!surfels) return surfels.error();
  auto caches = Spheres::create(bake);
  if (!caches) return caches.error();
  auto lines = Lines::create();
  if (!lines) return lines.error();
  Overlays overlays(bake);
  overlays.lightmapProgram_ = std::move(*lightmapProgram);
  overlays.surfels_.emplace(std::move(*surfels));
  overlays.caches_.emplace(std::move(*caches));
  overlays.lines_.emplace(std::move(*lines));
  overlays.nothing_ = GlVertexArray::make();
  return overlays;
}

void Overlays::draw(const ViewState& state, const Relighter& relighter, const GlResolveInputs& inputs,
                    const std::optional<glm::vec3>& picked, const Target& target) const {
  const glm::vec3& eye = state.camera.position;
  const float radius = 0.9f * surfelRadius(bake_->surfels);
  if (state.shows(Overlay::surfels))
    surfels_->draw(surfelColors(relighter), radius, target.clipFromWorld, eye, state.exposure, target.encode);
  if (state.shows(Overlay::clusters)) {
    std::vector<glm::vec3> colors;
    for (const std::uint32_t node : clustersAtLevel(*bake_, static_cast<std::uint32_t>(state.clusterLevel)))
      colors.push_back(clusterColor(node));
    surfels_->draw(colors, radius, target.clipFromWorld, eye, flatExposure(target.encode), target.encode);
  }
  if (state.shows(Overlay::caches)) caches_->draw(relighter, target.clipFromWorld, eye, state.exposure, target.encode);
  if (state.shows(Overlay::links) && picked) drawLinks(state, *picked, target);
  if (state.shows(Overlay::lightmap) && bake_->caches.lightmap.width > 0) drawLightmap(state, inputs, target);
}

// Radiance of each surfel: radiosity over pi.
std::vector<glm::vec3> Overlays::surfelColors(const Relighter& relighter) const {
  const std::vector<glm::vec3> radiosity = relighter.nodeRadiosity();
  std::vector<glm::vec3> colors(bake_->surfels.count());
  for (std::size_t s = 0; s < colors.size(); ++s)
    colors[s] = radiosity[bake_->hierarchy.leafNode[s]] * std::numbers::inv_pi_v<float>;
  return colors;
}

// The clusters that the picked point's cache reads, each in a colour of its own with a line to it (PIC Fig. 4). What it
// does not read has no disc. Lines to the sky are short.
void Overlays::drawLinks(const ViewState& state, const glm::vec3& picked, const Target& target) const {
  const auto cache = links_.cacheAt(picked, state.camera.position);
  if (!cache) return;
  const std::vector<DrawnLink> links = links_.linksOf(*cache);
  std::vector<glm::vec3> colors;
  for (const std::uint32_t node : links_.clustersOf(links))
    colors.push_back(node == ClusterLinks::kNoNode ? kHiddenDisc : clusterColor(node));
  surfels_->draw(colors, 0.9f * surfelRadius(bake_->surfels), target.clipFromWorld, state.camera.position,
                 flatExposure(target.encode), target.encode);

  constexpr float kSkyLine = 1.5f;  // [m]
  std::vector<LinePoint> points;
  const glm::vec3 from = bake_->caches.positionWorld[*cache];
  for (const DrawnLink& link : links) {
    const glm::vec3 color = clusterColor(link.node);
    points.push_back({from, color});
    points.push_back({link.isSky ? from + kSkyLine * link.centre : link.centre, color});
  }
  // Also where the level is in front of them: a cache may be behind what is seen.
  glDisable(GL_DEPTH_TEST);
  lines_->draw(points, target.clipFromWorld, flatExposure(target.encode), target.encode);
  glEnable(GL_DEPTH_TEST);
}

// The light map in the lower right corner.
void Overlays::drawLightmap(const ViewState& state, const GlResolveInputs& inputs, const Target& target) const {
  const auto side = static_cast<GLsizei>(std::min(target.width, target.height) * 2 / 3);
  glViewport(static_cast<GLint>(target.width) - side, 0, side, side);
  glDisable(GL_DEPTH_TEST);
  glUseProgram(lightmapProgram_.name());
  setDisplay(state.exposure, target.encode);
  const GLuint textures[] = {inputs.lightmapY, inputs.lightmapCo, inputs.lightmapCg};
  for (GLuint i = 0; i < 3; ++i) {
    glActiveTexture(GL_TEXTURE0 + i);
    glBindTexture(GL_TEXTURE_2D_ARRAY, textures[i]);
  }
  glActiveTexture(GL_TEXTURE0);
  glBindVertexArray(nothing_.name());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glBindVertexArray(0);
  glEnable(GL_DEPTH_TEST);
}

}  // namespace relume
