// SPDX-License-Identifier: MIT
// GPU time between marks of a frame, read when the GPU is done with it and never waited for. Timestamps, not
// GL_TIME_ELAPSED: some software drivers answer nonsense to that.
#pragma once

#include "runtime/gl/handle.h"
#include "runtime/gl/saved_state.h"

#include <array>

namespace relume::gl {

// While it lives, results of queries go to memory: with a buffer of the host's bound they would go there.
class ResultsToMemory {
 public:
  explicit ResultsToMemory(const Functions& gl)
      : gl_(gl), buffer_(gl.hasQueryBuffer ? integerOf(gl, GL_QUERY_BUFFER_BINDING) : 0) {
    if (buffer_ != 0) gl_.BindBuffer(GL_QUERY_BUFFER, 0);
  }
  ~ResultsToMemory() {
    if (buffer_ != 0) gl_.BindBuffer(GL_QUERY_BUFFER, bufferAgain(gl_, buffer_));
  }
  ResultsToMemory(const ResultsToMemory&) = delete;
  ResultsToMemory& operator=(const ResultsToMemory&) = delete;

 private:
  const Functions& gl_;
  GLint buffer_ = 0;
};

// kPasses intervals a frame. Several frames are in flight.
template <std::size_t kPasses>
class FrameTimer {
 public:
  explicit FrameTimer(const Functions& gl) : gl_(&gl) {
    for (auto& frame : query_) {
      for (Query& each : frame) {
        GLuint name = 0;
        gl.GenQueries(1, &name);
        each = Query(gl, name);
      }
    }
  }
  // Mark the start of a frame (0) and the end of each pass (1 .. kPasses), in order.
  void mark(std::size_t index) { gl_->QueryCounter(query_[current_][index].get(), GL_TIMESTAMP); }
  // The frame's last mark was made.
  void endFrame() {
    pending_[current_] = true;
    current_ = (current_ + 1) % kFrames;
    collect(current_, true);
  }
  // [ms] of each pass in the last frame that finished.
  const std::array<double, kPasses>& passMs() {
    for (std::size_t i = 0; i < kFrames; ++i) collect((current_ + i) % kFrames, false);
    return passMs_;
  }

 private:
  static constexpr std::size_t kFrames = 4;

  // Take the times of one frame in flight; `wait` before its queries are used again.
  void collect(std::size_t frame, bool wait) {
    if (!pending_[frame]) return;
    const ResultsToMemory toMemory(*gl_);
    GLint available = 0;
    gl_->GetQueryObjectiv(query_[frame][kPasses].get(), GL_QUERY_RESULT_AVAILABLE, &available);
    if (!available && !wait) return;
    std::array<GLuint64, kPasses + 1> at{};
    for (std::size_t i = 0; i <= kPasses; ++i)
      gl_->GetQueryObjectui64v(query_[frame][i].get(), GL_QUERY_RESULT, &at[i]);
    for (std::size_t i = 0; i < kPasses; ++i) passMs_[i] = static_cast<double>(at[i + 1] - at[i]) * 1e-6;
    pending_[frame] = false;
  }

  const Functions* gl_;
  std::array<std::array<Query, kPasses + 1>, kFrames> query_;
  std::array<bool, kFrames> pending_{};
  std::array<double, kPasses> passMs_{};
  std::size_t current_ = 0;
};

}  // namespace relume::gl
