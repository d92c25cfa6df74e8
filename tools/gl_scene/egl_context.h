// SPDX-License-Identifier: MIT
// An OpenGL core or OpenGL ES context without a window: EGL's surfaceless platform first, then each EGL device. For
// tests, the command line and headless samples; software rasterisers will do. Include before any other OpenGL header.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"

#include <memory>
#include <string>

namespace relume {

// Owns a context, current on the thread that made it until destroyed. Movable.
class EglContext {
 public:
  struct Options {
    int major = 4, minor = 5;  // version of the core profile; 4.3 is tried when this one cannot be had
    bool debug = false;        // a debug context of OpenGL that counts errors; see errorCount()
    bool es = false;           // OpenGL ES 3.0 in place of all that
  };
  // unsupported: no EGL, no device, or no OpenGL of at least 4.3, or ES of 3.0 (what was tried is in the message).
  static Result<EglContext> create(const Options& options);
  static Result<EglContext> create() { return create(Options{}); }
  EglContext(EglContext&&) noexcept;
  EglContext& operator=(EglContext&&) noexcept;
  ~EglContext();

  // For RelightOptions: the functions of EGL's contexts.
  static GlProc getProcAddress(const char* name);
  // GL_RENDERER and GL_VERSION.
  std::string renderer() const;
  std::string version() const;
  // Make this context current on the calling thread. False when EGL refuses.
  bool makeCurrent() const;
  // Debug contexts: errors and undefined behaviour reported since creation, and the text of the last.
  int errorCount() const;
  const std::string& lastError() const;
  void forgetErrors();

 private:
  struct State;
  explicit EglContext(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relume
