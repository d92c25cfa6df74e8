// SPDX-License-Identifier: MIT
// The one table of the bake's options: names, ranges, units, meanings. Checks, JSON in and out and the command line's
// help are loops over it (options.cpp).
#pragma once

#include "relume/bake/options.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace relume {

// An enumeration, by the index of its value among Field::names.
struct Choice {
  void* target;
  int (*get)(const void*);
  void (*set)(void*, int);
};

using Target = std::variant<bool*, std::uint32_t*, std::uint64_t*, float*, glm::uvec3*, std::string*, Choice>;

struct Field {
  const char* name;  // path in the JSON
  const char* flag;  // of the command line, "" = none
  Target target;
  double low, high;                // inclusive; of numbers
  std::vector<const char*> names;  // of choices and strings
  const char* unit;
  const char* comment;
};

// Every option of `o`, which the fields point into.
std::vector<Field> fields(BakeOptions& o);

}  // namespace relume
