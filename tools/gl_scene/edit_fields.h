// SPDX-License-Identifier: MIT
// Live light before and after an edit, and where it counts, for the level shader of a baked level that was edited
// (relume/edit_blend.h). Both lights come from the CPU.
#pragma once

#include "relume/edit_blend.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"
#include "tools/gl_scene/live_field.h"

#include <string>
#include <utility>

namespace relume {

class EditFields {
 public:
  // Errors of LiveField.
  static Result<EditFields> create();
  // Errors of LiveField::upload().
  Status uploadBefore(const LiveTexels& texels) { return before_.upload(texels); }
  Status uploadAfter(const LiveTexels& texels) { return after_.upload(texels); }
  // Until both lights are there, the bake's is all there is.
  void place(EditBlend blend) { blend_ = std::move(blend); }
  bool isLit() const { return before_.isLit() && after_.isLit(); }

  // What a program reads: EditBlend::glsl(), relumeBeforeIrradiance() and relumeAfterIrradiance(), as
  // relumeLiveIrradiance(). It follows a relighter's.
  static Result<std::string> glsl();
  // Before a draw with such a program. Binds textures to units 21 to 26.
  void bind(GLuint program) const;

 private:
  EditFields(LiveField before, LiveField after) : before_(std::move(before)), after_(std::move(after)) {}

  LiveField before_, after_;
  EditBlend blend_;
};

}  // namespace relume
