// SPDX-License-Identifier: MIT
// See provenance.h.
#include "bake/provenance.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <span>
#include <unordered_map>

namespace relume {
namespace {

static_assert(std::endian::native == std::endian::little, "content hashes are defined over little-endian bytes");

// XXH3 of a sequence of plain values; every array is preceded by its size, so that no two inputs run together.
class Hasher {
 public:
  Hasher() : state_(XXH3_createState()) { XXH3_64bits_reset(state_); }
  ~Hasher() { XXH3_freeState(state_); }
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  // Padding would make the hash depend on garbage.
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

std::uint64_t hashMesh(const Mesh& mesh) {
  Hasher h;
  h.array(spanOf(mesh.position));
  h.array(spanOf(mesh.normal));
  for (const auto& uv : mesh.uv) h.array(spanOf(uv));
  h.array(spanOf(mesh.color));
  h.array(spanOf(mesh.colorAlpha));
  h.array(spanOf(mesh.triangle));
  return h.digest();
}

// The texels of level 0: the other levels follow from it.
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
  return h.digest();
}

// Which triangles enclose matter: that follows from other nodes, cameras and lights, too (find_solids.h).
void hashSolid(Hasher& h, const Scene& scene, const Instance& instance) {
  if (scene.solid.empty()) return;
  const auto solid =
      std::span(scene.solid).subspan(instance.firstTriangle, scene.meshes[instance.mesh].triangle.size());
  if (std::find(solid.begin(), solid.end(), 1) != solid.end()) h.array(solid);
}

}  // namespace

std::vector<BakedInstance> describeInstances(const Scene& scene) {
  std::vector<std::uint64_t> imageHash, materialHash, meshHash;
  for (const Image& image : scene.images) imageHash.push_back(hashImage(image));
  for (const Material& material : scene.materials) materialHash.push_back(hashMaterial(material, imageHash));
  for (const Mesh& mesh : scene.meshes) meshHash.push_back(hashMesh(mesh));

  std::vector<BakedInstance> described;
  described.reserve(scene.instances.size());
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    const bool named = mesh.material < scene.materials.size();
    BakedInstance part{instance.node, mesh.name, named ? scene.materials[mesh.material].name : ""};
    Hasher transform, all;
    transform.array(std::span<const float>(&instance.toWorld[0][0], 16));
    part.transformHash = transform.digest();
    part.geometryHash = meshHash[instance.mesh];
    part.materialHash = named ? materialHash[mesh.material] : 0;
    all.value(part.transformHash);
    all.value(part.geometryHash);
    all.value(part.materialHash);
    all.value(instance.mode);
    all.value(instance.texelDensity);
    hashSolid(all, scene, instance);
    part.contentHash = all.digest();
    described.push_back(std::move(part));
  }
  return described;
}

std::uint64_t hashScene(const Scene& scene, const std::vector<BakedInstance>& instances) {
  Hasher h;
  h.value(static_cast<std::uint64_t>(instances.size()));
  for (const BakedInstance& instance : instances) {
    h.text(instance.node);
    h.text(instance.mesh);
    h.text(instance.material);
    h.value(instance.contentHash);
  }
  h.value(hashViews(scene));
  return h.digest();
}

std::uint64_t hashViews(const Scene& scene) {
  Hasher h;
  const std::vector<std::uint32_t> cameras = scene.playSpaceCameras();
  h.value(static_cast<std::uint64_t>(cameras.size()));
  for (const std::uint32_t i : cameras) {
    const Camera& camera = scene.cameras[i];
    h.array(std::span<const float>(&camera.toWorld[0][0], 16));
    h.value(camera.yfovRad);
    h.value(camera.aspect);
    h.value(static_cast<std::uint8_t>(camera.orthographic));
    h.value(camera.yMag);
  }
  h.value(static_cast<std::uint64_t>(scene.volumes.size()));
  for (const PlayVolume& volume : scene.volumes) h.array(std::span<const float>(&volume.toWorld[0][0], 16));
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
  provenance.seed = options.seed;
  provenance.rayTracer = rayTracer;
  provenance.lumaBands = options.lumaBands;
  provenance.chromaBands = options.chromaBands;
  return provenance;
}

}  // namespace relume
