// SPDX-License-Identifier: MIT
// The default scene's nodes to instances, cameras, lights and play volumes. The graph is checked to be a forest first;
// it is walked with a stack of our own, so that depth costs nothing. Transforms are multiplied in double precision.
// Nodes that KHR_node_visibility hides have no meshes and lights, but their cameras and play volumes are read: the
// extension hides only what is drawn.
#include "bake/base/memory_budget.h"
#include "bake/import/gltf_graph.h"
#include "bake/import/gltf_import.h"
#include "bake/import/gltf_transforms.h"
#include "bake/scene/unit_vector.h"

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string_view>

namespace relume {
namespace {

constexpr std::uint64_t kMaxTriangles = 1ull << 30;  // scene-wide: two sides must fit 32 bits
// Instances may not outgrow the file's data by more: nodes can share the accessors of EXT_mesh_gpu_instancing, which
// need not have data.
constexpr std::uint64_t kMinInstances = 1u << 20;
constexpr std::uint64_t kMaxInstancesPerByte = 1;

constexpr int kNoNode = -1;

struct Visit {
  int node = 0;
  glm::dmat4 parent{1.0};
  BakeMode mode = BakeMode::fixed;
  float texelDensity = 1.0f;
  bool playSpace = true;
  bool hidden = false;           // by KHR_node_visibility, of the node or of one above
  int shownAndHidden = kNoNode;  // the nearest node, this or one above, whose visibility an animation moves
  int moved = kNoNode;           // the nearest node, this or one above, that an animation moves
};

class NodeImporter {
 public:
  NodeImporter(const GltfDocument& document, MeshImporter& meshes, Scene& scene, Context& context)
      : document_(document), meshes_(meshes), scene_(scene), context_(context) {}
  Status run();

 private:
  Status visit(const Visit& at, std::vector<Visit>& stack);
  Status readExtras(const tinygltf::Node& node, const std::string& where, const glm::mat4& toWorld, Visit& at);
  Status addMesh(const tinygltf::Node& node, const Visit& at, const glm::dmat4& toWorld, const std::string& where);
  Status addInstance(const Visit& at, const glm::dmat4& toWorld, std::uint32_t primitive, std::uint32_t gpuInstance,
                     std::uint32_t mesh, const std::string& where);
  Result<std::vector<glm::dmat4>> gpuInstances(const tinygltf::Node& node, const std::string& where);
  Status checkRoom(std::uint64_t more, const std::string& where);
  Status addCamera(const tinygltf::Node& node, const Visit& at, const glm::dmat4& toWorld, const std::string& where);
  Status addLight(const tinygltf::Node& node, const Visit& at, const glm::dmat4& toWorld, const std::string& where);
  void warnOfMorph(const Visit& at, const tinygltf::Node& node, const std::string& where);
  void readAnimated(const tinygltf::Node& node, Visit& at) const;
  void warnOfShowing(const Visit& at);
  void tellHidden() const;
  void warnOfMoved() const;
  std::string instanceName(int node);

  const GltfDocument& document_;
  MeshImporter& meshes_;
  Scene& scene_;
  Context& context_;
  std::set<std::string> unknownMembers_;  // of extras.relume
  std::uint64_t triangles_ = 0;
  std::map<int, std::size_t> unnamed_;  // drawn nodes without a name, numbered as they are met
  std::set<int> morphsTold_;
  std::set<int> showingTold_;
  std::size_t hidden_ = 0;  // nodes that a mesh or light was left out of
  int firstHidden_ = kNoNode;
  std::set<int> moved_;  // nodes with baked meshes that animations move
  int firstMoved_ = kNoNode;
  std::set<std::uint32_t> movedCameras_;  // in Scene::cameras
};

bool finite(const glm::dmat4& m) {
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 4; ++r) {
      if (!(std::fabs(m[c][r]) <= static_cast<double>(std::numeric_limits<float>::max()))) return false;
    }
  }
  return true;
}

glm::dvec3 unitOr(const glm::dvec3& v, const glm::dvec3& fallback) {
  const glm::dvec3 unit = unitVector(v);
  return unit == glm::dvec3(0.0) ? fallback : unit;
}

