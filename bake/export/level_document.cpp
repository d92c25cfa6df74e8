// SPDX-License-Identifier: MIT
// See level_document.h. The GLB container: glTF 2.0, section 4.4.
#include "bake/export/level_document.h"

#include "bake/base/read_json.h"
#include "bake/import/gltf_accessors.h"
#include "bake/import/gltf_file.h"
#include "bake/import/gltf_schema.h"
#include "formats/file_io.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>
#include <utility>

namespace relume {
namespace {

using nlohmann::json;

constexpr std::uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinChunk = 0x004E4942;
constexpr std::uint64_t kSliceAlignment = 16;  // beginnings of buffers keep theirs up to this

std::uint64_t roundUp(std::uint64_t value, std::uint64_t multiple) {
  return (value + multiple - 1) / multiple * multiple;
}

// By the first bytes; empty = none that glTF knows.
std::string mimeTypeOf(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 16));
  if (text.starts_with("\x89PNG")) return "image/png";
  if (text.starts_with("\xFF\xD8\xFF")) return "image/jpeg";
  if (text.starts_with("\xABKTX 20\xBB")) return "image/ktx2";
  if (text.starts_with("DDS ")) return "image/vnd-ms.dds";
  if (text.starts_with("RIFF") && text.substr(8).starts_with("WEBP")) return "image/webp";
  return {};
}

std::span<const std::byte> bytesOf(std::string_view text) { return std::as_bytes(std::span(text)); }

bool writeZeros(const ByteSink& sink, std::uint64_t count) {
  constexpr std::array<std::byte, 16> kZeros{};
  return count == 0 || sink(std::span(kZeros).first(static_cast<std::size_t>(count)));
}

}  // namespace

Result<LevelDocument> LevelDocument::read(const std::filesystem::path& path, Context& context) {
  // The importer's document has the bytes and their checks, but a model without what it does not know: the JSON is
  // read once more.
  Result<GltfDocument> source = loadGltfDocument(path, context);
  if (!source) return source.error();
  if (const Status status = checkRanges(*source); !status) return status.error();
  LevelDocument out;
  out.source_ = std::move(*source);
  out.files_ = out.source_.files;
  Result<std::vector<std::uint8_t>> bytes = readSceneBytes(path, out.source_.file);
  if (!bytes) return bytes.error();
  const Result<GltfContainer> container = splitContainer(std::move(*bytes), out.source_.file);
  if (!container) return container.error();
  Result<json> root = readJson(container->json);
  if (!root) return Error{ErrorCode::invalidFile, out.source_.at(root.error().message)};
  // Numbers of elements that were written as 3.0 are whole numbers from here on, as the importer has them.
  for (const json& accessor : root->value("accessors", json::array()))
    out.wholeAsFloats_ = out.wholeAsFloats_ || (accessor.contains("count") && accessor["count"].is_number_float());
  if (const Status status = checkGltfSchema(*root, out.source_.file); !status) return status.error();
  out.root = std::move(*root);
  out.meshesBefore_ = out.root.value("meshes", json::array());
  if (const Status status = out.embedBuffers(); !status) return status.error();
  out.embedImages(context);
  return out;
}

// One buffer in place of all that have data; those without, which stand in for compressed ones, follow it.
Status LevelDocument::embedBuffers() {
  json buffers = json::array({{{"byteLength", 0}}});
  std::vector<std::size_t> number(source_.buffers.size(), 0);
  base_.assign(source_.buffers.size(), 0);
  bool first = true;
  for (std::size_t i = 0; i < source_.buffers.size(); ++i) {
    const FileSlice& slice = source_.buffers[i];
    if (slice.fileBytes == 0) {
      number[i] = buffers.size();
      buffers.push_back(root["buffers"][i]);
      continue;
    }
    // Names and extras of the first stay.
    if (std::exchange(first, false)) buffers[0] = root["buffers"][i];
    base_[i] = roundUp(sourceBytes_, kSliceAlignment) + slice.begin % kSliceAlignment;
    sourceBytes_ = base_[i] + slice.bytes.size();
  }
  buffers[0].erase("uri");
  sourceBytes_ = roundUp(sourceBytes_, 4);

  const auto move = [&](json& element, const std::string& where) -> Status {
    const auto buffer = element.at("buffer").get<std::size_t>();
    if (buffer >= number.size()) return source_.invalid(where, jsonPath("buffers", static_cast<int>(buffer)));
    element["buffer"] = number[buffer];
    if (number[buffer] != 0) return done();
    const auto offset = element.value("byteOffset", std::uint64_t{0});
    if (!source_.buffers[buffer].range(offset, element.value("byteLength", std::uint64_t{0})))
      return Error{ErrorCode::unsupported,
                   source_.at(where + ": bytes of a buffer that no known extension names; export the level without")};
    element["byteOffset"] = offset - source_.buffers[buffer].begin + base_[buffer];
    return done();
  };
  if (root.contains("bufferViews")) {
    for (std::size_t i = 0; i < root["bufferViews"].size(); ++i) {
      json& view = root["bufferViews"][i];
      const std::string where = jsonPath("bufferViews", static_cast<int>(i));
      if (const Status status = move(view, where); !status) return status;
      if (!view.contains("extensions")) continue;
      for (auto& [name, extension] : view["extensions"].items()) {
        if (!extension.is_object() || !extension.contains("buffer") || !extension["buffer"].is_number_unsigned())
          continue;
        if (const Status status = move(extension, where + ".extensions." + name); !status) return status;
      }
    }
  }
  root["buffers"] = std::move(buffers);
  return done();
}

