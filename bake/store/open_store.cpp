// SPDX-License-Identifier: MIT
// Chooses the kind of a store by its name (store.h).
#include "bake/store/directory_store.h"
#include "bake/store/http_store.h"

#include <strings.h>

#include <algorithm>
#include <system_error>

namespace relume {
namespace {

// "user:password@server/folder".
bool beginsWithPassword(const std::string& where) {
  const std::size_t colon = where.find(':'), at = where.find('@', std::min(colon, where.size()));
  return at < where.find('/');
}

}  // namespace

Store::~Store() = default;

// A URL that lost a slash or all before its user is no folder: its password would become one's name.
bool isUrl(const std::string& where) {
  std::error_code none;
  return (beginsWithPassword(where) && !std::filesystem::is_directory(where, none)) ||
         where.find("://") != std::string::npos || ::strncasecmp(where.c_str(), "http:", 5) == 0 ||
         ::strncasecmp(where.c_str(), "https:", 6) == 0;
}

Result<std::unique_ptr<Store>> openStore(const std::string& where, std::function<bool()> cancelled) {
  if (isUrl(where)) return openHttpStore(where, std::move(cancelled));
  if (where.empty()) return Error{ErrorCode::usage, "the store: a folder or a URL expected, \"\" found"};
  const std::filesystem::path folder(where);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (std::error_code none; !std::filesystem::is_directory(folder, none))
    return Error{ErrorCode::io, where + ": no folder" + (error ? ": " + error.message() : std::string())};
  return std::unique_ptr<Store>(std::make_unique<DirectoryStore>(folder));
}

}  // namespace relume