std::optional<BakeMode> bakeModeByName(std::string_view name) {
  if (name == "static") return BakeMode::fixed;
  if (name == "gridLit") return BakeMode::gridLit;
  if (name == "dynamic") return BakeMode::dynamic;
  if (name == "ignore") return BakeMode::ignore;
  return std::nullopt;
}

// A name that does not change when other nodes are put before the node in the file.
std::string NodeImporter::instanceName(int node) {
  const std::string& name = document_.model.nodes[static_cast<std::size_t>(node)].name;
  if (!name.empty()) return name;
  return "unnamed node " + std::to_string(unnamed_.try_emplace(node, unnamed_.size()).first->second);
}

// extras.relume: {"bake": "static"|"gridLit"|"dynamic"|"ignore", "texelDensity": f, "playSpace": false} hold for the
// node and what is below it;
// {"volume": [x, y, z]} is a play volume of that size in the node's axes.
Status NodeImporter::readExtras(const tinygltf::Node& node, const std::string& where, const glm::mat4& toWorld,
                                Visit& at) {
  if (!node.extras.IsObject() || !node.extras.Has("relume")) return done();
  const tinygltf::Value& relume = node.extras.Get("relume");
  const std::string path = where + ".extras.relume";
  if (!relume.IsObject()) return document_.invalid(path, "expected an object");
  // gpuInstance is the export's (place_meshes.cpp), for games alone.
  warnOfUnknownMembers(document_, relume, path, {"bake", "playSpace", "texelDensity", "volume", "gpuInstance"},
                       unknownMembers_, context_);
  if (relume.Has("bake")) {
    const tinygltf::Value& bake = relume.Get("bake");
    const std::string mode = bake.IsString() ? bake.Get<std::string>() : "";
    const std::optional<BakeMode> known = bakeModeByName(mode);
    if (!known) {
      return document_.invalid(path + ".bake",
                               "'" + mode + "'; expected \"static\", \"gridLit\", \"dynamic\" or \"ignore\"");
    }
    at.mode = *known;
  }
  if (relume.Has("texelDensity")) {
    const double density = numberOr(relume, "texelDensity", -1.0);
    if (!(density >= 0.01 && density <= 100.0))
      return document_.invalid(path + ".texelDensity", "expected a number from 0.01 to 100");
    at.texelDensity = static_cast<float>(density);
  }
  if (relume.Has("playSpace")) {
    const tinygltf::Value& playSpace = relume.Get("playSpace");
    const double number = numberOr(relume, "playSpace", -1.0);  // Blender 3.4 writes false and true as 0 and 1
    if (!playSpace.IsBool() && number != 0.0 && number != 1.0)
      return document_.invalid(path + ".playSpace", "expected true or false");
    at.playSpace = playSpace.IsBool() ? playSpace.Get<bool>() : number == 1.0;
  }
  if (relume.Has("volume")) {
    const tinygltf::Value& volume = relume.Get("volume");
    glm::vec3 size(0.0f);
    for (int i = 0; i < 3 && volume.IsArray() && volume.ArrayLen() == 3; ++i)
      size[i] = volume.Get(i).IsNumber() ? static_cast<float>(volume.Get(i).GetNumberAsDouble()) : 0.0f;
    const bool good = size.x > 0.0f && size.y > 0.0f && size.z > 0.0f && std::isfinite(size.x + size.y + size.z);
    if (!good) return document_.invalid(path + ".volume", "expected three sizes above 0");
    scene_.volumes.push_back(
        {nodeName(document_, at.node), glm::scale(toWorld, size), static_cast<std::uint32_t>(at.node)});
  }
  return done();
}

