// SPDX-License-Identifier: MIT
// See directory_store.h. POSIX.
#include "bake/store/directory_store.h"

#include "bake/store/entry_file.h"
#include "formats/file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace relume {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNameDigits = 32, kFolderDigits = 2;

bool areDigits(const std::string& text, std::size_t count) {
  return text.size() == count &&
         std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

Error ioError(const fs::path& path, int reason) {
  return {ErrorCode::io, path.string() + ": " + std::strerror(reason)};
}

Error closedError(const fs::path& path) { return {ErrorCode::unsupported, ioError(path, EACCES).message}; }

// Note that an entry was used now, by the file system's clock. A folder that may only be read keeps its times.
void touch(int file) {
  const timespec now[2] = {{0, UTIME_NOW}, {0, UTIME_NOW}};
  ::futimens(file, now);
}

class Descriptor {
 public:
  explicit Descriptor(int file) : file_(file) {}
  ~Descriptor() {
    if (file_ >= 0) ::close(file_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return file_; }

 private:
  int file_;
};

// Read until there is no more room or no more file. How many bytes; nothing: errno says why.
std::optional<std::size_t> readInto(int file, std::span<std::byte> room) {
  std::size_t read = 0;
  while (read < room.size()) {
    const ssize_t got = ::read(file, room.data() + read, room.size() - read);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    read += static_cast<std::size_t>(got);
  }
  return read;
}

constexpr mode_t kAccess = S_IRWXU | S_IRWXG | S_IRWXO;

// A new folder in a store, for whom the store is: with its access, whatever the umask leaves. A group that is inherited
// stays so.
Status makeFolder(const fs::path& folder, mode_t access) {
  std::error_code error;
  if (fs::create_directory(folder, error)) {
    const Descriptor made(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    struct stat info {};
    // File systems without modes refuse.
    if (made.get() >= 0 && ::fstat(made.get(), &info) == 0) ::fchmod(made.get(), (info.st_mode & 07000) | access);
  }
  if (error) return Error{ErrorCode::io, folder.string() + ": " + error.message()};
  if (fs::is_symlink(folder, error))
    return Error{ErrorCode::io, folder.string() + ": a link, expected a folder of the store"};
  if (::faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0 && errno == EACCES)
    return closedError(folder);
  return done();
}

}  // namespace

std::string folderOf(const std::string& entry) { return entry.substr(0, kFolderDigits); }
bool isEntryName(const std::string& text) { return areDigits(text, kNameDigits); }
bool isEntryFolder(const std::string& text) { return areDigits(text, kFolderDigits); }

fs::path DirectoryStore::pathOf(const EntryName& name) const {
  const std::string entry = toString(name);
  return folder_ / folderOf(entry) / entry;
}

Result<std::optional<std::vector<std::byte>>> DirectoryStore::get(const EntryName& name, std::uint64_t maxBytes) {
  const fs::path path = pathOf(name);
  // Not through links, and without waiting for the other end of a pipe.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  if (file.get() < 0) {
    if (errno == ENOENT) return std::optional<std::vector<std::byte>>();
    if (errno == EACCES) return closedError(path);
    if (errno == ELOOP || errno == ENXIO) return Error{ErrorCode::invalidFile, path.string() + ": not a regular file"};
    return ioError(path, errno);
  }
  struct stat info {};
  if (::fstat(file.get(), &info) != 0) return ioError(path, errno);
  if (!S_ISREG(info.st_mode)) return Error{ErrorCode::invalidFile, path.string() + ": not a regular file"};
  // The size is compared with what the header says and with what may be read before anything is allocated for it.
  const auto size = static_cast<std::uint64_t>(info.st_size);
  std::array<std::byte, kEntryHeaderBytes> header;
  const std::optional<std::size_t> begun = readInto(file.get(), header);
  if (!begun) return ioError(path, errno);
  const Result<std::uint64_t> most = mostEntryBytes(std::span(header).first(*begun));
  if (!most) return most.error();
  if (const Status fits = checkEntrySize(size, *most, maxBytes); !fits) return fits.error();
  std::vector<std::byte> bytes(std::max<std::uint64_t>(size, header.size()));
  std::copy(header.begin(), header.end(), bytes.begin());
  const std::optional<std::size_t> rest = readInto(file.get(), std::span(bytes).subspan(header.size()));
  if (!rest) return ioError(path, errno);
  bytes.resize(header.size() + *rest);
  touch(file.get());
  return std::optional(std::move(bytes));
}

Status DirectoryStore::put(const EntryName& name, std::span<const std::byte> bytes) {
  const fs::path path = pathOf(name);
  struct stat store {};
  if (::stat(folder_.c_str(), &store) != 0) return ioError(folder_, errno);
  const mode_t access = store.st_mode & kAccess;
  if (const Status made = makeFolder(path.parent_path(), access); !made) return made;
  // What is in the way of an entry: writing through a link would reach outside of the store.
  std::error_code error;
  const fs::file_status there = fs::symlink_status(path, error);
  if (fs::exists(there) && !fs::is_regular_file(there) && !fs::remove(path, error))
    return Error{ErrorCode::io, path.string() + ": not a regular file: " + error.message()};
  return writeFileAtomically(
      path, [&](const ByteSink& sink) { return sink(bytes); }, access & 0666);
}

Status DirectoryStore::hold(std::uint64_t limit) {
  if (::faccessat(AT_FDCWD, folder_.c_str(), W_OK, AT_EACCESS) != 0) return done();
  const Result<GarbageReport> report = collectGarbage(folder_, limit);
  return report ? checkHeld(*report, folder_, limit) : Status(report.error());
}

}  // namespace relume
