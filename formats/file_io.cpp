// SPDX-License-Identifier: MIT
// See file_io.h. A temporary is named "<file>.<process>-<n>.tmp" and locked while its writer lives, so that a later run
// can tell the leavings of a killed one from the work of a neighbour.
#include "formats/file_io.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <string>
#include <string_view>
#include <vector>

namespace relume {
namespace {

namespace fs = std::filesystem;

Error ioError(const fs::path& path, const std::string& what, int code) {
  return {ErrorCode::io, path.string() + ": " + what + ": " + std::strerror(code)};
}

// An open file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(Descriptor&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  Descriptor& operator=(Descriptor&&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

// Open for reading and ask for the size. Pipes and devices are refused: opening must not wait, size must be known.
Result<Descriptor> openRegular(const fs::path& path, std::size_t& sizeBytes) {
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) return ioError(path, "cannot be opened", errno);
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) return ioError(path, "cannot be read", errno);
  if (S_ISDIR(status.st_mode)) return ioError(path, "cannot be read", EISDIR);
  if (!S_ISREG(status.st_mode)) return Error{ErrorCode::io, path.string() + ": is not a regular file"};
  sizeBytes = static_cast<std::size_t>(status.st_size);
  return file;
}

struct alignas(64) Block {
  std::byte bytes[64];
};

fs::path folderOf(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

bool isDigits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

// Whether `name` is a temporary of the file `target`: "<target>.<digits>-<digits>.tmp".
bool isTemporaryOf(std::string_view name, std::string_view target) {
  constexpr std::string_view kEnd = ".tmp";
  if (!name.starts_with(target) || !name.ends_with(kEnd) || name.size() <= target.size() + 1 + kEnd.size())
    return false;
  if (name[target.size()] != '.') return false;
  const std::string_view middle = name.substr(target.size() + 1, name.size() - target.size() - 1 - kEnd.size());
  const std::size_t dash = middle.find('-');
  return dash != std::string_view::npos && isDigits(middle.substr(0, dash)) && isDigits(middle.substr(dash + 1));
}

// Remove the temporaries that nobody holds a lock on.
void removeStaleTemporaries(const fs::path& path) {
  std::error_code ignored;
  const std::string target = path.filename().string();
  for (fs::directory_iterator entry(folderOf(path), ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    if (!isTemporaryOf(entry->path().filename().string(), target)) continue;
    const Descriptor file(::open(entry->path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    if (file.get() >= 0 && ::flock(file.get(), LOCK_EX | LOCK_NB) == 0) ::unlink(entry->path().c_str());
  }
}

// A locked, empty temporary beside the path. Its name is tried again when another run's clean-up was faster than our
// lock.
Result<Descriptor> createTemporary(const fs::path& path, fs::path& temporary) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    temporary = folderOf(path) /
                (path.filename().string() + "." + std::to_string(::getpid()) + "-" + std::to_string(attempt) + ".tmp");
    Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (file.get() < 0 && errno == EEXIST) continue;
    if (file.get() < 0) return ioError(path, "cannot create a file in its folder", errno);
    struct stat mine {
    }, named{};
    if (::flock(file.get(), LOCK_EX | LOCK_NB) == 0 && ::fstat(file.get(), &mine) == 0 &&
        ::stat(temporary.c_str(), &named) == 0 && mine.st_ino == named.st_ino && mine.st_dev == named.st_dev)
      return file;
  }
  return Error{ErrorCode::io, path.string() + ": no free name for a temporary file beside it"};
}

bool writeAll(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

// Make the rename itself last. Not every file system can; the data is safe already.
void syncFolder(const fs::path& folder) {
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) ::fsync(directory.get());
}

Status checkTarget(const fs::path& path) {
  struct stat status {};
  if (path.filename().empty()) return ioError(path, "cannot be written", EISDIR);
  if (::stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) return ioError(path, "cannot be written", EISDIR);
    if (!S_ISREG(status.st_mode)) return Error{ErrorCode::io, path.string() + ": is not a regular file"};
  }
  return done();
}

}  // namespace

Result<FileBytes> readFile(const fs::path& path) {
  std::size_t size = 0;
  const Result<Descriptor> file = openRegular(path, size);
  if (!file) return file.error();
  std::shared_ptr<std::vector<Block>> blocks;
  try {
    blocks = std::make_shared<std::vector<Block>>((size + sizeof(Block) - 1) / sizeof(Block));
  } catch (const std::exception&) {
    return Error{ErrorCode::io, path.string() + ": no memory for its " + std::to_string(size) + " bytes"};
  }
  auto* data = reinterpret_cast<std::byte*>(blocks->data());
  for (std::size_t at = 0; at < size;) {
    const ssize_t got = ::read(file->get(), data + at, size - at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return ioError(path, "cannot be read", errno);
    if (got == 0) return Error{ErrorCode::io, path.string() + ": became shorter while it was read"};
    at += static_cast<std::size_t>(got);
  }
  return FileBytes{blocks, {data, size}};
}

Result<FileBytes> mapFile(const fs::path& path) {
  std::size_t size = 0;
  const Result<Descriptor> file = openRegular(path, size);
  if (!file) return file.error();
  if (size == 0) return FileBytes{};
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file->get(), 0);
  if (address == MAP_FAILED) return ioError(path, "cannot be mapped", errno);
  std::shared_ptr<const void> owner(address, [size](const void* p) { ::munmap(const_cast<void*>(p), size); });
  return FileBytes{std::move(owner), {static_cast<const std::byte*>(address), size}};
}

Status writeFileAtomically(const fs::path& path, const std::function<bool(const ByteSink&)>& body) {
  if (const Status status = checkTarget(path); !status) return status;
  removeStaleTemporaries(path);
  fs::path temporary;
  const Result<Descriptor> file = createTemporary(path, temporary);
  if (!file) return file.error();

  int reason = 0;
  const auto step = [&](bool good) {
    if (!good && reason == 0) reason = errno != 0 ? errno : EIO;
    return good;
  };
  const ByteSink sink = [&](std::span<const std::byte> bytes) { return step(writeAll(file->get(), bytes)); };
  errno = 0;
  const bool written =
      step(body(sink)) && step(::fsync(file->get()) == 0) && step(::rename(temporary.c_str(), path.c_str()) == 0);
  if (!written) {
    ::unlink(temporary.c_str());
    return ioError(path, "cannot be written", reason);
  }
  syncFolder(folderOf(path));
  return done();
}

Status checkWritable(const fs::path& path) {
  if (const Status status = checkTarget(path); !status) return status;
  removeStaleTemporaries(path);
  fs::path temporary;
  const Result<Descriptor> file = createTemporary(path, temporary);
  if (!file) return file.error();
  ::unlink(temporary.c_str());
  return done();
}

}  // namespace relume
