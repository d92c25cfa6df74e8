// SPDX-License-Identifier: MIT
// See gltf_file.h. The GLB container: glTF 2.0, section 4.4.
#include "bake/import/gltf_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>

namespace relume {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kGlbMagic = 0x46546C67;  // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinChunk = 0x004E4942;

Error invalid(const std::string& where, const std::string& what) {
  return {ErrorCode::invalidFile, where + ": " + what};
}

std::uint32_t readU32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) | static_cast<std::uint32_t>(bytes[at + 1]) << 8 |
         static_cast<std::uint32_t>(bytes[at + 2]) << 16 | static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

Error glbTooShort(const std::string& file, std::uint64_t claimed, std::uint64_t found) {
  return invalid(file, "GLB says it has " + std::to_string(claimed) + " bytes, the file has " + std::to_string(found));
}

bool isGlb(std::span<const std::uint8_t> bytes) { return bytes.size() >= 4 && readU32(bytes, 0) == kGlbMagic; }

Status checkBeginsAsJson(std::span<const std::uint8_t> bytes, const std::string& file) {
  if (bytes.empty()) return invalid(file, "empty file; expected a .glb or .gltf");
  const auto text = std::find_if(bytes.begin(), bytes.end(), [](std::uint8_t c) { return c > ' '; });
  const bool bom = bytes.size() > 3 && bytes[0] == 0xEF && bytes[1] == 0xBB && bytes[2] == 0xBF;
  if (bom || (text != bytes.end() && *text == '{')) return done();
  return invalid(file, "neither a .glb (magic 'glTF') nor a .gltf (JSON object)");
}

int hexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// Percent-decoding, once; nothing when malformed.
std::optional<std::string> percentDecode(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out.push_back(text[i]);
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    const int high = hexDigit(text[i + 1]), low = hexDigit(text[i + 2]);
    if (high < 0 || low < 0) return std::nullopt;
    out.push_back(static_cast<char>(high * 16 + low));
    i += 2;
  }
  return out;
}

std::optional<std::vector<std::uint8_t>> base64Decode(std::string_view text) {
  static const std::array<std::int8_t, 256> kValue = [] {
    std::array<std::int8_t, 256> table{};
    table.fill(-1);
    const std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < alphabet.size(); ++i)
      table[static_cast<std::uint8_t>(alphabet[i])] = static_cast<std::int8_t>(i);
    return table;
  }();
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  if (text.size() % 4 == 1) return std::nullopt;
  std::vector<std::uint8_t> out;
  out.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    const std::int8_t value = kValue[static_cast<std::uint8_t>(c)];
    if (value < 0) return std::nullopt;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    held += 6;
    if (held < 8) continue;
    held -= 8;
    out.push_back(static_cast<std::uint8_t>(bits >> held & 0xFF));
  }
  return out;
}

// Whether two texts are the same but for the case of their letters; `small` has none of another case.
bool isSame(std::string_view text, std::string_view small) {
  return std::equal(text.begin(), text.end(), small.begin(), small.end(),
                    [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; });
}

constexpr std::string_view kDataScheme = "data:";

Result<std::vector<std::uint8_t>> readDataUri(std::string_view uri, const std::string& where) {
  constexpr std::string_view kEncoding = ";base64";
  const std::size_t comma = uri.find(',');
  const std::string_view head = uri.substr(0, comma);
  if (comma == std::string_view::npos || head.size() < kEncoding.size() ||
      !isSame(head.substr(head.size() - kEncoding.size()), kEncoding))
    return invalid(where, "data URI that is not base64");
  std::string_view text = uri.substr(comma + 1);
  std::optional<std::string> decoded;
  if (text.find('%') != std::string_view::npos) {
    decoded = percentDecode(text);
    if (!decoded) return invalid(where, "data URI with a malformed % in its base64");
    text = *decoded;
  }
  auto bytes = base64Decode(text);
  if (bytes) return std::move(*bytes);
  // Encoders for mail break lines.
  const std::size_t blank = text.find_first_of(" \t\r\n");
  if (blank == std::string_view::npos) return invalid(where, "data URI with broken base64");
  return invalid(where, "data URI with a blank or line break in its base64, after " + std::to_string(blank) +
                            " characters; URIs have none, write it in one piece");
}

