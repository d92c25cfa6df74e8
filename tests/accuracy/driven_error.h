// SPDX-License-Identifier: MIT
// How far the light of driven materials is from a path tracer's: one material at a time, all else dark.
#pragma once

#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "tests/accuracy/compare_images.h"
#include "tools/render/drive_scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace relume {

struct DrivenError {
  ImageDifference difference;          // of DiffDir + DiffInd, the light of the emitter and its bounces
  double drivenMs = 0, surfelsMs = 0;  // [ms] of step 2, with the material driven, and with nothing driven
  std::size_t emissionBytes = 0;       // of the runtime's buffers
};

// Draw and trace the view of a camera. `scene` and the bake of it stay as they are.
Result<DrivenError> measureDriven(const Scene& scene, const Bake& bake, const DrivenMaterial& driven,
                                  const std::string& camera, std::uint32_t width, std::uint32_t height,
                                  std::uint32_t samplesPerPixel);

// An image that is dark but for two discs and a bar: power where most of it is not. [Size width * height]
std::vector<glm::vec3> drawSigns(std::uint32_t width, std::uint32_t height, float brightness);

}  // namespace relume
