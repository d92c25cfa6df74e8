// SPDX-License-Identifier: MIT
// See level.h.
#include "level.h"

#include <glm/common.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <tiny_gltf.h>

namespace {

constexpr std::array<std::string_view, 4> kReadExtensions{"KHR_lights_punctual", "KHR_materials_emissive_strength",
                                                          "KHR_mesh_quantization", "KHR_node_visibility"};

// A member of what may be no object: nothing then.
tinygltf::Value memberOf(const tinygltf::Value& value, const char* name) {
  return value.IsObject() ? value.Get(name) : tinygltf::Value();
}

// Scale, shear and mirroring of the nodes above do not change what a camera sees.
glm::mat4 rigid(const glm::mat4& m) {
  const glm::vec3 z = glm::normalize(glm::vec3(m[2])), x = glm::normalize(glm::cross(glm::vec3(m[1]), z));
  return {glm::vec4(x, 0.0f), glm::vec4(glm::cross(z, x), 0.0f), glm::vec4(z, 0.0f), m[3]};
}

// Whether KHR_node_visibility hides a node, and with it all below.
bool isHidden(const tinygltf::Node& node) {
  const auto found = node.extensions.find("KHR_node_visibility");
  if (found == node.extensions.end()) return false;
  const tinygltf::Value visible = memberOf(found->second, "visible");
  return visible.IsBool() && !visible.Get<bool>();
}

struct Loader {
  const tinygltf::Model& model;
  Level level;
  int lightmapSet = -1;      // TEXCOORD set of the light map
  float lightFactor = 1.0f;  // from the level's unit to W/sr and W/m²
  bool hasCamera = false, hasPerspective = false;

