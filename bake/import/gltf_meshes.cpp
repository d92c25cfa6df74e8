// SPDX-License-Identifier: MIT
// glTF primitives to triangle meshes: strips and fans unrolled, vertices no triangle uses dropped, values checked.
#include "bake/base/memory_budget.h"
#include "bake/import/gltf_import.h"
#include "bake/import/make_tangents.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {
namespace {

// Triangles of all meshes may not outgrow the file's data by more than this: primitives can share an index accessor.
constexpr std::uint64_t kMaxTrianglesPerByte = 64;
constexpr std::uint64_t kMinTriangleBudget = 1u << 20;

// Beyond this, a float has no digits left for a position within the image.
constexpr float kMaxTexcoord = 1e7f;

bool hasNormalMap(const Scene& scene, const Mesh& mesh) {
  return mesh.material != kNone && scene.materials[mesh.material].gloss.normalTexture.image != kNone;
}

bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

glm::vec3 vec3At(const AccessorValues& values, std::uint32_t i) {
  const float* v = &values.values[static_cast<std::size_t>(i) * static_cast<std::size_t>(values.components)];
  return {v[0], v[1], v[2]};
}

// Whether an accessor has data. Those of compressed attributes need none, and would read as zeros.
bool hasOwnData(const tinygltf::Model& model, int accessor) {
  if (accessor < 0 || static_cast<std::size_t>(accessor) >= model.accessors.size()) return true;  // refused when read
  const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(accessor)];
  return a.bufferView >= 0 || a.sparse.isSparse;
}

// Normalise the normals. Those that are zero or not finite become the area-weighted mean of the vertex's triangles.
// Returns how many.
std::size_t repairNormals(Mesh& mesh) {
  std::vector<std::uint8_t> broken(mesh.normal.size(), 0);
  std::size_t count = 0;
  for (std::size_t i = 0; i < mesh.normal.size(); ++i) {
    const float length = glm::length(mesh.normal[i]);
    broken[i] = !(length > 1e-6f && std::isfinite(length));
    count += broken[i];
    mesh.normal[i] = broken[i] ? glm::vec3(0.0f) : mesh.normal[i] / length;
  }
  if (count == 0) return 0;
  for (const glm::uvec3& t : mesh.triangle) {
    const glm::vec3 area = glm::cross(mesh.position[t.y] - mesh.position[t.x], mesh.position[t.z] - mesh.position[t.x]);
    for (const std::uint32_t v : {t.x, t.y, t.z}) {
      if (broken[v]) mesh.normal[v] += area;
    }
  }
  for (std::size_t i = 0; i < mesh.normal.size(); ++i) {
    const float length = glm::length(mesh.normal[i]);
    if (broken[i])
      mesh.normal[i] = length > 0.0f && std::isfinite(length) ? mesh.normal[i] / length : glm::vec3(0, 1, 0);
  }
  return count;
}

}  // namespace

std::vector<std::uint32_t> unrollTriangles(std::vector<std::uint32_t> indices, int mode) {
  if (mode == TINYGLTF_MODE_TRIANGLES) return indices;
  std::vector<std::uint32_t> out;
  if (indices.size() < 3) return out;
  out.reserve(3 * (indices.size() - 2));
  for (std::size_t i = 0; i + 2 < indices.size(); ++i) {
    const bool odd = i % 2 == 1;
    if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
      out.insert(out.end(), {indices[i], indices[i + (odd ? 2 : 1)], indices[i + (odd ? 1 : 2)]});
    } else {
      out.insert(out.end(), {indices[i + 1], indices[i + 2], indices[0]});
    }
  }
  return out;
}

