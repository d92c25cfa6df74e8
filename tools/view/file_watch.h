// SPDX-License-Identifier: MIT
// Tells when a file has become another one, by looking at it a few times a second.
#pragma once

#include <cstdint>
#include <filesystem>

namespace relume {

// What tells one state of a file from the next without reading it. Zeros where there is none.
struct FileStamp {
  std::uint64_t device = 0, node = 0, size = 0;
  std::int64_t changedNs = 0;

  bool exists() const { return node != 0; }
  bool operator==(const FileStamp&) const = default;
};
FileStamp stampOf(const std::filesystem::path& path);

class FileWatch {
 public:
  static constexpr double kEvery = 0.25;  // [s] between two looks
  // Until a file has stopped changing it may be half written. A file that is replaced by rename is whole at once.
  static constexpr double kStill = 0.4;  // [s]

  FileWatch() = default;
  // An empty path is never another one.
  FileWatch(std::filesystem::path path, const FileStamp& known) : path_(std::move(path)), known_(known), seen_(known) {}

  // Whether the file is another one than it was, and has been that for a moment; once for each. A file that is gone is
  // waited for. `now` [s] never goes back.
  bool hasChanged(double now);

 private:
  std::filesystem::path path_;
  FileStamp known_, seen_;
  double lookAgain_ = 0.0, seenSince_ = 0.0;
};

}  // namespace relume
