// SPDX-License-Identifier: MIT
// KHR_draco_mesh_compression: one primitive's triangles and attributes. Draco allocates what its stream claims, so the
// claims are checked against the stream's size and the accessors before each of its two steps, connectivity and
// attributes.
#include "bake/import/gltf_import.h"

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include <algorithm>
#include <array>
#include <exception>
#include <memory>
#include <type_traits>

namespace relume {
namespace {

float normalizer(draco::DataType type) {
  switch (type) {
    case draco::DT_INT8:
      return 1.0f / 127.0f;
    case draco::DT_UINT8:
      return 1.0f / 255.0f;
    case draco::DT_INT16:
      return 1.0f / 32767.0f;
    case draco::DT_UINT16:
      return 1.0f / 65535.0f;
    default:
      return 1.0f;
  }
}

Result<AccessorValues> readAttribute(const GltfDocument& document, const draco::Mesh& mesh,
                                     const draco::PointAttribute& attribute, bool normalized,
                                     const std::string& where) {
  AccessorValues out;
  out.count = mesh.num_points();
  out.components = attribute.num_components();
  if (out.components < 1 || out.components > 4)
    return document.invalid(where, std::to_string(out.components) + " components");
  out.values.reserve(out.count * static_cast<std::size_t>(out.components));
  const float scale = normalized && !attribute.normalized() ? normalizer(attribute.data_type()) : 1.0f;
  std::array<float, 4> value{};
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    const draco::AttributeValueIndex index = attribute.mapped_index(point);
    if (index.value() >= attribute.size() ||
        !attribute.ConvertValue<float>(index, static_cast<std::int8_t>(out.components), value.data()))
      return document.invalid(where, "value of point " + std::to_string(point.value()) + " is missing");
    for (int c = 0; c < out.components; ++c) out.values.push_back(value[static_cast<std::size_t>(c)] * scale);
  }
  return out;
}

// A flat regular grid may compress to nearly nothing; beyond this many triangles no encoder gets below a sixteenth of
// a byte.
constexpr std::uint64_t kFreeTriangles = 65536, kMaxTrianglesPerDracoByte = 16;
constexpr std::uint64_t kMaxPointBytes = 512;  // of all attributes of a point

// What a primitive's stream may claim.
struct DracoClaims {
  std::uint64_t triangles = 0;  // at most
  std::uint64_t points = 0;     // at most
  std::string refused;          // out: why the stream was refused, if it was

  bool refuse(const std::string& why) {
    refused = why;
    return false;
  }
  bool check(std::uint64_t claimed, std::uint64_t max, const char* what) {
    return claimed <= max ||
           refuse("claims " + std::to_string(claimed) + " " + what + ", expected at most " + std::to_string(max));
  }
};

// The sizes in front of the connectivity: Draco bitstream 2.2, sequential and edgebreaker.
bool checkConnectivity(draco::DecoderBuffer ahead, bool edgebreaker, DracoClaims& claims) {
  std::uint32_t triangles = 0, points = 0;
  std::uint32_t *first = edgebreaker ? &points : &triangles, *second = edgebreaker ? &triangles : &points;
  return draco::DecodeVarint(first, &ahead) && draco::DecodeVarint(second, &ahead) &&
         claims.check(triangles, claims.triangles, "triangles") && claims.check(points, claims.points, "points");
}

// One of Draco's two mesh decoders, which stops where a claim is too large.
template <class Decoder>
class BoundedDecoder : public Decoder {
 public:
  explicit BoundedDecoder(DracoClaims& claims) : claims_(claims) {}

 protected:
  bool DecodeConnectivity() override {
    constexpr bool edgebreaker = std::is_same_v<Decoder, draco::MeshEdgebreakerDecoder>;
    return checkConnectivity(*this->buffer(), edgebreaker, claims_) && Decoder::DecodeConnectivity();
  }
  bool DecodeAllAttributes() override {
    std::uint64_t bytes = 0;
    for (std::int32_t i = 0; i < this->point_cloud()->num_attributes(); ++i) {
      const draco::PointAttribute& a = *this->point_cloud()->attribute(i);
      bytes += static_cast<std::uint64_t>(a.num_components()) *
               static_cast<std::uint64_t>(draco::DataTypeLength(a.data_type()));
    }
    return claims_.check(bytes, kMaxPointBytes, "bytes a point") &&
           claims_.check(this->point_cloud()->num_points(), claims_.points, "points") && Decoder::DecodeAllAttributes();
  }

