// SPDX-License-Identifier: MIT
// A store: bytes by name, in a folder or behind an HTTP server, shared by any number of bakes at once. It promises
// nothing: what was put may be gone, cut or another's at the next get. entry_cache.h, which bakes use, checks what it
// is given and does without what is not there.
#pragma once

#include "relume/result.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace relume {

// What tells entries apart: XXH3-128 of all that an entry was made from.
struct EntryName {
  std::uint64_t high = 0, low = 0;
  bool operator==(const EntryName&) const = default;
};
std::string toString(const EntryName& name);  // 32 digits, 0-9a-f
EntryName nameEntry(std::span<const std::byte> madeFrom);

class Store {
 public:
  Store() = default;
  virtual ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  // What stands under a name, as it was put; nothing where there is none. Of what is no entry, of one that is longer
  // than its header says and of one that is larger than maxBytes hardly more than the header is read.
  // invalidFile: what stands there cannot be an entry (no header of one, a link, a folder); it may be put again.
  // memory: it is larger than maxBytes, or there is no memory for it. unsupported: this one may not be read, others
  // may. io: the store cannot be read.
  virtual Result<std::optional<std::vector<std::byte>>> get(const EntryName& name, std::uint64_t maxBytes) = 0;
  // Whole or not at all, over what stood there. unsupported: this one may not be written, others may. io: the store
  // cannot be written, or is full.
  virtual Status put(const EntryName& name, std::span<const std::byte> bytes) = 0;
  // Remove what was used longest ago until `limit` bytes are left. Where a server keeps the files, or they may only be
  // read: nothing.
  virtual Status hold(std::uint64_t limit) = 0;
  // For messages: the folder, or the URL without its password.
  virtual std::string name() const = 0;

  // Asked several times a second while a server is waited for, with the bytes of an entry that have come: false gives
  // the get() or put() up (io). A folder's own file system decides how long that takes.
  void askWhileWaiting(std::function<bool(std::uint64_t come)> goesOn) { goesOn_ = std::move(goesOn); }

 protected:
  std::function<bool(std::uint64_t come)> goesOn_;
};

// The store of a folder, which is made if there is none, or of a URL (http://, https://). cancelled: asked while a
// server is waited for. usage: a URL that is none; io: a folder that cannot be made or listed.
Result<std::unique_ptr<Store>> openStore(const std::string& where, std::function<bool()> cancelled = {});
// Whether it is meant as a URL, well formed or not: with "://", with "http:" or "https:" at its begin in any case, or
// with a user and a password at its begin, where there is no such folder.
bool isUrl(const std::string& where);

// What a collection has found and removed.
struct GarbageReport {
  std::uint64_t entries = 0, bytes = 0;                // that are left
  std::uint64_t removedEntries = 0, removedBytes = 0;  // used longest ago
  std::uint64_t temporaries = 0;                       // of writers that died
  std::uint64_t keptEntries = 0;                       // that may not be removed, of those left
  std::uint64_t closedFolders = 0;                     // that may not be listed: what they hold is not counted
  std::string reason;                                  // of the first of either: its path, and what the system says
};
// Hold a folder to `limit` bytes. Writers and readers may be at work: what is removed under a reader is made again.
// Order is by the file system's own times, never by a machine's clock. What may not be removed stays, and others go in
// its place. io: the folder cannot be listed.
Result<GarbageReport> collectGarbage(const std::filesystem::path& folder, std::uint64_t limit);
// What opens to a group what was kept under a umask.
inline constexpr const char* kShareHint = "chmod -R g+rwX, as its owner, shares a store with a group";
// io: more than the limit is left, or may be.
Status checkHeld(const GarbageReport& report, const std::filesystem::path& folder, std::uint64_t limit);

}  // namespace relume
