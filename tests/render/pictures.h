// SPDX-License-Identifier: MIT
// The shipped level with a draft bake, and pictures of it.
#pragma once

#include "relume/bake/bake.h"
#include "tools/render/render_frame.h"

#include <optional>
#include <string>
#include <vector>

namespace relume::test {

const Scene& level();
const Bake& levelBake();
Bake bakeDraft(const Scene& scene);
const Camera& camera(const Scene& scene, const std::string& name);
// All lights of the level, its emitters and a sky, 128 x 72 pixels.
RenderRequest request(const Scene& scene, const Bake* made, const std::string& cameraName);
Result<RenderedFrame> drawCpu(const Scene& scene, const RenderRequest& r, int threads = 0);
#ifdef RELUME_RENDER_GL
// By both backends. Nothing where OpenGL is not there, which skips the test, or where one has failed, which fails it.
struct DrawnTwice {
  RenderedFrame cpu, gl;
};
std::optional<DrawnTwice> drawTwice(const Scene& scene, const RenderRequest& r);
#endif
// Root of the mean squared difference over the mean of `a`.
double relativeRms(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b);
// Sum of all channels.
double total(const std::vector<glm::vec3>& image);
// Means of 8 x 8 pixels: what is left is not a matter of where single rays fell.
std::vector<glm::vec3> blocks(const std::vector<glm::vec3>& image, std::uint32_t width);

}  // namespace relume::test
