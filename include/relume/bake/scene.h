// SPDX-License-Identifier: MIT
// The level as the baker sees it: triangle meshes placed by instances, materials, cameras, lights, play volumes.
// Axes and units of length are glTF's: Y up, metres, right-handed, counter-clockwise fronts. Light is radiometric:
// point and spot intensities W/sr, directional W/m², emission W/m²/sr; candela and lux are converted by the importer.
//
// Triangles are numbered through: triangle t of instance i has the scene-wide index instances[i].firstTriangle + t.
#pragma once

#include "relume/lights.h"
#include "relume/result.h"

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

class Context;

inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;

enum class Wrap : std::uint8_t { repeat, mirror, clamp };

// 8-bit RGBA, row 0 on top, as the file had it (sRGB for colours). Mip levels by box filter in linear light.
struct Image {
  struct Level {
    std::uint32_t width = 0, height = 0;
    std::vector<std::uint8_t> rgba;   // [Size 4 width height]
    std::vector<glm::vec3> linear{};  // [Size 0, or width height] in place of rgba, of emission alone: linear light,
                                      // which no file of a level has (tools/render/drive_scene.h)
  };
  std::string name;
  std::vector<Level> levels;  // [Size >= 1] level 0 is the image
  bool isColor = true;        // sRGB; else numbers, such as roughness or a normal map
};

// A texture slot: image, sampler, which TEXCOORD_n and KHR_texture_transform folded into an affine map.
struct TextureRef {
  std::uint32_t image = kNone;
  std::uint32_t texcoord = 0;  // 0 or 1
  Wrap wrapU = Wrap::repeat, wrapV = Wrap::repeat;
  bool nearest = false;                              // magnification filter
  std::array<float, 6> transform{1, 0, 0, 0, 1, 0};  // u' = t0 u + t1 v + t2, v' = t3 u + t4 v + t5
};

enum class AlphaMode : std::uint8_t { opaque, mask };

// What a surface mirrors, by the metallic-roughness model of glTF 2.0. It is for pictures: bakes do not depend on it.
// The importer reads it where ImportOptions::gloss asks for it; else all is as here, glTF's default.
struct MaterialGloss {
  float metalness = 1.0f;    // [0..1] factor
  float roughness = 1.0f;    // [0..1] factor
  TextureRef texture;        // numbers: roughness in G, metalness in B
  TextureRef normalTexture;  // numbers: 0.5 n + 0.5 in the tangent space of Mesh::cornerTangent
  float normalScale = 1.0f;  // of the map's x and y
};

struct Material {
  std::string name;
  glm::vec3 albedo{1.0f};                   // [0..1] base colour factor, linear
  float alpha = 1.0f;                       // base colour alpha factor
  TextureRef albedoTexture;                 // sRGB colour, alpha
  glm::vec3 emission{0.0f};                 // [W/m²/sr] emissive factor x strength
  TextureRef emissionTexture;               // sRGB
  AlphaMode alphaMode = AlphaMode::opaque;  // BLEND is read as a mask with cutoff 0.5
  float alphaCutoff = 0.5f;
  bool drivable = false;     // extras.relume.drivable: counts as an emitter, also while it is dark
  bool doubleSided = false;  // emits from both sides, but for solids; both sides of any face reflect
  MaterialGloss gloss;
};

// One glTF primitive as triangles, in object space.
struct Mesh {
  std::string name;                          // glTF mesh name or "mesh<index>", "#<primitive>" appended when several
  std::vector<glm::vec3> position;           // [m]
  std::vector<glm::vec3> normal;             // unit; empty = flat
  bool normalsRepaired = false;              // some were zero or not finite, and come from the triangles instead
  std::array<std::vector<glm::vec2>, 2> uv;  // TEXCOORD_0, TEXCOORD_1; empty when absent
  std::vector<glm::vec3> color;              // COLOR_0 (linear factor); empty when absent
  std::vector<float> colorAlpha;             // COLOR_0's alpha; empty when absent
  std::vector<glm::uvec3> triangle;          // vertex indices, in glTF order, degenerate ones kept
  // Of each corner of each triangle the direction in which a normal map's x points, unit; w: 1 or -1, the side of its
  // y, which is w cross(normal, xyz); all 0 = the map says nothing there. [Size 0, or 3 a triangle with a normal map]
  std::vector<glm::vec4> cornerTangent;
  std::uint32_t material = kNone;  // kNone = glTF's default material
};

