// SPDX-License-Identifier: MIT
// A folder of this process for what is only read from files: in memory where there is such a place, removed at exit.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>

#include <unistd.h>

namespace relume::fuzz {

inline const std::filesystem::path& memoryFolder() {
  namespace fs = std::filesystem;
  static const fs::path path = [] {
    const fs::path memory = "/dev/shm";
    const fs::path made =
        (fs::is_directory(memory) ? memory : fs::temp_directory_path()) / ("relume_fuzz_" + std::to_string(::getpid()));
    fs::create_directories(made);
    std::atexit([] {
      std::error_code ignored;
      fs::remove_all(memoryFolder(), ignored);
    });
    return made;
  }();
  return path;
}

inline std::filesystem::path writeToMemory(const char* name, std::span<const std::uint8_t> bytes) {
  const std::filesystem::path path = memoryFolder() / name;
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) std::abort();
  std::fwrite(bytes.data(), 1, bytes.size(), file);
  std::fclose(file);
  return path;
}

}  // namespace relume::fuzz
