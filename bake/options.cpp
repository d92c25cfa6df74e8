// SPDX-License-Identifier: MIT
// Presets, ranges and JSON of the bake's options.
#include "bake/options.h"
