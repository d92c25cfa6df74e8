// SPDX-License-Identifier: MIT
// A store in a folder: FOLDER/ab/abcdef..., a file an entry, 256 folders. Files are written under another name and
// renamed; the one that was used last has the latest time, by the file system's clock, which all machines share. What
// is made in it may be read and written by those who may read and write the store's own folder.
#pragma once

#include "bake/store/store.h"

namespace relume {

class DirectoryStore : public Store {
 public:
  explicit DirectoryStore(std::filesystem::path folder) : folder_(std::move(folder)) {}
  Result<std::optional<std::vector<std::byte>>> get(const EntryName& name, std::uint64_t maxBytes) override;
  Status put(const EntryName& name, std::span<const std::byte> bytes) override;
  Status hold(std::uint64_t limit) override;
  std::string name() const override { return "\"" + folder_.string() + "\""; }

 private:
  std::filesystem::path pathOf(const EntryName& name) const;

  std::filesystem::path folder_;
};

// The folder of an entry, and whether a name is that of one: what is not, or does not begin as one, was put there by
// somebody else, and no collection touches it.
std::string folderOf(const std::string& entry);
bool isEntryName(const std::string& text);
bool isEntryFolder(const std::string& text);

}  // namespace relume
