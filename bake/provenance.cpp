// SPDX-License-Identifier: MIT
// See relume/bake/provenance.h.
#include "relume/bake/provenance.h"

#include "bake/shape_sums.h"

#include <xxhash.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <span>
#include <unordered_map>

namespace relume {
namespace {

static_assert(std::endian::native == std::endian::little, "content hashes are defined over little-endian bytes");

// XXH3 of a sequence of plain values. Every array is preceded by its size, so that different inputs never give the same
// sequence.
class Hasher {
 public:
  Hasher() : state_(XXH3_createState()) { XXH3_64bits_reset(state_); }
  ~Hasher() { XXH3_freeState(state_); }
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  // No types with padding: its bytes are undefined.
  template <class T>
  requires(std::is_arithmetic_v<T> || std::is_enum_v<T> ||
           std::has_unique_object_representations_v<T>) void value(const T& v) {
    bytes(&v, sizeof(T));
  }
  void value(const glm::vec3& v) { bytes(&v, sizeof(v)); }
  template <class T>
  void array(std::span<const T> values) {
    value(static_cast<std::uint64_t>(values.size()));
    bytes(values.data(), values.size_bytes());
  }
  void text(const std::string& s) { array(std::span<const char>(s)); }
  std::uint64_t digest() const { return XXH3_64bits_digest(state_); }

 private:
  void bytes(const void* data, std::size_t size) {
    if (size > 0) XXH3_64bits_update(state_, data, size);
  }
  XXH3_state_t* state_;
};

template <class T>
std::span<const T> spanOf(const std::vector<T>& values) {
  return values;
}

std::uint64_t hashTopology(const Mesh& mesh) {
  Hasher h;
  h.value(static_cast<std::uint64_t>(mesh.position.size()));
  h.value(static_cast<std::uint64_t>(mesh.normal.size()));
  for (const auto& uv : mesh.uv) h.array(spanOf(uv));
  h.array(spanOf(mesh.color));
  h.array(spanOf(mesh.colorAlpha));
  h.array(spanOf(mesh.triangle));
  return h.digest();
}

std::uint64_t hashMesh(const Mesh& mesh, std::uint64_t topology) {
  Hasher h;
  h.array(spanOf(mesh.position));
  h.array(spanOf(mesh.normal));
  h.value(topology);
  return h.digest();
}

// The texels of level 0: the other levels follow from it, and from the material's alpha mode.
std::uint64_t hashImage(const Image& image) {
  Hasher h;
  if (image.levels.empty()) return h.digest();
  h.value(image.levels[0].width);
  h.value(image.levels[0].height);
  h.array(spanOf(image.levels[0].rgba));
  return h.digest();
}

void hashTexture(Hasher& h, const TextureRef& texture, const std::vector<std::uint64_t>& imageHash) {
  const bool present = texture.image < imageHash.size();
  h.value(static_cast<std::uint8_t>(present));
  if (!present) return;
  h.value(imageHash[texture.image]);
  h.value(texture.texcoord);
  h.value(texture.wrapU);
  h.value(texture.wrapV);
  h.value(static_cast<std::uint8_t>(texture.nearest));
  h.array(std::span<const float>(texture.transform));
}

std::uint64_t hashMaterial(const Material& material, const std::vector<std::uint64_t>& imageHash) {
  Hasher h;
  h.value(material.albedo);
  h.value(material.alpha);
  hashTexture(h, material.albedoTexture, imageHash);
  h.value(material.emission);
  hashTexture(h, material.emissionTexture, imageHash);
  h.value(material.alphaMode);
  h.value(material.alphaCutoff);
  h.value(static_cast<std::uint8_t>(material.doubleSided));
  if (material.drivable) h.value(std::uint8_t{1});  // the others keep the sums that older bakes have
  return h.digest();
}

// Which triangles enclose matter. That depends on other nodes, cameras and lights, too (find_solids.h).
void hashSolid(Hasher& h, const Scene& scene, const Instance& instance) {
  if (scene.solid.empty()) return;
  const auto solid =
      std::span(scene.solid).subspan(instance.firstTriangle, scene.meshes[instance.mesh].triangle.size());
  if (std::find(solid.begin(), solid.end(), 1) != solid.end()) h.array(solid);
}

void hashCamera(Hasher& h, const Camera& camera) {
  h.array(std::span<const float>(&camera.toWorld[0][0], 16));
  h.value(camera.yfovRad);
  h.value(camera.aspect);
  h.value(static_cast<std::uint8_t>(camera.orthographic));
  h.value(camera.yMag);
}

// Hash of everything of an instance except names. `flipped` is hashed, too: it is decided in double precision, so that
// it does not follow from toWorld.
std::uint64_t hashContent(const Scene& scene, const BakedInstance& part, const Instance& instance) {
  Hasher h;
  h.value(part.transformHash);
  h.value(part.geometryHash);
  h.value(part.materialHash);
  h.value(instance.mode);
  h.value(instance.texelDensity);
  h.value(instance.primitive);
  h.value(instance.gpuInstance);
  h.value(static_cast<std::uint8_t>(instance.flipped));
  hashSolid(h, scene, instance);
  return h.digest();
}

// [m] length of the longest axis of a mesh's unit cube in the world.
float metresPerUnit(const glm::mat4& toWorld) {
  float longest = 0.0f;
  for (int axis = 0; axis < 3; ++axis) longest = std::max(longest, glm::length(glm::vec3(toWorld[axis])));
  return longest;
}

}  // namespace

std::vector<BakedInstance> describeInstances(const Scene& scene) {
  std::vector<std::uint64_t> imageHash, materialHash, meshHash;
  // Numbers are for pictures alone (MaterialGloss): no material's hash has them.
  for (const Image& image : scene.images) imageHash.push_back(image.isColor ? hashImage(image) : 0);
  for (const Material& material : scene.materials) materialHash.push_back(hashMaterial(material, imageHash));
  std::vector<std::uint64_t> topologyHash;
  std::vector<std::uint32_t> firstShape;
  std::uint32_t blocks = 0;
  for (const Mesh& mesh : scene.meshes) {
    topologyHash.push_back(hashTopology(mesh));
    meshHash.push_back(hashMesh(mesh, topologyHash.back()));
    firstShape.push_back(blocks);
    blocks += shapeBlocks(mesh);
  }

  std::vector<BakedInstance> described;
  described.reserve(scene.instances.size());
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    const bool named = mesh.material < scene.materials.size();
    BakedInstance part{instance.node, mesh.name, named ? scene.materials[mesh.material].name : ""};
    Hasher transform;
    // Where the file puts what moves is no part of a bake.
    if (instance.mode != BakeMode::dynamic) transform.array(std::span<const float>(&instance.toWorld[0][0], 16));
    part.transformHash = transform.digest();
    part.geometryHash = meshHash[instance.mesh];
    part.materialHash = named ? materialHash[mesh.material] : 0;
    part.contentHash = hashContent(scene, part, instance);
    part.topologyHash = topologyHash[instance.mesh];
    part.firstShape = firstShape[instance.mesh];
    part.shapeCount = shapeBlocks(mesh);
    described.push_back(std::move(part));
  }
  return described;
}

