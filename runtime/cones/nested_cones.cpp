// SPDX-License-Identifier: MIT
// See nested_cones.h.
#include "runtime/cones/nested_cones.h"

#include "runtime/cones/cone_march.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

namespace relume {

Status NestedMips::update(std::span<const VoxelVolume> volumes) {
  try {
    mips_.resize(volumes.size(), RadianceMips(directions_));
  } catch (const std::bad_alloc&) {
    mips_.clear();
    return Error{ErrorCode::memory, "cones: memory ran out; fewer cells take less"};
  }
  for (std::size_t level = 0; level < volumes.size(); ++level) {
    if (Status ok = mips_[level].update(volumes[level]); !ok) {
      mips_.clear();
      return ok;
    }
  }
  return done();
}

std::vector<PassTime> NestedMips::passTimes() const {
  double ms = 0.0;
  for (const RadianceMips& each : mips_) ms += each.passTimes()[0].ms;
  return {{"mips", ms}};
}

std::size_t NestedMips::sizeBytes() const {
  std::size_t bytes = 0;
  for (const RadianceMips& each : mips_) bytes += each.sizeBytes();
  return bytes;
}

NestedCones::NestedCones(std::span<const VoxelVolume> volumes, std::span<const RadianceMips> mips)
    : volumes_(volumes), mips_(mips) {}

ConeLight NestedCones::trace(const Cone& cone) const {
  if (volumes_.size() == 1) return mips_.front().trace(volumes_.front(), cone);
  if (!isValidCone(cone)) return {};
  // Lengths along the cone are in voxels of the innermost volume, places in those of each.
  const std::size_t count = volumes_.size();
  const float cosine = glm::dot(cone.direction, cone.normal), widening = std::min(cone.spread, cosine / kConePlane),
              voxel = volumes_.back().grid().voxel, outermost = static_cast<float>(1u << (count - 1));
  std::array<glm::vec3, kMaxCascades> origin;
  for (std::size_t level = 0; level < count; ++level) origin[level] = volumes_[level].grid().toGrid(cone.originWorld);
  float t = 0.0f, end = std::numeric_limits<float>::infinity();
  clipToGrid(volumes_.front().grid(), origin[0], cone.direction, t, end);
  t *= outermost;
  end *= outermost;

  ConeLight light;
  while (t < end && light.clear > kConeSpent) {
    // The innermost volume that has the sample says how long it is.
    glm::vec4 depth(0.0f);  // over the whole step
    float rest = 1.0f, advance = 0.0f, step = 0.0f, middle = 0.0f;
    for (std::size_t level = count; level-- > 0 && rest > 0.0f;) {
      const float side = static_cast<float>(1u << (count - 1 - level));  // of a voxel
      const float widest = static_cast<float>(1u << mips_[level].levels());
      const float width = std::clamp(t / side * widening, 1.0f, widest);
      if (rest == 1.0f) {
        advance = kConeStep * width * side;
        step = std::min(advance, end - t);
        middle = t + 0.5f * step;
      }
      const float own = middle / side;
      const glm::vec3 place =
          origin[level] + own * cone.direction + std::max(0.0f, kConeClear - own * cosine) * cone.normal;
      const float share = level > 0 ? volumes_[level].reach().share(place, width) : 1.0f;
      if (!(share > 0.0f)) continue;
      const glm::vec4 read = mips_[level].read(volumes_[level], width > 1.0f ? std::log2(width) : 0.0f, place,
                                               cone.direction, own < kConeNear ? &origin[level] : nullptr);
      depth += rest * share * (step / (side * width)) * read;
      rest *= 1.0f - share;
    }
    t += advance;
    if (!(depth.w > 0.0f)) continue;
    const float blocked = light.clear * -std::expm1(-depth.w);
    light.radiance += (blocked / depth.w) * glm::vec3(depth);
    light.occlusion += blocked / (1.0f + cone.falloff * middle * voxel);
    light.clear -= blocked;
  }
  return endedCone(light);
}

}  // namespace relume
