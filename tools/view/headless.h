// SPDX-License-Identifier: MIT
// The viewer without a window, for CI: N frames while a light moves, as PNG files.
#pragma once

#include "relume/result.h"
#include "tools/view/loaded_level.h"
#include "tools/view/options.h"

namespace relume {

// unsupported: no EGL; io: not writable; usage: no such light; else as Viewer.
Status runHeadless(const LoadedLevel& level, const ViewerOptions& options);

}  // namespace relume