// extras.relume.bake: "static", "dynamic", "ignore", "gridLit"
enum class BakeMode : std::uint8_t { fixed, dynamic, ignore, gridLit };

// A mesh with its transform. `fixed` and `gridLit` instances occlude and send light; of the two only `fixed` ones are
// on the light map, the others read the grid. Dynamic ones are kept for drawing (lit by the grid); ignored ones are
// drawn by nobody and not imported.
struct Instance {
  std::string node;               // glTF node name, or "unnamed node <k>": the k-th drawn one without
  std::uint32_t nodeIndex = 0;    // glTF node
  std::uint32_t primitive = 0;    // primitive of the node's glTF mesh
  std::uint32_t gpuInstance = 0;  // index within EXT_mesh_gpu_instancing
  std::uint32_t mesh = 0;
  glm::mat4 toWorld{1.0f};
  BakeMode mode = BakeMode::fixed;
  bool flipped = false;             // toWorld mirrors: triangle winding reverses
  float texelDensity = 1.0f;        // extras.relume.texelDensity: scale of light-map resolution here [0.01..100]
  std::uint32_t firstTriangle = 0;  // scene-wide index of its first triangle

  // Whether it is part of the bake: stands where it is for good, occludes and sends light.
  bool baked() const { return mode == BakeMode::fixed || mode == BakeMode::gridLit; }
  // Whether it may be on the light map.
  bool charted() const { return mode == BakeMode::fixed; }
};

struct Camera {
  std::string name;         // the camera's own
  std::string node;         // of the node that it is on, which is what editors show; empty = none
  glm::mat4 toWorld{1.0f};  // looks down its -Z
  float yfovRad = 1.0f;
  float znear = 0.01f;  // [m]
  float aspect = 0.0f;  // width / height; 0 = the viewport's
  bool orthographic = false;
  float yMag = 1.0f;                // [m] half height of an orthographic view
  bool playSpace = true;            // extras.relume.playSpace: receivers can be where it stands
  std::uint32_t nodeIndex = kNone;  // glTF node
};

// What the intensities of a file's punctual lights are: W/sr and W/m², or cd and lx, which are kLumensPerWatt as many.
enum class LightUnit : std::uint8_t { radiometric, photometric };
inline constexpr double kLumensPerWatt = 683.0;  // [lm/W] as Blender's exporter counts: the peak of the eye, 555 nm

struct SceneLight {
  std::string name;  // the light's own
  std::string node;  // of the node that it is on, which is what editors show; empty = none
  LightKind kind = LightKind::point;
  glm::vec3 intensity{1.0f};      // colour x intensity: W/sr (point, spot), W/m² (directional)
  glm::vec3 positionWorld{0.0f};  // [m]
  glm::vec3 direction{0, 0, -1};  // unit, the way the light travels
  float range = 0.0f;             // [m] 0 = infinite
  float innerConeRad = 0.0f, outerConeRad = 0.785398163f;
  std::uint32_t nodeIndex = kNone;  // glTF node
};

// Whether a camera or light is meant by a name: its own, or that of its node.
template <class Item>
bool isCalled(const Item& item, std::string_view name) {
  return !name.empty() && (item.name == name || item.node == name);
}

// Those of cameras or lights that a name means: on nodes of that name, which editors show, or else of that name of
// their own.
template <class Item>
std::vector<const Item*> allCalled(const std::vector<Item>& items, std::string_view name) {
  std::vector<const Item*> byNode, byName;
  for (const Item& item : items) {
    if (!isCalled(item, name)) continue;
    (item.node == name ? byNode : byName).push_back(&item);
  }
  return byNode.empty() ? byName : byNode;
}

// A box in which receivers can be: extras.relume {"volume": [x, y, z]} on a node gives its size in the node's axes.
struct PlayVolume {
  std::string name;
  glm::mat4 toWorld{1.0f};          // maps the unit cube [-0.5, 0.5]³ to the world
  std::uint32_t nodeIndex = kNone;  // glTF node
};

