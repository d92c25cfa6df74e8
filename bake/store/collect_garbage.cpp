// SPDX-License-Identifier: MIT
// Holds the folder of a store to a size (store.h). POSIX.
#include "bake/store/directory_store.h"
#include "bake/store/entry_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <span>
#include <string_view>
#include <system_error>
#include <tuple>

namespace relume {
namespace {

namespace fs = std::filesystem;

struct Entry {
  fs::path path;
  std::uint64_t bytes = 0;
  std::int64_t seconds = 0, nanoseconds = 0;  // when it was used last
};

// Where GETs of a server read the files, only the time of the last reading moves.
void noteLastUse(const struct stat& info, Entry& entry) {
  const auto read = std::pair(std::int64_t{info.st_atim.tv_sec}, std::int64_t{info.st_atim.tv_nsec});
  const auto written = std::pair(std::int64_t{info.st_mtim.tv_sec}, std::int64_t{info.st_mtim.tv_nsec});
  std::tie(entry.seconds, entry.nanoseconds) = std::max(read, written);
}

// "<entry>.<process>-<n>.tmp", as writeFileAtomically() names them.
bool isTemporary(const std::string& name) {
  return name.size() > 33 && isEntryName(name.substr(0, 32)) && name[32] == '.' && name.ends_with(".tmp");
}

// Remove a temporary that nobody is writing: its writer would hold a lock on it.
bool removeAbandoned(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return false;
  const bool abandoned = ::flock(file, LOCK_EX | LOCK_NB) == 0;
  const bool removed = abandoned && ::unlink(path.c_str()) == 0;
  ::close(file);
  return removed;
}

// Whether a file begins as an entry does: others may have such names too. To read moves the time of its last reading,
// by which entries go, unless `flags` has O_NOATIME, which takes the owner: a file of somebody else is believed then,
// and one that may not be read.
bool mayBeEntry(const fs::path& path, int flags) {
  const int file = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC | flags);
  if (file < 0) return (flags & O_NOATIME) != 0 && (errno == EPERM || errno == EACCES);
  std::array<std::byte, kEntryHeaderBytes> header;
  const ssize_t got = ::read(file, header.data(), header.size());
  ::close(file);
  return got > 0 && beginsAsEntry(std::span(header).first(static_cast<std::size_t>(got)));
}

// Remove an entry, or see that another collection has. False: errno says why it stays.
bool removeEntry(const Entry& entry, GarbageReport& report) {
  errno = 0;
  const bool isOurs = mayBeEntry(entry.path, 0);
  if (!isOurs && errno == EACCES) return false;
  if (isOurs && ::unlink(entry.path.c_str()) != 0 && errno != ENOENT) return false;
  report.bytes -= entry.bytes;
  --report.entries;
  report.removedBytes += isOurs ? entry.bytes : 0;
  report.removedEntries += isOurs;
  return true;
}

// What may not be listed or removed, and is left.
void noteLeft(const fs::path& path, const std::string& why, std::uint64_t& count, GarbageReport& report) {
  if (report.reason.empty()) report.reason = path.string() + ": " + why;
  ++count;
}

}  // namespace

Result<GarbageReport> collectGarbage(const fs::path& folder, std::uint64_t limit) {
  GarbageReport report;
  std::vector<Entry> entries;
  std::error_code error;
  fs::directory_iterator folders(folder, error);
  if (error) return Error{ErrorCode::io, folder.string() + ": " + error.message()};
  for (; !error && folders != fs::directory_iterator(); folders.increment(error)) {
    std::error_code inner;
    if (!isEntryFolder(folders->path().filename().string()) || folders->is_symlink(inner)) continue;
    fs::directory_iterator files(folders->path(), inner);
    if (inner == std::errc::permission_denied) noteLeft(folders->path(), inner.message(), report.closedFolders, report);
    for (; !inner && files != fs::directory_iterator(); files.increment(inner)) {
      const std::string name = files->path().filename().string();
      struct stat info {};
      if (::lstat(files->path().c_str(), &info) != 0 || !S_ISREG(info.st_mode)) continue;
      if (isTemporary(name)) report.temporaries += removeAbandoned(files->path());
      if (!isEntryName(name) || !mayBeEntry(files->path(), O_NOATIME)) continue;
      Entry& entry = entries.emplace_back();
      entry.path = files->path();
      entry.bytes = static_cast<std::uint64_t>(info.st_size);
      noteLastUse(info, entry);
      report.bytes += entry.bytes;
    }
  }
  if (error) return Error{ErrorCode::io, folder.string() + ": " + error.message()};

  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.seconds, a.nanoseconds, a.path) < std::tie(b.seconds, b.nanoseconds, b.path);
  });
  report.entries = entries.size();
  for (const Entry& entry : entries) {
    if (report.bytes <= limit) break;
    if (!removeEntry(entry, report))
      noteLeft(entry.path, std::system_category().message(errno), report.keptEntries, report);
  }
  return report;
}

Status checkHeld(const GarbageReport& report, const fs::path& folder, std::uint64_t limit) {
  if (report.bytes <= limit && report.closedFolders == 0) return done();
  std::string text = folder.string() + ": " + std::to_string(report.bytes) + " bytes are left";
  if (report.bytes > limit) text += ", " + std::to_string(report.bytes - limit) + " more than the limit";
  text += "; entries that may not be removed: " + std::to_string(report.keptEntries);
  if (report.closedFolders > 0)
    text += "; folders that may not be listed and are not counted: " + std::to_string(report.closedFolders);
  return Error{ErrorCode::io, text + "; the first: " + report.reason + "; " + kShareHint};
}

}  // namespace relume