  // Component c of element i, integers as the fractions that they stand for where they are normalised.
  double number(const tinygltf::Accessor& a, std::size_t i, std::size_t c) const {
    if (a.bufferView < 0) return 0.0;  // as glTF has it
    const tinygltf::BufferView& view = model.bufferViews.at(static_cast<std::size_t>(a.bufferView));
    const std::vector<unsigned char>& data = model.buffers.at(static_cast<std::size_t>(view.buffer)).data;
    const auto size =
        static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.componentType)));
    const std::size_t at = view.byteOffset + a.byteOffset + i * static_cast<std::size_t>(a.ByteStride(view)) + c * size;
    if (at + size > data.size()) throw std::out_of_range("an accessor is longer than its buffer");
    const auto as = [&](auto value, double one) {
      std::memcpy(&value, data.data() + at, sizeof value);
      return a.normalized ? std::max(static_cast<double>(value) / one, -1.0) : static_cast<double>(value);
    };
    switch (a.componentType) {
      case TINYGLTF_COMPONENT_TYPE_BYTE:
        return as(std::int8_t{}, 127.0);
      case TINYGLTF_COMPONENT_TYPE_SHORT:
        return as(std::int16_t{}, 32767.0);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return as(std::uint8_t{}, 255.0);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return as(std::uint16_t{}, 65535.0);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return as(std::uint32_t{}, 1.0);
      case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return as(0.0f, 1.0);
      default:
        throw std::runtime_error("an accessor has component type " + std::to_string(a.componentType));
    }
  }

  // The accessor of an attribute; null where a primitive or a morph target has none of it.
  const tinygltf::Accessor* find(const std::map<std::string, int>& attributes, const std::string& name) const {
    const auto found = attributes.find(name);
    return found == attributes.end() ? nullptr : &model.accessors.at(static_cast<std::size_t>(found->second));
  }

  // A vertex's position or normal as morph targets bend it. weights: of the targets, those that are missing are 0.
  glm::vec3 bent(const tinygltf::Primitive& primitive, const char* name, std::size_t i,
                 const std::vector<double>& weights) const {
    const tinygltf::Accessor* const base = find(primitive.attributes, name);
    glm::dvec3 v(number(*base, i, 0), number(*base, i, 1), number(*base, i, 2));
    for (std::size_t t = 0; t < std::min(weights.size(), primitive.targets.size()); ++t) {
      const tinygltf::Accessor* const delta = weights[t] != 0.0 ? find(primitive.targets[t], name) : nullptr;
      if (delta == nullptr) continue;
      v += weights[t] * glm::dvec3(number(*delta, i, 0), number(*delta, i, 1), number(*delta, i, 2));
    }
    return glm::vec3(v);
  }

  void addPrimitive(const tinygltf::Primitive& primitive, const glm::mat4& worldFromNode,
                    const std::vector<double>& weights) {
    const tinygltf::Accessor* const position = find(primitive.attributes, "POSITION");
    const tinygltf::Accessor* const normal = find(primitive.attributes, "NORMAL");
    const tinygltf::Accessor* const uv = find(primitive.attributes, "TEXCOORD_0");
    const tinygltf::Accessor* const map = find(primitive.attributes, "TEXCOORD_" + std::to_string(lightmapSet));
    if (primitive.mode != TINYGLTF_MODE_TRIANGLES || position == nullptr || normal == nullptr) return;
    const auto first = static_cast<std::uint32_t>(level.vertices.size());
    const glm::mat3 normalMatrix = glm::transpose(glm::inverse(glm::mat3(worldFromNode)));
    for (std::size_t i = 0; i < position->count; ++i) {
      const glm::vec3 p = bent(primitive, "POSITION", i, weights), n = bent(primitive, "NORMAL", i, weights);
      Vertex v{glm::vec3(worldFromNode * glm::vec4(p, 1.0f)), glm::normalize(normalMatrix * n), {}, {65535, 65535}};
      if (uv != nullptr) v.uv = {number(*uv, i, 0), number(*uv, i, 1)};
      for (std::size_t c = 0; map != nullptr && c < 2; ++c)
        v.lightmapUv[c] = static_cast<std::uint16_t>(std::lround(65535.0 * number(*map, i, c)));
      level.low = glm::min(level.low, v.position);
      level.high = glm::max(level.high, v.position);
      level.vertices.push_back(v);
    }
    Draw draw{static_cast<std::uint32_t>(level.indices.size()), static_cast<std::uint32_t>(position->count),
              primitive.material >= 0 ? static_cast<std::size_t>(primitive.material) : level.materials.size() - 1};
    const tinygltf::Accessor* const index =
        primitive.indices >= 0 ? &model.accessors.at(static_cast<std::size_t>(primitive.indices)) : nullptr;
    if (index != nullptr) draw.indexCount = static_cast<std::uint32_t>(index->count);
    for (std::uint32_t i = 0; i < draw.indexCount; ++i)
      level.indices.push_back(first + (index != nullptr ? static_cast<std::uint32_t>(number(*index, i, 0)) : i));
    if (glm::determinant(glm::mat3(worldFromNode)) < 0.0f) {  // fronts stay counter-clockwise where a node mirrors
      for (std::size_t i = draw.firstIndex; i + 2 < level.indices.size(); i += 3)
        std::swap(level.indices[i + 1], level.indices[i + 2]);
    }
    level.draws.push_back(draw);
  }

  // The first perspective camera, or where there is none, the place of the first.
  void addCamera(const tinygltf::Camera& camera, const glm::mat4& worldFromNode) {
    const bool isPerspective = camera.type == "perspective";
    if (hasPerspective || (hasCamera && !isPerspective)) return;
    level.worldFromCamera = rigid(worldFromNode);
    if (isPerspective) level.fovYRad = static_cast<float>(camera.perspective.yfov);
    hasCamera = true;
    hasPerspective = isPerspective;
  }

  // Of nodes that are hidden, or below such a one, cameras alone are read, as bakes have it.
  void addNode(std::size_t n, const glm::mat4& worldFromParent, bool isParentShown) {
    const tinygltf::Node& node = model.nodes.at(n);
    const bool isShown = isParentShown && !isHidden(node);
    glm::mat4 local(1.0f), turn(1.0f);
    if (node.matrix.size() == 16) {
      local = glm::mat4(glm::make_mat4(node.matrix.data()));
    } else {
      if (node.translation.size() == 3) local[3] = glm::vec4(glm::vec3(glm::make_vec3(node.translation.data())), 1.0f);
      if (node.rotation.size() == 4) turn = glm::mat4(glm::mat4_cast(glm::make_quat(node.rotation.data())));
      local = local * turn;
      for (int a = 0; node.scale.size() == 3 && a < 3; ++a)
        local[a] *= static_cast<float>(node.scale[static_cast<std::size_t>(a)]);
    }
    const glm::mat4 world = worldFromParent * local;
    if (node.mesh >= 0 && isShown) {
      const tinygltf::Mesh& mesh = model.meshes.at(static_cast<std::size_t>(node.mesh));
      for (const tinygltf::Primitive& primitive : mesh.primitives)
        addPrimitive(primitive, world, node.weights.empty() ? mesh.weights : node.weights);
    }
    if (node.camera >= 0) addCamera(model.cameras.at(static_cast<std::size_t>(node.camera)), world);
    if (const auto found = node.extensions.find("KHR_lights_punctual"); isShown && found != node.extensions.end()) {
      const tinygltf::Light& light =
          model.lights.at(static_cast<std::size_t>(found->second.Get("light").GetNumberAsInt()));
      glm::vec3 color(lightFactor * static_cast<float>(light.intensity));
      for (int c = 0; light.color.size() == 3 && c < 3; ++c)
        color[c] *= static_cast<float>(light.color[static_cast<std::size_t>(c)]);
      relume::Light* const ours = light.type == "directional" ? &level.sun
                                  : light.type == "point"     ? &level.lamp
                                                              : nullptr;
      if (ours != nullptr && ours->intensity == glm::vec3(0.0f)) {  // the first of each kind; spots are left to you
        ours->intensity = color;
        ours->positionWorld = glm::vec3(world[3]);
        // The scale of the light's own node does not turn it, unless it is in its matrix; nodes above may flatten it.
        const glm::vec3 axis(node.matrix.size() == 16 ? world[2] : worldFromParent * turn[2]);
        ours->direction = axis == glm::vec3(0.0f) ? glm::vec3(0, 0, -1) : -glm::normalize(axis);
      }
    }
    for (const int child : node.children) addNode(static_cast<std::size_t>(child), world, isShown);
  }

  void addMaterial(const tinygltf::Material& m) {
    Material made;
    made.color = glm::vec4(glm::make_vec4(m.pbrMetallicRoughness.baseColorFactor.data()));
    made.emission = glm::vec3(glm::make_vec3(m.emissiveFactor.data()));
    if (const auto strength = m.extensions.find("KHR_materials_emissive_strength"); strength != m.extensions.end())
      made.emission *= static_cast<float>(strength->second.Get("emissiveStrength").GetNumberAsDouble());
    if (m.alphaMode == "MASK") made.alphaCutoff = static_cast<float>(m.alphaCutoff);
    if (const int texture = m.pbrMetallicRoughness.baseColorTexture.index; texture >= 0)
      made.image = model.textures.at(static_cast<std::size_t>(texture)).source;
    level.materials.push_back(made);
  }

  void run() {
    const tinygltf::Value lightmap = memberOf(memberOf(model.asset.extras, "relume"), "lightmap");
    if (!lightmap.IsObject()) throw std::runtime_error("no light map: export it with relume bake --export-glb");
    lightmapSet = lightmap.Get("texcoord").GetNumberAsInt();
    const auto hash = lightmap.Get("sceneHash").Get<std::string>();
    const char* const end = hash.data() + hash.size();
    if (std::from_chars(hash.data(), end, level.bakeScene, 16).ptr != end || hash.size() != 16)
      throw std::runtime_error("sceneHash is not 16 hex digits: \"" + hash + "\"");
    const tinygltf::Scene& scene = model.scenes.at(static_cast<std::size_t>(std::max(model.defaultScene, 0)));
    const tinygltf::Value unit = memberOf(memberOf(scene.extras, "relume"), "lightUnit");
    if (unit.IsString() && unit.Get<std::string>() == "photometric") lightFactor = 1.0f / 683.0f;
    for (const tinygltf::Material& m : model.materials) addMaterial(m);
    level.materials.emplace_back();
    for (const tinygltf::Image& i : model.images)
      level.images.push_back(
          {i.width, i.height, i.component == 4 && i.bits == 8 ? i.image : std::vector<unsigned char>()});
    for (const int node : scene.nodes) addNode(static_cast<std::size_t>(node), glm::mat4(1.0f), true);
    if (level.indices.empty()) throw std::runtime_error("no triangles");
  }
};

}  // namespace

