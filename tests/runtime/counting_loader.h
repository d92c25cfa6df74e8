// SPDX-License-Identifier: MIT
// Hosts' loaders that count: each gives the backend functions of its own, which count and call EGL's.
#pragma once

#include "relume/relighter.h"

#include <string_view>

namespace relume::test {

// Loader 0 or 1, each with functions and counts of its own. Knows what the backend's table has, and nothing else.
GetProcAddress countingLoader(int loader);

// Calls by way of that loader since forgetCalls(), of functions whose names begin with `prefix`.
int calls(int loader, std::string_view prefix = {});
void forgetCalls(int loader);

// OpenGL objects made and deleted by way of that loader since forgetCalls().
int objectsMade(int loader);
int objectsDeleted(int loader);

}  // namespace relume::test