// A node of the level's file: which moves with which.
struct SceneNode {
  std::string name{};            // empty = none
  std::uint32_t parent = kNone;  // glTF node; kNone = a root
};

struct Scene {
  std::string name;  // file name without folder
  std::vector<Mesh> meshes;
  std::vector<Instance> instances;
  std::vector<Material> materials;
  std::vector<Image> images;
  std::vector<Camera> cameras;
  std::vector<SceneLight> lights;
  std::vector<PlayVolume> volumes;
  std::vector<SceneNode> nodes;     // [Size nodes of the file; 0 where the level has no file] by glTF node: a forest
  std::vector<std::uint8_t> solid;  // [Size triangleCount(), or empty = none] 1 = two-sided, but encloses matter: the
                                    // importer finds them
  LightUnit lightUnit = LightUnit::radiometric;  // of the file; `lights` are radiometric
  std::optional<std::uint64_t> exportedWith;  // level of relume export: identifyBakeFile() of the bake it was made with
  // For the same level: what its surfaces were when it was made, a hash of each by the BakedInstance::geometryHash that
  // the bake has of it. `relume status` compares them.
  std::map<std::uint64_t, std::uint64_t> exportedSurfaces;
  std::vector<std::filesystem::path> files;  // every file that was read, the scene's first (for dependency files)

  std::uint32_t triangleCount() const;  // over all instances
  // World-space corners of triangle t of an instance, wound so that the front is counter-clockwise.
  std::array<glm::vec3, 3> corners(const Instance& instance, std::uint32_t t) const;
  const Material& material(const Instance& instance) const;
  // Whether the back of a triangle is a surface like its front: it emits, and who sees it is not inside of something.
  bool bothSides(const Instance& instance, std::uint32_t t) const;
  // The instance that holds a scene-wide triangle index.
  std::uint32_t instanceOf(std::uint32_t triangle) const;
  // Indices of the cameras that say where receivers can be: none where there are play volumes, which say it better.
  std::vector<std::uint32_t> playSpaceCameras() const;
};

// A point on a surface: barycentric (b, c) weighs corners 1 and 2 of corners().
struct SurfacePoint {
  std::uint32_t instance = kNone;
  std::uint32_t triangle = 0;  // within the instance
  glm::vec2 barycentric{0.0f};
};

// Geometric normal (unit, front side), and the shading normal interpolated from the mesh's normals (unit, on the
// geometric normal's side). Zero for a degenerate triangle.
glm::vec3 geometricNormal(const Scene& scene, const SurfacePoint& p);
glm::vec3 shadingNormal(const Scene& scene, const SurfacePoint& p);

// Linear albedo [0..1], emitted radiance [W/m²/sr] and coverage after the alpha test. footprintWorld [m] selects the
// mip level: the width of the surface patch the value stands for; 0 = level 0, bilinear.
glm::vec3 albedoAt(const Scene& scene, const SurfacePoint& p, float footprintWorld = 0.0f);
glm::vec3 emissionAt(const Scene& scene, const SurfacePoint& p, float footprintWorld = 0.0f);
bool opaqueAt(const Scene& scene, const SurfacePoint& p);

// Metalness and roughness [0..1]: factors times texture.
struct SurfaceGloss {
  float metalness = 1.0f, roughness = 1.0f;
};
SurfaceGloss glossAt(const Scene& scene, const SurfacePoint& p);

// shadingNormal(), bent by the material's normal map where it has one.
glm::vec3 mappedNormal(const Scene& scene, const SurfacePoint& p);

struct ImportOptions {
  // Of the punctual lights. Empty: extras.relume.lightUnit of the file's scene or asset, else radiometric, with a
  // warning when the numbers look photometric.
  std::optional<LightUnit> lightUnit;
  // Read what pictures of glossy surfaces need in addition: Material::gloss, its images, Mesh::cornerTangent. What
  // cannot be read of it is left out with a warning. All else comes out the same.
  bool gloss = false;
};

// Read a .glb or .gltf. io: not readable; invalidFile: malformed, with JSON path, accessor, node or image named;
// unsupported: an extension in extensionsRequired that we do not know. Nothing outside the scene's folder is read.
Result<Scene> importGltf(const std::filesystem::path& path, Context& context, const ImportOptions& options = {});

}  // namespace relume