// A file beside the scene.
struct FileInside {
  fs::path file;                  // links followed, as it is read
  std::vector<fs::path> asNamed;  // by the scene's own path: what the URI names, and where links lead from there
};

// The file a relative URI names, which must stay inside the folder, links followed.
Result<FileInside> resolveInside(const std::string& uri, const fs::path& folder, const std::string& where) {
  const char* const remedy = "put the file into it, or export the level as one .glb";
  const std::string quoted = "'" + uri.substr(0, 200) + "'";
  const std::optional<std::string> name = percentDecode(uri);
  if (!name || name->empty() || name->find('\0') != std::string::npos) return invalid(where, "malformed URI " + quoted);
  // RFC 3986, section 3: a colon ends a scheme only before the first of these.
  const std::size_t delimiter = uri.find_first_of(":/?#");
  if (delimiter != std::string::npos && uri[delimiter] == ':')
    return invalid(where, "URI " + quoted + " has a scheme; expected a file beside the scene or a data URI");
  if (name->find('\\') != std::string::npos)
    return invalid(where, "URI " + quoted + " has a backslash; expected / between folder and file");
  const fs::path relative = fs::path(*name).lexically_normal();  // as URIs are resolved: a/../b is b, whatever a is
  if (relative.is_absolute() || *relative.begin() == "..")
    return invalid(where, "URI " + quoted + " leaves the scene's folder; " + remedy);

  std::error_code ec;
  const fs::path root = fs::canonical(folder, ec);
  if (ec) return Error{ErrorCode::io, where + ": folder " + folder.string() + ": " + ec.message()};
  const fs::path file = fs::canonical(root / relative, ec);
  if (ec) return Error{ErrorCode::io, where + ": " + quoted + " not found beside the scene (" + ec.message() + ")"};
  if (std::mismatch(root.begin(), root.end(), file.begin(), file.end()).first != root.end())
    return invalid(where, "URI " + quoted + " is a link that leaves the scene's folder; " + remedy);
  const auto asNamed = [&](const fs::path& inside) { return folder == "." ? inside : folder / inside; };
  FileInside found{file, {asNamed(relative)}};
  if (file != (root / relative).lexically_normal()) found.asNamed.push_back(asNamed(file.lexically_relative(root)));
  return found;
}

}  // namespace

std::optional<std::span<const std::uint8_t>> FileSlice::range(std::uint64_t offset, std::uint64_t length) const {
  if (offset > fileBytes || length > fileBytes - offset) return std::nullopt;
  if (length == 0) return std::span<const std::uint8_t>();
  if (offset < begin || offset - begin > bytes.size() || length > bytes.size() - (offset - begin)) return std::nullopt;
  return std::span(bytes).subspan(static_cast<std::size_t>(offset - begin), static_cast<std::size_t>(length));
}

Result<FileSlice> readFileBytes(const fs::path& path, const std::string& where, ByteRange range) {
  // Name the scene's own file only once in a message.
  const std::string file = (path.filename() == where ? "" : where + ": ") + path.string();
  std::error_code ec;
  const fs::file_status status = fs::status(path, ec);
  const auto unreadable = [&](const std::string& reason) {
    return Error{ErrorCode::io, file + ": cannot be read: " + reason};
  };
  if (!fs::status_known(status)) return unreadable(ec.message());
  if (!fs::exists(status)) return Error{ErrorCode::io, file + ": no such file"};
  if (!fs::is_regular_file(status)) return Error{ErrorCode::io, file + ": not a regular file"};
  const std::uintmax_t size = fs::file_size(path, ec);
  if (ec) return unreadable(ec.message());
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) return unreadable(std::generic_category().message(errno != 0 ? errno : EIO));
  FileSlice slice;
  slice.fileBytes = size;
  const std::uint64_t end = std::min<std::uint64_t>(range.end, size);
  slice.begin = std::min(range.begin, end);
  slice.bytes.resize(static_cast<std::size_t>(end - slice.begin));
  in.seekg(static_cast<std::streamoff>(slice.begin));
  in.read(reinterpret_cast<char*>(slice.bytes.data()), static_cast<std::streamsize>(slice.bytes.size()));
  if (static_cast<std::size_t>(in.gcount()) != slice.bytes.size()) return Error{ErrorCode::io, file + ": ended early"};
  return slice;
}

