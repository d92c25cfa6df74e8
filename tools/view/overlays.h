// SPDX-License-Identifier: MIT
// What is laid over the level to look at a bake: surfels in their light or by cluster, caches as spheres, the links of
// a cache, the light map.
#pragma once

#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "tools/view/clusters.h"
#include "tools/view/discs.h"
#include "tools/view/lines.h"
#include "tools/view/spheres.h"
#include "tools/view/view_state.h"

#include <glm/mat4x4.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace relume {

class Overlays {
 public:
  // failed: a shader did not compile. The bake must outlive it.
  static Result<Overlays> create(const Bake& bake);

  struct Target {
    glm::mat4 clipFromWorld{1.0f};
    std::uint32_t width = 0, height = 0;  // [pixel]
    bool encode = false;
  };
  // relighter: whose light is shown; inputs: where the light map of it is; picked: whose links are shown, nothing =
  // none.
  void draw(const ViewState& state, const Relighter& relighter, const GlResolveInputs& inputs,
            const std::optional<glm::vec3>& picked, const Target& target) const;

 private:
  explicit Overlays(const Bake& bake) : bake_(&bake), links_(bake) {}
  std::vector<glm::vec3> surfelColors(const Relighter& relighter) const;
  void drawLinks(const ViewState& state, const glm::vec3& picked, const Target& target) const;
  void drawLightmap(const ViewState& state, const GlResolveInputs& inputs, const Target& target) const;

  const Bake* bake_;
  ClusterLinks links_;
  std::optional<Discs> surfels_;
  std::optional<Spheres> caches_;
  std::optional<Lines> lines_;
  GlProgram lightmapProgram_;
  GlVertexArray nothing_;
};

}  // namespace relume
