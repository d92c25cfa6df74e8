// SPDX-License-Identifier: MIT
// A closed box in the smallest bake that still has every step: one surfel a wall, one cache a wall and one in the air,
// SH links by quadrature. All walls have albedo rho and emit Le, so that every point sees radiosity pi Le / (1 - rho).
#pragma once

#include "relume/bake_data.h"

namespace relume::test {

Bake makeFurnaceBake(float albedo, float emission, std::uint32_t bands);

}  // namespace relume::test