// Whether so many instances more are in proportion to the file, and to the memory there is.
Status NodeImporter::checkRoom(std::uint64_t more, const std::string& where) {
  constexpr std::uint64_t kMany = 65536;
  const std::uint64_t count = scene_.instances.size() + more;
  if (count > std::max(kMinInstances, kMaxInstancesPerByte * document_.dataBytes))
    return document_.invalid(where, "with it, the level has " + std::to_string(count) + " instances in " +
                                        std::to_string(document_.dataBytes) + " bytes");
  if (more < kMany) return done();
  Status reserved =
      reserveMemory(context_, "import", static_cast<double>(more) * (sizeof(Instance) + sizeof(glm::dmat4)),
                    std::to_string(more) + " instances", "split the level");
  if (!reserved) reserved.error().message = document_.at(reserved.error().message);
  return reserved;
}

Status NodeImporter::addInstance(const Visit& at, const glm::dmat4& toWorld, std::uint32_t primitive,
                                 std::uint32_t gpuInstance, std::uint32_t mesh, const std::string& where) {
  if (!finite(toWorld)) return document_.invalid(where, "its transform to the world is not finite");
  Instance instance;
  instance.node = instanceName(at.node);
  instance.nodeIndex = static_cast<std::uint32_t>(at.node);
  instance.primitive = primitive;
  instance.gpuInstance = gpuInstance;
  instance.mesh = mesh;
  instance.toWorld = glm::mat4(toWorld);
  instance.mode = at.mode;
  instance.flipped = glm::determinant(glm::dmat3(toWorld)) < 0.0;
  instance.texelDensity = at.texelDensity;
  instance.firstTriangle = static_cast<std::uint32_t>(triangles_);
  triangles_ += scene_.meshes[mesh].triangle.size();
  if (triangles_ > kMaxTriangles)
    return Error{ErrorCode::unsupported,
                 document_.at(where + ": the level has more than " + std::to_string(kMaxTriangles) + " triangles")};
  scene_.instances.push_back(std::move(instance));
  return done();
}

// Transforms of EXT_mesh_gpu_instancing, one per instance; one identity without it.
Result<std::vector<glm::dmat4>> NodeImporter::gpuInstances(const tinygltf::Node& node, const std::string& where) {
  const auto extension = node.extensions.find("EXT_mesh_gpu_instancing");
  if (extension == node.extensions.end()) return std::vector<glm::dmat4>{glm::dmat4(1.0)};
  const std::string path = where + ".extensions.EXT_mesh_gpu_instancing";
  const tinygltf::Value& attributes = extension->second.Get("attributes");
  const AccessorValues* part[3] = {nullptr, nullptr, nullptr};
  std::optional<std::size_t> count;
  const char* names[3] = {"TRANSLATION", "ROTATION", "SCALE"};
  for (int i = 0; i < 3; ++i) {
    if (!attributes.Has(names[i])) continue;
    const int components = i == 1 ? 4 : 3;
    const auto values =
        meshes_.reader().floats(indexOr(attributes, names[i], -1), components, components, path + "." + names[i]);
    if (!values) return values.error();
    part[i] = *values;
    if (count && *count != part[i]->count)
      return document_.invalid(path, std::string(names[i]) + " has " + std::to_string(part[i]->count) +
                                         " values, the attribute before " + std::to_string(*count));
    count = part[i]->count;
  }
  // Attributes of the game's own say how many there are, too.
  if (const std::vector<std::string> own = attributes.Keys(); !count && !own.empty()) {
    const std::string& name = own.front();
    const auto values = meshes_.reader().floats(indexOr(attributes, name.c_str(), -1), 1, 4, path + "." + name);
    if (!values) return values.error();
    count = (*values)->count;
  }
  if (!count) return document_.invalid(path, "has no attributes, which say how many instances there are");
  if (Status status = checkRoom(*count, path); !status) return status.error();

  std::vector<glm::dmat4> out(*count, glm::dmat4(1.0));
  for (std::size_t i = 0; i < *count; ++i) {
    if (part[0]) {
      const float* t = &part[0]->values[3 * i];
      out[i] = glm::translate(out[i], glm::dvec3(t[0], t[1], t[2]));
    }
    if (part[1]) {
      const float* r = &part[1]->values[4 * i];
      out[i] *= glm::mat4_cast(rotationOf({r[0], r[1], r[2], r[3]}));
    }
    if (part[2]) {
      const float* s = &part[2]->values[3 * i];
      out[i] = glm::scale(out[i], glm::dvec3(s[0], s[1], s[2]));
    }
  }
  return out;
}

