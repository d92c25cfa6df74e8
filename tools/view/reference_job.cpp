// SPDX-License-Identifier: MIT
// See reference_job.h.
#include "tools/view/reference_job.h"

#include "formats/color.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/images/diverging.h"
#include "tools/render/view_options.h"
#include "tools/view/light_set.h"

#include <glm/ext/matrix_transform.hpp>

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

namespace relume {
namespace {

constexpr std::uint32_t kSamples = 64, kAllBounces = 16;

// The level as it is shown: with what its materials emit now, and its objects where they are.
Scene shownScene(const LoadedLevel& level, const ViewState& state) {
  Scene scene = level.scene;
  for (std::uint32_t m = 0; m < scene.materials.size(); ++m) {
    const ShownEmission shown = shownEmission(level, state, m);
    scene.materials[m].emission = shown.radiance;
    scene.materials[m].emissionTexture = shown.texture;
  }
  const std::vector<MovingNode> nodes = movingNodes(scene, level.movable());
  for (std::size_t k = 0; k < nodes.size() && k < state.objects.size(); ++k) {
    const glm::mat4 moved = glm::translate(glm::mat4(1.0f), state.objects[k].position - state.objects[k].home);
    for (std::uint32_t i = 0; i < nodes[k].instanceCount; ++i) {
      glm::mat4& toWorld = scene.instances[nodes[k].firstInstance + i].toWorld;
      toWorld = moved * toWorld;
    }
  }
  return scene;
}

}  // namespace

HeatPicture heatOf(std::uint32_t width, std::uint32_t height, const std::vector<glm::vec3>& shown,
                   const std::vector<glm::vec3>& reference) {
  HeatPicture heat{width, height, {}, 0.0};
  double sum = 0.0, difference = 0.0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    sum += static_cast<double>(luminance(reference[i]));
    difference += std::abs(static_cast<double>(luminance(shown[i]) - luminance(reference[i])));
  }
  heat.error = sum > 0.0 ? difference / sum : 0.0;
  const auto unit = static_cast<float>(sum / static_cast<double>(std::max<std::size_t>(reference.size(), 1)));
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const float t = unit > 0.0f ? (luminance(shown[i]) - luminance(reference[i])) / unit : 0.0f;
    const glm::vec3 color = diverging(t);
    for (int c = 0; c < 3; ++c) heat.rgb.push_back(static_cast<std::uint8_t>(std::lround(255.0f * color[c])));
  }
  return heat;
}

ReferenceJob::ReferenceJob(LevelPtr level, const ViewState& state, std::uint32_t height, std::vector<glm::vec3> shown) {
  context_.onProgress = [this](std::string_view, double fraction) {
    progress_.store(fraction, std::memory_order_relaxed);
    return true;
  };
  thread_ = std::thread(
      [this, level = std::move(level), state, height, shown = std::move(shown)] { run(level, state, shown, height); });
}

ReferenceJob::~ReferenceJob() {
  cancel();
  thread_.join();
}

void ReferenceJob::run(const LevelPtr& level, const ViewState& state, const std::vector<glm::vec3>& shown,
                       std::uint32_t height) {
  Result<HeatPicture> result = cancelledError();
  try {
    const FlyCamera& fly = state.camera;
    const Camera camera = lookAt(fly.position, fly.position + fly.forward(), fly.yfovRad);
    TraceOptions options;
    options.width = kWidth;
    options.height = height;
    options.samplesPerPixel = kSamples;
    options.maxBounces = state.bounces > 0 ? static_cast<std::uint32_t>(state.bounces) : kAllBounces;
    options.sky = state.sky;
    const Scene scene = shownScene(*level, state);
    auto reference = traceIrradiance(scene, camera, sceneLightsOn(state.lights), options, context_);
    if (reference) {
      result = heatOf(kWidth, height, shown, *reference);
    } else {
      result = reference.error();
    }
  } catch (const std::exception& e) {
    result = Error{ErrorCode::failed, std::string("reference: ") + e.what()};
  }
  const std::lock_guard lock(mutex_);
  result_.emplace(std::move(result));
}

std::optional<Result<HeatPicture>> ReferenceJob::takeResult() {
  const std::lock_guard lock(mutex_);
  return std::exchange(result_, std::nullopt);
}

}  // namespace relume
