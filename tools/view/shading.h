// SPDX-License-Identifier: MIT
// The programs that shade the level in the window, one for each kind of view, made when it is first shown: what a view
// does not show, its program does not compute.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"
#include "tools/view/view_state.h"

#include <compare>
#include <map>

namespace relume {

// What of a ViewState decides on the code of its shading. Of what a mode takes no notice of, nothing is set.
struct ShadingKind {
  ViewMode mode = ViewMode::full;
  bool gloss = false;    // surfaces mirror as their materials say
  bool mirrors = false;  // they do by ViewState::reflectance and roughness
  bool records = false;  // light over links may come from records
  bool cones = false;    // cones have found what is mirrored, or how open surroundings are
  bool edited = false;   // live light corrects the bake's where it was edited: Viewer says
  auto operator<=>(const ShadingKind&) const = default;
};
// hasCones: there are voxels for cones. Where there are none, all light is shown in place of occlusion.
ShadingKind shadingKind(const ViewState& state, bool hasRecords, bool hasCones);

class Shading {
 public:
  // The program of a kind. relighter: of the GL backend, the same in each call; null = live light. failed: a shader did
  // not compile.
  Result<GLuint> program(const ShadingKind& kind, const Relighter* relighter);

  // Set what the program, which is in use, shades by. shown: the mode of its kind; encode: as Viewer::draw(). mapSize:
  // of the light map [texel].
  static void set(const ViewState& state, ViewMode shown, const glm::uvec2& mapSize, bool encode);

 private:
  std::map<ShadingKind, GlProgram> programs_;
};

}  // namespace relume