Status NodeImporter::addMesh(const tinygltf::Node& node, const Visit& at, const glm::dmat4& toWorld,
                             const std::string& where) {
  const Result<std::vector<std::uint32_t>> meshes = meshes_.import(node, where);
  if (!meshes) return meshes.error();
  const Result<std::vector<glm::dmat4>> copies = gpuInstances(node, where);
  if (!copies) return copies.error();
  if (Status status = checkRoom(copies->size() * meshes->size(), where); !status) return status;
  for (std::size_t copy = 0; copy < copies->size(); ++copy) {
    for (std::size_t p = 0; p < meshes->size(); ++p) {
      const std::uint32_t mesh = (*meshes)[p];
      if (mesh == kNone) continue;
      Status added = addInstance(at, toWorld * (*copies)[copy], static_cast<std::uint32_t>(p),
                                 static_cast<std::uint32_t>(copy), mesh, where);
      if (!added) return added;
    }
  }
  return done();
}

// Cameras look down -Z; scale and shear of the nodes above do not change what they see.
Status NodeImporter::addCamera(const tinygltf::Node& node, const Visit& at, const glm::dmat4& toWorld,
                               const std::string& where) {
  const auto& cameras = document_.model.cameras;
  if (static_cast<std::size_t>(node.camera) >= cameras.size())
    return document_.invalid(
        where, jsonPath("cameras", node.camera) + " does not exist, there are " + std::to_string(cameras.size()));
  if (!finite(toWorld)) return document_.invalid(where, "its transform to the world is not finite");
  const tinygltf::Camera& source = cameras[static_cast<std::size_t>(node.camera)];
  const std::string path = jsonPath("cameras", node.camera) + (source.name.empty() ? "" : " '" + source.name + "'");
  Camera camera;
  camera.name = source.name.empty() ? nodeName(document_, at.node) : source.name;
  camera.node = node.name;
  camera.nodeIndex = static_cast<std::uint32_t>(at.node);
  camera.playSpace = at.playSpace;
  camera.orthographic = source.type == "orthographic";
  camera.yfovRad = static_cast<float>(source.perspective.yfov);
  camera.znear = static_cast<float>(camera.orthographic ? source.orthographic.znear : source.perspective.znear);
  camera.aspect = static_cast<float>(source.perspective.aspectRatio);
  if (camera.orthographic) {
    camera.yMag = static_cast<float>(std::fabs(source.orthographic.ymag));
    camera.aspect = static_cast<float>(std::fabs(source.orthographic.xmag / source.orthographic.ymag));
  }
  const bool lens = camera.orthographic ? camera.yMag > 0.0f && std::isfinite(camera.aspect) && camera.znear >= 0.0f
                                        : camera.yfovRad > 0.0f && camera.yfovRad < 3.14159f && camera.znear >= 0.0f;
  if (!lens || !(camera.aspect >= 0.0f) || !std::isfinite(camera.yMag + camera.znear))
    return document_.invalid(path, "its lens has values out of range");

  const glm::dvec3 z = unitOr(glm::dvec3(toWorld[2]), glm::dvec3(0, 0, 1));
  const glm::dvec3 x = unitOr(glm::cross(glm::dvec3(toWorld[1]), z), glm::dvec3(1, 0, 0));
  camera.toWorld =
      glm::mat4(glm::dmat4(glm::dvec4(x, 0), glm::dvec4(glm::cross(z, x), 0), glm::dvec4(z, 0), toWorld[3]));
  scene_.cameras.push_back(std::move(camera));
  return done();
}

