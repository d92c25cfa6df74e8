// SPDX-License-Identifier: MIT
// EXT_meshopt_compression and its successor KHR_meshopt_compression: decode compressed buffer views with meshoptimizer.
// Sizes are bounded before anything is allocated: the codecs expand at most 64-fold (vertices, 1024-fold by version 1
// of their codec) or to three indices a byte (triangles). Only the successor has version 1 and the filter COLOR, which
// need a newer library than the rest.
#include "bake/import/gltf_document.h"

#include <meshoptimizer.h>

namespace relume {
namespace {

// What the library decodes.
constexpr int kNewestVertexCodec = MESHOPTIMIZER_VERSION >= 230 ? 1 : 0;
constexpr bool kReadsColor = MESHOPTIMIZER_VERSION >= 250;
constexpr std::uint64_t kMaxExpansion[] = {64, 1024};  // by version of the vertex codec
constexpr std::uint64_t kSlackBytes = 16384;           // one vertex block, whatever it compressed to
constexpr std::uint64_t kMaxTotalExpansion = 256;      // of all views against all bytes read

struct Compressed {
  int buffer = -1;
  std::span<const std::uint8_t> bytes;
  std::size_t count = 0, stride = 0;
  std::string mode, filter;
};

Result<Compressed> readExtension(const GltfDocument& document, const tinygltf::Value& extension,
                                 const std::string& where) {
  const int buffer = indexOr(extension, "buffer", -1);
  if (buffer < 0 || static_cast<std::size_t>(buffer) >= document.buffers.size())
    return document.invalid(where, jsonPath("buffers", buffer) + " does not exist");
  const FileSlice& slice = document.buffers[static_cast<std::size_t>(buffer)];
  const auto offset = static_cast<std::uint64_t>(numberOr(extension, "byteOffset", 0.0));
  const auto length = static_cast<std::uint64_t>(numberOr(extension, "byteLength", 0.0));
  const auto bytes = slice.range(offset, length);
  if (!bytes)
    return document.invalid(where, "bytes " + std::to_string(offset) + " + " + std::to_string(length) + " of " +
                                       jsonPath("buffers", buffer) + ", which has " + std::to_string(slice.fileBytes));
  Compressed out;
  out.buffer = buffer;
  out.bytes = *bytes;
  out.count = static_cast<std::size_t>(numberOr(extension, "count", 0.0));
  out.stride = static_cast<std::size_t>(numberOr(extension, "byteStride", 0.0));
  out.mode = extension.Get("mode").Get<std::string>();
  out.filter = extension.Has("filter") ? extension.Get("filter").Get<std::string>() : "NONE";
  return out;
}

// The first byte of a stream of vertices: 0xa0 + version. 0 for any other, which decodes to an error.
int vertexCodec(const Compressed& view) {
  constexpr int kFirstByte = 0xa0;
  const bool isVertices = view.mode == "ATTRIBUTES" && !view.bytes.empty() && (view.bytes[0] & 0xf0) == kFirstByte;
  return isVertices ? view.bytes[0] - kFirstByte : 0;
}

// Whether the library can decode the view at all.
Status checkCodec(const GltfDocument& document, const Compressed& view, const std::string& where) {
  std::string needed;
  if (const int version = vertexCodec(view); version > kNewestVertexCodec)
    needed = "version " + std::to_string(version) + " of the vertex codec";
  else if (view.filter == "COLOR" && !kReadsColor)
    needed = "filter COLOR";
  else
    return done();
  constexpr int kLibrary = MESHOPTIMIZER_VERSION;
  return Error{ErrorCode::unsupported,
               document.at(where + ": " + needed + " is not in meshoptimizer " + std::to_string(kLibrary / 1000) + "." +
                           std::to_string(kLibrary / 10 % 100) +
                           ", which reads these here; write the file again by gltfpack -ce ext")};
}

Status checkClaims(const GltfDocument& document, const Compressed& view, const std::string& where) {
  const bool attributes = view.mode == "ATTRIBUTES";
  const bool strideFits = attributes ? view.stride >= 4 && view.stride <= 256 && view.stride % 4 == 0
                                     : view.stride == 2 || view.stride == 4;
  if (!strideFits)
    return document.invalid(where, "byteStride " + std::to_string(view.stride) + " for mode " + view.mode);
  if (!attributes && view.mode != "TRIANGLES" && view.mode != "INDICES")
    return document.invalid(where, "unknown mode " + view.mode);
  if (view.mode == "TRIANGLES" && view.count % 3 != 0)
    return document.invalid(where, std::to_string(view.count) + " indices are not whole triangles");
  const std::uint64_t max =
      attributes ? (kMaxExpansion[vertexCodec(view) == 0 ? 0 : 1] * view.bytes.size() + kSlackBytes) / view.stride
                 : 3 * static_cast<std::uint64_t>(view.bytes.size());
  if (view.count > max)
    return document.invalid(where, "claims " + std::to_string(view.count) + " elements in " +
                                       std::to_string(view.bytes.size()) + " compressed bytes");
  const bool quaternion = view.filter == "QUATERNION";
  const bool ofBytesOrShorts = view.filter == "OCTAHEDRAL" || view.filter == "COLOR";
  if (!quaternion && !ofBytesOrShorts && view.filter != "EXPONENTIAL" && view.filter != "NONE")
    return document.invalid(where, "unknown filter " + view.filter);
  if (view.filter != "NONE" && !attributes) return document.invalid(where, "filter on mode " + view.mode);
  if ((quaternion && view.stride != 8) || (ofBytesOrShorts && view.stride != 4 && view.stride != 8))
    return document.invalid(where, "byteStride " + std::to_string(view.stride) + " for filter " + view.filter);
  return done();
}

bool decode(const Compressed& view, std::vector<std::uint8_t>& out) {
  const unsigned char* bytes = view.bytes.data();
  const std::size_t size = view.bytes.size();
  int result = 0;
  if (view.mode == "ATTRIBUTES") {
    result = meshopt_decodeVertexBuffer(out.data(), view.count, view.stride, bytes, size);
  } else if (view.mode == "TRIANGLES") {
    result = meshopt_decodeIndexBuffer(out.data(), view.count, view.stride, bytes, size);
  } else {
    result = meshopt_decodeIndexSequence(out.data(), view.count, view.stride, bytes, size);
  }
  if (result != 0) return false;
  if (view.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(out.data(), view.count, view.stride);
  if (view.filter == "QUATERNION") meshopt_decodeFilterQuat(out.data(), view.count, view.stride);
  if (view.filter == "EXPONENTIAL") meshopt_decodeFilterExp(out.data(), view.count, view.stride);
#if MESHOPTIMIZER_VERSION >= 250
  if (view.filter == "COLOR") meshopt_decodeFilterColor(out.data(), view.count, view.stride);
#endif
  return true;
}

// The name of the extension that compresses a view; null for plain ones.
const char* compressionOf(const tinygltf::BufferView& view) {
  for (const char* name : kMeshoptExtensions) {
    if (view.extensions.contains(name)) return name;
  }
  return nullptr;
}

}  // namespace

Status decodeMeshopt(GltfDocument& document) {
  std::uint64_t total = 0;
  const std::uint64_t budget = kMaxTotalExpansion * document.dataBytes;
  for (std::size_t i = 0; i < document.model.bufferViews.size(); ++i) {
    tinygltf::BufferView& raw = document.model.bufferViews[i];
    const char* name = compressionOf(raw);
    if (name == nullptr) continue;
    const std::string where = jsonPath("bufferViews", static_cast<int>(i)) + ".extensions." + name;
    const Result<Compressed> view = readExtension(document, raw.extensions.at(name), where);
    if (!view) return view.error();
    if (Status status = checkClaims(document, *view, where); !status) return status.error();
    if (Status status = checkCodec(document, *view, where); !status) {
      if (raw.buffer != view->buffer && document.hasData(raw.buffer)) continue;  // read as it is there, uncompressed
      return status.error();
    }
    total += std::uint64_t{view->count} * view->stride;
    if (total > budget)
      return document.invalid(where, "the file's compressed views decode to more than " +
                                         std::to_string(kMaxTotalExpansion) + " times its size");
    std::vector<std::uint8_t> bytes(view->count * view->stride);
    if (view->count > 0 && !decode(*view, bytes))
      return document.invalid(
          where, "broken compressed data (mode " + view->mode + ", " + std::to_string(view->count) + " elements)");
    raw.byteStride = view->mode == "ATTRIBUTES" ? view->stride : 0;
    document.decodedViews[i] = std::move(bytes);
  }
  document.dataBytes += total;
  return done();
}

}  // namespace relume
