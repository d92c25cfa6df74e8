// SPDX-License-Identifier: MIT
// Which instruction set the kernels use.
#pragma once

#include "relume/relighter.h"

namespace relume::cpu {

// The set asked for, the best one for Simd::best; Simd::best when this processor, or this build, lacks it.
Simd chooseSimd(Simd simd);

}  // namespace relume::cpu
