// SPDX-License-Identifier: MIT
// See spline_prefilter.h.
#include "tests/measure/spline_prefilter.h"

#include <vector>

namespace relume::test {
namespace {

// Solve for a line of `count` points, `step` numbers apart. ratio: scratch. [Size ratio >= count]
void prefilterLine(float* values, std::size_t step, std::size_t count, std::span<float> ratio) {
  if (count < 2) return;
  // The border's neighbour beyond is itself, which adds 1 to its 4.
  float diagonal = 5.0f;
  values[0] *= 6.0f;
  for (std::size_t i = 1; i < count; ++i) {
    ratio[i - 1] = 1.0f / diagonal;
    diagonal = (i + 1 == count ? 5.0f : 4.0f) - ratio[i - 1];
    values[i * step] = 6.0f * values[i * step] - ratio[i - 1] * values[(i - 1) * step];
  }
  ratio[count - 1] = 1.0f / diagonal;
  values[(count - 1) * step] *= ratio[count - 1];
  for (std::size_t i = count - 1; i > 0; --i)
    values[(i - 1) * step] = (values[(i - 1) * step] - values[i * step]) * ratio[i - 1];
}

}  // namespace

void prefilterSpline(std::span<float> values, const glm::uvec3& resolution, std::size_t stride) {
  const std::size_t steps[] = {stride, stride * resolution.x, stride * resolution.x * resolution.y};
  std::vector<float> ratio(std::size_t{resolution.x} + resolution.y + resolution.z);
  for (int axis = 0; axis < 3; ++axis) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (std::size_t j = 0; j < resolution[b]; ++j) {
      for (std::size_t k = 0; k < resolution[c]; ++k) {
        float* line = values.data() + j * steps[b] + k * steps[c];
        for (std::size_t i = 0; i < stride; ++i) prefilterLine(line + i, steps[axis], resolution[axis], ratio);
      }
    }
  }
}

}  // namespace relume::test