// Attributes of the vertices in `used`, in that order.
Status MeshImporter::fillMesh(const std::map<std::string, const AccessorValues*>& attributes, const UvSets& sets,
                              const std::vector<std::uint32_t>& used, const std::string& where, Mesh& mesh) {
  const auto find = [&](const std::string& name) {
    const auto it = attributes.find(name);
    return it == attributes.end() ? nullptr : it->second;
  };
  const AccessorValues& positions = *find("POSITION");
  mesh.position.reserve(used.size());
  for (const std::uint32_t v : used) {
    const glm::vec3 position = vec3At(positions, v);
    if (!finite(position))
      return document_.invalid(where, "POSITION of vertex " + std::to_string(v) +
                                          (bent_.contains("POSITION") ? ", moved by its morph targets," : "") +
                                          " is not finite");
    mesh.position.push_back(position);
  }
  if (const AccessorValues* normals = find("NORMAL")) {
    for (const std::uint32_t v : used) mesh.normal.push_back(vec3At(*normals, v));
  }
  if (const AccessorValues* colors = find("COLOR_0")) {
    for (const std::uint32_t v : used) {
      const glm::vec3 color = vec3At(*colors, v);
      mesh.color.push_back(finite(color) ? glm::clamp(color, 0.0f, 1.0f) : glm::vec3(1.0f));
      if (colors->components < 4) continue;
      const float alpha = colors->values[4 * static_cast<std::size_t>(v) + 3];
      mesh.colorAlpha.push_back(std::isfinite(alpha) ? std::clamp(alpha, 0.0f, 1.0f) : 1.0f);
    }
  }
  tangents_.clear();
  if (const AccessorValues* tangents = find("TANGENT")) {
    for (const std::uint32_t v : used) {
      const float* t = &tangents->values[4 * static_cast<std::size_t>(v)];
      tangents_.emplace_back(t[0], t[1], t[2], t[3]);
    }
  }
  std::size_t broken = 0;
  for (std::size_t set = 0; set < sets.size(); ++set) {
    const std::string name = "TEXCOORD_" + std::to_string(sets[set]);
    const AccessorValues* uvs = find(name);
    if (!uvs) {
      warnOfMissing(name, set, where, mesh);
      continue;
    }
    for (const std::uint32_t v : used) {
      const glm::vec2 uv(uvs->values[2 * static_cast<std::size_t>(v)],
                         uvs->values[2 * static_cast<std::size_t>(v) + 1]);
      const bool good = std::abs(uv.x) <= kMaxTexcoord && std::abs(uv.y) <= kMaxTexcoord;
      mesh.uv[set].push_back(good ? uv : glm::vec2(0.0f));
      broken += !good;
    }
  }
  if (broken > 0)
    tellOnce(Severity::warning, "TEXCOORD", where,
             std::to_string(broken) +
                 " texture coordinates are not finite or beyond 1e7 and read as 0; unwrap the mesh again, or export it "
                 "anew");
  return done();
}

// Say which textures read a set that the mesh does not have.
void MeshImporter::warnOfMissing(const std::string& name, std::size_t set, const std::string& where, const Mesh& mesh) {
  if (mesh.material == kNone) return;
  const Material& material = scene_.materials[mesh.material];
  const auto warn = [&](const TextureRef& texture, std::string_view what) {
    if (texture.image == kNone || texture.texcoord != set) return;
    tellOnce(Severity::warning, what, where,
             "has no " + name + ", by which its " + std::string(what) +
                 " texture lies, so that all of it looks as the texture does at (0, 0); unwrap the mesh, or take the "
                 "texture off the material");
  };
  warn(material.albedoTexture, "base colour");
  warn(material.emissionTexture, "emissive");
}

// Ask the memory budget for a mesh of so many vertices in use; for small ones together.
Status MeshImporter::reserveMesh(const std::map<std::string, const AccessorValues*>& attributes, std::size_t vertices,
                                 std::size_t triangles) {
  constexpr double kMuch = 16 << 20;  // [byte]
  double numbers = 0.0;               // of a vertex
  for (const auto& [name, values] : attributes) numbers += values->components;
  const double bytes = static_cast<double>(vertices) * (numbers * sizeof(float) + sizeof(std::uint32_t)) +
                       static_cast<double>(triangles) * sizeof(glm::uvec3);
  unreserved_ += bytes;
  if (unreserved_ < kMuch) return done();
  unreserved_ = 0.0;
  Status reserved = reserveMemory(context_, "import", bytes, "a mesh of " + std::to_string(triangles) + " triangles",
                                  "split the level");
  if (!reserved) reserved.error().message = document_.at(reserved.error().message);
  return reserved;
}