Result<std::vector<std::uint8_t>> readSceneBytes(const fs::path& path, const std::string& file) {
  constexpr std::uint64_t kBeginning = 4096;  // white space before a .gltf's first brace may be as long
  Result<FileSlice> beginning = readFileBytes(path, file, {0, kBeginning});
  if (!beginning) return beginning.error();
  const std::vector<std::uint8_t>& bytes = beginning->bytes;
  std::uint64_t end = beginning->fileBytes;
  if (isGlb(bytes)) {
    const std::uint64_t claimed = bytes.size() >= 12 ? readU32(bytes, 8) : end;
    if (claimed > end) return glbTooShort(file, claimed, end);
    end = claimed;
  } else {
    if (const Status status = checkBeginsAsJson(bytes, file); !status) return status.error();
    if (end > kMaxGltfBytes)
      return invalid(file, "a .gltf of " + std::to_string(end) + " bytes, at most " + std::to_string(kMaxGltfBytes) +
                               " expected; buffers may have files of their own");
  }
  // splitContainer() reports a header that claims fewer bytes than it has itself.
  if (end <= bytes.size()) return std::move(beginning->bytes);
  Result<FileSlice> whole = readFileBytes(path, file, {0, end});
  if (!whole) return whole.error();
  return std::move(whole->bytes);
}

Result<GltfContainer> splitContainer(std::vector<std::uint8_t> bytes, const std::string& file) {
  GltfContainer container;
  if (!isGlb(bytes)) {
    if (const Status status = checkBeginsAsJson(bytes, file); !status) return status.error();
    container.json.assign(bytes.begin(), bytes.end());
    return container;
  }

  if (bytes.size() < 20) return invalid(file, "GLB of " + std::to_string(bytes.size()) + " bytes is cut short");
  const std::uint32_t version = readU32(bytes, 4), length = readU32(bytes, 8);
  if (version != 2)
    return Error{ErrorCode::unsupported, file + ": GLB version " + std::to_string(version) + "; expected 2"};
  if (length > bytes.size() || length < 20) return glbTooShort(file, length, bytes.size());
  for (std::size_t at = 12, index = 0; at + 8 <= length; ++index) {
    const std::size_t size = readU32(bytes, at);
    const std::uint32_t type = readU32(bytes, at + 4);
    at += 8;
    if (size > length - at)
      return invalid(file, "GLB chunk " + std::to_string(index) + " says it has " + std::to_string(size) + " bytes, " +
                               std::to_string(length - at) + " are left");
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const auto end = begin + static_cast<std::ptrdiff_t>(size);
    if (index == 0 && type != kJsonChunk) return invalid(file, "GLB does not begin with a JSON chunk");
    if (index == 0) container.json.assign(begin, end);
    if (index == 1 && type == kBinChunk) {
      container.binary.assign(begin, end);
      container.hasBinary = true;
    }
    at += std::min((size + 3) / 4 * 4, length - at);
  }
  return container;
}

Result<FileSlice> readUri(const std::string& uri, const fs::path& folder, const std::string& where,
                          std::vector<fs::path>& filesRead, ByteRange range) {
  if (isSame(std::string_view(uri).substr(0, kDataScheme.size()), kDataScheme)) {
    Result<std::vector<std::uint8_t>> bytes = readDataUri(uri, where);
    if (!bytes) return bytes.error();
    const std::uint64_t size = bytes->size();
    return FileSlice{std::move(*bytes), 0, size};
  }
  const Result<FileInside> found = resolveInside(uri, folder, where);
  if (!found) return found.error();
  // An image is read in two parts, one after the other.
  const auto last = filesRead.end() - std::min(std::ssize(filesRead), std::ssize(found->asNamed));
  if (!std::equal(last, filesRead.end(), found->asNamed.begin(), found->asNamed.end()))
    filesRead.insert(filesRead.end(), found->asNamed.begin(), found->asNamed.end());
  return readFileBytes(found->file, where, range);
}

}  // namespace relume
