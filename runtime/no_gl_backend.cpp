// SPDX-License-Identifier: MIT
// Stands where gl/ would in a build without OpenGL.
#include "runtime/backend.h"

namespace relume {

Result<Owned<Backend>> makeGlBackend(const Bake&, const BackendRequest&) {
  return Error{ErrorCode::unsupported, "this build of the runtime has no OpenGL backend (RELUME_BUILD_GL is off)"};
}

}  // namespace relume
