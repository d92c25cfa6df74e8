// SPDX-License-Identifier: MIT
// See reserve_bake.h.
#include "tools/cli/reserve_bake.h"

#include "bake/base/memory_budget.h"

#include <filesystem>
#include <system_error>

namespace relume {

Status reserveBake(Context& context, std::string_view stage, const std::string& path) {
  std::error_code missing;
  const auto bytes = static_cast<double>(std::filesystem::file_size(path, missing));
  if (missing) return done();
  return reserveMemory(context, stage, bytes, "\"" + path + "\"", "use a smaller bake");
}

}  // namespace relume
