// SPDX-License-Identifier: MIT
// KHR_draco_mesh_compression: one primitive's triangles and attributes.
#include "bake/scene/gltf_import.h"

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
#include <draco/compression/decode.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include <array>
#include <exception>
#include <memory>

namespace relume {
namespace {

float normalizer(draco::DataType type) {
  switch (type) {
    case draco::DT_INT8: return 1.0f / 127.0f;
    case draco::DT_UINT8: return 1.0f / 255.0f;
    case draco::DT_INT16: return 1.0f / 32767.0f;
    case draco::DT_UINT16: return 1.0f / 65535.0f;
    default: return 1.0f;
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

std::unique_ptr<draco::Mesh> decodeMesh(std::span<const std::uint8_t> bytes, std::string& error) {
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::Decoder decoder;
    auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
    if (mesh.ok()) return std::move(mesh).value();
    error = mesh.status().error_msg_string();
  } catch (const std::exception& e) {
    error = e.what();
  }
  return nullptr;
}

}  // namespace

Result<DracoPrimitive> decodeDraco(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                   const std::string& where) {
  const tinygltf::Value& extension = primitive.extensions.at("KHR_draco_mesh_compression");
  const Result<std::span<const std::uint8_t>> bytes =
      document.viewBytes(indexOr(extension, "bufferView", -1), where);
  if (!bytes) return bytes.error();
  std::string error;
  const std::unique_ptr<draco::Mesh> mesh = decodeMesh(*bytes, error);
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
    if (!attribute) return document.invalid(where, semantic + ": Draco attribute " + std::to_string(id) + " is missing");
    const auto accessor = primitive.attributes.find(semantic);
    const bool known = accessor != primitive.attributes.end() && accessor->second >= 0 &&
                       static_cast<std::size_t>(accessor->second) < document.model.accessors.size();
    const bool normalized =
        known && document.model.accessors[static_cast<std::size_t>(accessor->second)].normalized;
    Result<AccessorValues> values =
        readAttribute(document, *mesh, *attribute, normalized, where + ", " + semantic);
    if (!values) return values.error();
    out.attributes.emplace(semantic, std::move(*values));
  }
  return out;
}

}  // namespace relume