// Read indices and the attributes the baker knows into `mesh`, compacted to the vertices in use.
Status MeshImporter::readAttributes(const tinygltf::Primitive& primitive, const MorphWeights& weights,
                                    const std::string& where, Mesh& mesh, std::vector<std::uint32_t>& indices) {
  UvSets sets{0, 1};
  if (primitive.material >= 0) sets = uvSets_[static_cast<std::size_t>(primitive.material)];
  DracoPrimitive draco;
  const bool compressed = primitive.extensions.contains(kDracoExtension);
  if (compressed) {
    Result<DracoPrimitive> decoded = decodeDraco(document_, primitive, where);
    if (!decoded) return decoded.error();
    draco = std::move(*decoded);
  }

  // Gather the attributes; all have as many values as there are positions.
  struct Wanted {
    std::string name;
    int min, max;
  };
  std::vector<Wanted> wanted = {{"POSITION", 3, 3},
                                {"NORMAL", 3, 3},
                                {"COLOR_0", 3, 4},
                                {"TEXCOORD_" + std::to_string(sets[0]), 2, 2},
                                {"TEXCOORD_" + std::to_string(sets[1]), 2, 2}};
  if (hasNormalMap(scene_, mesh)) wanted.push_back({"TANGENT", 4, 4});
  std::map<std::string, const AccessorValues*> attributes;
  for (const Wanted& want : wanted) {
    const std::string at = where + ".attributes." + want.name;
    const AccessorValues* values = nullptr;
    if (const auto it = draco.attributes.find(want.name); it != draco.attributes.end()) {
      values = &it->second;
      if (values->components < want.min || values->components > want.max)
        return document_.invalid(at, std::to_string(values->components) + " components");
    } else if (const auto accessor = primitive.attributes.find(want.name); accessor != primitive.attributes.end()) {
      if (compressed && !hasOwnData(document_.model, accessor->second))
        return document_.invalid(at, jsonPath("accessors", accessor->second) + " has no data, and " + kDracoExtension +
                                         " has no such attribute; export the mesh anew");
      const auto read = reader_.floats(accessor->second, want.min, want.max, at);
      if (!read) return read.error();
      values = *read;
    }
    if (!values) continue;
    attributes.emplace(want.name, values);
    const auto position = attributes.find("POSITION");
    if (position != attributes.end() && values->count != position->second->count)
      return document_.invalid(
          at, std::to_string(values->count) + " values, POSITION has " + std::to_string(position->second->count));
  }
  const auto position = attributes.find("POSITION");
  if (position == attributes.end()) {
    tellOnce(Severity::warning, "POSITION", where,
             "no POSITION, so it is left out; export it with positions, or delete it");
    return done();
  }
  Status morphed = bendAttributes(document_, reader_, primitive, weights, where, attributes, bent_, moved_);
  if (!morphed) return morphed;

  // Indices, their range checked.
  const std::size_t vertexCount = position->second->count;
  if (compressed) {
    indices = std::move(draco.indices);
  } else if (primitive.indices >= 0) {
    auto read = reader_.indices(primitive.indices, where + ".indices");
    if (!read) return read.error();
    indices = std::move(*read);
  } else {
    indices.resize(vertexCount);
    for (std::size_t i = 0; i < vertexCount; ++i) indices[i] = static_cast<std::uint32_t>(i);
  }
  if (!compressed && primitive.mode == TINYGLTF_MODE_TRIANGLES && indices.size() % 3 != 0)
    return document_.invalid(
        where, std::to_string(indices.size()) + " vertices are not whole triangles; expected a multiple of 3");
  indices = unrollTriangles(std::move(indices), compressed ? TINYGLTF_MODE_TRIANGLES : primitive.mode);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] >= vertexCount)
      return document_.invalid(where, "triangle " + std::to_string(i / 3) + " uses vertex " +
                                          std::to_string(indices[i]) + " of " + std::to_string(vertexCount));
  }
  triangles_ += indices.size() / 3;
  if (triangles_ > std::max(kMinTriangleBudget, kMaxTrianglesPerByte * document_.dataBytes))
    return document_.invalid(where, "the meshes have " + std::to_string(triangles_) + " triangles in " +
                                        std::to_string(document_.dataBytes) + " bytes");

  // Keep the vertices in use, in their order.
  if (renumbered_.size() < vertexCount) renumbered_.resize(vertexCount, kNone);
  std::vector<std::uint32_t> used(indices);
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (std::size_t i = 0; i < used.size(); ++i) renumbered_[used[i]] = static_cast<std::uint32_t>(i);
  for (std::uint32_t& index : indices) index = renumbered_[index];
  if (Status status = reserveMesh(attributes, used.size(), indices.size() / 3); !status) return status;
  return fillMesh(attributes, sets, used, where, mesh);
}

// The tangents of a mesh with a normal map.
void MeshImporter::addTangents(const std::string& where, Mesh& mesh) {
  const TextureRef& map = scene_.materials[mesh.material].gloss.normalTexture;
  const std::size_t broken = makeTangents(mesh, tangents_, map);
  if (broken == 0) return;
  tellOnce(Severity::warning, "TANGENT", where,
           std::to_string(broken) + " of " + std::to_string(mesh.triangle.size()) +
               " triangles have a normal map, but no texture coordinates with an area, nor tangents; they are drawn "
               "without it: unwrap the mesh");
}

// Of a primitive that is imported in several shapes, say each thing once.
void MeshImporter::tellOnce(Severity severity, std::string_view about, const std::string& where,
                            const std::string& what) {
  if (told_.emplace(about, where).second) context_.message(severity, document_.at(where + ": " + what));
}