void LevelDocument::embedImages(Context& context) {
  if (!root.contains("images")) return;
  for (std::size_t i = 0; i < root["images"].size(); ++i) {
    json& image = root["images"][i];
    if (!image.contains("uri")) continue;
    const std::string where = jsonPath("images", static_cast<int>(i));
    const Result<FileSlice> bytes = readUri(image["uri"].get<std::string>(), source_.folder, source_.at(where), files_);
    const std::string type = bytes ? mimeTypeOf(bytes->bytes) : "";
    if (type.empty()) {
      const std::string why =
          bytes ? source_.at(where) + ": no image of a kind that glTF knows" : bytes.error().message;
      context.message(Severity::warning, why + "; it is not put into the .glb and keeps its URI");
      continue;
    }
    image["bufferView"] = addView(bytes->bytes, ViewTarget::none);
    image["mimeType"] = type;
    image.erase("uri");
  }
}

int LevelDocument::addView(std::span<const std::uint8_t> bytes, ViewTarget target, std::size_t stride) {
  added_.resize(roundUp(added_.size(), 4), 0);
  json view = {{"buffer", 0}, {"byteOffset", sourceBytes_ - cutBytes_ + added_.size()}, {"byteLength", bytes.size()}};
  if (target != ViewTarget::none) view["target"] = static_cast<int>(target);
  if (stride != 0) view["byteStride"] = stride;
  added_.insert(added_.end(), bytes.begin(), bytes.end());
  root["bufferViews"].push_back(std::move(view));
  return static_cast<int>(root["bufferViews"].size()) - 1;
}

int LevelDocument::addAccessor(json accessor) {
  root["accessors"].push_back(std::move(accessor));
  return static_cast<int>(root["accessors"].size()) - 1;
}

std::uint64_t LevelDocument::cut(std::vector<ByteRange> ranges) {
  cuts_ = std::move(ranges);
  for (const ByteRange& range : cuts_) cutBytes_ += range.end - range.begin;
  return cutBytes_;
}

Status LevelDocument::write(const std::filesystem::path& path) const {
  // What it is shows in its first bytes: `asset` opens the JSON.
  json rest = root;
  const std::uint64_t used = sourceBytes_ - cutBytes_ + added_.size(), binary = roundUp(used, 4);
  if (binary > 0) {
    rest["buffers"][0]["byteLength"] = used;
  } else if (rest["buffers"].size() == 1) {
    rest.erase("buffers");
  }
  const json asset = rest["asset"];
  rest.erase("asset");
  std::string text = "{\"asset\":" + asset.dump();
  text += rest.empty() ? "}" : "," + rest.dump().substr(1);
  text.resize(roundUp(text.size(), 4), ' ');
  const std::uint64_t size = 12 + 8 + text.size() + (binary > 0 ? 8 + binary : 0);
  if (size > std::numeric_limits<std::uint32_t>::max())
    return Error{ErrorCode::unsupported, path.string() + ": would have " + std::to_string(size) +
                                             " bytes, a .glb at most 4294967295; compress the level's images, or "
                                             "split the level"};

  return writeFileAtomically(path, [&](const ByteSink& sink) {
    const std::array<std::uint32_t, 5> header{kGlbMagic, 2, static_cast<std::uint32_t>(size),
                                              static_cast<std::uint32_t>(text.size()), kJsonChunk};
    const std::array<std::uint32_t, 2> chunk{static_cast<std::uint32_t>(binary), kBinChunk};
    if (!sink(std::as_bytes(std::span(header))) || !sink(bytesOf(text))) return false;
    if (binary == 0) return true;
    if (!sink(std::as_bytes(std::span(chunk)))) return false;
    std::uint64_t at = 0;
    // Bytes from `at` on, without those that were cut.
    const auto put = [&](std::span<const std::uint8_t> bytes) {
      const std::uint64_t end = at + bytes.size();
      auto next = std::upper_bound(cuts_.begin(), cuts_.end(), at,
                                   [](std::uint64_t value, const ByteRange& range) { return value < range.end; });
      while (at < end) {
        const std::uint64_t stop = next == cuts_.end() ? end : std::min(end, next->begin);
        if (stop > at && !sink(std::as_bytes(bytes.last(end - at).first(stop - at)))) return false;
        at = next == cuts_.end() ? stop : std::max(at, std::min(end, next->end));
        if (next != cuts_.end() && at >= next->end) ++next;
      }
      return true;
    };
    constexpr std::array<std::uint8_t, 16> kGap{};
    for (std::size_t i = 0; i < source_.buffers.size(); ++i) {
      const std::vector<std::uint8_t>& bytes = source_.buffers[i].bytes;
      if (source_.buffers[i].fileBytes == 0) continue;
      while (at < base_[i]) {
        if (!put(std::span(kGap).first(std::min<std::uint64_t>(base_[i] - at, 16)))) return false;
      }
      if (!put(bytes)) return false;
    }
    if (!put(std::span(kGap).first(sourceBytes_ - at))) return false;
    if (!added_.empty() && !sink(std::as_bytes(std::span(added_)))) return false;
    return writeZeros(sink, binary - used);
  });
}

}  // namespace relume
