// SPDX-License-Identifier: MIT
// See check_setup.h.
#include "runtime/check_setup.h"

#include "formats/decimal.h"
#include "formats/limits.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>
#include <string>

namespace relume {
namespace {

constexpr float kMaxLight = kMaxIntensity;  // of radiances, irradiances and factors on them as well

Error refused(const std::string& what) { return Error{ErrorCode::usage, "light setup: " + what}; }

std::string text(const glm::vec3& v) { return "(" + decimal(v.x) + ", " + decimal(v.y) + ", " + decimal(v.z) + ")"; }

// Comparisons that NaN fails.
bool within(float v, float low, float high) { return v >= low && v <= high; }
bool within(const glm::vec3& v, float low, float high) {
  return within(v.x, low, high) && within(v.y, low, high) && within(v.z, low, high);
}

// What is checked, named only where it is refused: a frame that passes allocates nothing.
struct Field {
  const char* list = "";  // "lights", or "" for a field of the setup itself
  std::size_t index = 0;
  const char* name = "";

  std::string text() const {
    if (*list == '\0') return name;
    const std::string element = std::string(list) + "[" + std::to_string(index) + "]";
    return *name == '\0' ? element : element + "." + name;
  }
};

Status checkColor(const Field& field, const glm::vec3& color) {
  if (within(color, 0.0f, kMaxLight)) return done();
  return refused(field.text() + " is " + text(color) + ", expected 0 to " + decimal(kMaxLight) + " in each channel");
}

Status checkDirection(const Field& field, LightKind kind, const glm::vec3& direction) {
  const float length = glm::length(direction);
  if (std::abs(length - 1.0f) <= kDirectionTolerance) return done();
  // A struct of zeros in C is a directional light; one who meant a lamp has to hear of the kind.
  if (length == 0.0f) {
    return refused(field.text() + " is (0, 0, 0) of length 0, expected 1, for its kind is " +
                   (kind == LightKind::spot ? "spot" : "directional") +
                   ": give it a direction, or kind point, which has none");
  }
  return refused(field.text() + " is " + text(direction) + " of length " + decimal(length) +
                 ", expected 1, at most 1 % more or less: normalise it");
}

Status checkCone(std::size_t index, const Light& light) {
  if (!within(light.outerConeRad, 0.0f, std::numbers::pi_v<float>)) {
    return refused(Field{"lights", index, "outerConeRad"}.text() + " is " + decimal(light.outerConeRad) +
                   ", expected 0 to pi");
  }
  if (!within(light.innerConeRad, 0.0f, light.outerConeRad)) {
    return refused(Field{"lights", index, "innerConeRad"}.text() + " is " + decimal(light.innerConeRad) +
                   ", expected 0 to outerConeRad, " + decimal(light.outerConeRad));
  }
  return done();
}

// Fields that a kind of light does not have may hold anything.
Status checkLight(const Light& light, std::size_t index) {
  const auto field = [&](const char* name) { return Field{"lights", index, name}; };
  if (light.kind > LightKind::spot) {
    return refused(field("kind").text() + " is " + std::to_string(static_cast<std::uint32_t>(light.kind)) +
                   ", expected directional 0, point 1 or spot 2");
  }
  if (Status ok = checkColor(field("intensity"), light.intensity); !ok) return ok;
  if (light.kind != LightKind::point) {
    if (Status ok = checkDirection(field("direction"), light.kind, light.direction); !ok) return ok;
  }
  if (light.kind == LightKind::directional) return done();
  if (!within(light.positionWorld, -kMaxCoordinate, kMaxCoordinate)) {
    return refused(field("positionWorld").text() + " is " + text(light.positionWorld) +
                   ", expected coordinates within " + decimal(kMaxCoordinate) + " m");
  }
  if (!(light.range >= 0.0f) || std::isinf(light.range)) {
    return refused(field("range").text() + " is " + decimal(light.range) +
                   ", expected a length in metres, or 0 for no limit");
  }
  return light.kind == LightKind::spot ? checkCone(index, light) : done();
}

// A span that must be empty or hold `size` radiometric colours.
Status checkColors(const char* name, std::span<const glm::vec3> colors, std::size_t size) {
  if (colors.empty()) return done();
  if (colors.size() != size) {
    return refused(std::string(name) + " has " + std::to_string(colors.size()) + " elements, expected none or " +
                   std::to_string(size));
  }
  for (std::size_t i = 0; i < size; ++i) {
    if (Status ok = checkColor({name, i, ""}, colors[i]); !ok) return ok;
  }
  return done();
}

}  // namespace

Status checkSetup(const LightSetup& setup, std::size_t surfelCount, std::size_t skyPatchCount) {
  for (std::size_t i = 0; i < setup.lights.size(); ++i) {
    if (Status ok = checkLight(setup.lights[i], i); !ok) return ok;
  }
  if (Status ok = checkColors("surfelIrradiance", setup.surfelIrradiance, surfelCount); !ok) return ok;
  if (Status ok = checkColors("surfelEmission", setup.surfelEmission, surfelCount); !ok) return ok;
  if (Status ok = checkColors("skyPatches", setup.skyPatches, skyPatchCount); !ok) return ok;
  if (Status ok = checkColor({"", 0, "emissionScale"}, setup.emissionScale); !ok) return ok;
  if (Status ok = checkColor({"", 0, "skyRadiance"}, setup.skyRadiance); !ok) return ok;
  if (!within(setup.bounceScale, 0.0f, 1.0f))
    return refused("bounceScale is " + decimal(setup.bounceScale) + ", expected 0 to 1");
  return done();
}

Status checkMovingParts(const LightSetup& setup, std::uint32_t most) {
  const std::size_t count = setup.movingParts.size();
  if (count > most)
    return refused("movingParts has " + std::to_string(count) + " elements, expected at most " + std::to_string(most) +
                   ", as RelightOptions::movingParts says");
  if (count > 0 && setup.movingShapes == nullptr) return refused("movingParts without movingShapes");
  for (std::size_t i = 0; i < count; ++i) {
    const MovingPart& part = setup.movingParts[i];
    if (part.shape >= setup.movingShapes->count())
      return refused(Field{"movingParts", i, "shape"}.text() + " is " + std::to_string(part.shape) + ", there are " +
                     std::to_string(setup.movingShapes->count()));
    for (int column = 0; column < 4; ++column) {
      if (!isWithin(part.toWorld[column], kMaxLevelCoordinate))
        return refused(Field{"movingParts", i, "toWorld"}.text() + " has " + text(part.toWorld[column]) +
                       " as column " + std::to_string(column) + ", expected numbers within " +
                       decimal(kMaxLevelCoordinate));
    }
  }
  return done();
}

void normaliseLights(std::span<const Light> lights, std::pmr::vector<Light>& normalised) {
  normalised.assign(lights.begin(), lights.end());
  for (Light& light : normalised) {
    if (light.kind != LightKind::point) light.direction = glm::normalize(light.direction);
  }
}

LightSetup withoutFunctions(const LightSetup& setup) {
  LightSetup copy;
  copy.surfelIrradiance = setup.surfelIrradiance;
  copy.surfelIrradianceOnGpu = setup.surfelIrradianceOnGpu;
  copy.emissionScale = setup.emissionScale;
  copy.surfelEmission = setup.surfelEmission;
  copy.materialEmissions = setup.materialEmissions;
  copy.skyRadiance = setup.skyRadiance;
  copy.skyPatches = setup.skyPatches;
  copy.bounceScale = setup.bounceScale;
  copy.movingParts = setup.movingParts;
  copy.movingShapes = setup.movingShapes;
  return copy;
}

}  // namespace relume
