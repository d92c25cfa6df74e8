// SPDX-License-Identifier: MIT
// The importer's rooms: materials, meshes and nodes of a checked document, each appending to a Scene.
#pragma once

#include "bake/import/gltf_accessors.h"
#include "bake/import/gltf_document.h"
#include "bake/import/gltf_morph.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"

#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace relume {

// Materials with the images they use, one Scene material per glTF material.
// uvSets[m] says which TEXCOORD_n fill Mesh::uv[0] and [1] for material m.
using UvSets = std::array<int, 2>;
Result<std::vector<UvSets>> importMaterials(GltfDocument& document, Scene& scene, Context& context);

// Material::gloss of each, and the images of numbers that it uses. What cannot be read is left out with a warning.
// failed: cancelled, or out of memory.
Status importGloss(GltfDocument& document, const std::vector<UvSets>& uvSets, Scene& scene, Context& context);

// A primitive whose vertices and indices came out of KHR_draco_mesh_compression. Accessors may claim more than the
// stream has: encoders merge vertices, and many files keep the counts of before.
struct DracoPrimitive {
  std::vector<std::uint32_t> indices;                // triangles
  std::map<std::string, AccessorValues> attributes;  // by glTF semantic
};
Result<DracoPrimitive> decodeDraco(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                   const std::string& where);

// Vertex indices of triangles from those of a primitive of `mode`, TRIANGLES, TRIANGLE_STRIP or TRIANGLE_FAN: glTF 2.0,
// section 3.7.2.1.
std::vector<std::uint32_t> unrollTriangles(std::vector<std::uint32_t> indices, int mode);

// Turns glTF meshes into Scene meshes, each once for each shape that nodes draw it in, when first asked for.
class MeshImporter {
 public:
  MeshImporter(const GltfDocument& document, std::vector<UvSets> uvSets, Scene& scene, Context& context)
      : document_(document), uvSets_(std::move(uvSets)), scene_(scene), context_(context), reader_(document) {}

  // Scene meshes of a node's glTF mesh in the shape that the node draws, one a primitive; kNone for primitives without
  // triangles. `where` names the node.
  Result<std::vector<std::uint32_t>> import(const tinygltf::Node& node, const std::string& where);
  AccessorReader& reader() { return reader_; }

 private:
  Result<std::vector<double>> weightsOf(const tinygltf::Node& node, const std::string& where);
  Result<std::uint32_t> importPrimitive(const tinygltf::Primitive& primitive, const MorphWeights& weights,
                                        const std::string& name, const std::string& where);
  Status readAttributes(const tinygltf::Primitive& primitive, const MorphWeights& weights, const std::string& where,
                        Mesh& mesh, std::vector<std::uint32_t>& indices);
  Status fillMesh(const std::map<std::string, const AccessorValues*>& attributes, const UvSets& sets,
                  const std::vector<std::uint32_t>& used, const std::string& where, Mesh& mesh);
  void warnOfMissing(const std::string& name, std::size_t set, const std::string& where, const Mesh& mesh);
  void addTangents(const std::string& where, Mesh& mesh);
  Status reserveMesh(const std::map<std::string, const AccessorValues*>& attributes, std::size_t vertices,
                     std::size_t triangles);
  void tellOnce(Severity severity, std::string_view about, const std::string& where, const std::string& what);

  const GltfDocument& document_;
  std::vector<UvSets> uvSets_;
  Scene& scene_;
  Context& context_;
  AccessorReader reader_;
  std::map<std::tuple<int, std::size_t, MorphWeights>, std::uint32_t> imported_;  // by mesh, primitive and shape
  std::set<std::pair<std::string_view, std::string>> told_;                       // what was said, of whom
  std::uint64_t triangles_ = 0;                                                   // of all meshes so far
  std::uint64_t moved_ = 0;                     // vertices of all meshes so far, by morph targets that move them
  double unreserved_ = 0.0;                     // [byte] of meshes that the memory budget was not asked for
  std::vector<std::uint32_t> renumbered_;       // scratch: new index per vertex, kNone = unused
  std::vector<glm::vec4> tangents_;             // scratch: TANGENT of the primitive's vertices, empty where it has none
  std::map<std::string, AccessorValues> bent_;  // scratch: attributes of the primitive that morph targets move
};

// A light by its number, which exists; its place is the node's. invalidFile: values out of range.
Result<SceneLight> readLight(const GltfDocument& document, int index);

// Which unit the intensities of the file's punctual lights have, by `asked`, the file's extras or what their sizes
// suggest; makes scene.lights radiometric. invalidFile: extras that name no unit.
Status convertLights(const GltfDocument& document, std::optional<LightUnit> asked, Scene& scene, Context& context);

// Walk the default scene: instances, cameras, lights, play volumes.
Status importNodes(const GltfDocument& document, MeshImporter& meshes, Scene& scene, Context& context);

}  // namespace relume