// KHR_lights_punctual. The scale of the light's own node does not change its direction; nodes above move the light like
// anything else.
Status NodeImporter::addLight(const tinygltf::Node& node, const Visit& at, const glm::dmat4& toWorld,
                              const std::string& where) {
  const auto extension = node.extensions.find("KHR_lights_punctual");
  if (extension == node.extensions.end()) return done();
  const int index = indexOr(extension->second, "light", -1);
  const auto& lights = document_.model.lights;
  if (index < 0 || static_cast<std::size_t>(index) >= lights.size())
    return document_.invalid(where,
                             jsonPath("lights", index) + " does not exist, there are " + std::to_string(lights.size()));
  if (!finite(toWorld)) return document_.invalid(where, "its transform to the world is not finite");
  Result<SceneLight> read = readLight(document_, index);
  if (!read) return read.error();
  SceneLight& light = *read;
  if (light.name.empty()) light.name = nodeName(document_, at.node);
  light.node = node.name;
  light.nodeIndex = static_cast<std::uint32_t>(at.node);
  const glm::dvec3 axis = lightAxis(node);
  const glm::dvec3 direction = unitVector(-(glm::dmat3(at.parent) * axis));
  if (direction == glm::dvec3(0.0) && light.kind != LightKind::point) {
    const bool own = axis == glm::dvec3(0.0);
    context_.message(Severity::warning,
                     document_.at(where + ": its light '" + light.name + "' points nowhere, as " +
                                  (own ? "its own matrix flattens" : "the nodes above flatten") +
                                  " its axis; -Z is taken. Give " + (own ? "it" : "them") + " a scale other than 0"));
  }
  light.direction = direction == glm::dvec3(0.0) ? glm::vec3(0, 0, -1) : glm::vec3(direction);
  light.positionWorld = glm::vec3(toWorld[3]);
  scene_.lights.push_back(std::move(light));
  return done();
}

// What an animation bends is baked in the shape of its weights: say so once a mesh.
void NodeImporter::warnOfMorph(const Visit& at, const tinygltf::Node& node, const std::string& where) {
  const tinygltf::Mesh& mesh = document_.model.meshes[static_cast<std::size_t>(node.mesh)];
  const Animated& animated = document_.animated;
  const bool moves = animated.weightsOfNodes.contains(at.node) ||
                     (node.weights.empty() && animated.weightsOfMeshes.contains(node.mesh));
  const bool hasTargets = std::any_of(mesh.primitives.begin(), mesh.primitives.end(),
                                      [](const tinygltf::Primitive& p) { return !p.targets.empty(); });
  if (!moves || !hasTargets || !morphsTold_.insert(node.mesh).second) return;
  context_.message(
      Severity::warning,
      document_.at(where + ": an animation bends its mesh by morph targets (shape keys), which bakes do not know: it "
                           "is baked in the shape that the file's weights give it; mark the node extras.relume.bake: "
                           "\"dynamic\", or delete the animation if the shape stays"));
}

void NodeImporter::readAnimated(const tinygltf::Node& node, Visit& at) const {
  at.hidden = at.hidden || hidesNode(node);
  if (document_.animated.visibilityOfNodes.contains(at.node)) at.shownAndHidden = at.node;
  if (document_.animated.placesOfNodes.contains(at.node)) at.moved = at.node;
}

// What an animation shows and hides is baked, or left out, as the file has it: say so once a node that it moves.
void NodeImporter::warnOfShowing(const Visit& at) {
  if (at.shownAndHidden == kNoNode || !showingTold_.insert(at.shownAndHidden).second) return;
  context_.message(
      Severity::warning,
      document_.at(nodePath(document_, at.shownAndHidden) +
                   ": an animation shows and hides it and what is below, which bakes do not know: " +
                   (at.hidden ? "as the file hides it, it is left out" : "as the file shows it, it is baked") +
                   "; mark the node extras.relume.bake: \"dynamic\", or delete the animation if it stays so"));
}

void NodeImporter::tellHidden() const {
  if (hidden_ == 0) return;
  context_.message(Severity::info,
                   document_.at("left out the meshes and lights of nodes that KHR_node_visibility hides: " +
                                std::to_string(hidden_) + ", the first " + nodePath(document_, firstHidden_)));
}

