// SPDX-License-Identifier: MIT
// See file_io.h. A temporary is named "<file>.<process>-<n>.tmp", a long name cut, and locked while its writer lives,
// so that a later run can tell the leavings of a killed one from the work of a neighbour. File systems without locks
// (NFS without lockd, some FUSE) are told by the error of the first attempt; there the age of a temporary decides.
#include "formats/file_io.h"

#include "formats/memory.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <mutex>
#include <new>
#include <set>
#include <string>
#include <string_view>
#include <utility>
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

fs::path folderOf(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

bool isDigits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

// What the temporaries of a file of this name begin with: the name, or where little of what a file system allows would
// be left for the rest, its beginning and a number of the whole (FNV-1a).
std::string stemOf(const std::string& name) {
  constexpr std::size_t kLongest = 120, kKept = 80;
  if (name.size() <= kLongest) return name;
  std::size_t end = kKept;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0u) == 0x80u) --end;  // whole characters of UTF-8
  std::uint64_t number = 14695981039346656037u;
  for (const char c : name) number = (number ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return name.substr(0, end) + "~" + std::to_string(number);
}

// Whether `name` is a temporary of the file whose temporaries begin with `target`: "<target>.<digits>-<digits>.tmp".
bool isTemporaryOf(std::string_view name, std::string_view target) {
  constexpr std::string_view kEnd = ".tmp";
  if (!name.starts_with(target) || !name.ends_with(kEnd) || name.size() <= target.size() + 1 + kEnd.size())
    return false;
  if (name[target.size()] != '.') return false;
  const std::string_view middle = name.substr(target.size() + 1, name.size() - target.size() - 1 - kEnd.size());
  const std::size_t dash = middle.find('-');
  return dash != std::string_view::npos && isDigits(middle.substr(0, dash)) && isDigits(middle.substr(dash + 1));
}

enum class Lock { held, taken, none };  // ours; another process's; the file system has no locks