Result<std::uint32_t> MeshImporter::importPrimitive(const tinygltf::Primitive& primitive, const MorphWeights& weights,
                                                    const std::string& name, const std::string& where) {
  const int mode = primitive.mode;
  if (mode < TINYGLTF_MODE_POINTS || mode > TINYGLTF_MODE_TRIANGLE_FAN)
    return document_.invalid(where, "mode " + std::to_string(mode) + "; expected 0 to 6");
  const int material = primitive.material;
  if (material >= 0 && static_cast<std::size_t>(material) >= scene_.materials.size())
    return document_.invalid(where, jsonPath("materials", material) + " does not exist, there are " +
                                        std::to_string(scene_.materials.size()));
  if (mode < TINYGLTF_MODE_TRIANGLES) {
    context_.message(Severity::info, document_.at(where + ": points or lines; left out"));
    return kNone;
  }

  Mesh mesh;
  mesh.name = name;
  mesh.material = material < 0 ? kNone : static_cast<std::uint32_t>(material);
  std::vector<std::uint32_t> indices;
  if (Status status = readAttributes(primitive, weights, where, mesh, indices); !status) return status.error();
  if (indices.empty()) return kNone;
  mesh.triangle.resize(indices.size() / 3);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    mesh.triangle[t] = {indices[3 * t], indices[3 * t + 1], indices[3 * t + 2]};
  const std::size_t broken = repairNormals(mesh);
  mesh.normalsRepaired = broken > 0;
  if (broken > 0)
    tellOnce(Severity::warning, "NORMAL", where,
             std::to_string(broken) +
                 " normals are zero or not finite, and taken from the triangles instead; recalculate the mesh's "
                 "normals");
  if (hasNormalMap(scene_, mesh)) addTangents(where, mesh);
  scene_.meshes.push_back(std::move(mesh));
  return static_cast<std::uint32_t>(scene_.meshes.size() - 1);
}

// The morph weights that a node draws its mesh with: its own, else its mesh's.
Result<std::vector<double>> MeshImporter::weightsOf(const tinygltf::Node& node, const std::string& where) {
  const tinygltf::Mesh& mesh = document_.model.meshes[static_cast<std::size_t>(node.mesh)];
  const std::vector<double>& weights = node.weights.empty() ? mesh.weights : node.weights;
  const std::string owner = node.weights.empty() ? jsonPath("meshes", node.mesh) : where;
  bool bends = false;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!(std::fabs(weights[i]) <= static_cast<double>(std::numeric_limits<float>::max())))
      return document_.invalid(owner + "." + jsonPath("weights", static_cast<int>(i)), "is not finite as a float");
    bends |= weights[i] != 0.0;
  }
  for (const tinygltf::Primitive& primitive : mesh.primitives) {
    if (!bends || weights.size() == primitive.targets.size()) continue;
    tellOnce(Severity::warning, "weights", owner,
             std::to_string(weights.size()) + " weights for " + std::to_string(primitive.targets.size()) +
                 " morph targets of " + jsonPath("meshes", node.mesh) + "." +
                 jsonPath("primitives", static_cast<int>(&primitive - mesh.primitives.data())) + "; " +
                 (weights.size() < primitive.targets.size() ? "targets without one do not bend it"
                                                            : "those beyond are left out") +
                 ": export the mesh anew");
  }
  return weights;
}

Result<std::vector<std::uint32_t>> MeshImporter::import(const tinygltf::Node& node, const std::string& where) {
  const int mesh = node.mesh;
  const auto& meshes = document_.model.meshes;
  if (mesh < 0 || static_cast<std::size_t>(mesh) >= meshes.size())
    return document_.invalid("nodes",
                             jsonPath("meshes", mesh) + " does not exist, there are " + std::to_string(meshes.size()));
  const Result<std::vector<double>> weights = weightsOf(node, where);
  if (!weights) return weights.error();
  const tinygltf::Mesh& source = meshes[static_cast<std::size_t>(mesh)];
  std::vector<std::uint32_t> out;
  for (std::size_t p = 0; p < source.primitives.size(); ++p) {
    const MorphWeights shape = trimWeights(*weights, source.primitives[p].targets.size());
    const std::tuple key(mesh, p, shape);
    auto known = imported_.find(key);
    if (known == imported_.end()) {
      const std::string base = source.name.empty() ? "mesh" + std::to_string(mesh) : source.name;
      const std::string name = source.primitives.size() > 1 ? base + "#" + std::to_string(p) : base;
      const std::string path = jsonPath("meshes", mesh) + (source.name.empty() ? "" : " '" + source.name + "'") + "." +
                               jsonPath("primitives", static_cast<int>(p));
      const Result<std::uint32_t> id = importPrimitive(source.primitives[p], shape, name, path);
      if (!id) return id.error();
      known = imported_.emplace(key, *id).first;
    }
    out.push_back(known->second);
  }
  return out;
}

}  // namespace relume
