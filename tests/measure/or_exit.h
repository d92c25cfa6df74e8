// SPDX-License-Identifier: MIT
// Programs that print figures end at the first error, saying it.
#pragma once

#include "relume/result.h"

#include <cstdio>
#include <cstdlib>
#include <utility>

namespace relume {

inline void orExit(const Status& status) {
  if (status) return;
  std::fprintf(stderr, "%s\n", status.error().message.c_str());
  std::exit(exitCode(status.error().code));
}

template <class T>
T orExit(Result<T> result) {
  if (!result) orExit(Status(result.error()));
  return std::move(*result);
}

}  // namespace relume
