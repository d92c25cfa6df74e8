// SPDX-License-Identifier: MIT
// Files as a bake needs them: read whole or mapped, written so that a crash at any moment leaves the old file or the
// new one, never a part. POSIX.
#pragma once

#include "relume/result.h"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <memory_resource>
#include <span>
#include <string>

namespace relume {

// What a reader says of a file that is not what it should be.
inline Error invalidFile(const std::string& message) { return {ErrorCode::invalidFile, message}; }

// Bytes and what keeps them alive. Aligned to 64.
struct FileBytes {
  std::shared_ptr<const void> owner;
  std::span<const std::byte> bytes;
};

// io: cannot be opened or read, or is not a regular file. invalidFile: larger than `maxBytes`, which is looked at
// before anything is read. memory: there is not enough for it. Messages name the path. Memory comes from `memory` [not
// null], which must outlive the owner.
Result<FileBytes> readFile(const std::filesystem::path& path,
                           std::size_t maxBytes = std::numeric_limits<std::size_t>::max(),
                           std::pmr::memory_resource* memory = std::pmr::new_delete_resource());
// The same, mapped read-only. The file must not be shortened while it is mapped (replacing it by rename is safe).
Result<FileBytes> mapFile(const std::filesystem::path& path,
                          std::pmr::memory_resource* memory = std::pmr::new_delete_resource());

// Hands bytes to the file; false when the disk refuses them.
using ByteSink = std::function<bool(std::span<const std::byte>)>;

// Write through `body` into a temporary beside `path`, flush it to the disk, and rename it to `path`. On failure the
// temporary is removed and `path` is untouched. Temporaries that killed runs left for the same path are removed first;
// where the file system has no locks, those of the last day are left alone, because a neighbour may be writing them.
// A file that is replaced hands on its mode, and its group where this user may give it; `mode`, unless 0, is the file's
// in any case.
// A symbolic link stays, and what it points to is written. Devices, pipes and links of /proc are refused.
// io: names the path and the system's reason.
Status writeFileAtomically(const std::filesystem::path& path, const std::function<bool(const ByteSink&)>& body,
                           unsigned mode = 0);

// Remove the temporaries that writeFileAtomically() is writing, in any thread of this process; files that are whole
// stay. From then on such writes wait for ever. For a process that ends by _exit() right after, while its threads still
// work. Waits a tenth of a second at most for a file system that does not respond. Not for signal handlers.
void removeOpenTemporaries();

// Whether writeFileAtomically() can work: the folder exists and can be written, the path is no folder and no name too
// long, a file there can be replaced (not another user's in a sticky folder, nor immutable or mounted). Also removes
// stale temporaries. For commands that compute for minutes before they write. `locks`, unless null, becomes whether
// the file system has locks (flock).
Status checkWritable(const std::filesystem::path& path, bool* locks = nullptr);

// What a file's name ends in, from its last dot on, in lower case: "a.PNG" is a picture as "a.png" is.
std::string lowerExtension(const std::filesystem::path& path);

// The path with its last component's symbolic links followed; the last of them may point to a file that does not exist
// yet. io: links in a circle, a link of /proc (an open file of a process, which has no name to rename to).
Result<std::filesystem::path> followLinks(const std::filesystem::path& path);

}  // namespace relume