 private:
  DracoClaims& claims_;
};

template <class Decoder>
draco::Status decodeWith(draco::DecoderBuffer& buffer, DracoClaims& claims, draco::Mesh& mesh) {
  BoundedDecoder<Decoder> decoder(claims);
  return decoder.Decode(draco::DecoderOptions(), &buffer, &mesh);
}

std::unique_ptr<draco::Mesh> decodeMesh(std::span<const std::uint8_t> bytes, DracoClaims& claims, std::string& error) {
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::DecoderBuffer ahead = buffer;
    draco::DracoHeader header;
    draco::Status status = draco::PointCloudDecoder::DecodeHeader(&ahead, &header);
    if (status.ok() &&
        (header.version_major != 2 || header.version_minor != 2 || header.encoder_type != draco::TRIANGULAR_MESH))
      status = draco::Status(draco::Status::UNSUPPORTED_VERSION, "not a mesh of Draco bitstream 2.2");
    auto mesh = std::make_unique<draco::Mesh>();
    if (status.ok() && header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING)
      status = decodeWith<draco::MeshSequentialDecoder>(buffer, claims, *mesh);
    else if (status.ok())
      status = decodeWith<draco::MeshEdgebreakerDecoder>(buffer, claims, *mesh);
    if (status.ok()) return mesh;
    error = claims.refused.empty() ? status.error_msg_string() : claims.refused;
  } catch (const std::bad_alloc&) {
    throw;  // not an error of the file: importGltf() reports it
  } catch (const std::exception& e) {
    error = e.what();
  }
  return nullptr;
}

// The primitive's accessors say how many there are; without one, the stream's size bounds them.
DracoClaims claimsOf(const GltfDocument& document, const tinygltf::Primitive& primitive, std::size_t bytes) {
  const auto countOf = [&](int accessor, std::uint64_t otherwise) {
    const auto index = static_cast<std::size_t>(accessor);
    return accessor >= 0 && index < document.model.accessors.size() ? document.model.accessors[index].count : otherwise;
  };
  DracoClaims claims;
  const std::uint64_t max = kFreeTriangles + kMaxTrianglesPerDracoByte * bytes;
  const std::uint64_t indices = countOf(primitive.indices, 3 * max);
  const bool strip = primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP;
  claims.triangles = std::min(max, strip ? std::max<std::uint64_t>(indices, 2) - 2 : indices / 3);
  const auto position = primitive.attributes.find("POSITION");
  claims.points = std::min(3 * max, countOf(position == primitive.attributes.end() ? -1 : position->second, 3 * max));
  return claims;
}

}  // namespace

Result<DracoPrimitive> decodeDraco(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                   const std::string& where) {
  if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != TINYGLTF_MODE_TRIANGLE_STRIP)
    return document.invalid(where, "mode " + std::to_string(primitive.mode) + " with " + kDracoExtension +
                                       "; expected 4 or 5 (TRIANGLES or TRIANGLE_STRIP): export it as triangles");
  const tinygltf::Value& extension = primitive.extensions.at(kDracoExtension);
  const Result<std::span<const std::uint8_t>> bytes = document.viewBytes(indexOr(extension, "bufferView", -1), where);
  if (!bytes) return bytes.error();
  DracoClaims claims = claimsOf(document, primitive, bytes->size());
  std::string error;
  const std::unique_ptr<draco::Mesh> mesh = decodeMesh(*bytes, claims, error);
  if (!mesh) return document.invalid(where, "broken Draco data: " + error);

  DracoPrimitive out;
  out.indices.reserve(static_cast<std::size_t>(mesh->num_faces()) * 3);
  for (draco::FaceIndex face(0); face < mesh->num_faces(); ++face) {
    for (const draco::PointIndex& point : mesh->face(face)) out.indices.push_back(point.value());
  }
  const tinygltf::Value& attributes = extension.Get("attributes");
  for (const std::string& semantic : attributes.Keys()) {
    const int id = indexOr(attributes, semantic.c_str(), -1);
    const draco::PointAttribute* attribute =
        id < 0 ? nullptr : mesh->GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
    if (!attribute)
      return document.invalid(where, semantic + ": Draco attribute " + std::to_string(id) + " is missing");
    const auto accessor = primitive.attributes.find(semantic);
    const bool known = accessor != primitive.attributes.end() && accessor->second >= 0 &&
                       static_cast<std::size_t>(accessor->second) < document.model.accessors.size();
    const bool normalized = known && document.model.accessors[static_cast<std::size_t>(accessor->second)].normalized;
    Result<AccessorValues> values = readAttribute(document, *mesh, *attribute, normalized, where + ", " + semantic);
    if (!values) return values.error();
    out.attributes.emplace(semantic, std::move(*values));
  }
  return out;
}

}  // namespace relume
