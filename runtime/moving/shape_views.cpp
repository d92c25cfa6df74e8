// SPDX-License-Identifier: MIT
// See shape_views.h.
#include "runtime/moving/shape_views.h"

#include "formats/frame_about.h"
#include "runtime/moving/moving_shape.h"
#include "runtime/voxels/march.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace relume {
namespace {

constexpr float kRoundShare = 0.8f;  // of the sphere's disc
constexpr int kRaysAcross = 16;      // on the square around the disc

// How many rays of a view meet each patch; the last counts those that meet none that faces them.
struct Seen {
  std::vector<std::uint32_t> rays;
  std::uint32_t sent = 0, met = 0;
  float depth = 0.0f;
};

void lookAlong(const MovingShape& shape, const glm::vec3& toViewer, Seen& seen) {
  const glm::mat3 frame = frameAbout(toViewer);
  std::fill(seen.rays.begin(), seen.rays.end(), 0u);
  seen.sent = seen.met = 0;
  seen.depth = 0.0f;
  for (int k = 0; k < kRaysAcross * kRaysAcross; ++k) {
    const int column = k % kRaysAcross, row = k / kRaysAcross;
    const float x = (2.0f * static_cast<float>(column) + 1.0f) / kRaysAcross - 1.0f,
                y = (2.0f * static_cast<float>(row) + 1.0f) / kRaysAcross - 1.0f;
    if (x * x + y * y > 1.0f) continue;
    ++seen.sent;
    const glm::vec3 origin = shape.centre + shape.radius * (x * frame[0] + y * frame[1] + 2.0f * toViewer);
    const glm::vec3 way = -toViewer / shape.grid.voxel;  // [voxels/m]
    const MarchHit hit =
        VoxelMarch(shape.grid, shape.bits.data(), shape.grid.toGrid(origin), way).first(4.0f * shape.radius);
    if (!hit.found) continue;
    ++seen.met;
    seen.depth += 2.0f * shape.radius - hit.t;
    const std::uint32_t patch = shape.patchToward(hit.voxel, way);
    ++seen.rays[patch == kNoPatch ? shape.patch.size() : patch];
  }
}

}  // namespace

void makeViews(MovingShape& shape) {
  Seen seen;
  seen.rays.resize(shape.patch.size() + 1);
  shape.view.assign(kViews, ShapeView{});
  for (std::uint32_t v = 0; v < kViews; ++v) {
    lookAlong(shape, directionOfView(v), seen);
    if (seen.met == 0) continue;
    ShapeView& view = shape.view[v];
    view.share = static_cast<float>(seen.met) / static_cast<float>(seen.sent);
    view.depth = seen.depth / static_cast<float>(seen.met);
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < kViewPatches; ++i) {
      const auto most = std::max_element(seen.rays.begin(), seen.rays.end());
      const auto patch = static_cast<std::uint32_t>(most - seen.rays.begin());
      view.patch[i] = patch == shape.patch.size() ? kNoPatch : patch;
      view.weight[i] = static_cast<float>(*most);
      kept += *most;
      *most = 0;
    }
    for (float& weight : view.weight) weight /= static_cast<float>(kept);
  }
  float least = 1.0f, sum = 0.0f;
  for (const ShapeView& view : shape.view) {
    least = std::min(least, view.share);
    sum += view.share;
  }
  if (least > kRoundShare) shape.ball = shape.radius * std::sqrt(sum / kViews);
}

}  // namespace relume
