// SPDX-License-Identifier: MIT
// See file_watch.h.
#include "tools/view/file_watch.h"

#include <sys/stat.h>

namespace relume {

FileStamp stampOf(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return {};
  return {static_cast<std::uint64_t>(status.st_dev), static_cast<std::uint64_t>(status.st_ino),
          static_cast<std::uint64_t>(status.st_size),
          static_cast<std::int64_t>(status.st_mtim.tv_sec) * 1000000000 + status.st_mtim.tv_nsec};
}

bool FileWatch::hasChanged(double now) {
  if (path_.empty() || now < lookAgain_) return false;
  lookAgain_ = now + kEvery;
  const FileStamp found = stampOf(path_);
  if (found != seen_) {
    seen_ = found;
    seenSince_ = now;
  }
  if (!found.exists() || found == known_ || now - seenSince_ < kStill) return false;
  known_ = found;
  return true;
}

}  // namespace relume
