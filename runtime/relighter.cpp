// SPDX-License-Identifier: MIT
#include "runtime/relighter.h"