relume::Result<Level> loadLevel(const std::string& path) {
  tinygltf::TinyGLTF parser;
  tinygltf::Model model;
  std::string error, warning;
  const bool parsed = parser.LoadBinaryFromFile(&model, &error, &warning, path);
  for (const std::string& name : model.extensionsRequired) {
    if (std::find(kReadExtensions.begin(), kReadExtensions.end(), name) == kReadExtensions.end())
      return relume::Error{relume::ErrorCode::unsupported,
                           path + ": requires the extension " + name + ", which is not read here"};
  }
  if (!parsed) return relume::Error{relume::ErrorCode::io, path + ": " + error};
  try {
    Loader loader{model, {}};
    loader.run();
    return std::move(loader.level);
  } catch (const std::exception& e) {
    return relume::Error{relume::ErrorCode::invalidFile, path + ": " + e.what()};
  }
}

Draw appendCube(Level& level) {
  const Draw cube{static_cast<std::uint32_t>(level.indices.size()), 36, level.materials.size() - 1};
  for (int face = 0; face < 6; ++face) {
    const auto first = static_cast<std::uint32_t>(level.vertices.size());
    const int axis = face / 2;
    const float side = face % 2 == 0 ? 0.5f : -0.5f;
    for (int k = 0; k < 4; ++k) {
      Vertex v{{}, {}, {}, {65535, 65535}};
      v.normal[axis] = 2.0f * side;
      v.position[axis] = side;
      v.position[(axis + 1) % 3] = k == 1 || k == 2 ? side : -side;  // counter-clockwise from outside
      v.position[(axis + 2) % 3] = k >= 2 ? 0.5f : -0.5f;
      level.vertices.push_back(v);
    }
    for (const std::uint32_t k : {0u, 1u, 2u, 0u, 2u, 3u}) level.indices.push_back(first + k);
  }
  return cube;
}
