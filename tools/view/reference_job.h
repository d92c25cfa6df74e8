// SPDX-License-Identifier: MIT
// The view of a moment path traced on a thread of its own, and held against what the window showed: where the relit
// light is too bright (leaks) and where it is too dark.
#pragma once

#include "relume/bake/context.h"
#include "relume/result.h"
#include "tools/render/trace_irradiance.h"
#include "tools/view/loaded_level.h"
#include "tools/view/view_state.h"

#include <glm/vec3.hpp>

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace relume {

// Irradiance / pi of the window and of the reference, pixel by pixel.
struct HeatPicture {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // sRGB [Size 3 width height] red: too bright, blue: too dark, by the reference's mean
  double error = 0.0;             // sum of the differences' sizes over the reference's sum
};
// [Size shown == reference == width * height] row 0 on top
HeatPicture heatOf(std::uint32_t width, std::uint32_t height, const std::vector<glm::vec3>& shown,
                   const std::vector<glm::vec3>& reference);

class ReferenceJob {
 public:
  static constexpr std::uint32_t kWidth = 192;  // [pixel]

  // Starts at once. shown: irradiance / pi that the viewer has by now. [Size kWidth * height]
  ReferenceJob(LevelPtr level, const ViewState& state, std::uint32_t height, std::vector<glm::vec3> shown);
  // Cancels, and waits until the work has stopped.
  ~ReferenceJob();
  ReferenceJob(const ReferenceJob&) = delete;
  ReferenceJob& operator=(const ReferenceJob&) = delete;

  double progress() const { return progress_.load(std::memory_order_relaxed); }  // [0..1]
  void cancel() { context_.cancel(); }
  bool isCancelled() const { return context_.cancelled(); }
  // What came of it, once; nothing before it is over.
  std::optional<Result<HeatPicture>> takeResult();

 private:
  void run(const LevelPtr& level, const ViewState& state, const std::vector<glm::vec3>& shown, std::uint32_t height);

  Context context_;
  std::atomic<double> progress_{0.0};
  std::mutex mutex_;  // of the result
  std::optional<Result<HeatPicture>> result_;
  std::thread thread_;
};

}  // namespace relume
