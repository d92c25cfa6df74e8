// SPDX-License-Identifier: MIT
// A baked level that is being edited: near the parts that were moved, added or taken away since the bake, light without
// a bake (live_light.h) says what has changed; everywhere else light is the bake's, to the bit, until the level is
// baked again.
//
//   EditBlend::create()   from the bounds of the changed parts, where they were and where they are: once an edit
//   share()               at a place: how much of what has changed counts, 0 far from them and 1 near
//   blendEdited()         the bake's light there, corrected by what the edit has done to live light
//
// Two LiveLights run beside the Relighter: one of the level as it was baked, one of the level as it is now. Both take
// the lights and shadows that the Relighter takes, those of the level as it is: a bake's surfels are lit by the frame's
// shadows as well. What live light errs by is in both, and cancels. Surfaces of changed parts have nothing in the bake:
// they are lit by the second alone, kEditedPart. docs/notes/edits.md has errors and times.
#pragma once

#include "relume/result.h"
#include "relume/vectors.h"

#include <glm/vec4.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kMaxEditBoxes = 32;

// The box of a part in the world, where it was or where it is. [m]
struct EditBounds {
  glm::vec3 min{0.0f}, max{0.0f};
  // [0..1e8] as far as this at least its change counts in full: of a part that emits, as far as its light goes.
  float reach = 0.0f;
};

struct EditBlendOptions {
  // [m] (0..1e8] edge of a voxel of the live lights: the longest side of their box / (4 LiveLightOptions::cells).
  float voxel = 0.1f;
  // [m] [0..1e8] how far from a box its change counts in full; 0 = kEditReach times half of its diagonal, two cells of
  // the live lights at least. A part fills no more than 1 / kEditReach² of what is seen from there.
  float reach = 0.0f;
  // [m] [0..1e8] within which it fades beyond that; 0 = as wide as the reach.
  float fade = 0.0f;
};

inline constexpr float kEditReach = 3.0f;

struct EditShare {
  float change = 0.0f;   // [0..1] of what live light says has changed
  float contact = 0.0f;  // [0..1] of live light itself: where the bake has what lay under the part, or was hidden by it
};

// Of the surfaces of changed parts, wherever they are.
inline constexpr EditShare kEditedPart{1.0f, 1.0f};

class EditBlend {
 public:
  // Boxes beyond kMaxEditBoxes are joined, those first that grow least. usage: a box that is not finite, within 1e8 m
  // and right side out, or its reach is out of its range, named by its index; an option out of its range. memory: it
  // ran out.
  static Result<EditBlend> create(std::span<const EditBounds> changed, const EditBlendOptions& options = {});
  EditBlend() = default;  // nothing has changed

  // At a place. Continuous; 0 where the place is not finite.
  [[nodiscard]] EditShare share(const glm::vec3& positionWorld) const;
  [[nodiscard]] bool isEmpty() const { return boxes_.empty(); }

  // GLSL of every version that Relighter::textureResolveGlsl() is valid in, the same in shaders:
  //   vec2 relumeEditShare(vec3 positionWorld)   change, contact
  //   vec3 relumeBlendEdited(vec3 baked, vec3 before, vec3 after, vec2 share)
  // by uniform int relumeEditBoxes, uniform float relumeEditVoxel and uniform vec4 relumeEditBox[2 * kMaxEditBoxes]
  // [Size 2 * relumeEditBoxes are read]. Live light need not be read where share.x is 0.
  static std::string glsl();
  // Of relumeEditBox, two for each box: least corner, reach; greatest corner, 1 / fade. [Size 2 * relumeEditBoxes]
  [[nodiscard]] std::span<const glm::vec4> boxes() const { return boxes_; }
  [[nodiscard]] float voxel() const { return voxel_; }

 private:
  std::vector<glm::vec4> boxes_;
  float voxel_ = 0.1f;
};

// Irradiance [W/m²] of a bake of the level before an edit, corrected by live light before and after it, channel by
// channel: what live light has lost scales the bake's, what it has gained is added. `baked` to the bit where the change
// counts nothing. Finite and never negative where all three are from 0 to 1e38.
[[nodiscard]] glm::vec3 blendEdited(const glm::vec3& baked, const glm::vec3& before, const glm::vec3& after,
                                    const EditShare& share);

}  // namespace relume