std::vector<std::uint32_t> describeShapes(const Scene& scene) {
  std::vector<std::uint32_t> shapes;
  for (const Mesh& mesh : scene.meshes) {
    const std::vector<std::uint32_t> words = shapeSums(mesh);
    shapes.insert(shapes.end(), words.begin(), words.end());
  }
  return shapes;
}

std::vector<BakedInstance> forgiveNoise(const Scene& scene, std::vector<BakedInstance> now, const Bake& bake,
                                        const std::vector<std::uint32_t>& answers) {
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (answers[i] >= bake.instances.size()) continue;
    const BakedInstance& then = bake.instances[answers[i]];
    if (then.geometryHash == now[i].geometryHash || then.topologyHash != now[i].topologyHash) continue;
    const float metres = metresPerUnit(scene.instances[i].toWorld);
    const std::span<const std::uint32_t> sums = bake.shapes.span().subspan(std::size_t{then.firstShape} * kShapeWords,
                                                                           std::size_t{then.shapeCount} * kShapeWords);
    if (!(metres > 0.0f) || !sameShape(scene.meshes[scene.instances[i].mesh], sums, metres)) continue;
    now[i].geometryHash = then.geometryHash;
    now[i].contentHash = hashContent(scene, now[i], scene.instances[i]);
  }
  return now;
}

std::uint64_t hashScene(const Scene& scene, const std::vector<BakedInstance>& instances) {
  Hasher h;
  h.value(static_cast<std::uint64_t>(instances.size()));
  // In a large level, instances that share a mesh are traced in another way than copies of it.
  std::unordered_map<std::uint32_t, std::uint32_t> firstOfMesh;
  for (std::uint32_t i = 0; i < instances.size(); ++i) {
    h.text(instances[i].node);
    h.text(instances[i].mesh);
    h.text(instances[i].material);
    h.value(instances[i].contentHash);
    h.value(firstOfMesh.try_emplace(scene.instances[i].mesh, i).first->second);
  }
  h.value(hashViews(scene));
  return h.digest();
}

std::uint64_t hashViews(const Scene& scene) {
  Hasher h;
  const std::vector<std::uint32_t> cameras = scene.playSpaceCameras();
  h.value(static_cast<std::uint64_t>(cameras.size()));
  for (const std::uint32_t i : cameras) hashCamera(h, scene.cameras[i]);
  h.value(static_cast<std::uint64_t>(scene.volumes.size()));
  for (const PlayVolume& volume : scene.volumes) h.array(std::span<const float>(&volume.toWorld[0][0], 16));
  return h.digest();
}

std::uint64_t hashCameras(const Scene& scene) {
  Hasher h;
  for (const Camera& camera : scene.cameras) hashCamera(h, camera);
  return h.digest();
}

Provenance describeProvenance(const Scene& scene, const std::vector<BakedInstance>& instances,
                              const BakeOptions& options, const std::string& rayTracer) {
  Provenance provenance;
  provenance.toolVersion = RELUME_VERSION;
  provenance.algorithmVersion = kAlgorithmVersion;
  provenance.optionsJson = optionsToJson(options);
  provenance.sceneHash = hashScene(scene, instances);
  provenance.viewHash = hashViews(scene);
  provenance.cameraHash = hashCameras(scene);
  provenance.seed = options.seed;
  provenance.rayTracer = rayTracer;
  provenance.lumaBands = options.lumaBands;
  provenance.chromaBands = options.chromaBands;
  return provenance;
}

}  // namespace relume
