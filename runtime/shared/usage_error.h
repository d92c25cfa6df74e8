// SPDX-License-Identifier: MIT
// The error of a call that cannot be meant so.
#pragma once

#include "relume/result.h"

#include <string>
#include <utility>

namespace relume {

inline Error usageError(std::string message) { return {ErrorCode::usage, std::move(message)}; }

}  // namespace relume