Lock tryLock(const Descriptor& file) {
  int result = 0;
  do {
    result = ::flock(file.get(), LOCK_EX | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  if (result == 0) return Lock::held;
  return errno == EWOULDBLOCK ? Lock::taken : Lock::none;
}

// Without locks, whether a temporary is so old that no writer can still be at it.
bool isForgotten(const fs::directory_entry& entry) {
  std::error_code failed;
  const fs::file_time_type written = entry.last_write_time(failed);
  return !failed && fs::file_time_type::clock::now() - written > std::chrono::hours(24);
}

// Remove the temporaries that nobody holds a lock on.
void removeStaleTemporaries(const fs::path& path) {
  std::error_code ignored;
  const std::string target = stemOf(path.filename().string());
  for (fs::directory_iterator entry(folderOf(path), ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    if (!isTemporaryOf(entry->path().filename().string(), target)) continue;
    const Descriptor file(::open(entry->path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    if (file.get() < 0) continue;
    const Lock lock = tryLock(file);
    if (lock == Lock::held || (lock == Lock::none && isForgotten(*entry))) ::unlink(entry->path().c_str());
  }
}

// The temporaries of this process. Whoever holds the lock alone makes, renames or removes one.
struct OpenTemporaries {
  std::timed_mutex mutex;
  std::set<fs::path> paths;
};

// Never destroyed: threads may write while the process ends.
OpenTemporaries& openTemporaries() {
  static OpenTemporaries* const instance = new OpenTemporaries;
  return *instance;
}

// A file that goes with this object unless it was renamed.
struct Temporary {
  Descriptor file;
  fs::path path;
  bool locked = false;

  Temporary(Descriptor opened, fs::path name) : file(std::move(opened)), path(std::move(name)) {}
  Temporary(Temporary&& other) noexcept
      : file(std::move(other.file)), path(std::exchange(other.path, {})), locked(other.locked) {}
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  Temporary& operator=(Temporary&&) = delete;
  ~Temporary() {
    if (path.empty()) return;
    OpenTemporaries& open = openTemporaries();
    const std::lock_guard lock(open.mutex);
    if (open.paths.erase(path) != 0 && isThere()) ::unlink(path.c_str());
  }
  // Whether the file now has the name `target`; errno says why not.
  bool renameTo(const fs::path& target) const {
    OpenTemporaries& open = openTemporaries();
    const std::lock_guard lock(open.mutex);
    if (::rename(path.c_str(), target.c_str()) != 0) return false;
    open.paths.erase(path);
    return true;
  }
  // Whether the name still is the open file's: a clean-up may have removed it.
  bool isThere() const {
    struct stat mine {
    }, named{};
    return !path.empty() && ::fstat(file.get(), &mine) == 0 && ::stat(path.c_str(), &named) == 0 &&
           mine.st_ino == named.st_ino && mine.st_dev == named.st_dev;
  }
};

// A new file of this name among the open temporaries; errno says why there is none.
Descriptor openListed(const fs::path& name) {
  OpenTemporaries& open = openTemporaries();
  const std::lock_guard lock(open.mutex);
  const auto [listed, isNew] = open.paths.insert(name);
  if (!isNew) {
    errno = EEXIST;
    return Descriptor(-1);
  }
  Descriptor file(::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.get() >= 0) return file;
  const int reason = errno;
  open.paths.erase(listed);
  errno = reason;
  return file;
}

// An empty temporary beside the path, locked where there are locks. Its name is tried again when another run's clean-up
// was faster than our lock.
Result<Temporary> createTemporary(const fs::path& path) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const fs::path name = folderOf(path) / (stemOf(path.filename().string()) + "." + std::to_string(::getpid()) + "-" +
                                            std::to_string(attempt) + ".tmp");
    Descriptor file = openListed(name);
    if (file.get() < 0 && errno == EEXIST) continue;
    if (file.get() < 0) return ioError(path, "cannot create a file in its folder", errno);
    Temporary temporary(std::move(file), name);
    const Lock lock = tryLock(temporary.file);
    temporary.locked = lock == Lock::held;
    if (lock != Lock::taken && temporary.isThere()) return temporary;
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

// A file that takes another's place is for the same people: its group, where this user may give it, and its mode. Where
// the group stays another one, that has no more than everybody had.
void keepAccess(const fs::path& replaced, const Descriptor& file) {
  struct stat old {
  }, mine{};
  if (::stat(replaced.c_str(), &old) != 0 || ::fstat(file.get(), &mine) != 0) return;
  mode_t mode = old.st_mode & (S_IRWXU | S_IRWXG | S_IRWXO);
  if (mine.st_gid != old.st_gid && ::fchown(file.get(), static_cast<uid_t>(-1), old.st_gid) != 0)
    mode &= S_IRWXU | S_IRWXO | ((mode & S_IRWXO) << 3);
  ::fchmod(file.get(), mode);  // file systems without modes refuse
}

// Make the rename itself last. Not every file system can; the data is safe already.
void syncFolder(const fs::path& folder) {
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) ::fsync(directory.get());
}

Status checkTarget(const fs::path& path) {
  struct stat status {};
  if (path.filename().empty()) return ioError(path, "cannot be written", EISDIR);
  if (::stat(path.c_str(), &status) != 0) {
    if (errno == ENAMETOOLONG) return ioError(path, "cannot be written", errno);
  } else {
    if (S_ISDIR(status.st_mode)) return ioError(path, "cannot be written", EISDIR);
    if (!S_ISREG(status.st_mode))
      return Error{ErrorCode::io,
                   path.string() + ": is not a regular file; a file's name expected, for files are written as a whole"};
  }
  return done();
}

Error cannotBeReplaced(const fs::path& path, int code) {
  Error error = ioError(path, "the file that is there cannot be replaced", code);
  error.message += "; choose another name, or move that file away";
  return error;
}

// Whether a rename can put another file in the place of what is there: of another user in a sticky folder, immutable
// and mounted files it cannot. Found out by removing the folder of that name, which such files refuse as they would
// refuse to be replaced, and all others because they are no folders.
Status checkReplaceable(const fs::path& path, const fs::path& target) {
  struct stat status {};
  if (::lstat(target.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return done();
  if (::rmdir(target.c_str()) != 0 && (errno == EPERM || errno == EACCES)) return cannotBeReplaced(path, errno);
#ifdef STATX_ATTR_MOUNT_ROOT
  struct statx more {};
  if (::statx(AT_FDCWD, target.c_str(), AT_SYMLINK_NOFOLLOW, 0, &more) == 0 &&
      (more.stx_attributes & more.stx_attributes_mask & STATX_ATTR_MOUNT_ROOT) != 0)
    return cannotBeReplaced(path, EBUSY);
#endif
  return done();
}

// What is written for `path`: the end of its links.
Result<fs::path> targetOf(const fs::path& path) {
  if (const Status status = checkTarget(path); !status) return status.error();
  return followLinks(path);
}

}  // namespace

Result<FileBytes> readFile(const fs::path& path, std::size_t maxBytes, std::pmr::memory_resource* memory) {
  std::size_t size = 0;
  const Result<Descriptor> file = openRegular(path, size);
  if (!file) return file.error();
  if (size > maxBytes)
    return Error{ErrorCode::invalidFile, path.string() + ": has " + std::to_string(size) + " bytes, at most " +
                                             std::to_string(maxBytes) + " expected"};
  std::shared_ptr<std::pmr::vector<AlignedBlock>> blocks;
  try {
    // The vector takes the resource of the allocator that makes it.
    blocks =
        std::allocate_shared<std::pmr::vector<AlignedBlock>>(std::pmr::polymorphic_allocator<AlignedBlock>(memory),
                                                             (size + sizeof(AlignedBlock) - 1) / sizeof(AlignedBlock));
  } catch (const std::exception&) {
    return Error{ErrorCode::memory, path.string() + ": out of memory for its " + std::to_string(size) + " bytes"};
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

Result<FileBytes> mapFile(const fs::path& path, std::pmr::memory_resource* memory) {
  std::size_t size = 0;
  const Result<Descriptor> file = openRegular(path, size);
  if (!file) return file.error();
  if (size == 0) return FileBytes{};
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file->get(), 0);
  if (address == MAP_FAILED) return ioError(path, "cannot be mapped", errno);
  try {
    // Unmaps also where there is no memory for the owner.
    std::shared_ptr<const void> owner(
        address, [size](const void* p) { ::munmap(const_cast<void*>(p), size); },
        std::pmr::polymorphic_allocator<std::byte>(memory));
    return FileBytes{std::move(owner), {static_cast<const std::byte*>(address), size}};
  } catch (const std::bad_alloc& e) {
    return outOfMemory(e);
  }
}

Result<fs::path> followLinks(const fs::path& path) {
  constexpr int kMaxLinks = 40;  // as the kernel
  fs::path target = path;
  for (int i = 0; i < kMaxLinks; ++i) {
    std::error_code failed;
    const fs::path next = fs::read_symlink(target, failed);
    if (failed) return target;  // not a link, or nothing there yet
    struct statfs system {};
    if (::statfs(folderOf(target).c_str(), &system) == 0 && system.f_type == PROC_SUPER_MAGIC)
      return Error{ErrorCode::io, path.string() + ": is an open file of a process; a file's own name expected"};
    target = next.is_absolute() ? next : folderOf(target) / next;
  }
  return ioError(path, "cannot be written", ELOOP);
}

Status writeFileAtomically(const fs::path& path, const std::function<bool(const ByteSink&)>& body, unsigned mode) {
  const Result<fs::path> target = targetOf(path);
  if (!target) return target.error();
  removeStaleTemporaries(*target);
  const Result<Temporary> temporary = createTemporary(*target);
  if (!temporary) return temporary.error();

  int reason = 0;
  const auto step = [&](bool good) {
    if (!good && reason == 0) reason = errno != 0 ? errno : EIO;
    return good;
  };
  const int fd = temporary->file.get();
  const ByteSink sink = [&](std::span<const std::byte> bytes) { return step(writeAll(fd, bytes)); };
  errno = 0;
  if (!step(body(sink))) return ioError(path, "cannot be written", reason);
  keepAccess(*target, temporary->file);
  if (mode != 0) ::fchmod(fd, static_cast<mode_t>(mode));
  if (!step(::fsync(fd) == 0)) return ioError(path, "cannot be written", reason);
  if (!step(temporary->renameTo(*target))) return cannotBeReplaced(path, reason);
  syncFolder(folderOf(*target));
  return done();
}

void removeOpenTemporaries() {
  OpenTemporaries& open = openTemporaries();
  // The lock is kept, so that no thread renames or makes a file any more.
  if (!open.mutex.try_lock_for(std::chrono::milliseconds(100))) return;
  for (const fs::path& path : open.paths) ::unlink(path.c_str());
}

std::string lowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

Status checkWritable(const fs::path& path, bool* locks) {
  const Result<fs::path> target = targetOf(path);
  if (!target) return target.error();
  removeStaleTemporaries(*target);
  const Result<Temporary> temporary = createTemporary(*target);
  if (!temporary) return temporary.error();
  if (locks != nullptr) *locks = temporary->locked;
  return checkReplaceable(path, *target);
}

}  // namespace relume