// What animations move is baked, and its cameras look, where the file puts it.
void NodeImporter::warnOfMoved() const {
  if (!moved_.empty()) {
    context_.message(
        Severity::warning,
        document_.at("animations move nodes, which bakes do not know: these and what is below are baked "
                     "where the file puts them: " +
                     std::to_string(moved_.size()) + ", the first " + nodePath(document_, firstMoved_) +
                     "; mark them extras.relume.bake: \"dynamic\", or delete the animation of what stays"));
  }
  const std::vector<std::uint32_t> cameras = scene_.playSpaceCameras();
  const auto first =
      std::find_if(cameras.begin(), cameras.end(), [&](std::uint32_t c) { return movedCameras_.contains(c); });
  if (first == cameras.end()) return;
  context_.message(
      Severity::info,
      document_.at("animations move cameras, about which receivers are looked for only where the file puts them, "
                   "the first \"" +
                   scene_.cameras[*first].name + "\"; where they fly through walls, give the level play volumes"));
}

Status NodeImporter::visit(const Visit& from, std::vector<Visit>& stack) {
  const tinygltf::Node& node = document_.model.nodes[static_cast<std::size_t>(from.node)];
  const std::string where = nodePath(document_, from.node);
  Visit at = from;
  const glm::dmat4 toWorld = from.parent * localTransform(node);
  if (Status status = readExtras(node, where, glm::mat4(toWorld), at); !status) return status;
  readAnimated(node, at);
  const bool hasMesh = node.mesh >= 0 && at.mode != BakeMode::ignore;
  if (hasMesh && node.skin < 0 && at.mode != BakeMode::dynamic) warnOfShowing(at);
  if (at.hidden && (hasMesh || node.extensions.contains("KHR_lights_punctual"))) {
    if (hidden_++ == 0) firstHidden_ = at.node;
  }
  if (hasMesh && !at.hidden) {
    Visit placed = at;
    if (node.skin >= 0 && at.mode != BakeMode::dynamic) {
      placed.mode = BakeMode::dynamic;
      context_.message(Severity::info, document_.at(where + ": has a skin; treated as dynamic"));
    }
    if (Status status = addMesh(node, placed, toWorld, where); !status) return status;
    if (placed.mode != BakeMode::dynamic) warnOfMorph(at, node, where);
    if (placed.mode != BakeMode::dynamic && at.moved != kNoNode) {
      if (moved_.empty()) firstMoved_ = at.moved;
      moved_.insert(at.moved);
    }
  }
  if (node.camera >= 0) {
    if (Status status = addCamera(node, at, toWorld, where); !status) return status;
    if (at.moved != kNoNode) movedCameras_.insert(static_cast<std::uint32_t>(scene_.cameras.size() - 1));
  }
  if (!at.hidden) {
    if (Status status = addLight(node, at, toWorld, where); !status) return status;
  }
  for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
    stack.push_back({*child, toWorld, at.mode, at.texelDensity, at.playSpace, at.hidden, at.shownAndHidden, at.moved});
  return done();
}

Status NodeImporter::run() {
  Result<std::vector<SceneNode>> forest = readForest(document_);
  if (!forest) return forest.error();
  scene_.nodes = std::move(*forest);
  const Result<std::vector<int>> starts = findRoots(document_);
  if (!starts) return starts.error();
  tellScene(document_, context_);
  std::vector<Visit> stack;
  for (auto root = starts->rbegin(); root != starts->rend(); ++root) stack.push_back({*root, glm::dmat4(1.0)});
  std::vector<std::uint8_t> visited(document_.model.nodes.size(), 0);
  while (!stack.empty()) {
    const Visit at = stack.back();
    stack.pop_back();
    if (context_.cancelled()) return cancelledError();
    if (visited[static_cast<std::size_t>(at.node)]++)
      return document_.invalid(jsonPath("scenes", std::max(document_.model.defaultScene, 0)),
                               nodePath(document_, at.node) + " is listed, and a node above it is, too");
    if (Status status = visit(at, stack); !status) return status;
  }
  tellHidden();
  warnOfMoved();
  return done();
}

}  // namespace

Status importNodes(const GltfDocument& document, MeshImporter& meshes, Scene& scene, Context& context) {
  return NodeImporter(document, meshes, scene, context).run();
}

}  // namespace relume
