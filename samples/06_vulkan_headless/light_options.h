// SPDX-License-Identifier: MIT
// What the shaders are compiled for and the bake is lit with: one choice for all levels of a game.
#pragma once

#include <relume/relighter.h>

inline relume::RelightOptions lightOptions() {
  relume::RelightOptions options;
  options.lumaBands = 3;
  options.chromaBands = 1;
  return options;
}
