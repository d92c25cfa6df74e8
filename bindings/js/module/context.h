// SPDX-License-Identifier: MIT
// The one context of a module, by which everything is allocated (module.cpp).
#pragma once

#include "relume/relume.h"

relume_context* relume_web_context();
