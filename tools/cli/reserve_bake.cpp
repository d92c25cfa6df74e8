// SPDX-License-Identifier: MIT
// See reserve_bake.h.
#include "tools/cli/reserve_bake.h"

#include "bake/base/memory_budget.h"
#include "formats/chunks.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace relume {
namespace {

bool beginsAsABake(const std::string& path) {
  std::array<char, kBakeMagic.size()> first{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(first.data(), first.size())) return false;
  const auto same = [](char found, unsigned char wanted) { return static_cast<unsigned char>(found) == wanted; };
  return std::ranges::any_of(std::array{kBakeFileType, kPlanFileType, kShardFileType}, [&](const ChunkFileType& type) {
    return std::equal(first.begin(), first.end(), type.magic.begin(), same);
  });
}

}  // namespace

Status reserveBake(Context& context, std::string_view stage, const std::string& path, double copies) {
  std::error_code missing;
  const auto bytes = static_cast<double>(std::filesystem::file_size(path, missing));
  if (missing || !beginsAsABake(path)) return done();
  return reserveMemory(context, stage, copies * bytes, "\"" + path + "\"", "use a smaller bake");
}

}  // namespace relume
