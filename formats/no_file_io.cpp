// SPDX-License-Identifier: MIT
// file_io.h where there is no file system (WebAssembly): everything fails, saying so. Bakes come from memory there.
#include "formats/file_io.h"

#include <string>

namespace relume {
namespace {

Error noFiles(const std::filesystem::path& path) {
  return {ErrorCode::unsupported,
          path.native() + ": this build has no files; hand the bytes over (relume_bake_from_memory)"};
}

}  // namespace

Result<FileBytes> readFile(const std::filesystem::path& path, std::size_t, std::pmr::memory_resource*) {
  return noFiles(path);
}
Result<FileBytes> mapFile(const std::filesystem::path& path, std::pmr::memory_resource*) { return noFiles(path); }
Status writeFileAtomically(const std::filesystem::path& path, const std::function<bool(const ByteSink&)>&) {
  return noFiles(path);
}
void removeOpenTemporaries() {}
Status checkWritable(const std::filesystem::path& path, bool*) { return noFiles(path); }
Result<std::filesystem::path> followLinks(const std::filesystem::path& path) { return noFiles(path); }

}  // namespace relume
