// SPDX-License-Identifier: MIT
// One look-up in OpenGL, of many receivers at once, timed.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"

#include <epoxy/gl.h>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <string>
#include <vector>

namespace relume::bench {

// Two vectors a receiver, whatever the look-up takes.
struct Receiver {
  glm::vec4 a, b;
};

// The OpenGL context it was made in must be current, as must the relighter be alive.
class ReceiverPass {
 public:
  // lookup: an expression of type vec3 in GLSL over `a` and `b` of a receiver, with the functions of the resolve.
  static Result<ReceiverPass> create(const Relighter& relighter, const std::string& lookup,
                                     const std::vector<Receiver>& receivers);
  ReceiverPass(ReceiverPass&&) noexcept;
  ReceiverPass& operator=(ReceiverPass&&) = delete;
  ~ReceiverPass();

  // [ms] Look all of them up, and wait for it.
  double run();

 private:
  explicit ReceiverPass(const Relighter& relighter) : relighter_(&relighter) {}

  const Relighter* relighter_;
  GLuint program_ = 0, count_ = 0;
  GLuint buffers_[2] = {}, queries_[2] = {};
};

}  // namespace relume::bench
