// SPDX-License-Identifier: MIT
// See driven_emission.h.
#include "runtime/shared/driven_emission.h"

#include "formats/decimal.h"
#include "formats/limits.h"
#include "formats/pack.h"
#include "runtime/shared/usage_error.h"

#include <glm/common.hpp>

#include <algorithm>
#include <string>

namespace relume {
namespace {

std::string text(const glm::vec3& v) { return "(" + decimal(v.x) + ", " + decimal(v.y) + ", " + decimal(v.z) + ")"; }
std::string text(const glm::uvec2& size) { return std::to_string(size.x) + " x " + std::to_string(size.y); }

std::string namesOf(const Emitters& emitters) {
  std::string names;
  for (const DrivableMaterial& m : emitters.materials) names += (names.empty() ? "\"" : ", \"") + m.name + "\"";
  return names;
}

Error noneDrivable() {
  return {ErrorCode::unsupported,
          "the bake knows no drivable material: nothing in its level emits or has extras.relume.drivable, or it is of "
          "file format 3, which has none; bake the level again"};
}

// name(): made only where something is refused.
template <class Name>
Status checkImage(const MaterialEmission& emission, const Name& name, const glm::uvec2& size) {
  if (size.x == 0)
    return usageError(name() + " has an image, but none is declared for it in RelightOptions::drivenImages");
  if (emission.image.empty()) return done();
  const std::size_t expected = std::size_t{size.x} * size.y;
  if (emission.image.size() != expected) {
    return usageError(name() + ".image has " + std::to_string(emission.image.size()) + " texels, expected " +
                      std::to_string(expected) + ", the " + text(size) + " that were declared");
  }
  for (std::size_t i = 0; i < expected; ++i) {
    if (!isRadiance(emission.image[i])) {
      return usageError(name() + ".image: texel " + std::to_string(i % size.x) + ", " + std::to_string(i / size.x) +
                        " is " + text(emission.image[i]) + ", expected 0 to " + decimal(kMaxRadiance) +
                        " in each channel");
    }
  }
  return done();
}

}  // namespace

Result<ImageSizes> declareImages(const Emitters& emitters, std::span<const DrivenImage> images,
                                 std::pmr::memory_resource* memory) {
  ImageSizes sizes(emitters.materials.size(), glm::uvec2(0u), memory);
  if (!images.empty() && emitters.materials.empty()) return noneDrivable();
  for (const DrivenImage& image : images) {
    const std::string name = "driven image of \"" + image.material + "\"";
    if (image.width < 1 || image.height < 1 || image.width > kMaxDrivenSide || image.height > kMaxDrivenSide) {
      return usageError(name + ": " + text(glm::uvec2(image.width, image.height)) + " texels, expected 1 to " +
                        std::to_string(kMaxDrivenSide) + " along a side");
    }
    bool found = false;
    for (std::size_t m = 0; m < sizes.size(); ++m) {
      if (emitters.materials[m].name != image.material) continue;
      if (sizes[m].x != 0) return usageError(name + " is declared twice");
      if (!emitters.materials[m].textured)
        return usageError(name + ": some of its meshes have no texture coordinates; a colour can drive it");
      sizes[m] = {image.width, image.height};
      found = true;
    }
    if (!found) return usageError(name + ": no such drivable material; there are " + namesOf(emitters));
  }
  return sizes;
}

Status checkEmissions(const LightSetup& setup, const Emitters& emitters, const ImageSizes& sizes, BackendKind backend) {
  const std::span<const MaterialEmission> emissions = setup.materialEmissions;
  if (emissions.empty()) return done();
  if (!setup.surfelEmission.empty())
    return usageError("light setup: surfelEmission and materialEmissions: one of them expected, both found");
  if (emitters.materials.empty()) {
    Error none = noneDrivable();
    none.message = "light setup: materialEmissions: " + none.message;
    return none;
  }
  for (std::size_t i = 0; i < emissions.size(); ++i) {
    const MaterialEmission& e = emissions[i];
    // A frame that passes allocates nothing.
    const auto name = [&] {
      std::string known = "light setup: materialEmissions[" + std::to_string(i) + "]";
      return e.material < sizes.size() ? known + " (\"" + emitters.materials[e.material].name + "\")" : known;
    };
    if (e.material >= sizes.size()) {
      return usageError(name() + ".material is " + std::to_string(e.material) + ", expected less than " +
                        std::to_string(sizes.size()) + ": " + namesOf(emitters));
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (emissions[j].material == e.material)
        return usageError(name() + " names the material of materialEmissions[" + std::to_string(j) + "] again");
    }
    if (!isRadiance(e.radiance)) {
      return usageError(name() + ".radiance is " + text(e.radiance) + ", expected 0 to " + decimal(kMaxRadiance) +
                        " in each channel");
    }
    if (e.texture != 0 && backend != BackendKind::gl) return usageError(name() + ".texture needs the OpenGL backend");
    if (e.texture != 0 && !e.image.empty())
      return usageError(name() + ": image and texture: one of them expected, both found");
    if (e.texture == 0 && e.image.empty()) continue;
    if (Status ok = checkImage(e, name, sizes[e.material]); !ok) return ok;
  }
  return done();
}

glm::vec3 clampRadiance(const glm::vec3& radiance) {
  // max() takes its first argument where the second is NaN.
  const auto clamped = [](float v) { return std::min(v > 0.0f ? v : 0.0f, kMaxRadiance); };
  return {clamped(radiance.x), clamped(radiance.y), clamped(radiance.z)};
}

DrivenEmission::DrivenEmission(const Emitters& emitters, const ImageSizes& sizes, std::pmr::memory_resource* memory)
    : emitters_(emitters),
      frame_(emitters.materials.size(), nullptr, memory),
      imageOf_(emitters.materials.size(), kNoImage, memory),
      image_(memory) {
  image_.reserve(static_cast<std::size_t>(
      std::count_if(sizes.begin(), sizes.end(), [](const glm::uvec2& size) { return size.x > 0; })));
  for (std::size_t m = 0; m < sizes.size(); ++m) {
    if (sizes[m].x == 0) continue;
    imageOf_[m] = static_cast<std::uint32_t>(image_.size());
    image_.emplace_back(sizes[m].x, sizes[m].y, memory);
  }
}

void DrivenEmission::begin(std::span<const MaterialEmission> emissions, const ParallelFor& parallelFor) {
  std::fill(frame_.begin(), frame_.end(), nullptr);
  for (const MaterialEmission& e : emissions) {
    frame_[e.material] = &e;
    if (!e.image.empty()) image_[imageOf_[e.material]].set(e.image, parallelFor);
  }
}

void DrivenEmission::end() {
  std::fill(frame_.begin(), frame_.end(), nullptr);
  for (ImagePyramid& image : image_) image.clear();
}

ImagePyramid* DrivenEmission::image(std::uint32_t material) {
  return imageOf_[material] == kNoImage ? nullptr : &image_[imageOf_[material]];
}

glm::vec3 DrivenEmission::radiance(std::uint32_t material, std::uint32_t entry) const {
  const MaterialEmission& emission = *frame_[material];
  if (emission.image.empty()) return emission.radiance;
  const ImagePyramid& image = image_[imageOf_[material]];
  const DrivableMaterial& drivable = emitters_.materials[material];
  const float level = levelOfTap(emitters_.tapWidth[entry], image.size(0).x, image.size(0).y);
  glm::vec3 sum(0.0f);
  for (std::uint32_t k = 0; k < kFootprintTaps; ++k) {
    const glm::vec2 at = unpackUnorm16x2(emitters_.tap[std::size_t{kFootprintTaps} * entry + k]);
    sum += image.sample(at, level, drivable.clampU, drivable.clampV);
  }
  return clampRadiance(emission.radiance * (sum / static_cast<float>(kFootprintTaps)));
}

std::size_t DrivenEmission::bytes() const {
  std::size_t bytes = (emitters_.surfel.size() + emitters_.tap.size() + emitters_.tapWidth.size()) * 4 +
                      frame_.size() * sizeof(void*) + imageOf_.size() * sizeof(std::uint32_t);
  for (const ImagePyramid& image : image_) bytes += image.bytes();
  return bytes;
}

}  // namespace relume
