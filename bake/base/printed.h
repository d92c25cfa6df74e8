// SPDX-License-Identifier: MIT
// printf into a string, the same in every locale (formats/decimal.h says why).
#pragma once

#include <cstdarg>
#include <string>

namespace relume {

std::string printed(const char* pattern, ...) __attribute__((format(printf, 1, 2)));
std::string vprinted(const char* pattern, std::va_list arguments) __attribute__((format(printf, 1, 0)));

// For main(): let the whole program read and write numbers with a point wherever it runs, also where a preloaded
// library has chosen the user's locale. No library may call it: the process is its host's.
void useClassicLocale();

}  // namespace relume
