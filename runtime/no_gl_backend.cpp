// SPDX-License-Identifier: MIT
// Stands where gl/ would in a build without OpenGL.
#include "runtime/backend.h"
#ifndef __EMSCRIPTEN__
#include "runtime/live/live_backend.h"
#endif

namespace relume {
namespace {

Error noGl() {
  return {ErrorCode::unsupported, "this build of the runtime has no OpenGL backend (RELUME_BUILD_GL is off)"};
}

}  // namespace

Result<Owned<Backend>> makeGlBackend(const Bake&, const BackendRequest&) { return noGl(); }

#ifndef __EMSCRIPTEN__
Result<std::unique_ptr<LiveBackend>> makeLiveGlBackend(const LiveLightOptions&) { return noGl(); }
#endif

}  // namespace relume
